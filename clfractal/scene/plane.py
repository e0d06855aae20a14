"""A rectangle in space: where a cut plane lies, and how it is moved about."""

from math import cos, radians, sin
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from clfractal.scene.base import Coordinate, Position, Section, Vector, cross, length, minus, problem
from clfractal.scene.surface import Length

Factor = Annotated[float, Field(strict=True, gt=0, le=1e12, allow_inf_nan=False)]
Angle = Annotated[float, Field(strict=True, ge=-36_000, le=36_000, allow_inf_nan=False)]
MOVES = ("scale", "move_normal", "move_side", "move_up", "rotate_normal", "rotate_side", "rotate_up")
TURNS = ("rotate_x", "rotate_y", "rotate_z")


class Transform(Section):
    """One step of moving a plane about: exactly one of its keys."""

    scale: Factor | None = Field(None, description="factor on width and height, about the centre")
    move_normal: Coordinate | None = Field(None, description="along the normal, scene units")
    move_side: Coordinate | None = Field(None, description="to the plane's right, scene units")
    move_up: Coordinate | None = Field(None, description="to the plane's top, scene units")
    rotate_normal: Angle | None = Field(None, description="about the plane's own normal, degrees")
    rotate_side: Angle | None = Field(None, description="about the plane's own side, degrees")
    rotate_up: Angle | None = Field(None, description="about the plane's own up, degrees")
    rotate_x: Angle | None = Field(None, description="about the x axis of space, degrees")
    rotate_y: Angle | None = Field(None, description="about the y axis of space, degrees")
    rotate_z: Angle | None = Field(None, description="about the z axis of space, degrees")

    @model_validator(mode="after")
    def _one(self) -> Self:
        given = [name for name in (*MOVES, *TURNS) if getattr(self, name) is not None]
        if len(given) != 1:
            raise problem(f"must have one key of {', '.join((*MOVES, *TURNS))}, got {len(given)}")
        return self


class Plane(Section):
    """A rectangle that faces its normal; `side` = up x normal is its right."""

    center: Position = Field((0.0, 0.0, 0.0), description="its middle, scene units")
    normal: Position = Field((0.0, 0.0, 1.0), description="towards the viewer")
    up: Position | None = Field(
        None, description="towards its top; y, or z where the normal leaves little of y, if null"
    )
    width: Length = Field(4.0, description="scene units")
    height: Length = Field(4.0, description="scene units")
    corners: Annotated[tuple[Position, Position, Position], Field(strict=False)] | None = Field(
        None, description="in place of all these: its lower left, lower right and upper left corner"
    )
    transform: Annotated[tuple[Transform, ...], Field(strict=False, max_length=256)] = Field(
        (), description="steps that move it about, one after the other"
    )

    @model_validator(mode="after")
    def _faces_somewhere(self) -> Self:
        if self.corners is not None:
            given = sorted(self.model_fields_set - {"corners", "transform"})
            if given and any(getattr(self, name) != type(self).model_fields[name].default for name in given):
                raise problem(f"corners already say it; remove {given[0]} or corners", given[0])
            low, right, high = self.corners
            size = max(1e-300, *(abs(x) for corner in self.corners for x in corner))
            side, up = minus(right, low), minus(high, low)
            if length(cross(side, up)) <= 1e-12 * max(length(side) * length(up), 1e-12 * size * size):
                raise problem("must not lie on one line", "corners")
            if abs(_dot(side, up)) > 1e-4 * length(side) * length(up):
                raise problem("must make a right angle at the first, the lower left", "corners")
            return self
        if length(self.normal) < 1e-12:
            raise problem("must not be zero", "normal")
        if self.up is not None:
            if length(self.up) < 1e-12:
                raise problem("must not be zero", "up")
            if length(cross(self.normal, self.up)) <= 1e-6 * length(self.normal) * length(self.up):
                raise problem("must not be parallel to the normal", "up")
        return self

    @property
    def placed(self) -> "Placed":
        """Where the plane lies, all transformations applied."""
        plane = _placed(self)
        for step in self.transform:
            plane = _step(plane, step)
        return plane


class Placed(Section):
    """A plane by its middle, its unit vectors to the right, to the top and to the viewer, and its size, scene units."""

    center: Position
    side: Position
    up: Position
    normal: Position
    width: float
    height: float


Axis = Literal["normal", "side", "up", "x", "y", "z"]
AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def scaled(plane: Placed, factor: float) -> Placed:
    """The plane, wider and higher by a factor, about its middle."""
    return plane.model_copy(update={"width": plane.width * factor, "height": plane.height * factor})


def moved(plane: Placed, *, normal: float = 0.0, side: float = 0.0, up: float = 0.0) -> Placed:
    """The plane, moved along its own axes, scene units."""
    center = tuple(
        c + normal * n + side * s + up * u
        for c, n, s, u in zip(plane.center, plane.normal, plane.side, plane.up, strict=True)
    )
    return plane.model_copy(update={"center": center})


def rotated(plane: Placed, axis: Axis, degrees: float) -> Placed:
    """The plane, turned by the right-hand rule: about its own middle for its own axes, about the origin for x, y and z."""
    about: Vector = AXES[axis] if axis in AXES else getattr(plane, axis)
    turned = {name: turn(getattr(plane, name), about, degrees) for name in ("side", "up", "normal")}
    if axis in AXES:
        turned["center"] = turn(plane.center, about, degrees)
    return plane.model_copy(update=turned)


def turn(vector: Vector, axis: Vector, degrees: float) -> Vector:
    """A vector, turned about an axis of length 1 (Rodrigues' formula)."""
    c, s = cos(radians(degrees)), sin(radians(degrees))
    across, along = cross(axis, vector), _dot(axis, vector) * (1 - c)
    x, y, z = (v * c + a * s + k * along for v, a, k in zip(vector, across, axis, strict=True))
    return (x, y, z)


def _placed(plane: Plane) -> Placed:
    if plane.corners is not None:
        low, right, high = plane.corners
        across, rise = minus(right, low), minus(high, low)
        side = _unit(across)
        normal = _unit(cross(across, rise))
        center = tuple(a + (b + c) / 2 for a, b, c in zip(low, across, rise, strict=True))
        return Placed.model_validate(
            {
                "center": center,
                "side": side,
                "up": cross(normal, side),
                "normal": normal,
                "width": length(across),
                "height": length(rise),
            }
        )
    normal = _unit(plane.normal)
    wanted = plane.up
    if wanted is None:
        wanted = AXES["y"] if abs(normal[1]) < 0.99 else AXES["z"]
    side = _unit(cross(wanted, normal))
    return Placed(
        center=plane.center,
        side=side,
        up=cross(normal, side),
        normal=normal,
        width=plane.width,
        height=plane.height,
    )


def _step(plane: Placed, step: Transform) -> Placed:
    if step.scale is not None:
        return scaled(plane, step.scale)
    for name in ("normal", "side", "up"):
        distance = getattr(step, f"move_{name}")
        if distance is not None:
            return moved(plane, **{name: distance})
    axes: tuple[Axis, ...] = ("normal", "side", "up", "x", "y", "z")
    for axis in axes:
        degrees = getattr(step, f"rotate_{axis}")
        if degrees is not None:
            return rotated(plane, axis, degrees)
    return plane


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _unit(a: Vector) -> Vector:
    size = length(a)
    return (a[0] / size, a[1] / size, a[2] / size)
