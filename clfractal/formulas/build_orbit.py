"""Reads what a formula does with z: variables, parameters, functions, `let`, `map`, `do`, what is carried."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from clfractal.errors import FormulaError, Where
from clfractal.formulas.blocks import Assign, Block, nodes_of
from clfractal.formulas.build_blocks import BlockReader
from clfractal.formulas.build_parameters import parameters_from_mapping
from clfractal.formulas.definition import Carried, Parameter, inside, point_name
from clfractal.formulas.names import APPLICATION, as_mapping, check_keys, check_name
from clfractal.formulas.nodes import Call, Name, Node, names_in, walk
from clfractal.formulas.parser import Names, OwnFunction, parse, parse_operand
from clfractal.formulas.sharing import Sharing
from clfractal.formulas.vectors import COMPONENTS, Operand, Vector, described

MAX_LETS = 100
MAX_STATE = 16
MAX_FUNCTIONS = 64

_SIGNATURE = re.compile(r"\s*([A-Za-z][A-Za-z0-9_]*)\s*\(([^()]*)\)\s*")
# What a formula that carries numbers, or has statements, says in another way.
_OTHERWISE = {
    "derivative": "carry the derivative as a number of `state`, and say a `distance`",
    "repeat": "use a `loop`",
}


@dataclass(frozen=True, slots=True)
class Orbit:
    """What a formula does with z; see `Formula`."""

    variables: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    let: tuple[tuple[str, Node], ...]
    map: tuple[Node, ...]
    state: tuple[Carried, ...]
    steps: Block
    slice: Node | None
    shape: Node | None
    derivative: Node | None
    distance: Node | None
    point_map: bool
    numbered: bool


class OrbitReader:
    """Reads the keys of one formula in the order in which they build on each other."""

    def __init__(self, data: Mapping[str, Any], where: Where) -> None:
        self.data = data
        self.where = where
        self.sharing = Sharing()
        self.let: list[tuple[str, Node]] = []

    def read(self) -> Orbit:
        """All of them.

        Raises:
            FormulaError: as `formula_from_mapping`.
        """
        data = self.data
        if "include" in data:
            raise FormulaError(
                "files are included where scenes and files are read", inside(self.where, "include")
            )
        if ("map" in data) == ("do" in data):
            both = "has both `map` and `do`" if "map" in data else "lacks the key 'map', or 'do'"
            raise FormulaError(f"the formula {both}", self.where)
        self.variables = self._variables()
        self.parameters = parameters_from_mapping(
            data.get("parameters", {}), self.variables, inside(self.where, "parameters")
        )
        self.constants = tuple(p.name for p in self.parameters)
        self.points = tuple(point_name(v) for v in self.variables)
        taken = {*self.variables, *self.points, *self.constants, *self._keys("let"), *self._keys("state")}
        self.number = () if APPLICATION in taken else (APPLICATION,)
        self.functions = self._functions()
        known = [*self.variables, *self.points, *self.constants, *self.number]
        starts = self._starts(known)
        everything = [*known, *(name for pairs in starts.values() for name, _ in pairs)]
        self._let(everything)
        carried = self._state(starts, everything)
        maps = self._map(everything) if "map" in data else ()
        self._check_static_exponents(maps, (*self.number, *(each.name for each in carried)))
        steps = self._steps(maps, carried, everything)
        if steps:
            for key, advice in _OTHERWISE.items():
                if key in data:
                    message = f"cannot be used with `state` or `do`; {advice}"
                    raise FormulaError(message, inside(self.where, key))
        if "derivative" in data and "distance" in data:
            raise FormulaError("a formula has a derivative or a distance, not both", self.where)
        derivative = self._optional("derivative", (*everything, "dr", "added"), shares=True)
        used = _names([*maps, *(node for _, node in self.let), *nodes_of(steps)])
        of_rule = _names([derivative] if derivative is not None else [])
        absent = {*self.points, *self.number}
        at_end = [name for name in everything if name not in absent]
        orbit = Orbit(
            self.variables,
            self.parameters,
            tuple(self.let),
            maps or tuple(Name(variable) for variable in self.variables),
            carried,
            steps,
            self._slice(),
            self._optional("shape", at_end),
            derivative,
            self._optional("distance", at_end),
            point_map=not used.isdisjoint(self.points),
            numbered=not (used | of_rule).isdisjoint(self.number),
        )
        self._check_at_end(orbit, absent)
        return orbit

    def _keys(self, key: str) -> Collection[str]:
        return as_mapping(self.data.get(key, {}), inside(self.where, key), key).keys()

    def _names(self, known: Collection[str], *, shares: bool = True) -> Names:
        return Names(known, self.functions, self.sharing.share if shares else None)

    def _variables(self) -> tuple[str, ...]:
        """The names of z's numbers; `{z: 3}` is one vector, whose numbers are `z.x`, `z.y`, `z.z`."""
        where = inside(self.where, "variables")
        names = self.data["variables"]
        if isinstance(names, Mapping) and len(names) == 1:
            ((name, size),) = names.items()
            check_name(name, (), inside(where, str(name)))
            if size not in (3, 4) or isinstance(size, bool):
                raise FormulaError("must be 3 or 4: of how many numbers it is", inside(where, name))
            return tuple(f"{name}.{letter}" for letter in COMPONENTS[:size])
        if not isinstance(names, (list, tuple)) or len(names) not in (3, 4):
            raise FormulaError("must be a list of three or four names", where)
        for index, name in enumerate(names):
            check_name(name, names[:index], inside(where, str(index)))
        return tuple(names)

    def _functions(self) -> dict[str, OwnFunction]:
        where = inside(self.where, "functions")
        data = as_mapping(self.data.get("functions", {}), where, "functions")
        if len(data) > MAX_FUNCTIONS:
            raise FormulaError(f"must be at most {MAX_FUNCTIONS}, got {len(data)}", where)
        found: dict[str, OwnFunction] = {}
        for key, body in data.items():
            here = inside(where, str(key))
            signature = _SIGNATURE.fullmatch(str(key))
            if signature is None:
                raise FormulaError("a function is named as in `box(v, limit)`", here)
            name = signature[1]
            arguments = (
                tuple(each.strip() for each in signature[2].split(",")) if signature[2].strip() else ()
            )
            check_name(name, found, here)
            for index, argument in enumerate(arguments):
                check_name(argument, arguments[:index], here)
            parts = body if isinstance(body, Mapping) else {"value": body}
            check_keys(parts, ("let", "value"), here)
            if "value" not in parts:
                raise FormulaError("lacks the key 'value'", here)
            let = as_mapping(parts.get("let", {}), inside(here, "let"), "let")
            for local in let:
                check_name(local, arguments, inside(here, "let", str(local)))
            place = here if parts is not body or let else inside(here, "value")
            found[name] = OwnFunction(
                name,
                arguments,
                tuple(let.items()),
                parts["value"],
                place,
                frozenset((*self.constants, *self.number)),
                dict(found),
            )
        return found

    def _let(self, known: list[str]) -> None:
        where = inside(self.where, "let")
        data = as_mapping(self.data.get("let", {}), where, "let")
        if len(data) > MAX_LETS:
            raise FormulaError(f"must be at most {MAX_LETS} names, got {len(data)}", where)
        for name, value in data.items():
            here = inside(where, str(name))
            check_name(name, known, here)
            try:
                operand = parse_operand(value, names=self._names(known), where=here)
            except FormulaError as error:
                raise _recursion(error, name, value, data, known) from None
            self.let += self.sharing.taken()
            pairs = named(name, operand)
            self.let += pairs
            known += (each for each, _ in pairs)

    def _map(self, names: Collection[str]) -> tuple[Node, ...]:
        where = inside(self.where, "map")
        texts, size = self.data["map"], len(self.variables)
        known = self._names(names)
        if isinstance(texts, str) and "." in self.variables[0]:
            value = parse_operand(texts, names=known, where=where)
            if not isinstance(value, Vector) or len(value.parts) != size:
                raise FormulaError(f"must be a vector of {size}, got {described(value)}", where)
            maps = value.parts
        else:
            if not isinstance(texts, (list, tuple)) or len(texts) != size:
                got = f"{len(texts)}" if isinstance(texts, (list, tuple)) else "no list"
                raise FormulaError(f"must have {size} expressions, one for each variable, got {got}", where)
            maps = tuple(
                parse(text, names=known, where=inside(where, str(i))) for i, text in enumerate(texts)
            )
        self.let += self.sharing.taken()
        return maps

    def _starts(self, known: Sequence[str]) -> dict[str, list[tuple[str, Node]]]:
        """Of each key of `state` the carried numbers, and their values before the first application."""
        where = inside(self.where, "state")
        data = as_mapping(self.data.get("state", {}), where, "state")
        before = Names((*self.variables[:3], *self.constants), self.functions)
        taken = list(known)
        starts: dict[str, list[tuple[str, Node]]] = {}
        for name, value in data.items():
            here = inside(where, str(name))
            check_name(name, taken, here)
            parts = value if isinstance(value, Mapping) else {"start": value}
            check_keys(parts, ("start", "next"), here)
            if "start" not in parts:
                raise FormulaError("lacks the key 'start': its value before the first application", here)
            if "next" in parts and "do" in self.data:
                raise FormulaError("a formula with `do` gives its numbers values there", inside(here, "next"))
            place = inside(here, "start") if parts is value else here
            starts[name] = named(name, parse_operand(parts["start"], names=before, where=place))
            taken += (each for each, _ in starts[name])
        if len(taken) - len(known) > MAX_STATE:
            raise FormulaError(f"must be at most {MAX_STATE} numbers, got {len(taken) - len(known)}", where)
        return starts

    def _state(
        self, starts: Mapping[str, Sequence[tuple[str, Node]]], known: Collection[str]
    ) -> tuple[Carried, ...]:
        """The carried numbers: `name: start`, or with a `map` `name: {start: ..., next: ...}`."""
        found: list[Carried] = []
        for name, pairs in starts.items():
            given = self.data["state"][name]
            following: Sequence[Node | None] = (None,) * len(pairs)
            if isinstance(given, Mapping) and "next" in given:
                here = inside(self.where, "state", name, "next")
                value = parse_operand(given["next"], names=self._names(known), where=here)
                self.let += self.sharing.taken()
                following = value.parts if isinstance(value, Vector) else (value,)
                if len(following) != len(pairs):
                    size = f"a vector of {len(pairs)}" if len(pairs) > 1 else "a number"
                    raise FormulaError(f"must be {size} as its start is, got {described(value)}", here)
            found += (
                Carried(each, start, after) for (each, start), after in zip(pairs, following, strict=True)
            )
        return tuple(found)

    def _steps(self, maps: tuple[Node, ...], carried: tuple[Carried, ...], known: Collection[str]) -> Block:
        """An application as statements; none of a formula that has `let` and `map` alone."""
        if "do" not in self.data and not carried:
            return ()
        before = tuple(Assign((name,), (node,)) for name, node in self.let)
        if "do" not in self.data:
            pairs = [*zip(self.variables, maps, strict=True)]
            pairs += [(each.name, each.next) for each in carried if each.next is not None]
            return (*before, Assign(tuple(name for name, _ in pairs), tuple(node for _, node in pairs)))
        moving = {*self.variables, *self.points, *self.number, *(each.name for each in carried)}
        for name, node in self.let:
            if names_in(node) & moving:
                moving.add(name)
        fixed = (*self.constants, *self.points, *self.number)
        reader = BlockReader(
            self.parameters, fixed, moving, self.functions, self.sharing, inside(self.where, "do")
        )
        return (*before, *reader.read(self.data["do"], known))

    def _check_at_end(self, orbit: Orbit, absent: Collection[str]) -> None:
        """A shape with carried numbers, or a distance, is of the last z: no application has it."""
        let = dict(orbit.let)
        for key, node in (("shape", orbit.shape if orbit.state else None), ("distance", orbit.distance)):
            pending, seen = list(names_in(node)) if node is not None else [], set()
            while pending:
                name = pending.pop()
                if name in absent:
                    message = f"cannot use {name!r}: carry it as a number of `state`"
                    raise FormulaError(message, inside(self.where, key))
                if name in let and name not in seen:
                    seen.add(name)
                    pending += names_in(let[name])

    def _slice(self) -> Node | None:
        where = inside(self.where, "slice")
        if len(self.variables) == 3:
            if "slice" in self.data:
                raise FormulaError("only a formula of four variables has a slice", where)
            return None
        fourth = self.variables[3].rpartition(".")[2]
        data = as_mapping(self.data.get("slice", {fourth: 0}), where, "slice")
        check_keys(data, (fourth,), where)
        if fourth not in data:
            raise FormulaError(f"must give the fourth coordinate, {fourth!r}", where)
        names = Names((*self.variables[:3], *self.constants), self.functions)
        return parse(data[fourth], names=names, where=inside(where, fourth))

    def _optional(self, key: str, names: Collection[str], *, shares: bool = False) -> Node | None:
        if key not in self.data:
            return None
        node = parse(self.data[key], names=self._names(names, shares=shares), where=inside(self.where, key))
        self.let += self.sharing.taken()
        return node

    def _check_static_exponents(self, maps: tuple[Node, ...], changing: Collection[str]) -> None:
        """The exponent of cpow_re and cpow_im must not depend on z: the way it is computed is fixed."""
        moving = {*self.variables, *self.points, *changing}
        places = [
            *((("let", name), node) for name, node in self.let),
            *((("map", str(i)), n) for i, n in enumerate(maps)),
        ]
        for place, node in places:
            for part in walk(node):
                if isinstance(part, Call) and part.function in ("cpow_re", "cpow_im"):
                    used = names_in(part.arguments[2]) & moving
                    if used:
                        message = (
                            f"the exponent of {part.function} must be constant, but uses {sorted(used)[0]!r}"
                        )
                        raise FormulaError(message, inside(self.where, *place))
            if place[0] == "let" and names_in(node) & moving:
                moving.add(place[1])


def named(name: str, value: Operand) -> list[tuple[str, Node]]:
    """A name's value, or those of a vector's components."""
    if not isinstance(value, Vector):
        return [(name, value)]
    return [(f"{name}.{letter}", part) for letter, part in zip(COMPONENTS, value.parts, strict=False)]


def _names(nodes: Iterable[Node]) -> frozenset[str]:
    return frozenset(name for node in nodes for name in names_in(node))


def _recursion(
    error: FormulaError, name: str, value: object, data: Mapping[str, Any], known: Collection[str]
) -> FormulaError:
    """A better message where a `let` uses itself or a later one."""
    for later in [name, *(key for key in data if key not in known and key != name)]:
        if error.message.startswith(f"unknown name {later!r}"):
            problem = "uses itself" if later == name else f"uses {later!r}, which is defined after it"
            return FormulaError(f"{name!r} {problem}", error.where)
    return error
