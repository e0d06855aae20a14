"""Builds a formula from a mapping (a YAML file's content): strict keys, every error with its place."""

from __future__ import annotations

import keyword
import re
from collections.abc import Collection, Mapping
from typing import Any

from clfractal.errors import FormulaError, Where, unknown_name
from clfractal.formulas.binding import check_constant
from clfractal.formulas.definition import Add, Formula, Parameter, inside, point_name
from clfractal.formulas.nodes import FUNCTIONS, Node, names_in, walk
from clfractal.formulas.nodes import Call as CallNode
from clfractal.formulas.parser import parse

MAX_PARAMETERS = 32
MAX_LETS = 100

# The step scale of a formula that tells none and has no scalar rule: where a map stretches space unevenly, distances are
# too long here and there.
JACOBIAN_STEP = 0.75
_REQUIRED = ("variables", "map", "bounds")
_KEYS = (
    *(
        "title",
        "reference",
        "description",
        "variables",
        "parameters",
        "let",
        "map",
        "repeat",
        "add",
        "degree",
    ),
    *(
        "bounds",
        "bailout",
        "distance_bailout",
        "step_scale",
        "slice",
        "shape",
        "derivative",
        "julia",
        "alone",
    ),
)
_PARAMETER_KEYS = ("type", "default", "minimum", "maximum", "choices", "baked", "description")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
_RESERVED = frozenset({*FUNCTIONS, "log2", "pi", "dr", "added", "julia"})


def formula_from_mapping(data: object, where: Where | None = None, *, name: str) -> Formula:
    """The formula described by a mapping with the keys of the design's formula section.

    `where` is where the mapping stands; an error's place is its path with the key's appended, and where
    `where` names no file, the column inside the expression (`Document.locate` turns both into line and
    column).

    Raises:
        FormulaError: an unknown or missing key, a value of the wrong kind, or an expression that does not
        parse.
    """
    return _Builder(_mapping(data, where or Where(), "a formula"), where or Where(), name).build()


class _Builder:
    """Reads the keys of one formula in the order in which they build on each other."""

    def __init__(self, data: Mapping[str, Any], where: Where, name: str) -> None:
        self.data = data
        self.where = where
        self.name = name

    def build(self) -> Formula:
        check_keys(self.data, _KEYS, self.where)
        for key in _REQUIRED:
            if key not in self.data:
                raise FormulaError(f"the formula lacks the key {key!r}", self.where)
        self.variables = self._variables()
        self.parameters = self._parameters()
        known = tuple(p.name for p in self.parameters)
        state = (*self.variables, *(point_name(v) for v in self.variables), *known)
        let = self._let(state)
        everything = (*state, *(name for name, _ in let))
        maps = self._map(everything)
        self._check_static_exponents(let, maps)
        center, radius = bounds_from_mapping(self.data["bounds"], known, inside(self.where, "bounds"))
        uses_point = frozenset(point_name(v) for v in self.variables)
        add = self._add()
        return Formula(
            name=self.name,
            title=self._text("title", self.name),
            reference=self._text("reference", ""),
            variables=self.variables,
            parameters=self.parameters,
            let=let,
            map=maps,
            repeat=self._of_parameters("repeat", 1),
            add=add,
            degree=self._of_parameters("degree", 1),
            bounds_center=center,
            bounds_radius=radius,
            bailout=self._of_parameters("bailout", 4),
            distance_bailout=self._of_parameters("distance_bailout", 0)
            if "distance_bailout" in self.data
            else None,
            step_scale=self._of_parameters("step_scale", 1 if "derivative" in self.data else JACOBIAN_STEP),
            slice=self._slice(known),
            shape=self._optional("shape", (*self.variables, *known, *(n for n, _ in let))),
            derivative=self._optional("derivative", (*everything, "dr", "added")),
            point_map=any(names_in(node) & uses_point for node in (*maps, *(node for _, node in let))),
            julia=self._julia(add),
            alone=self._alone(),
            source=dict(self.data),
            description=self._text("description", ""),
        )

    def _text(self, key: str, default: str) -> str:
        value = self.data.get(key, default)
        if not isinstance(value, str) or len(value) > 10_000:
            raise FormulaError("must be text", inside(self.where, key))
        return " ".join(value.split())

    def _alone(self) -> bool:
        value = self.data.get("alone", False)
        if not isinstance(value, bool):
            raise FormulaError("must be true or false", inside(self.where, "alone"))
        return value

    def _variables(self) -> tuple[str, ...]:
        where = inside(self.where, "variables")
        names = self.data["variables"]
        if not isinstance(names, (list, tuple)) or len(names) not in (3, 4):
            raise FormulaError("must be a list of three or four names", where)
        for index, name in enumerate(names):
            check_name(name, names[:index], inside(where, str(index)))
        return tuple(names)

    def _parameters(self) -> tuple[Parameter, ...]:
        where = inside(self.where, "parameters")
        data = _mapping(self.data.get("parameters", {}), where, "parameters")
        if len(data) > MAX_PARAMETERS:
            raise FormulaError(f"must be at most {MAX_PARAMETERS}, got {len(data)}", where)
        found = []
        for name, value in data.items():
            here = inside(where, str(name))
            check_name(name, self.variables, here)
            found.append(_parameter(name, value, here))
        return tuple(found)

    def _let(self, names: Collection[str]) -> tuple[tuple[str, Node], ...]:
        where = inside(self.where, "let")
        data = _mapping(self.data.get("let", {}), where, "let")
        if len(data) > MAX_LETS:
            raise FormulaError(f"must be at most {MAX_LETS} names, got {len(data)}", where)
        known = list(names)
        found = []
        for name, value in data.items():
            here = inside(where, str(name))
            check_name(name, known, here)
            try:
                node = parse(value, names=known, where=here)
            except FormulaError as error:
                raise _recursion(error, name, value, data, known) from None
            found.append((name, node))
            known.append(name)
        return tuple(found)

    def _map(self, names: Collection[str]) -> tuple[Node, ...]:
        where = inside(self.where, "map")
        texts = self.data["map"]
        if not isinstance(texts, (list, tuple)) or len(texts) != len(self.variables):
            got = f"{len(texts)}" if isinstance(texts, (list, tuple)) else "no list"
            raise FormulaError(
                f"must have {len(self.variables)} expressions, one for each variable, got {got}", where
            )
        return tuple(parse(text, names=names, where=inside(where, str(i))) for i, text in enumerate(texts))

    def _of_parameters(self, key: str, default: float) -> Node:
        names = [p.name for p in self.parameters]
        where = inside(self.where, key)
        return parse(self.data.get(key, default), names=names, where=where, parameters_only=True)

    def _add(self) -> Add:
        value = self.data.get("add", "point")
        if value not in ("point", "constant", "none"):
            known = ("point", "constant", "none")
            raise FormulaError(unknown_name("value", str(value), known), inside(self.where, "add"))
        add: Add = value
        return add

    def _slice(self, parameters: tuple[str, ...]) -> Node | None:
        where = inside(self.where, "slice")
        if len(self.variables) == 3:
            if "slice" in self.data:
                raise FormulaError("only a formula of four variables has a slice", where)
            return None
        fourth = self.variables[3]
        data = _mapping(self.data.get("slice", {fourth: 0}), where, "slice")
        check_keys(data, (fourth,), where)
        if fourth not in data:
            raise FormulaError(f"must give the fourth coordinate, {fourth!r}", where)
        return parse(data[fourth], names=(*self.variables[:3], *parameters), where=inside(where, fourth))

    def _optional(self, key: str, names: Collection[str]) -> Node | None:
        if key not in self.data:
            return None
        return parse(self.data[key], names=names, where=inside(self.where, key))

    def _julia(self, add: Add) -> tuple[float, ...] | None:
        if "julia" not in self.data:
            return None
        where = inside(self.where, "julia")
        if add != "constant":
            raise FormulaError("only a formula with `add: constant` may have the key julia", where)
        return check_constant(self.data["julia"], len(self.variables), where)

    def _check_static_exponents(self, let: tuple[tuple[str, Node], ...], maps: tuple[Node, ...]) -> None:
        """The exponent of cpow_re and cpow_im must not depend on z: the way it is computed is fixed."""
        moving = {*self.variables, *(point_name(v) for v in self.variables)}
        places = [
            *((("let", name), node) for name, node in let),
            *((("map", str(i)), n) for i, n in enumerate(maps)),
        ]
        for place, node in places:
            for part in walk(node):
                if isinstance(part, CallNode) and part.function in ("cpow_re", "cpow_im"):
                    used = names_in(part.arguments[2]) & moving
                    if used:
                        message = (
                            f"the exponent of {part.function} must be constant, but uses {sorted(used)[0]!r}"
                        )
                        raise FormulaError(message, inside(self.where, *place))
            if place[0] == "let" and names_in(node) & moving:
                moving.add(place[1])


def bounds_from_mapping(
    data: object, parameters: Collection[str], where: Where
) -> tuple[tuple[Node, Node, Node], Node]:
    """Centre and radius of `bounds: {center: [x, y, z], radius: r}`; `julia` in them is a Julia set's |C|."""
    mapping = _mapping(data, where, "bounds")
    check_keys(mapping, ("center", "radius"), where)
    if "radius" not in mapping:
        raise FormulaError("lacks the key 'radius'", where)
    names = (*parameters, "julia")
    center = mapping.get("center", (0, 0, 0))
    here = inside(where, "center")
    if not isinstance(center, (list, tuple)) or len(center) != 3:
        raise FormulaError("must be a list of three numbers", here)
    x, y, z = (
        parse(value, names=names, where=inside(here, str(i)), parameters_only=True)
        for i, value in enumerate(center)
    )
    radius = parse(mapping["radius"], names=names, where=inside(where, "radius"), parameters_only=True)
    return (x, y, z), radius


def check_keys(data: Mapping[str, Any], known: Collection[str], where: Where) -> None:
    """Refuses keys that do not exist, with the nearest one that does."""
    for key in data:
        if key not in known:
            raise FormulaError(unknown_name("key", str(key), known), where)


def check_name(name: object, taken: Collection[object], where: Where) -> None:
    """Refuses a name that is malformed, reserved or taken."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        shown = str(name)[:60]
        raise FormulaError(
            f"a name is a letter followed by at most 39 letters, digits or '_', got {shown!r}", where
        )
    if name in _RESERVED or keyword.iskeyword(name) or name.startswith("point_"):
        raise FormulaError(f"the name {name!r} is reserved", where)
    if name in taken:
        raise FormulaError(f"the name {name!r} is used twice", where)


def _mapping(data: object, where: Where, what: str) -> Mapping[str, Any]:
    if not isinstance(data, Mapping):
        raise FormulaError(f"{what} must be a mapping of keys to values", where)
    return data


def _recursion(
    error: FormulaError, name: str, value: object, data: Mapping[str, Any], known: Collection[str]
) -> FormulaError:
    """A better message where a `let` uses itself or a later one."""
    for later in [name, *(key for key in data if key not in known and key != name)]:
        if error.message.startswith(f"unknown name {later!r}"):
            problem = "uses itself" if later == name else f"uses {later!r}, which is defined after it"
            return FormulaError(f"{name!r} {problem}", error.where)
    return error


def _parameter(name: str, value: object, where: Where) -> Parameter:
    """A parameter from its mapping, or from a plain number (a real one with this default)."""
    data = value if isinstance(value, Mapping) else {"default": value}
    check_keys(data, _PARAMETER_KEYS, where)
    kind = data.get("type", "real")
    if kind not in ("int", "real"):
        raise FormulaError(unknown_name("type", str(kind), ("int", "real")), inside(where, "type"))
    if "default" not in data:
        raise FormulaError("lacks the key 'default'", where)
    plain = Parameter(name, kind, 0.0)
    number = {
        key: plain.check(data[key], inside(where, key)) if key in data else None
        for key in ("minimum", "maximum", "default")
    }
    baked = data.get("baked", kind == "int")
    if not isinstance(baked, bool):
        raise FormulaError("must be true or false", inside(where, "baked"))
    choices = data.get("choices")
    if choices is not None:
        here = inside(where, "choices")
        if not isinstance(choices, (list, tuple)) or not choices:
            raise FormulaError("must be a list of numbers", here)
        choices = tuple(plain.check(choice, inside(here, str(i))) for i, choice in enumerate(choices))
    description = data.get("description", "")
    if not isinstance(description, str):
        raise FormulaError("must be text", inside(where, "description"))
    default = number["default"] or 0.0
    parameter = Parameter(
        name, kind, default, number["minimum"], number["maximum"], choices, baked, description
    )
    parameter.check(default, inside(where, "default"))
    return parameter
