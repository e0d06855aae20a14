"""What stands around the set of a settings file, in the set's own space: turned, moved or mirrored.

Theirs turn and move the set (`fractal_rotation`, `fractal_position`). Our formula stays where it is, and all else goes the
other way around it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from clfractal.exchange.parameters import Matrix, rotation, times, transposed
from clfractal.exchange.settings import Section, Settings

_ORIGIN = (0.0, 0.0, 0.0)

Vector = Sequence[float]


@dataclass(frozen=True, slots=True)
class Placing:
    """Where a file has its set: a place around it has the coordinates `turn` (place - `position`) in the set's space."""

    turn: Matrix
    position: Vector

    def place(self, place: Vector) -> list[float]:
        """A place in the set's space."""
        return self.direction([a - b for a, b in zip(place, self.position, strict=True)])

    def direction(self, direction: Vector) -> list[float]:
        """A direction in the set's space."""
        return [sum(a * b for a, b in zip(row, direction, strict=True)) + 0.0 for row in self.turn]


def reach_from(main: Section, place: Vector) -> float:
    """How far from a place anything is seen: nothing is farther from the eye than they look."""
    away = math.dist(main.vector("camera", (3, -6, 2)), place)
    return away + max(main.number("view_distance_max", 50.0), 0.1)


def placing_of(settings: Settings) -> Placing | None:
    """Where a file has its set; None: where our formula is."""
    angles, position = settings.main.vector("fractal_rotation"), settings.main.vector("fractal_position")
    if not any((*angles, *position)):
        return None
    return Placing(rotation(angles), position)


def place_around(scene: dict[str, Any], placing: Placing, beside: Sequence[str]) -> None:
    """Camera, lights and the objects `beside` the set of a scene, in the set's space."""

    def turned(angles: Vector) -> list[float]:
        return angles_of(times(matrix_of(angles), transposed(placing.turn)))

    _changed(scene, beside, placing.place, placing.direction, placing.direction, turned)


def mirror(scene: dict[str, Any]) -> None:
    """Turns a scene's z axis around, but for its formula, so that its picture is upside down."""

    def flat(vector: Vector) -> list[float]:
        return [vector[0] + 0.0, vector[1] + 0.0, -vector[2] + 0.0]

    def up(vector: Vector) -> list[float]:
        return [-each + 0.0 for each in flat(vector)]

    def turned(angles: Vector) -> list[float]:
        x, y, z = angles  # a mirror turns what goes about x and y the other way
        return [-x + 0.0, -y + 0.0, z]

    _changed(scene, tuple(scene.get("objects", ())), flat, flat, up, turned)
    background = scene["background"]
    scene["background"] = {"top": background["bottom"], "bottom": background["top"]}


def _changed(
    scene: dict[str, Any],
    beside: Sequence[str],
    place: Callable[[Vector], list[float]],
    direction: Callable[[Vector], list[float]],
    up: Callable[[Vector], list[float]],
    turned: Callable[[Vector], list[float]],
) -> None:
    camera = scene["camera"]
    camera |= {key: place(camera[key]) for key in ("position", "target")}
    camera["up"] = up(camera["up"])
    for light in scene["lights"]:
        if "position" in light:
            light["position"] = place(light["position"])
        if "direction" in light:
            light["direction"] = direction(light["direction"])
    for name in beside:
        part = scene["objects"][name]
        part["position"] = place(part.get("position", _ORIGIN))
        if part["type"] in ("plane", "water"):
            part["normal"] = direction(part.get("normal", (0, 0, 1)))
            continue
        angles = turned(part.pop("rotation", _ORIGIN))
        if any(angles):
            part["rotation"] = angles


def matrix_of(angles: Vector) -> Matrix:
    """Their matrix, which turns an object of ours back, by our angles about x, then y, then z, in degrees."""
    (a, b), (c, d), (e, f) = ((math.cos(each), math.sin(each)) for each in map(math.radians, angles))
    return (
        (c * e, c * f, -d),
        (b * d * e - a * f, b * d * f + a * e, b * c),
        (a * d * e + b * f, a * d * f - b * e, a * c),
    )


def angles_of(matrix: Matrix) -> list[float]:
    """Our angles about x, then y, then z, in degrees, of an object that their matrix turns back."""
    # Ours turns the object, theirs turns space: one is the other transposed.
    x = math.atan2(matrix[1][2], matrix[2][2])
    y = -math.asin(min(max(matrix[0][2], -1.0), 1.0))
    z = math.atan2(matrix[0][1], matrix[0][0])
    return [round(math.degrees(each), 6) + 0.0 for each in (x, y, z)]
