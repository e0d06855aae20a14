"""A formula of Mandelbulber by its text, as formulas of ours: one for each way its applications differ."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from clfractal.errors import FileError, Where
from clfractal.exchange.c_text import Expression, Statement
from clfractal.exchange.ends import DISCS, ending
from clfractal.exchange.installed import Installed
from clfractal.exchange.parameters import Parameters
from clfractal.exchange.settings import Section
from clfractal.exchange.symbols import Symbols, TooLargeError, Value, names_in, written
from clfractal.exchange.translate import (
    COLOR,
    NO_FOLDS,
    VARIABLES,
    Applied,
    Folds,
    KeepsError,
    Space,
    State,
    apply,
    carried_name,
    first_state,
)
from clfractal.formulas.build_blocks import MAX_STATEMENTS
from clfractal.formulas.build_orbit import MAX_LETS

_Found = TypeVar("_Found")
_TITLE = 60
_STEP_SCALE = 0.7
"""Of distances that are a little too large."""


STAYS = (Statement("return", "", (Expression("name", "z", (), 0),), (), 0),)
"""The text of a formula that leaves z where it is."""


@dataclass(frozen=True, slots=True)
class Addition:
    """What is added after a formula: nothing, the point times factors, or a constant; or its x and y in exchange."""

    factors: tuple[float, ...] | None = None
    constant: tuple[float, ...] | None = None
    swapped: bool = False

    def placed(self, vector: Sequence[Value]) -> list[Value]:
        """A vector in the order in which it is added."""
        return [vector[1], vector[0], *vector[2:]] if self.swapped else list(vector)


@dataclass
class Text:
    """A formula's text, and the parameters that it is followed with; `colors`: also for what colours follow.

    `solids`: what it says of solids in space counts.
    """

    number: int
    statements: tuple[Statement, ...]
    file: Path
    fractal: Section
    choices: Mapping[str, int]
    colors: bool = False
    solids: bool = True
    parameters: Parameters = field(init=False)

    def __post_init__(self) -> None:
        self.parameters = Parameters(self.fractal, self.choices, colors=self.colors, solids=self.solids)


def text_of(
    number: int, fractal: Section, installed: Installed | None, *, colors: bool = False, solids: bool = True
) -> Text | None:
    """The text of a formula; None if it is not there.

    Raises:
        FileError: it cannot be read, or is outside of the C that is read.
    """
    found = None if installed is None else installed.text(number)
    if found is None or installed is None:
        return None
    return Text(number, *found, fractal, installed.choices, colors, solids)


@dataclass
class Following:
    """Follows applications one after the other, with what they keep.

    Args:
        space: the numbers that z has.
        first: the first formula's parameters, which give the scale that an orbit begins with.
        carried: the fields that formulas carry, as they depend on z.
        folds: what is done to z before each application.
        last: the distance by the end of an orbit, of formulas with one of their own (`ends.py`).
        bailout: beyond which orbits end that may also stand still; None: they go on.
        shift: how much `n` is above their number of an application; None: applications are formulas of their own.
    """

    space: Space
    first: Parameters
    carried: tuple[str, ...] = ()
    shift: int | None = None
    folds: Folds = NO_FOLDS
    last: str | None = None
    bailout: float | None = None
    symbols: Symbols = field(default_factory=Symbols)
    state: State = field(init=False)
    done: dict[tuple[object, ...], list[Applied]] = field(default_factory=dict)
    found: dict[tuple[object, ...], dict[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.state = first_state(self.symbols, self.first, self.space)

    def applied(self, text: Text, application: int, addition: Addition) -> dict[str, Any]:
        """The formula of an application; the same object for the same formula.

        Raises:
            FileError: the text does something that our language has not.
        """
        known = self.done.setdefault((id(text), *self.state.key()), [])
        done = next((each for each in known if each.is_like(application)), None)
        if done is None:
            done = apply(
                text.statements,
                str(text.file),
                text.parameters,
                self.symbols,
                application,
                self.state,
                text.choices,
                space=self.space,
                carried=self.carried,
                turn=self.turn,
                folds=self.folds,
            )
            known.append(done)
        self.state = done.state
        size = 4 if self.space.four else 3
        if not self.space.four and done.z[3] != 0.0:
            raise NeedsFourError
        z, adds = self._added(done.z[:size], addition)
        whole = [*z, *done.carry.values()]
        key = (adds, *(part if isinstance(part, float) else (id(part),) for part in whole))
        if key not in self.found:
            try:
                let, maps = written(whole, "v", most=MAX_STATEMENTS)
            except TooLargeError as error:
                raise FileError(f"has no counterpart: {error}", Where(str(text.file))) from None
            formula = _formula(text, let, maps[:size], adds)
            formula |= self.carrying(dict(zip(done.carry, maps[size:], strict=True)))
            self.found[key] = with_room(self.ending(formula, text.number in DISCS))
        return self.found[key]

    @property
    def turn(self) -> Value | None:
        """The number of an application, where it is no number but a name."""
        if self.shift is None:
            return None
        return self.symbols.call("-", self.symbols.name("n"), float(self.shift))

    @property
    def changed(self) -> tuple[str, ...]:
        """The fields that are not what they began with, and so might be carried."""
        begin = first_state(self.symbols, self.first, self.space)
        return tuple(name for name, value in self.state.scalars.items() if value != begin.scalars[name])

    def carrying(self, following: Mapping[str, str]) -> dict[str, Any]:
        """The keys of a formula for what is carried, by the values after an application; it stays where there is none."""
        if not self.carried:
            return {}
        begin = {"DE": 1.0, COLOR: 1.0, **first_state(self.symbols, self.first, self.space).scalars}
        state = {
            carried_name(name): {"start": begin[name], "next": following.get(name, carried_name(name))}
            for name in self.carried
        }
        found: dict[str, Any] = {"state": state}
        if self.last is not None:
            found["distance"] = self.last
            found["step_scale"] = _STEP_SCALE
        elif "dist" in self.carried:
            found["distance"] = carried_name("dist")
        return found

    def ending(self, formula: dict[str, Any], checks: bool) -> dict[str, Any]:
        """The formula, whose orbits stop where those of the Pseudo Kleinian do."""
        if self.bailout is None or "dist" in self.carried or formula["add"] == "point":
            return formula
        return ending(formula, self.bailout, checks=checks)

    def _added(self, z: Sequence[Value], addition: Addition) -> tuple[list[Value], bool]:
        """The map, with what is added but what our language adds by itself; and whether that is the point."""
        call = self.symbols.call
        # Our language adds the point itself, and not that in the part of space that repeats.
        raw: list[Value] = [self.symbols.name(f"point_{name}") for name in VARIABLES[: len(z)]]
        here = self.space.begins(self.symbols, "point_")
        found = list(z)
        if addition.constant is not None:
            constant = self.space.turned(self.symbols, addition.placed(addition.constant))
            found = [*(call("+", a, b) for a, b in zip(found, constant, strict=False)), *found[3:]]
        factors = [*(addition.factors or (0.0, 0.0, 0.0)), 0.0]  # the fourth number of the point is not added
        if not any(factors) and not any(name.startswith("point_") for name in names_in(found)):
            return found, False
        for place, part in enumerate(found):
            own = 1.0
            if addition.swapped and place < 2:
                part = call("+", part, call("*", factors[place], here[1 - place]))
            else:
                own = 1.0 - factors[place]
            found[place] = call("-", part, call("*", own, here[place]))
            if here[place] is not raw[place]:
                found[place] = call("+", found[place], call("-", here[place], raw[place]))
        return found, True

    def standing(self) -> dict[str, Any]:
        """A formula for one application, by which an orbit begins at the point, in the part of space that repeats."""
        let, maps = written(self.space.begins(self.symbols, ""), "v")
        formula = {
            "title": "The point",
            "variables": list(VARIABLES[: len(maps)]),
            **({"let": dict(let)} if let else {}),
            "map": maps,
            "add": "none",
            "degree": 1,
            "bounds": {"radius": 0.001},
            **(self.carrying({}) or {"derivative": "dr"}),
        }
        return {"formula": self.ending(formula, False), "count": 1, "start": 0, "stop": 1}


class NeedsFourError(Exception):
    """z does not stay in three dimensions."""


def with_room(formula: dict[str, Any]) -> dict[str, Any]:
    """A formula whose map has more parts than `let` has room for, as statements."""
    let = formula.get("let", {})
    if len(let) <= MAX_LETS:
        return formula
    state = formula.get("state", {})
    after = dict(zip(formula["variables"], formula["map"], strict=True))
    after |= {name: each["next"] for name, each in state.items()}
    found = {key: value for key, value in formula.items() if key not in ("let", "map")}
    if state:
        found["state"] = {name: {"start": each["start"]} for name, each in state.items()}
    return {**found, "do": [*({name: part} for name, part in let.items()), after]}


def followed_as_needed(
    begin: Callable[[bool, tuple[str, ...]], Following],
    follow: Callable[[Following], _Found],
    *,
    four: bool = False,
    carried: tuple[str, ...] = (),
) -> tuple[_Found, Following]:
    """What `follow` finds, with three numbers of z where they are enough, and with the fields that have to be carried.

    Args:
        begin: makes a `Following`, of whether z has four numbers, and the fields that are carried.
        four, carried: to begin with.

    Raises:
        FileError: the text does something that our language has not.
    """
    while True:
        following = begin(four, carried)
        try:
            return follow(following), following
        except NeedsFourError:
            four = True
        except KeepsError as error:
            if error.name in carried:
                raise
            # Distances to shapes are divided by how much space was enlarged.
            carried = (*carried, *((error.name, "DE") if error.name == "dist" else (error.name,)))


def _formula(text: Text, let: Mapping[str, str], maps: Sequence[str], adds: bool) -> dict[str, Any]:
    """A formula of ours; what is measured of it is filled in later."""
    found: dict[str, Any] = {
        "title": f"Formula {text.number} of Mandelbulber"[:_TITLE],
        "reference": f"made of {text.file.name} of the installed Mandelbulber 2",
        "variables": list(VARIABLES[: len(maps)]),
    }
    if let:
        found["let"] = dict(let)
    return {
        **found,
        "map": list(maps),
        "add": "point" if adds else "none",
        "degree": 1,
        "bounds": {"radius": 100},
    }
