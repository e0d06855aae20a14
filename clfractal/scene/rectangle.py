"""A rectangle in space: where a cut plane lies, and how it is moved and rotated."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Literal, TypeVar

from pydantic import Field

from clfractal.schema.base import (
    Angle,
    Coordinate,
    Direction,
    Length,
    Position,
    Section,
    Vector,
    check_frame,
    cross,
    dot,
    length,
    minus,
    problem,
    rule,
    turn,
    unit,
)
from clfractal.schema.fields import SCALE

Factor = Annotated[float, Field(strict=True, gt=0, le=1e12, allow_inf_nan=False)]
MOVES = ("scale", "move_normal", "move_side", "move_up", "rotate_normal", "rotate_side", "rotate_up")
TURNS = ("rotate_x", "rotate_y", "rotate_z")
# Of a plane's size and of its middle's coordinates, scene units.
LARGEST, SMALLEST = 1e6, 1e-18


class Transform(Section):
    """One step that scales, moves or rotates a plane; exactly one key is given."""

    scale: Annotated[Factor, SCALE] | None = Field(
        None, description="factor on width and height; the centre stays"
    )
    move_normal: Coordinate | None = Field(None, description="shift along the normal, scene units")
    move_side: Coordinate | None = Field(None, description="shift to the plane's right, scene units")
    move_up: Coordinate | None = Field(None, description="shift towards the plane's top, scene units")
    rotate_normal: Angle | None = Field(None, description="rotation about the plane's normal, degrees")
    rotate_side: Angle | None = Field(
        None, description="rotation about the plane's axis to its right, degrees"
    )
    rotate_up: Angle | None = Field(None, description="rotation about the plane's axis to its top, degrees")
    rotate_x: Angle | None = Field(None, description="rotation about the x axis of space, degrees")
    rotate_y: Angle | None = Field(None, description="rotation about the y axis of space, degrees")
    rotate_z: Angle | None = Field(None, description="rotation about the z axis of space, degrees")

    @rule
    def _one(self) -> None:
        given = [name for name in (*MOVES, *TURNS) if getattr(self, name) is not None]
        if len(given) != 1:
            raise problem(f"must have exactly one key of {', '.join((*MOVES, *TURNS))}, got {len(given)}")


class Plane(Section):
    """A rectangle that faces its normal; `side` = up x normal is its right."""

    center: Position = Field((0.0, 0.0, 0.0), description="the plane's middle, scene units")
    normal: Direction = Field((0.0, 0.0, 1.0), description="direction towards the viewer")
    up: Direction | None = Field(
        None, description="direction towards the plane's top; null: y, or z where the normal is nearly y"
    )
    width: Annotated[Length, SCALE] = Field(4.0, description="scene units")
    height: Annotated[Length, SCALE] = Field(4.0, description="scene units")
    corners: Annotated[tuple[Position, Position, Position], Field(strict=False)] | None = Field(
        None, description="lower left, lower right and upper left corner, instead of all keys above"
    )
    transform: Annotated[tuple[Transform, ...], Field(strict=False, max_length=256)] = Field(
        (), description="steps that scale, move or rotate the plane, one after the other"
    )

    @rule
    def _faces_somewhere(self) -> None:
        if self.corners is not None:
            fields = type(self).model_fields
            for name in ("center", "normal", "up", "width", "height"):
                if getattr(self, name) != fields[name].default:
                    raise problem(f"is already given by corners; remove {name} or corners", name)
            low, right, high = self.corners
            # Nearer to each other than the number type can tell, corners are one corner.
            least = 1e-15 * max(abs(x) for corner in self.corners for x in corner)
            side, up = minus(right, low), minus(high, low)
            width, height = length(side), length(up)
            if min(width, height) <= least or length(cross(side, up)) <= 1e-6 * width * height:
                raise problem("must not lie on one line", "corners")
            if abs(dot(side, up)) > 1e-4 * width * height:
                raise problem("must have a right angle at the first corner, the lower left one", "corners")
            return
        if self.up is not None:
            check_frame(self.normal, self.up)

    @rule
    def _stays_near(self) -> None:
        for index, plane in enumerate(self._places()):
            first = "corners" if self.corners else "width" if plane.width <= plane.height else "height"
            path = f"transform.{index - 1}" if index else first
            if max(plane.width, plane.height) > LARGEST:
                raise problem(f"must leave the plane at most {LARGEST:,.0f} wide and high", path)
            if min(plane.width, plane.height) < SMALLEST:
                raise problem(f"must leave the plane at least {SMALLEST:g} wide and high", path)
            if max(abs(x) for x in plane.center) > LARGEST:
                raise problem(f"must leave the plane's coordinates below {LARGEST:,.0f}", path)

    @property
    def placed(self) -> "Placed":
        """Where the plane lies, all transformations applied."""
        *_, last = self._places()
        return last

    def _places(self) -> Iterator["Placed"]:
        """The plane before its transformations, and after each of them."""
        plane = _by_corners(*self.corners) if self.corners is not None else _by_normal(self)
        yield plane
        for step in self.transform:
            plane = _transformed(plane, step)
            yield plane


@dataclass(frozen=True, slots=True)
class Placed:
    """A plane by its middle, its unit vectors to the right, to the top and to the viewer, and its size, scene units."""

    center: Vector
    side: Vector
    up: Vector
    normal: Vector
    width: float
    height: float

    def at(self, x: float, y: float) -> Vector:
        """The point at the fractions x of the plane's width and y of its height; (0, 0) is the lower left corner."""
        across, rise = (x - 0.5) * self.width, (y - 0.5) * self.height
        a, b, c = (m + across * s + rise * u for m, s, u in zip(self.center, self.side, self.up, strict=True))
        return (a, b, c)


Axis = Literal["normal", "side", "up", "x", "y", "z"]
AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
SomePlane = TypeVar("SomePlane", Plane, Placed)


def scaled(plane: SomePlane, factor: float) -> SomePlane:
    """The plane, wider and higher by a factor above 0, about its middle."""
    placed = _place(plane)
    return _like(plane, replace(placed, width=placed.width * factor, height=placed.height * factor))


def moved(plane: SomePlane, *, normal: float = 0.0, side: float = 0.0, up: float = 0.0) -> SomePlane:
    """The plane, moved along its own axes: towards the viewer, to its right, to its top; scene units."""
    placed = _place(plane)
    x, y, z = (
        c + normal * n + side * s + up * u
        for c, n, s, u in zip(placed.center, placed.normal, placed.side, placed.up, strict=True)
    )
    return _like(plane, replace(placed, center=(x, y, z)))


def rotated(plane: SomePlane, axis: Axis, degrees: float) -> SomePlane:
    """The plane, rotated by the right-hand rule: for its own axes about its middle, for x, y and z about the origin."""
    placed = _place(plane)
    about: Vector = AXES[axis] if axis in AXES else getattr(placed, axis)
    return _like(
        plane,
        replace(
            placed,
            center=turn(placed.center, about, degrees) if axis in AXES else placed.center,
            side=turn(placed.side, about, degrees),
            up=turn(placed.up, about, degrees),
            normal=turn(placed.normal, about, degrees),
        ),
    )


def _place(plane: Plane | Placed) -> Placed:
    return plane.placed if isinstance(plane, Plane) else plane


def _like(plane: SomePlane, placed: Placed) -> SomePlane:
    """A placed plane as a scene's `Plane`, without transformations."""
    if isinstance(plane, Placed):
        return placed
    names = ("center", "normal", "up", "width", "height")
    return Plane.checked({name: getattr(placed, name) for name in names})


def _by_corners(low: Vector, right: Vector, high: Vector) -> Placed:
    across, rise = minus(right, low), minus(high, low)
    side = unit(across)
    normal = unit(cross(across, rise))
    x, y, z = (a + (b + c) / 2 for a, b, c in zip(low, across, rise, strict=True))
    return Placed((x, y, z), side, cross(normal, side), normal, length(across), length(rise))


def _by_normal(plane: Plane) -> Placed:
    normal = unit(plane.normal)
    wanted = plane.up or AXES["y" if abs(normal[1]) < 0.99 else "z"]
    side = unit(cross(wanted, normal))
    return Placed(plane.center, side, cross(normal, side), normal, plane.width, plane.height)


def _transformed(plane: Placed, step: Transform) -> Placed:
    if step.scale is not None:
        return scaled(plane, step.scale)
    for name in ("normal", "side", "up"):
        distance = getattr(step, f"move_{name}")
        if distance is not None:
            return moved(plane, **{name: distance})
    axes: tuple[Axis, ...] = ("normal", "side", "up", "x", "y", "z")
    axis = next(axis for axis in axes if getattr(step, f"rotate_{axis}") is not None)
    return rotated(plane, axis, getattr(step, f"rotate_{axis}"))
