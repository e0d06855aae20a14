"""Where a camera stands by other words than its position: angles, roll, moves, a ball that is to be seen.

Scene units and degrees. Plain arithmetic without NumPy, so that reading a scene is quick.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from math import atan2, degrees, hypot, inf, radians, tan
from operator import mul
from typing import ClassVar, Protocol, TypeAlias

from clfractal.schema.base import Vector, cos_sin, cross, dot, length, minus, turn, unit

LARGEST = 1e6
"""Largest coordinate of a camera, scene units."""
NEAREST = 1e-11
"""A target nearer than this part of the coordinates would leave the direction of view too few digits."""
FILLED = 0.9
"""Part of the picture's smaller side that a framed object fills."""
# An orthographic camera stands so many radii before the middle of what it frames.
_CLEAR = 2.0
# Below this cosine of the elevation the camera is at a pole, where `up` gives no direction in the picture.
_AT_POLE = 1e-5


def angles(position: Vector, target: Vector, up: Vector) -> tuple[float, float, float]:
    """Azimuth (above -180 to 180), elevation (-90 to 90) and distance of a camera, as seen from its target.

    The elevation is the angle towards `up`. The azimuth is 0 in front, which is -y where z is up, and 90 on the right,
    which is x. Where another direction is up, front and right are turned with it, on the shortest way.
    """
    away = minus(position, target)
    pole, front, right = _compass(up)
    rise, ahead, aside = dot(away, pole), dot(away, front), dot(away, right)
    level = hypot(ahead, aside)
    azimuth = degrees(atan2(aside, ahead)) if level > 0 else 0.0
    return azimuth, degrees(atan2(rise, level)), length(away)


def orbited(
    target: Vector, up: Vector, azimuth: float, elevation: float, distance: float
) -> tuple[Vector, Vector]:
    """Position and `up` of a camera by its angles and distance, as of `angles`.

    At the poles `up` would lie along the view. There it becomes the direction that is up in pictures nearby.
    """
    pole, front, right = _compass(up)
    (ca, sa), (ce, se) = cos_sin(azimuth), cos_sin(elevation)
    level = _sum((ca, front), (sa, right))
    position = _sum((1.0, target), (distance * ce, level), (distance * se, pole))
    return position, _sum((-se, level)) if abs(ce) < _AT_POLE else up


def rolled(position: Vector, target: Vector, up: Vector, roll: float) -> Vector:
    """The `up` of a camera that is turned about its line of sight: clockwise as seen from behind it."""
    axis, _, above = axes(position, target, up)
    return turn(above, axis, roll)


def axes(position: Vector, target: Vector, up: Vector) -> tuple[Vector, Vector, Vector]:
    """Unit vectors of a camera: in the direction of view, to the picture's right, to its top."""
    axis = unit(minus(target, position))
    side = unit(cross(axis, up))
    return axis, side, cross(side, axis)


def shifted(
    point: Vector, along: tuple[Vector, Vector, Vector], forward: float, right: float, up: float
) -> Vector:
    """A point, moved along a camera's `axes`."""
    return _sum((1.0, point), (forward, along[0]), (right, along[1]), (up, along[2]))


Along: TypeAlias = tuple[Vector, Vector, Vector]
"""A camera's `axes`."""
Ways: TypeAlias = Sequence[Vector]
"""Directions of any length, in parts of a camera's axes: in the direction of view, to the right, to the top; in pairs
of opposite sides."""


class Framed(Protocol):
    """What a camera shows all of.

    Attributes:
        center, radius: of a ball around it, scene units.
        has_middle: whether the centre is its middle, and shall be that of the picture.
    """

    has_middle: ClassVar[bool]

    @property
    def center(self) -> Vector: ...
    @property
    def radius(self) -> float: ...

    def reaches(self, along: Along, ways: Ways) -> Sequence[float]:
        """How far it reaches: of each of these ways the largest product with a way from `center` to a part of it."""


@dataclass(frozen=True, slots=True)
class Extent:
    """What is to be seen: a ball, or the block, from its middle to these corners, that the ball goes round; scene units."""

    has_middle: ClassVar[bool] = True
    center: Vector
    radius: float
    corners: tuple[Vector, ...] | None = None

    @classmethod
    def box(cls, center: Vector, sides: Vector) -> "Extent":
        """A box along the axes."""
        x, y, z = sides
        return cls.block(center, ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)))

    @classmethod
    def block(cls, center: Vector, edges: Sequence[Vector]) -> "Extent":
        """A block with these three edges, whichever way they go."""
        corners = tuple(_sum(*zip(signs, edges, strict=True)) for signs in product((-0.5, 0.5), repeat=3))
        return cls(center, max(length(corner) for corner in corners), corners)

    def reaches(self, along: Along, ways: Ways) -> list[float]:
        """As of everything that is framed."""
        if self.corners is None:
            return [self.radius * hypot(*way) for way in ways]
        corners = [tuple(dot(corner, axis) for axis in along) for corner in self.corners]
        return [max(sum(map(mul, way, corner)) for corner in corners) for way in ways]


def framing(
    along: Along, shown: Framed, aspect: float, fov: float | None
) -> tuple[Vector, Vector, float | None]:
    """Where a camera stands that shows all of something in 90 % of the picture's height or width, whichever it fills first.

    The sides of that part of the picture touch it: they are planes through the eye, which know of what they touch but how
    far it reaches in their direction. A ball fills 90 % of the smaller side.

    Args:
        along: the camera's `axes`.
        aspect: width of the picture divided by its height.
        fov: vertical angle of view, degrees; None: an orthographic camera.

    Returns:
        Its position, its target, which is in the middle of what is shown, and the height of an orthographic camera's
        picture, or None. Where that is too large for the range of coordinates, the camera is as far away as it can be.
    """
    slope = 1.0 if fov is None else tan(radians(fov) / 2)
    ahead = 0.0 if fov is None else -1.0
    # Directions across the picture's sides, as long as one goes ahead for each step to the side.
    across, rise = 1 / (FILLED * aspect * slope), 1 / (FILLED * slope)
    ways = ((ahead, across, 0.0), (ahead, -across, 0.0), (ahead, 0.0, rise), (ahead, 0.0, -rise))
    right, left, top, bottom, far, near = shown.reaches(along, (*ways, (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)))
    if shown.has_middle:
        right, top, far = left, bottom, near = max(right, left), max(top, bottom), 0.0
    middle = (far - near) / 2
    aside, above = (right - left) / 2 / across, (top - bottom) / 2 / rise
    target = shifted(shown.center, along, middle, aside, above)
    # From the target: what is needed at depth 1, or of the picture's half height.
    needed, back = max(right + left, top + bottom) / 2, _sum((-1.0, along[0]))
    height = min(max(2 * needed, 1e-12), LARGEST) if fov is None else None
    distance = _CLEAR * shown.radius if fov is None else needed + middle
    distance = min(max(distance, least_distance(target)), room(target, back))
    return _sum((1.0, target), (distance, back)), target, height


def least_distance(target: Iterable[float]) -> float:
    """The least distance from a target that leaves the direction of view its digits."""
    return 2 * max(NEAREST * max(abs(x) for x in target), 1e-15)


def room(start: Iterable[float], direction: Iterable[float]) -> float:
    """How far one can go from a point within the range of coordinates, a little less than to its end."""
    ends = [
        ((LARGEST if d > 0 else -LARGEST) - s) / d for s, d in zip(start, direction, strict=True) if d != 0
    ]
    return float(min(ends, default=inf)) * (1 - 1e-9)


def _compass(up: Vector) -> tuple[Vector, Vector, Vector]:
    """The pole, what is in front of it, and what is on its right."""
    pole = unit(up)
    front = (0.0, -1.0, 0.0)
    if pole[2] > -1 + 1e-12:
        # Turned as z is turned into the pole, by Rodrigues' formula with the axis's length as the sine of the angle.
        about = cross((0.0, 0.0, 1.0), pole)
        across = cross(about, front)
        front = _sum((1.0, front), (1.0, across), (1 / (1 + pole[2]), cross(about, across)))
    return pole, front, cross(pole, front)


def _sum(*terms: tuple[float, Vector]) -> Vector:
    x, y, z = (sum(factor * vector[i] for factor, vector in terms) for i in range(3))
    return x + 0.0, y + 0.0, z + 0.0
