"""Solids as formulas: repeated in space, hollow, without lids or with round edges, and cut with the set.

The formula maps a place to that in the middle cell and is done; its `shape` is the distance to the solid there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

MOST_FORMULAS = 8
"""Objects of a scene that may be formulas."""
_LEAST = 1e-9
_THIN = 2e-3
"""How thick shells are to either side, as a part of the solid's least radius or half side."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What an object alone is not.

    Attributes:
        repeat: after which lengths along its own axes it is there again; 0: it is not.
        hollow: it is a shell.
        open: it has no lids, and is hollow.
        rounding: how far from the solid its surface is.
        cut: it is cut as the set is.
    """

    repeat: Sequence[float] = (0.0, 0.0, 0.0)
    hollow: bool = False
    open: bool = False
    rounding: float = 0.0
    cut: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether an object is all that. (From outside a shell looks as a solid does.)"""
        return not (any(self.repeat) or self.open or self.rounding or self.cut)


def as_formula(solid: Mapping[str, Any], wanted: Wanted, reach: float) -> dict[str, Any]:
    """An object of a scene that is a solid as one that is a formula, at the same place.

    Args:
        reach: how far from the camera anything is seen, and how far that is away, scene units.
    """
    kind = solid["type"]
    size = _SIZES[kind](solid)
    thick = _thickness(solid)
    shape = _SHAPES[kind](solid, wanted)
    if wanted.hollow and not wanted.open:
        shape = f"abs({shape}) - {_text(thick)}"
    radius = reach if any(wanted.repeat) else size + wanted.rounding + thick
    formula = {
        "title": f"A {kind}",
        "variables": ["x", "y", "z"],
        "map": [_cell(axis, length) for axis, length in zip("xyz", wanted.repeat, strict=True)],
        "add": "none",
        "degree": 1,
        "bounds": {"radius": float(f"{min(max(1.001 * radius, 1e-6), 1e6):.6g}")},
        "bailout": 1e9,
        "derivative": "dr",
        "shape": shape,
    }
    place = {key: solid[key] for key in ("position", "rotation", "material") if key in solid}
    return {"type": "formula", "formula": {"inline": formula, "iterations": 1}, **place}


def can_be_formula(solid: Mapping[str, Any]) -> bool:
    """Whether an object is a solid that has an end."""
    return solid["type"] in _SHAPES


def size_of(solid: Mapping[str, Any]) -> float:
    """How far from its middle a solid reaches, scene units."""
    return _SIZES[solid["type"]](solid)


def _cell(axis: str, length: float) -> str:
    half = _text(length / 2)
    return f"mod({axis} + {half}, {_text(length)}) - {half}" if length > 0 else axis


def _sphere(solid: Mapping[str, Any], _: Wanted) -> str:
    return f"{_length('x*x + y*y + z*z', solid)} - {_text(solid['radius'])}"


def _box(solid: Mapping[str, Any], wanted: Wanted) -> str:
    x, y, z = (f"abs({axis}) - {_text(side / 2)}" for axis, side in zip("xyz", solid["size"], strict=True))
    flat = f"max(max({x}, {y}), {z})"
    if not wanted.rounding:
        return flat
    out = " + ".join(f"max({side}, 0)**2" for side in (x, y, z))
    return f"sqrt({out}) + min({flat}, 0) - {_text(wanted.rounding)}"


def _cylinder(solid: Mapping[str, Any], wanted: Wanted) -> str:
    wall = f"{_across(solid)} - {_text(solid['radius'])}"
    return f"max({_wall(wall, solid, wanted)}, abs(z) - {_text(solid['height'] / 2)})"


def _cone(solid: Mapping[str, Any], wanted: Wanted) -> str:
    radius, height = solid["radius"], solid["height"]
    slant = math.hypot(radius, height)
    wall = f"{_text(height / slant)}*{_across(solid)} + {_text(radius / slant)}*(z - {_text(height / 2)})"
    return f"max({_wall(wall, solid, wanted)}, -{_text(height / 2)} - z)"


def _torus(solid: Mapping[str, Any], _: Wanted) -> str:
    ring = f"({_across(solid)} - {_text(solid['radius'])})"
    return f"sqrt({ring}*{ring} + z*z) - {_text(solid['tube'])}"


def _across(solid: Mapping[str, Any]) -> str:
    return _length("x*x + y*y", solid)


def _length(squares: str, solid: Mapping[str, Any]) -> str:
    # In the middle a root has no slope, of which distances are made, so there it is a coordinate.
    return f"max(sqrt({squares}), x + {_text(_LEAST * solid['radius'])})"


def _wall(wall: str, solid: Mapping[str, Any], wanted: Wanted) -> str:
    return f"abs({wall}) - {_text(_thickness(solid))}" if wanted.open else wall


def _thickness(solid: Mapping[str, Any]) -> float:
    sides = (side / 2 for side in (*solid.get("size", ()), solid.get("height", math.inf)))
    return float(_THIN * min(*sides, solid.get("radius", math.inf), solid.get("tube", math.inf)))


_SHAPES: Mapping[str, Callable[[Mapping[str, Any], Wanted], str]] = {
    "sphere": _sphere,
    "box": _box,
    "cylinder": _cylinder,
    "cone": _cone,
    "torus": _torus,
}
_SIZES: Mapping[str, Callable[[Mapping[str, Any]], float]] = {
    "sphere": lambda solid: float(solid["radius"]),
    "box": lambda solid: math.hypot(*solid["size"]) / 2,
    "cylinder": lambda solid: math.hypot(solid["radius"], solid["height"] / 2),
    "cone": lambda solid: math.hypot(solid["radius"], solid["height"] / 2),
    "torus": lambda solid: float(solid["radius"] + solid["tube"]),
}


def _text(value: float) -> str:
    return f"{value:.9g}"
