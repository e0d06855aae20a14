"""Writes a fragment's distance as a formula of ours: its orbit, what that carries, the distance behind it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from clfractal.errors import FileError, Where
from clfractal.exchange.frag_follow import POINT, Followed
from clfractal.exchange.glsl_orbit import TURN, Orbit
from clfractal.exchange.glsl_symbols import numbers_of, replaced
from clfractal.exchange.glsl_tree import WHOLE, Uniform
from clfractal.exchange.symbols import (
    CONDITIONS,
    Symbol,
    TooLargeError,
    Value,
    names_in,
    ordered,
    written,
)
from clfractal.formulas.build_orbit import MAX_LETS, MAX_STATE
from clfractal.formulas.names import check_name

AXES = ("x", "y", "z", "w")
FAR = 1e9
"""A bailout for orbits that end in another way."""
MAX_STATEMENTS = 1500
_GOING = "going"
_LONGEST = 600
_SAMPLES = 24


@dataclass
class Writer:
    """Writes the formula.

    Args:
        values: those of uniforms.
    """

    followed: Followed
    values: Mapping[str, tuple[float, ...]]
    file: str
    names: dict[str, Value] = field(default_factory=dict)
    taken: set[str] = field(default_factory=lambda: {*AXES, TURN, _GOING, "reached"})
    used: set[str] = field(default_factory=set)
    """The symbols of parameters that the formula has."""
    kept: dict[str, Symbol] = field(default_factory=dict)
    """What is made of the point alone, by the names under which it is carried."""
    parts: dict[int, Value] = field(default_factory=dict)
    """Those names as symbols, by the `id` of what they stand for."""

    def write(self) -> dict[str, Any]:
        """The formula, but for its bounds and its degree.

        Raises:
            FileError: it is larger than our language takes.
        """
        try:
            return self._write()
        except TooLargeError as error:
            raise FileError(f"has no counterpart: {error}", Where(self.file)) from None

    def _write(self) -> dict[str, Any]:
        orbit, symbols = self.followed.orbit, self.followed.symbols
        for name, (uniform, place) in self.followed.parameters.items():
            self.names[name] = symbols.name(self.named(uniform.name, place, _size(uniform)))
        if orbit is None:
            self.names |= {point: symbols.name(axis) for point, axis in zip(POINT, AXES, strict=False)}
            return self.done({"variables": list(AXES[:3]), "map": list(AXES[:3])}, {})
        z, radius = self.chosen(orbit)
        flagged = orbit.exit != 0.0 and radius is None
        roots = [self.followed.distance, *([orbit.exit] if flagged else [])]
        roots += [orbit.leaves[each].end for each in z if each in orbit.leaves]
        needed = self.needed(orbit, roots)
        beside = [each for each in orbit.leaves if each in needed and each not in z]
        if z:
            self.keep(orbit, [*z, *beside], flagged)
        for place, each in enumerate(z):
            self.names[each] = symbols.name(AXES[place])
        for each in beside:
            variable, _, component = each.rpartition(" ")
            size = len(orbit.groups.get(variable, ()))
            shown = self.named(variable or each, int(component) if component.isdecimal() else 0, max(size, 1))
            self.names[each] = symbols.name(shown)
        ends = [orbit.leaves[each].end for each in (*z, *beside)]
        asked = [*ends, self.followed.distance, *([orbit.exit] if flagged else [])]
        places = [] if self.kept else [each for each in POINT if each in names_in(asked)]
        state: dict[str, Any] = {}
        if z:
            for place, each in enumerate(POINT):
                if each in places:
                    shown = self.named(f"point{AXES[place].upper()}", 0, 1)
                    self.names[each] = symbols.name(shown)
                    state[shown] = {"start": AXES[place]}
        else:
            self.names |= {point: symbols.name(axis) for point, axis in zip(POINT, AXES, strict=False)}
        return self.iterated(orbit, z, beside, state, radius if z else None, flagged)

    def iterated(
        self,
        orbit: Orbit,
        z: Sequence[str],
        beside: Sequence[str],
        state: dict[str, Any],
        radius: Value | None,
        flagged: bool,
    ) -> dict[str, Any]:
        """The formula of an orbit."""
        variables = list(AXES[: max(len(z), 3)])
        before: dict[str, Value] = dict(zip(POINT, map(self.followed.symbols.name, AXES), strict=False))
        later: dict[str, Value] = {}
        for place, each in enumerate(z):
            start = orbit.leaves[each].start
            if place < 3 and start is not self.followed.symbols.name(POINT[place]):
                later[AXES[place]] = start
        starts = {**self.kept, **{self.shown(each): orbit.leaves[each].start for each in beside}}
        for shown, start in starts.items():
            begin = self.begin(start, before)
            state[shown] = {"start": "0" if begin is None else begin}
            if begin is None:
                later[shown] = start
        if flagged:
            enters = self.followed.symbols.choose(orbit.enters, 1.0, 0.0)
            begin = self.begin(enters, before)
            state[_GOING] = {"start": "1" if begin is None else begin}
            if begin is None:
                later[_GOING] = enters
        if len(state) > MAX_STATE:
            raise FileError(
                f"has no counterpart: its orbit carries {len(state)} numbers beside z; {MAX_STATE} are allowed",
                Where(self.file),
            )
        statements: list[dict[str, Any]] = []
        if later:
            let, texts = self.texts(list(later.values()), "s", {**self.names, **before}, first=True)
            inner = [*({name: text} for name, text in let.items()), dict(zip(later, texts, strict=True))]
            statements.append({"when": f"{TURN} == 0", "do": inner})
        targets = [*AXES[: len(z)], *(self.shown(each) for each in beside)]
        ends = [orbit.leaves[each].end for each in (*z, *beside)]
        if flagged:
            targets.append(_GOING)
            ends.append(self.followed.symbols.choose(orbit.exit, 0.0, 1.0))
        let, texts = self.texts(ends, "v", self.names)
        closed, let = self.closed(let)
        changed = {name: text for name, text in zip(targets, texts, strict=True) if name != text}
        turn = [*({name: text} for name, text in let.items()), *([changed] if changed else [])]
        statements += [{"when": f"{_GOING} > 0.5", "do": turn}] if flagged and turn else turn
        found: dict[str, Any] = {"variables": variables}
        if not statements:
            statements = [{"x": "x"}]
        if state:
            found["state"] = state
        if closed:
            found["let"] = closed
        found["do"] = statements
        if len(z) == 4:
            found["slice"] = {"w": self.plain(orbit.leaves[z[3]].start, before)}
        more: dict[str, Any] = {}
        if radius is not None:
            more["bailout"] = self.plain(radius, {})
        return self.done(found, more)

    def done(self, found: dict[str, Any], more: dict[str, Any]) -> dict[str, Any]:
        """The formula with its distance and its parameters."""
        let, (text,) = self.texts([self.followed.distance], "d", self.names)
        functions: dict[str, Any] = {}
        known = found.get("let", {})
        # No application asks for these, so they are computed in the end alone.
        room = MAX_LETS - len(known)
        known = {**known, **dict([*let.items()][:room])}
        rest = dict([*let.items()][room:])
        if rest:
            own = {*rest, *(self.shown(symbol) for symbol in self.used)}
            names = sorted({name for each in (*rest.values(), text) for name in words_of(each)} - own)
            functions = {f"reached({', '.join(names)})": {"let": rest, "value": text}}
            text = f"reached({', '.join(names)})"
        found = {key: value for key, value in found.items() if key != "let"}
        parameters = {}
        for symbol in sorted(self.used):
            uniform, place = self.followed.parameters[symbol]
            parameters[self.shown(symbol)] = _parameter(uniform, place, self.values)
        return {
            **({"parameters": parameters} if parameters else {}),
            **({"functions": functions} if functions else {}),
            **{key: found[key] for key in ("variables", "state") if key in found},
            **({"let": known} if known else {}),
            **{key: value for key, value in found.items() if key not in ("variables", "state")},
            "add": "none",
            "degree": 1,
            "bounds": {"center": [0, 0, 0], "radius": 100},
            "bailout": more.get("bailout", FAR),
            "distance_bailout": more.get("bailout", FAR),
            "distance": text,
        }

    # --- names and texts

    def named(self, name: str, place: int, size: int) -> str:
        """A name of our language for a number of a variable."""
        plain = (
            "".join(each if each.isalnum() and each.isascii() else "_" for each in name).strip("_")[:30]
            or "value"
        )
        plain = plain if plain[0].isalpha() else f"v{plain}"
        wanted = f"{plain}_{AXES[place]}" if 1 < size <= 4 else f"{plain}_{place + 1}" if size > 4 else plain
        for count in range(1, 1000):
            shown = wanted if count == 1 else f"{wanted}_{count}"
            try:
                check_name(shown, self.taken, Where())
            except Exception:
                continue
            self.taken.add(shown)
            return shown
        raise TooLargeError("it has too many names")

    def shown(self, symbol: str) -> str:
        """A symbol's name in our language."""
        found = self.names[symbol]
        assert isinstance(found, Symbol)
        return found.name

    def texts(
        self, values: Sequence[Value], prefix: str, names: Mapping[str, Value], *, first: bool = False
    ) -> tuple[dict[str, str], list[str]]:
        """Values as text, with names for parts of them; `first`: before the first turn."""
        self.used |= names_in(values) & self.followed.parameters.keys()
        found = replaced(self.followed.symbols, values, names, {} if first else self.parts)
        while any(each.startswith(prefix) and each[len(prefix) :].isdecimal() for each in self.taken):
            prefix += "_"
        return written(found, prefix, most=MAX_STATEMENTS, long=12)

    def plain(self, value: Value, names: Mapping[str, Value]) -> str:
        """A value as text without names for parts."""
        let, (text,) = self.texts([value], "q", {**self.names, **names}, first=True)
        # From the last one on, as later ones are made of earlier ones.
        for name, part in reversed(let.items()):
            text = _put(text, name, part)
            if len(text) > 8000:
                raise TooLargeError("an expression is too long")
        return text

    def closed(self, let: Mapping[str, str]) -> tuple[dict[str, str], dict[str, str]]:
        """The names that depend on parameters alone, and the others."""
        known = {self.shown(symbol) for symbol in self.used}
        found: dict[str, str] = {}
        for name, text in let.items():
            if words_of(text) <= known and len(found) < MAX_LETS:
                found[name] = text
                known.add(name)
        return found, {name: text for name, text in let.items() if name not in found}

    def begin(self, start: Value, before: Mapping[str, Value]) -> str | None:
        """What a number begins with, of the point's coordinates; None: it is too long for one expression."""
        try:
            text = self.plain(start, before)
        except TooLargeError:
            return None
        return text if len(text) <= _LONGEST else None

    # --- what is carried

    def keep(self, orbit: Orbit, turning: Sequence[str], flagged: bool) -> None:
        """Carries what is made of the point alone, where there is room: else each turn would compute it anew."""
        asked = [orbit.leaves[each].end for each in turning]
        asked += [self.followed.distance, *([orbit.exit] if flagged else [])]
        found = self.alike(asked)
        if (
            not found
            or len(found) + len(turning) + 1 > MAX_STATE
            or all(p.operation == "name" for p in found)
        ):
            return
        for place, part in enumerate(found):
            shown = self.named(f"kept{place + 1}", 0, 1)
            self.kept[shown] = part
            self.parts[id(part)] = self.followed.symbols.name(shown)

    def alike(self, values: Sequence[Value]) -> list[Symbol]:
        """The largest parts of values that are made of the point and parameters alone."""
        fixed: dict[int, bool] = {}
        order = ordered(values)
        for symbol in order:
            if symbol.operation == "name":
                fixed[id(symbol)] = symbol.name in POINT
            else:
                used = names_in([symbol])
                fixed[id(symbol)] = (
                    symbol.operation not in CONDITIONS
                    and bool(used & {*POINT})
                    and used <= {*POINT, *self.followed.parameters}
                )
        outer = {id(value) for value in values} | {
            id(part)
            for symbol in order
            if not fixed[id(symbol)]
            for part in symbol.parts
            if isinstance(part, Symbol)
        }
        return [symbol for symbol in order if fixed[id(symbol)] and id(symbol) in outer]

    def needed(self, orbit: Orbit, roots: Iterable[Value]) -> set[str]:
        """The leaves that values depend on, in later turns, too."""
        found: set[str] = set()
        pending = [*roots]
        while pending:
            new = (names_in(pending) & orbit.leaves.keys()) - found
            found |= new
            pending = [orbit.leaves[each].end for each in new]
        return found

    def chosen(self, orbit: Orbit) -> tuple[list[str], Value | None]:
        """The numbers that are z, and the radius beyond which it has gone; None: it goes in another way."""
        needed = self.needed(orbit, [self.followed.distance, orbit.exit])
        vectors = [
            [each for each in group if each in orbit.leaves]
            for group in orbit.groups.values()
            if len(group) in (3, 4) and all(each in orbit.leaves for each in group[:3])
        ]
        vectors = [group for group in vectors if needed & {*group}]
        point = [self.followed.symbols.name(each) for each in POINT]

        def begins(group: Sequence[str]) -> bool:
            return all(orbit.leaves[each].start is at for each, at in zip(group, point, strict=False))

        vectors.sort(key=lambda group: not begins(group))
        for group in vectors:
            for size in (3, 4)[: len(group) - 2]:
                if size == 4 and names_in(
                    [orbit.leaves[group[3]].start]
                ) - self.followed.parameters.keys() - {*POINT}:
                    continue
                radius = self.gone(orbit, group[:size])
                if radius is not None:
                    return group[:size], radius
        return (vectors[0][:3], None) if vectors else ([], None)

    def gone(self, orbit: Orbit, group: Sequence[str]) -> Value | None:
        """The radius, if the last turn is the one behind which z is beyond it."""
        leaving = orbit.exit
        if isinstance(leaving, Symbol) and leaving.operation == "not":
            inner = leaving.parts[0]
            turned = {"<": ">", "<=": ">", ">": "<", ">=": "<"}
            if not isinstance(inner, Symbol) or inner.operation not in turned:
                return None
            sign, parts = turned[inner.operation], inner.parts
        elif isinstance(leaving, Symbol) and leaving.operation in ("<", "<=", ">", ">="):
            sign, parts = leaving.operation[0], leaving.parts
        else:
            return None
        size, bound = parts if sign == ">" else (parts[1], parts[0])
        if names_in([bound]) - self.followed.parameters.keys() or isinstance(size, float):
            return None
        ends = [orbit.leaves[each].end for each in group]
        power = self.like(size, ends)
        call = self.followed.symbols.call
        if power == 1:
            return call("max", bound, 0.001)
        return call("sqrt", call("max", bound, 1e-6)) if power == 2 else None

    def like(self, size: Value, ends: Sequence[Value]) -> int:
        """1 or 2 if a value is that power of a vector's length wherever one looks, else 0."""
        import numpy as np

        generator = np.random.default_rng(1)
        names = sorted(names_in([size, *ends]))
        powers = {1, 2}
        seen = 0
        for _ in range(_SAMPLES):
            given = {name: float(generator.uniform(0.1, 2.5)) for name in names}
            if TURN in given:
                given[TURN] = float(generator.integers(0, 5))
            value, *vector = numbers_of([size, *ends], given)
            length = math.hypot(*vector)
            if not (math.isfinite(value) and math.isfinite(length)):
                continue
            seen += 1
            powers = {power for power in powers if math.isclose(value, length**power, rel_tol=1e-9)}
        return min(powers) if powers and seen > _SAMPLES // 2 else 0


def words_of(text: str) -> set[str]:
    """The names in an expression, but those of functions."""
    return set(re.findall(r"\b[A-Za-z_]\w*(?!\w*\()", text)) - {"and", "or", "not"}


def _put(text: str, name: str, part: str) -> str:
    """A text with a part in brackets where its name stands."""
    return re.sub(rf"\b{name}\b", f"({part})", text)


def _size(uniform: Uniform) -> int:
    return len(uniform.values or (0.0,))


def _parameter(uniform: Uniform, place: int, values: Mapping[str, tuple[float, ...]]) -> dict[str, Any]:
    """A parameter with the range of its slider, widened to its value."""
    assert uniform.values is not None
    given = values.get(uniform.name, uniform.values)
    value = given[place] if place < len(given) else uniform.values[place]
    whole = uniform.type in WHOLE or uniform.type.startswith("b")
    value = float(round(value)) if whole else value
    found: dict[str, Any] = {"default": _plain(value)}
    if whole:
        found["type"] = "int"
    if uniform.least is not None and uniform.most is not None:
        ends = sorted((uniform.least[place], uniform.most[place]))
        low, high = min(ends[0], value), max(ends[1], value)
        if low < high:
            found |= {"minimum": _plain(math.floor(low) if whole else low)}
            found |= {"maximum": _plain(math.ceil(high) if whole else high)}
    return found


def _plain(value: float) -> float | int:
    return int(value) if float(value).is_integer() and abs(value) < 1e15 else float(value)
