"""Builds a formula from a mapping (a YAML file's content): strict keys, every error with its place."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from clfractal.errors import FormulaError, Where, unknown_name
from clfractal.formulas.binding import check_constant
from clfractal.formulas.build_orbit import OrbitReader
from clfractal.formulas.definition import Add, Formula, inside
from clfractal.formulas.names import as_mapping, check_keys
from clfractal.formulas.nodes import Node
from clfractal.formulas.parser import parse

# The step scale of a formula that tells none and has no scalar rule: where a map stretches space unevenly, distances are
# too long here and there.
JACOBIAN_STEP = 0.75
_REQUIRED = ("variables", "bounds")
_TEXTS = ("title", "reference", "description")
_ORBIT = (
    *("variables", "parameters", "include", "functions", "state", "let", "map", "do", "repeat", "add"),
    *("degree", "slice", "julia"),
)
_SET = ("bounds", "bailout", "distance_bailout", "step_scale", "shape", "derivative", "distance", "alone")
_KEYS = (*_TEXTS, *_ORBIT, *_SET)


def formula_from_mapping(data: object, where: Where | None = None, *, name: str) -> Formula:
    """The formula described by a mapping with the keys of the design's formula section.

    `where` is where the mapping stands; an error's place is its path with the key's appended, and where
    `where` names no file, the column inside the expression (`Document.locate` turns both into line and
    column).

    Raises:
        FormulaError: an unknown or missing key, a value of the wrong kind, or an expression that does not
        parse.
    """
    return _Builder(as_mapping(data, where or Where(), "a formula"), where or Where(), name).build()


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
        orbit = OrbitReader(self.data, self.where).read()
        self.parameters = orbit.parameters
        known = tuple(p.name for p in orbit.parameters)
        center, radius = bounds_from_mapping(self.data["bounds"], known, inside(self.where, "bounds"))
        add = self._add()
        has_rule = "derivative" in self.data or "distance" in self.data
        return Formula(
            name=self.name,
            title=self._text("title", self.name),
            reference=self._text("reference", ""),
            variables=orbit.variables,
            parameters=orbit.parameters,
            let=orbit.let,
            map=orbit.map,
            repeat=self._of_parameters("repeat", 1),
            add=add,
            degree=self._of_parameters("degree", 1),
            bounds_center=center,
            bounds_radius=radius,
            bailout=self._of_parameters("bailout", 4),
            distance_bailout=self._of_parameters("distance_bailout", 0)
            if "distance_bailout" in self.data
            else None,
            step_scale=self._of_parameters("step_scale", 1 if has_rule else JACOBIAN_STEP),
            slice=orbit.slice,
            shape=orbit.shape,
            derivative=orbit.derivative,
            point_map=orbit.point_map,
            julia=self._julia(add, len(orbit.variables)),
            alone=self._alone(),
            source=dict(self.data),
            description=self._text("description", ""),
            state=orbit.state,
            steps=orbit.steps,
            distance=orbit.distance,
            numbered=orbit.numbered,
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

    def _julia(self, add: Add, size: int) -> tuple[float, ...] | None:
        if "julia" not in self.data:
            return None
        where = inside(self.where, "julia")
        if add != "constant":
            raise FormulaError("only a formula with `add: constant` may have the key julia", where)
        return check_constant(self.data["julia"], size, where)


def bounds_from_mapping(
    data: object, parameters: Collection[str], where: Where
) -> tuple[tuple[Node, Node, Node], Node]:
    """Centre and radius of `bounds: {center: [x, y, z], radius: r}`; `julia` in them is a Julia set's |C|."""
    mapping = as_mapping(data, where, "bounds")
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
