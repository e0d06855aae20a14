"""Directions of the faces of solids that formulas of Mandelbulber fold space by, unit vectors, by name.

They stand as solids mostly do, with axes of two turns along the axes of space, or with a prism's axis along z.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from itertools import product

Vector = tuple[float, ...]

_GOLDEN = (1 + math.sqrt(5)) / 2


@cache
def faces(name: str) -> tuple[Vector, ...] | None:
    """The outer normals of a solid's faces; None for what is none of these solids."""
    make = _SOLIDS.get(name)
    return None if make is None else tuple(_unit(each) for each in make())


def _unit(vector: Vector) -> Vector:
    length = math.hypot(*vector)
    return tuple(part / length for part in vector)


def _corners() -> list[Vector]:
    """Of a cube."""
    return [(float(x), float(y), float(z)) for x, y, z in product((1, -1), repeat=3)]


def _axes() -> list[Vector]:
    return [
        tuple(sign if at == axis else 0.0 for at in range(3)) for axis in range(3) for sign in (1.0, -1.0)
    ]


def _rectangles(short: float, long: float) -> list[Vector]:
    """The corners of three rectangles, one across each axis of space."""
    flat = [(0.0, a * short, b * long) for a, b in product((1, -1), repeat=2)]
    return [(*each[turn:], *each[:turn]) for turn in range(3) for each in flat]


def _prism(sides: int) -> list[Vector]:
    around = (2 * math.pi * side / sides for side in range(sides))
    return [*((math.cos(angle), math.sin(angle), 0.0) for angle in around), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]


_SOLIDS: Mapping[str, Callable[[], Iterable[Vector]]] = {
    "tet": lambda: [each for each in _corners() if math.prod(each) < 0],
    "cube": _axes,
    "oct": _corners,
    "oct_cube": lambda: [*_axes(), *_corners()],
    "dodeca": lambda: _rectangles(1, _GOLDEN),
    "icosa": lambda: [*_corners(), *_rectangles(1 / _GOLDEN, _GOLDEN)],
    "box6": lambda: _prism(6),
    "box5": lambda: _prism(5),
}
"""By the names that texts have for them: `oct_cube` has the faces of both, the boxes are prisms of six and five sides."""
