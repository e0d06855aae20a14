"""The values of expressions in a formula's text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from clfractal.exchange.arithmetic import NOTHING, Arithmetic, Nothing, Place, Turn, Vector
from clfractal.exchange.c_text import SIZES, Expression
from clfractal.exchange.functions import NUMBERS, call_function
from clfractal.exchange.parameters import IGNORED, Parameters, UnknownFieldError
from clfractal.exchange.symbols import Symbol, Value


@dataclass
class Values(Arithmetic):
    """Finds the values of expressions.

    Attributes:
        parameters: of the formula.
        choices: the numbers of names that choose between ways to do something.
        names: the text's variables.
        aux: what is kept from one application to the next, and what the loop around the text gives it.
    """

    parameters: Parameters
    choices: Mapping[str, int]
    names: dict[str, object]
    aux: dict[str, object]

    def places(self, name: str) -> list[int]:
        """The components that letters name."""
        if not name or any(letter not in "xyzw" for letter in name):
            self.refuse(f"the field {name}")
        return ["xyzw".index(letter) for letter in name]

    # --- values

    def condition(self, expression: Expression) -> Value | Nothing:
        value = self.value(expression)
        if isinstance(value, Nothing):
            return value
        if isinstance(value, Turn):
            self.compared.add(0.0)
        return self.symbols.condition(self.scalar_of(value))

    def value(self, expression: Expression) -> object:
        return getattr(self, f"_value_{expression.kind}")(expression)

    def _value_number(self, expression: Expression) -> object:
        return expression.number

    def _value_name(self, expression: Expression) -> object:
        name = expression.name
        if name in self.names:
            return self.names[name]
        if name in NUMBERS:
            return NUMBERS[name]
        if name in self.choices:
            return float(self.choices[name])
        return self.refuse(f"the name {name}")

    def _value_member(self, expression: Expression) -> object:
        owner = expression.parts[0]
        if owner.kind == "name" and owner.name == "aux":
            if expression.name not in self.aux:
                self.refuse(f"aux->{expression.name}")
            return self.aux[expression.name]
        path, indices = self.path(expression)
        if path is not None:
            return self.parameter(path, indices, expression)
        vector = self.value(owner)
        if isinstance(vector, Nothing):
            return NOTHING
        if isinstance(vector, list):
            if expression.name in ("m1", "m2", "m3"):
                return vector[int(expression.name[1]) - 1]
            places = self.places(expression.name)
            if max(places) < len(vector):
                parts = [vector[place] for place in places]
                return parts[0] if len(parts) == 1 else parts
        return self.refuse(f"the field {expression.name}")

    def path(self, expression: Expression) -> tuple[str | None, list[int]]:
        """The path of a parameter, and its indices; None for what is none."""
        parts: list[str] = []
        asked: list[Expression] = []
        here = expression
        while here.kind in ("member", "item"):
            if here.kind == "member":
                parts.insert(0, here.name)
            else:
                asked.insert(0, here.parts[1])
            here = here.parts[0]
        if here.kind != "name" or here.name != "fractal":
            return None, []
        indices: list[int] = []
        for each in asked:
            index = self.value(each)
            self.computed |= isinstance(index, Turn)
            if not isinstance(index, float):
                self.refuse("an index that depends on z")
            indices.append(int(index))
        return ".".join(parts), indices

    def parameter(self, path: str, indices: list[int], expression: Expression) -> object:
        """A parameter's value, or a component of it."""
        if path.startswith(IGNORED) and not self.parameters.colors:
            return NOTHING
        last = path.rpartition(".")[2]
        name, part = (
            (path[: -len(last) - 1], last)
            if path.count(".") > 1 and all(each in "xyzw" for each in last)
            else (path, "")
        )
        try:
            found = self.parameters.value(name, indices)
        except UnknownFieldError:
            self.refuse(f"the parameter {name}")
        value: object = (
            found
            if isinstance(found, float)
            else [list(row) if isinstance(row, tuple) else row for row in found]
        )
        if not part:
            return value
        if not isinstance(value, list):
            self.refuse(f"the parameter {path}")
        picked = [value[place] for place in self.places(part)]
        return picked[0] if len(picked) == 1 else picked

    def _value_item(self, expression: Expression) -> object:
        path, indices = self.path(expression)
        if path is not None:
            return self.parameter(path, indices, expression)
        array, index = self.value(expression.parts[0]), self.value(expression.parts[1])
        if isinstance(array, Nothing):
            return NOTHING
        if isinstance(array, list) and isinstance(index, float) and 0 <= index < len(array):
            return array[int(index)]
        if isinstance(array, list) and array and isinstance(index, Symbol):
            return self.picked(array, index)
        return self.refuse("this part of an array")

    def picked(self, array: list[object], index: Value) -> object:
        """The part of an array at an index that conditions choose; where it is outside nobody asks for the part."""
        if isinstance(index, float):
            return array[int(index)] if 0 <= index < len(array) else array[0]
        if index.operation != "where":
            self.refuse("an index that depends on z")
        condition, yes, no = index.parts
        return self.merged(condition, self.picked(array, yes), self.picked(array, no))

    def _value_address(self, expression: Expression) -> object:
        inner = expression.parts[0]
        if inner.kind == "item":
            array, index = self.value(inner.parts[0]), self.value(inner.parts[1])
            if isinstance(array, Nothing):
                return NOTHING
            if isinstance(array, list) and isinstance(index, float) and 0 <= index < len(array):
                return Place(array, int(index))
        else:
            value = self.value(inner)
            if isinstance(value, list | Nothing):
                return value
        return self.refuse("a pointer to this")

    def _value_target(self, expression: Expression) -> object:
        place = self.value(expression.parts[0])
        if isinstance(place, Nothing):
            return NOTHING
        if isinstance(place, list) and place:
            return place[0]
        if isinstance(place, Place):
            return place.vector[place.index]
        return self.refuse("what this leads to")

    def _value_vector(self, expression: Expression) -> object:
        parts: Vector = []
        for part in expression.parts:
            value = self.value(part)
            if isinstance(value, Nothing):
                return NOTHING
            parts += value if isinstance(value, list) else [self.scalar_of(value)]
        size = SIZES.get(expression.name, 0)
        if len(parts) == 1:
            parts *= size
        if len(parts) != size:
            self.refuse(f"{expression.name} of {len(parts)} numbers")
        return parts

    def _value_operator(self, expression: Expression) -> object:
        name = expression.name
        if name == "?":
            condition = self.condition(expression.parts[0])
            if isinstance(condition, float):
                return self.value(expression.parts[1 if condition else 2])
            if isinstance(condition, Nothing):
                return NOTHING
            return self.merged(condition, self.value(expression.parts[1]), self.value(expression.parts[2]))
        if name in ("&&", "||"):
            return self.joined(name, expression)
        if name.startswith("unary"):
            value = self.value(expression.parts[0])
            self.computed |= isinstance(value, Turn)
            if name == "unary !":
                return (
                    NOTHING
                    if isinstance(value, Nothing)
                    else self.symbols.opposite(self.symbols.condition(self.scalar_of(value)))
                )
            return self.each(self.symbols.negative, value) if name == "unary -" else value
        return self.operator(name, self.value(expression.parts[0]), self.value(expression.parts[1]))

    def joined(self, name: str, expression: Expression) -> Value | Nothing:
        """`&&` and `||`: the second one is not asked where the first one decides."""
        one = self.condition(expression.parts[0])
        if isinstance(one, float) and bool(one) == (name == "||"):
            return one
        other = self.condition(expression.parts[1])
        if isinstance(one, Nothing) or isinstance(other, Nothing):
            return NOTHING
        if name == "&&":
            return self.symbols.both(one, other)
        opposite = self.symbols.opposite
        return opposite(self.symbols.both(opposite(one), opposite(other)))

    def _value_call(self, expression: Expression) -> object:
        values = [self.value(part) for part in expression.parts]
        return call_function(self, expression.name, values)
