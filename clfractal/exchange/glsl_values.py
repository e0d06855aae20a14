"""The values of expressions in a fragment's code, and what they give new values to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from clfractal.errors import FileError, Where, unknown_name
from clfractal.exchange.glsl_arithmetic import GlslArithmetic
from clfractal.exchange.glsl_functions import call_glsl, is_known
from clfractal.exchange.glsl_symbols import Items, Matrix
from clfractal.exchange.glsl_tree import MATRICES, SIZES, WHOLE, Code, Expression, Function
from clfractal.exchange.symbols import Value

_LETTERS = ("xyzw", "rgba", "stpq")
CONSTANTS: Mapping[str, float] = {"PI": math.pi, "true": 1.0, "false": 0.0}
"""Names that are there without being declared."""


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable: its type, how many values it has as an array, and its value."""

    type: str
    size: int
    value: object


Scope = dict[str, Variable]


@dataclass
class GlslValues(GlslArithmetic):
    """Finds the values of expressions.

    Attributes:
        code: the text.
        outer: variables outside of functions.
        scopes: those of the function that is followed, the innermost last.
    """

    code: Code
    outer: Scope = field(default_factory=dict)
    scopes: list[Scope] = field(default_factory=list)
    depth: int = 0

    def value(self, expression: Expression) -> object:
        self.here = expression.where
        self.depth += 1
        if self.depth > 150:
            self.refuse("what is nested so deep")
        found = getattr(self, f"_value_{expression.kind}")(expression)
        self.depth -= 1
        return found

    def number(self, expression: Expression) -> Value:
        """The value of what must be one number."""
        found = self.value(expression)
        self.here = expression.where
        return self.scalar_of(found)

    def condition(self, expression: Expression) -> Value:
        found = self.value(expression)
        self.here = expression.where
        return self.condition_of(found)

    # --- variables

    def scope_of(self, name: str) -> Scope | None:
        """Where a variable is."""
        for scope in reversed(self.scopes):
            if name in scope:
                return scope
        return self.outer if name in self.outer else None

    def variable(self, name: str, where: Where) -> Variable:
        scope = self.scope_of(name)
        if scope is not None:
            return scope[name]
        names = [*self.outer, *(each for scope in self.scopes for each in scope)]
        raise FileError(unknown_name("name", name[:60], names), where)

    def declare(self, name: str, kind: str, size: int, value: object) -> None:
        """A new variable in the innermost scope."""
        if isinstance(value, float) and kind == "int" and not value.is_integer():
            value = float(math.trunc(value))
        if not self.fits(kind, size, value):
            self.refuse(f"such a value of {kind} {name[:40]}")
        (self.scopes[-1] if self.scopes else self.outer)[name] = Variable(kind, size, value)

    def set(self, name: str, value: object, where: Where) -> None:
        """Gives a variable another value."""
        old = self.variable(name, where)
        if not self.fits(old.type, old.size, value):
            self.here = where
            self.refuse(f"such a value of {old.type} {name[:40]}")
        scope = self.scope_of(name)
        assert scope is not None
        scope[name] = Variable(old.type, old.size, value)

    # --- expressions

    def _value_number(self, expression: Expression) -> object:
        return expression.number

    def _value_name(self, expression: Expression) -> object:
        name = expression.name
        if self.scope_of(name) is None and name in CONSTANTS:
            return CONSTANTS[name]
        return self.variable(name, expression.where).value

    def _value_list(self, expression: Expression) -> object:
        found: object = None
        for part in expression.parts:
            found = self.value(part)
        return found

    def _value_member(self, expression: Expression) -> object:
        owner = self.value(expression.parts[0])
        self.here = expression.where
        if expression.name == "length" and isinstance(owner, Items):
            return float(len(owner.values))
        parts = [self.vector_of(owner)[place] for place in self.places(expression.name, owner)]
        return parts[0] if len(parts) == 1 else parts

    def places(self, name: str, owner: object) -> list[int]:
        """The components that letters name."""
        letters = next((each for each in _LETTERS if all(letter in each for letter in name)), None)
        size = len(self.vector_of(owner))
        if letters is None or len(name) > 4 or any(letters.index(letter) >= size for letter in name):
            self.refuse(f"the member .{name[:40]}")
        return [letters.index(letter) for letter in name]

    def _value_item(self, expression: Expression) -> object:
        owner = self.value(expression.parts[0])
        place = self.index(expression, owner)
        if isinstance(owner, Items):
            return owner.values[place]
        return list(owner.columns[place]) if isinstance(owner, Matrix) else self.vector_of(owner)[place]

    def index(self, expression: Expression, owner: object) -> int:
        """The index in brackets."""
        found = self.number(expression.parts[1])
        self.here = expression.where
        if not isinstance(found, float):
            self.refuse("an index that is not known")
        whole = (
            owner.values
            if isinstance(owner, Items)
            else owner.columns
            if isinstance(owner, Matrix)
            else owner
        )
        count = len(whole) if isinstance(whole, list | tuple) else 0
        if not 0 <= found < count:
            self.refuse(f"the index {found:g} of {count} values")
        return int(found)

    def _value_operator(self, expression: Expression) -> object:
        name = expression.name
        if name == "?":
            condition = self.condition(expression.parts[0])
            if isinstance(condition, float):
                return self.value(expression.parts[1 if condition else 2])
            yes, no = self.value(expression.parts[1]), self.value(expression.parts[2])
            return self.mixed(condition, yes, no)
        if name in ("&&", "||", "^^"):
            return self.joined(expression)
        if name.startswith("unary"):
            found = self.value(expression.parts[0])
            self.here = expression.where
            if name == "unary !":
                return self.symbols.opposite(self.condition_of(found))
            if name == "unary +":
                return found
            return self.operator("*", -1.0, found) if isinstance(found, Matrix) else self.negative(found)
        one, other = self.value(expression.parts[0]), self.value(expression.parts[1])
        self.here = expression.where
        found = self.operator(name, one, other)
        if name == "/" and self.is_whole(expression.parts[0]) and self.is_whole(expression.parts[1]):
            return self.each(self.cut, found)
        return found

    def negative(self, value: object) -> object:
        """-value."""
        return self.each(lambda part: self.symbols.negative(self.plain(part)), value)

    def joined(self, expression: Expression) -> Value:
        """`&&`, `||` and `^^`: the second one is not asked where the first one decides."""
        one = self.condition(expression.parts[0])
        if isinstance(one, float) and expression.name != "^^" and bool(one) == (expression.name == "||"):
            return one
        other = self.condition(expression.parts[1])
        if expression.name == "&&":
            return self.symbols.both(one, other)
        if expression.name == "||":
            return self.symbols.either(one, other)
        return self.symbols.picked(one, self.symbols.opposite(other), other)

    def is_whole(self, expression: Expression) -> bool:
        """Whether a value is an `int`, by its types."""
        if expression.kind == "number":
            return expression.whole
        if expression.kind == "name":
            scope = self.scope_of(expression.name)
            return scope is not None and scope[expression.name].type in WHOLE
        if expression.kind in ("member", "item"):
            return self.is_whole(expression.parts[0])
        if expression.kind == "call":
            own = self.code.functions.get(expression.name)
            return expression.name in WHOLE or (own is not None and own[0].type in WHOLE)
        if expression.kind == "operator" and expression.name in (
            "+",
            "-",
            "*",
            "/",
            "%",
            "unary -",
            "unary +",
        ):
            return all(self.is_whole(part) for part in expression.parts)
        return False

    # --- giving values

    def _value_assign(self, expression: Expression) -> object:
        target, right = expression.parts
        found = self.value(right)
        if expression.name != "=":
            old = self.value(target)
            self.here = expression.where
            sign = expression.name[:-1]
            found = self.operator(sign, old, found)
            if sign == "/" and self.is_whole(target) and self.is_whole(right):
                found = self.each(self.cut, found)
        self.store(target, found)
        return found

    def _value_before(self, expression: Expression) -> object:
        found = self.operator("+" if expression.name == "++" else "-", self.value(expression.parts[0]), 1.0)
        self.store(expression.parts[0], found)
        return found

    def _value_after(self, expression: Expression) -> object:
        old = self.value(expression.parts[0])
        self.store(expression.parts[0], self.operator("+" if expression.name == "++" else "-", old, 1.0))
        return old

    def store(self, target: Expression, value: object) -> None:
        """Sets a variable, or a part of one."""
        self.here = target.where
        if target.kind == "name":
            self.set(target.name, value, target.where)
            return
        if target.kind not in ("member", "item"):
            self.refuse("an assignment to this")
        owner = self.value(target.parts[0])
        self.here = target.where
        if target.kind == "member":
            places = self.places(target.name, owner)
            whole = list(self.vector_of(owner))
            parts = value if isinstance(value, list) else [self.scalar_of(value)] * len(places)
            if len(parts) != len(places) or len(set(places)) < len(places):
                self.refuse(f"such a value of .{target.name}")
            for place, part in zip(places, parts, strict=True):
                whole[place] = part
            self.store(target.parts[0], whole)
            return
        place = self.index(target, owner)
        if isinstance(owner, Items):
            changed: object = Items((*owner.values[:place], value, *owner.values[place + 1 :]))
        elif isinstance(owner, Matrix):
            column = tuple(self.vector_of(value))
            if len(column) != len(owner.columns):
                self.refuse("such a column")
            changed = Matrix((*owner.columns[:place], column, *owner.columns[place + 1 :]))
        else:
            changed = list(self.vector_of(owner))
            changed[place] = self.scalar_of(value)
        self.store(target.parts[0], changed)

    # --- calls

    def _value_call(self, expression: Expression) -> object:
        name = expression.name
        own = self.code.functions.get(name)
        values = [self.value(part) for part in expression.parts]
        self.here = expression.where
        if own is not None and self.scope_of(name) is None:
            return self.called(self.overload(own, values, expression), values, expression)
        if name in SIZES or name in MATRICES:
            if SIZES.get(name) == 1 and len(expression.parts) == 1 and self.is_whole(expression.parts[0]):
                return self.scalar_of(values[0] if not isinstance(values[0], list) else values[0][0])
            return self.made(name, values)
        if not is_known(name):
            names = [*self.code.functions, "length", "dot", "normalize", "clamp", "rotationMatrix3"]
            raise FileError(unknown_name("function", name[:60], names), expression.where)
        return call_glsl(self, name, values)

    def overload(self, own: tuple[Function, ...], values: list[object], expression: Expression) -> Function:
        """The function of a name that takes such values."""
        fitting = [
            each
            for each in own
            if len(each.arguments) == len(values)
            and all(self.fits(a.type, a.size, v) for a, v in zip(each.arguments, values, strict=True))
        ]
        if not fitting:
            self.refuse(f"{expression.name[:60]} of such values")
        whole = [self.is_whole(part) for part in expression.parts]
        return next(
            (
                each
                for each in fitting
                if all((a.type in WHOLE) == w for a, w in zip(each.arguments, whole, strict=True))
            ),
            fitting[0],
        )

    def called(self, function: Function, values: list[object], expression: Expression) -> object:
        """Follows a function."""
        raise NotImplementedError
