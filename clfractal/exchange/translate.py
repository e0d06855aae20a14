"""Follows the text of a formula for given parameters, and writes what it does to z in our formula language.

Parameters are numbers here, so what they switch off is not there, loops that they bound are unrolled, and conditions on
the number of the application are decided. What is left are assignments, and choices that depend on z: these become
`where`. What a formula keeps from one application to the next must not depend on z.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from clfractal.errors import FileError, Where
from clfractal.exchange.arithmetic import NOTHING, Nothing, Place, Turn, Vector
from clfractal.exchange.c_text import MATRIX, POINTER, SIZES, Expression, Statement
from clfractal.exchange.parameters import Parameters
from clfractal.exchange.symbols import Symbols, TooLargeError, Value, names_in
from clfractal.exchange.values import Values

VARIABLES = ("x", "y", "z", "w")
MAX_STEPS = 20_000
MAX_TURNS = 24
"""Of a loop whose end depends on z: it ends then."""
_SCALARS = ("pos_neg", "cw", "actualScale", "actualScaleA", "temp1000", "addDist", "DE0", "dist")
COLOR = "color"
"""The field that sums up how a point was folded."""
_UNSEEN = ("DE", COLOR, "colorHybrid", "pseudoKleinianDE", "r_dz")
"""What is for distances and colours, which are found in another way here."""


@dataclass(frozen=True, slots=True)
class Space:
    """The numbers that z has.

    Attributes:
        four: whether there is a fourth one; else it is 0, and so is the point's.
        mirrored: whether our third axis points the other way than theirs.
        repeats: after which lengths along each axis space is there once more; 0: it is not.
    """

    four: bool = True
    mirrored: bool = False
    repeats: tuple[float, ...] = ()

    def point(self, symbols: Symbols) -> Vector:
        """The point in space as they have it, which does not change."""
        return self.turned(symbols, [*self.begins(symbols, "point_"), 0.0][:4])

    def begins(self, symbols: Symbols, before: str) -> list[Value]:
        """A point of ours, in the part of space that repeats: as many variables as z has."""
        found: list[Value] = [symbols.name(before + name) for name in VARIABLES[: 4 if self.four else 3]]
        for place, length in enumerate(self.repeats):
            if length > 0:
                half = symbols.call("+", found[place], length / 2)
                found[place] = symbols.call("-", symbols.call("mod", half, length), length / 2)
        return found

    def named(self, symbols: Symbols, before: str = "") -> Vector:
        """Variables of ours as a vector of theirs."""
        return self.turned(
            symbols, [symbols.name(before + n) if self.four or n != "w" else 0.0 for n in VARIABLES]
        )

    def turned(self, symbols: Symbols, vector: Vector) -> Vector:
        """A vector of theirs as one of ours, or the other way."""
        if not self.mirrored:
            return vector
        return [symbols.negative(part) if place == 2 else part for place, part in enumerate(vector)]


@dataclass(frozen=True, slots=True)
class Folds:
    """What is done to z before each application, whichever formula it has.

    Attributes:
        box: where axes are folded, and what coordinates are taken from; None: they are not.
        ball: radii of the ball fold, within which space is enlarged evenly, and the outer one; None: there is none.
    """

    box: tuple[float, float] | None = None
    ball: tuple[float, float] | None = None


NO_FOLDS = Folds()


@dataclass
class State:
    """What a formula keeps from one application to the next; a constant, or made of the point alone."""

    scalars: dict[str, Value]
    c: Vector
    old_z: Vector

    def key(self) -> tuple[object, ...]:
        """Equal for equal states of one `Symbols`."""
        parts = (*self.scalars.values(), *self.c)
        return tuple(part if isinstance(part, float) else (id(part),) for part in parts)


def first_state(symbols: Symbols, parameters: Parameters, space: Space) -> State:
    """What is there before the first application."""
    scale = parameters.value("mandelbox.scale")
    assert isinstance(scale, float)
    scalars: dict[str, Value] = dict.fromkeys(_SCALARS, 0.0)
    scalars |= {"pos_neg": 1.0, "actualScale": scale, "temp1000": 1000.0, "dist": 1000.0}
    return State(scalars, space.point(symbols), space.point(symbols))


@dataclass
class Applied:
    """One application: z after it, and what it keeps.

    Attributes:
        compared: the numbers that its own number was compared with.
        computed: whether this was used in another way, so that the next one is another.
        carry: what is carried, after it.
    """

    z: Vector
    state: State
    number: int
    compared: frozenset[float]
    computed: bool
    carry: dict[str, Value]

    def is_like(self, number: int) -> bool:
        """Whether an application of another number that begins with the same state is the same."""
        if self.computed:
            return number == self.number
        return all((number > at, number < at) == (self.number > at, self.number < at) for at in self.compared)


class KeepsError(FileError):
    """A formula keeps a field that depends on z: `name`."""

    def __init__(self, name: str, message: str, where: Where) -> None:
        super().__init__(message, where)
        self.name = name


def carried_name(name: str) -> str:
    """What a field is called in a formula of ours."""
    return f"kept_{name.lower()}"


class _Left(Exception):  # noqa: N818
    """`break` or `continue`."""


class _Returned(Exception):  # noqa: N818
    def __init__(self, value: object) -> None:
        self.value = value


def apply(
    text: Sequence[Statement],
    file: str,
    parameters: Parameters,
    symbols: Symbols,
    application: int,
    state: State,
    choices: Mapping[str, int],
    *,
    space: Space,
    carried: Sequence[str] = (),
    turn: Value | None = None,
    folds: Folds = NO_FOLDS,
) -> Applied:
    """What an application does.

    Args:
        application: its number, from 0.
        choices: the numbers of names that choose between ways to do something.
        space: the numbers that z has.
        carried: the fields that our formula carries from one application to the next.
        turn: an expression of the application's number, for a formula of all applications; None: it is known.
        folds: what is done to z before.

    Raises:
        KeepsError: a field would have to be carried.
        FileError: the text does something that our language has not, at its line.
    """
    run = Run(
        file, symbols, 0, parameters, choices, {}, {}, application, state, space, tuple(carried), turn, folds
    )
    try:
        z = run.function(text)
    except RecursionError:
        raise FileError("is nested too deep", Where(file)) from None
    except TooLargeError as error:
        raise FileError(f"has no counterpart: {error}", Where(file, run.line)) from None
    # Distances that a text keeps are nothing for z.
    kept_values = {
        name: state.scalars[name]
        if name in carried
        else 0.0
        if run.is_nothing(run.aux[name])
        else run.scalar_of(run.aux[name])
        for name in _SCALARS
    }
    kept = State(kept_values, run.vector_of(run.aux["c"]), state.old_z)
    allowed = {f"point_{name}" for name in VARIABLES}
    for name in _SCALARS:
        if kept.scalars[name] is not state.scalars[name] and names_in([kept.scalars[name]]) - allowed:
            where = Where(file, run.kept_at.get(name, run.line))
            raise KeepsError(name, f"has no counterpart: it keeps {name}, which depends on z", where)
    if names_in(kept.c) - allowed:
        where = Where(file, run.kept_at.get("c", run.line))
        raise FileError("has no counterpart: it keeps c, which depends on z", where)
    found = space.turned(symbols, z)
    run.computed |= any(isinstance(part, Turn) for part in (*found, *kept.c, *kept.scalars.values()))
    carry = {name: run.scalar_of(run.aux[name]) for name in carried}
    run.computed |= any(isinstance(part, Turn) for part in carry.values())
    return Applied(found, kept, application, frozenset(run.compared), run.computed, carry)


@dataclass
class Run(Values):
    """A text that is being followed."""

    application: int
    state: State
    space: Space
    carried: tuple[str, ...]
    turn: Value | None
    folds: Folds
    steps: int = 0
    kept_at: dict[str, int] = field(default_factory=dict)
    """The lines where what is kept was set."""

    def function(self, text: Sequence[Statement]) -> Vector:
        z = self.space.named(self.symbols)
        self.names = {"z": z}
        self.aux = {
            **self.state.scalars,
            "i": Turn(self.application) if self.turn is None else self.turn,
            "c": list(self.state.c),
            "const_c": self.space.point(self.symbols),
            "old_z": list(self.state.old_z),
            "r": self.length(z),
            **dict.fromkeys(_UNSEEN, NOTHING),
            **{name: self.symbols.name(carried_name(name)) for name in self.carried},
        }
        self.fold(z)
        try:
            self.block(text)
        except _Returned as returned:
            return self.vector_of(returned.value)
        except _Left:
            self.refuse("a break outside of a loop")
        return self.refuse("it returns nothing")

    def fold(self, z: Vector) -> None:
        """Folds z, and enlarges what distances are divided by as much as space."""
        call, choose = self.call, self.symbols.choose
        if self.folds.box is not None:
            limit, value = self.folds.box
            for place, part in enumerate(z[:3]):
                below = choose(call("<", part, -limit), call("-", -value, part), part)
                z[place] = choose(call(">", part, limit), call("-", value, part), below)
            self.aux["r"] = self.length(z)
        if self.folds.ball is not None:
            inner, outer = (radius * radius for radius in self.folds.ball)
            square = self.dot(z, z)
            between = choose(call("<", square, outer), call("/", outer, square), 1.0)
            factor = choose(call("<", square, inner), call("/", outer, inner), between)
            z[:] = [call("*", factor, part) for part in z]
            if not self.is_nothing(self.aux["DE"]):
                self.aux["DE"] = call("*", factor, self.scalar_of(self.aux["DE"]))
            self.aux["r"] = self.length(z)

    # --- statements

    def block(self, statements: Sequence[Statement]) -> None:
        """Follows statements; what they declare is known within them only."""
        outer = dict(self.names)
        self.follow(statements)
        declared = {statement.name for statement in statements if statement.kind == "declare"}
        for name in declared:
            self.names.pop(name, None)
            if name in outer:
                self.names[name] = outer[name]

    def follow(self, statements: Sequence[Statement]) -> None:
        for statement in statements:
            self.line = statement.line or self.line
            self.steps += 1
            if self.steps > MAX_STEPS:
                self.refuse("it has too many steps")
            getattr(self, f"_statement_{statement.kind}")(statement)

    def _statement_refuse(self, statement: Statement) -> None:
        self.refuse(statement.name)

    def _statement_return(self, statement: Statement) -> None:
        raise _Returned(self.value(statement.values[0]))

    def _statement_leave(self, statement: Statement) -> None:
        if statement.name == "continue":
            self.refuse("continue")
        raise _Left

    def _statement_declare(self, statement: Statement) -> None:
        if statement.type == POINTER:
            # One that leads nowhere yet is given its place later.
            self.names[statement.name] = self.value(statement.values[0]) if statement.values else NOTHING
            return
        value: object
        size = SIZES.get(statement.type, 1)
        if statement.type == MATRIX:
            value = [[0.0] * 3 for _ in range(3)]
        elif statement.size:
            value = [0.0 if size == 1 else [0.0] * size for _ in range(statement.size)]
        else:
            value = 0.0 if size == 1 else [0.0] * size
        if statement.values:
            first = statement.values[0]
            if first.kind == "list":
                value = [self.value(each) for each in first.parts]
            else:
                value = self.value(first)
                if size > 1 and isinstance(value, float | Nothing):
                    value = value if isinstance(value, Nothing) else [value] * size
                elif (
                    isinstance(value, list) and size == 1 and statement.type != MATRIX and not statement.size
                ):
                    self.refuse("a vector as a number")
                value = self._whole(value) if statement.type == "int" else value
        self.names[statement.name] = _copied(value)

    def _whole(self, value: object) -> object:
        is_number = isinstance(value, float) and not isinstance(value, Turn)
        return float(math.trunc(value)) if is_number else value  # type: ignore[arg-type]

    def _statement_assign(self, statement: Statement) -> None:
        target, right = statement.values
        value = self.value(right)
        if statement.name != "=":
            value = self.operator(statement.name[:-1], self.value(target), value)
        self.store(target, value)

    def _statement_if(self, statement: Statement) -> None:
        condition = self.condition(statement.values[0])
        if isinstance(condition, float):
            self.block(statement.blocks[0 if condition else 1])
            return
        self.chosen(condition, statement.blocks)

    def chosen(self, condition: Value | Nothing, blocks: Sequence[Sequence[Statement]]) -> None:
        """Follows both of two blocks, and has of each variable what the condition chooses."""
        names, aux = self.names, self.aux
        ends = []
        for block in blocks:
            copies: dict[int, list[object]] = {}
            self.names = {name: _copied(value, copies) for name, value in names.items()}
            self.aux = {name: _copied(value, copies) for name, value in aux.items()}
            try:
                self.block(block)
            except (_Left, _Returned):
                self.refuse("it leaves a loop, or ends, by a condition on z")
            ends.append((self.names, self.aux))
        (yes, yes_aux), (no, no_aux) = ends
        self.names, self.aux = names, aux
        for found, one, other in ((names, yes, no), (aux, yes_aux, no_aux)):
            for name, old in found.items():
                # Pointers lead to the same vectors as before.
                if not isinstance(old, Place):
                    self.put(found, name, self.merged(condition, one[name], other[name]))

    def put(self, found: dict[str, object], name: str, value: object) -> None:
        """Sets a variable; a vector stays the same one, with other numbers, as pointers may lead to it."""
        old = found.get(name)
        if isinstance(old, list) and isinstance(value, list) and len(old) == len(value):
            old[:] = _copied(value)
        else:
            found[name] = _copied(value)

    def _statement_loop(self, statement: Statement) -> None:
        start, step, body = statement.blocks
        self.follow(start)
        going: Value = 1.0
        turns = 0
        for _ in range(MAX_STEPS):
            condition = self.condition(statement.values[0]) if statement.values else 1.0
            if isinstance(condition, Nothing):
                self.refuse("a loop whose end depends on nothing")
            if condition == 0.0:
                return
            going = condition if isinstance(going, float) else self.symbols.both(going, condition)
            if not isinstance(going, float):
                turns += 1
                if turns > MAX_TURNS:
                    return
                # What counts the turns goes on, as it may end the loop for all z.
                self.chosen(going, (body if start else (*body, *step), ()))
                if start:
                    self.block(step)
                continue
            try:
                self.block(body)
            except _Left:
                return
            self.block(step)
        self.refuse("a loop without an end")

    def _statement_switch(self, statement: Statement) -> None:
        value = self.value(statement.values[0])
        self.computed |= isinstance(value, Turn)
        if not isinstance(value, float):
            self.refuse("a choice that depends on z")
        cases = statement.blocks[0]
        first = next(
            (
                place
                for place, case in enumerate(cases)
                if case.values and self.value(case.values[0]) == value
            ),
            next((place for place, case in enumerate(cases) if not case.values), len(cases)),
        )
        try:
            for case in cases[first:]:
                self.follow(case.blocks[0])
        except _Left:
            return

    def store(self, target: Expression, value: object) -> None:
        """Sets a variable, a part of a vector, or a field that is kept."""
        if target.kind == "name":
            old = self.names.get(target.name)
            if isinstance(old, list) and isinstance(value, float):
                value = [value] * len(old)
            self.put(self.names, target.name, value)
            return
        if target.kind == "target":
            place = self.value(target.parts[0])
            if isinstance(place, Nothing):
                return
            if isinstance(place, Place):
                place.vector[place.index] = self.scalar_of(value)
                return
            self.refuse("an assignment to this")
        if target.kind == "item":
            array, index = self.value(target.parts[0]), self.value(target.parts[1])
            if isinstance(array, list) and isinstance(index, float) and 0 <= index < len(array):
                array[int(index)] = _copied(value)
                return
            self.refuse("an assignment to this part of an array")
        if target.kind == "member":
            owner = target.parts[0]
            if owner.kind == "name" and owner.name == "aux":
                if target.name == "dist" and not self.parameters.solids:
                    return
                if target.name == "dist" and "dist" not in self.carried:
                    what = "has no counterpart: its solid is a shape in space, which each application adds to"
                    raise KeepsError("dist", what, Where(self.file, self.line or None))
                if target.name == COLOR and self.parameters.colors and COLOR not in self.carried:
                    what = "has no counterpart: it keeps what colours follow"
                    raise KeepsError(COLOR, what, Where(self.file, self.line or None))
                if target.name not in self.aux or target.name in ("i", "const_c"):
                    self.refuse(f"an assignment to aux->{target.name}")
                self.aux[target.name] = _copied(value)
                self.kept_at[target.name] = self.line
                return
            if owner.kind == "member":
                self.kept_at[owner.name] = self.line
            vector = self.value(owner)
            if isinstance(vector, list) and target.name in ("m1", "m2", "m3"):
                vector[int(target.name[1]) - 1] = self.vector_of(value)[:3]
                return
            places = self.places(target.name)
            if isinstance(vector, list) and max(places) < len(vector):
                parts = value if isinstance(value, list) else [value] * len(places)
                for place, part in zip(places, parts, strict=False):
                    vector[place] = self.scalar_of(part)
                return
        self.refuse("an assignment to this")


def _copied(value: Any, copies: dict[int, list[object]] | None = None) -> Any:
    """Vectors, and pointers to them, once more; one that is there twice is one in `copies`, too."""
    copies = {} if copies is None else copies
    if isinstance(value, Place):
        return Place(_copied(value.vector, copies), value.index)
    if not isinstance(value, list):
        return value
    if id(value) not in copies:
        copies[id(value)] = [_copied(each, copies) for each in value]
    return copies[id(value)]
