"""Objects beside the set: planes, water, spheres, boxes, cylinders, formulas and volumes, by name."""

import math
from abc import abstractmethod
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import AfterValidator, Field, Tag, model_validator

from clfractal.scene.base import (
    Amount,
    Angle,
    Coordinate,
    Fraction,
    Length,
    Number,
    Position,
    Section,
    Vector,
    chosen_by,
    cross,
    length,
    problem,
    unit,
)
from clfractal.scene.formula import FormulaSpec
from clfractal.scene.materials import MAX_NAME, MaterialName
from clfractal.scene.plane import turn
from clfractal.scene.volume import Transfer

MAX_OBJECTS = 64
MAX_FORMULAS = 8
"""Most objects that are formulas: each one's text is a part of the programs."""
MAX_VOLUMES = 8
"""Most objects that are volumes: a ray looks for each one's surface, or goes through each one's cloud."""
MAX_VALUES = 1 << 28
"""Most values of all volumes' grids together: what their places are counted in, and a gigabyte of memory."""
Ball: TypeAlias = tuple[Vector, float]
"""A centre and a radius, scene units."""
AXES: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

Angles = Annotated[tuple[Angle, Angle, Angle], Field(strict=False)]
Sides = Annotated[tuple[Length, Length, Length], Field(strict=False)]


class ObjectBase(Section):
    """Keys that every object has."""

    material: MaterialName | None = Field(
        None, description="one of `materials`; null: as `material`, in its colour"
    )
    position: Position = Field((0.0, 0.0, 0.0), description="its middle, or a point of a plane; scene units")


class Joined(ObjectBase):
    """An object that may be a part of the set: joined to it, or cut out of it."""

    join: Literal["union", "smooth_union", "cut", "intersection"] = Field(
        "union",
        description="with the set and the formulas above it in the file: beside them; flowing together; taken out of"
        " them; or only what both have in common is left",
    )
    smoothness: Length = Field(
        0.2, description="of a smooth union: how far apart surfaces begin to flow together, scene units"
    )


class Simple(Joined):
    """A body that an equation tells; of a formula only its chain knows what is inside."""

    @abstractmethod
    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""


class Level(ObjectBase):
    """A surface without an end, seen from both sides."""

    normal: Position = Field((0.0, 0.0, 1.0), description="direction that it faces")

    @model_validator(mode="after")
    def _faces_somewhere(self) -> Self:
        if length(self.normal) < 1e-12:
            raise problem("must not be zero", "normal")
        return self


class PlaneObject(Simple, Level):
    """A plane without an end; as a part of the set, all below it."""

    tag = "plane"
    type: Literal["plane"] = "plane"

    def holds(self, point: Vector) -> bool:
        """Whether a point is below it."""
        return sum((p - q) * n for p, q, n in zip(point, self.position, self.normal, strict=True)) < 0


class Waves(Section):
    """Waves of many lengths, which travel as on deep water; `time` moves them."""

    height: Amount = Field(
        0.1, description="mean of the highest third of waves, from trough to crest, scene units; 0: flat"
    )
    length: Length = Field(1.0, description="about the distance between the largest crests, scene units")
    direction: Position = Field((1.0, 0.0, 0.0), description="where they travel to; not along the normal")
    spread: float = Field(30.0, ge=0, le=180, description="how far their directions differ from it, degrees")
    choppiness: Fraction = Field(0.5, description="0: crests are as round as troughs; 1: they are sharper")
    seed: int = Field(0, ge=0, le=2**31 - 1, description="chooses the waves")
    time: Coordinate = Field(0.0, description="seconds, if scene units are metres")


class WaterObject(Level):
    """A plane without an end, on which waves travel."""

    tag = "water"
    type: Literal["water"] = "water"
    waves: Waves = Field(default_factory=dict, validate_default=True, description="its waves")

    @model_validator(mode="after")
    def _travels_somewhere(self) -> Self:
        way = self.waves.direction
        if length(way) < 1e-12:
            raise problem("must not be zero", "waves.direction")
        if length(cross(unit(way), unit(self.normal))) < 1e-6:
            raise problem("must not be along the normal", "waves.direction")
        return self


def ball_of_both(a: Ball, b: Ball) -> Ball:
    """The smallest ball that holds two others."""
    apart = math.dist(a[0], b[0])
    if apart + b[1] <= a[1]:
        return a
    if apart + a[1] <= b[1]:
        return b
    radius = (a[1] + b[1] + apart) / 2
    share = (radius - a[1]) / apart
    x, y, z = (p + share * (q - p) for p, q in zip(a[0], b[0], strict=True))
    return (x, y, z), radius


def turned_axes(rotation: Vector) -> tuple[Vector, Vector, Vector]:
    """The three axes after turns about those of space, in degrees; each has length 1."""
    found = []
    for axis in AXES:
        for about, degrees in zip(AXES, rotation, strict=True):
            axis = turn(axis, about, degrees)
        found.append(axis)
    return found[0], found[1], found[2]


class FormulaObject(Joined):
    """The set of another formula, or of the same one at another place."""

    tag = "formula"
    type: Literal["formula"] = "formula"
    formula: FormulaSpec = Field(description="as the scene's own")
    rotation: Angles = Field(
        (0.0, 0.0, 0.0), description="about the x axis of space, then y, then z, degrees"
    )
    scale: Length = Field(1.0, description="factor on the formula's own size")

    def own_place(self, point: Vector) -> Vector:
        """A point in the formula's own space."""
        offset = [p - q for p, q in zip(point, self.position, strict=True)]
        x, y, z = (
            sum(o * a for o, a in zip(offset, axis, strict=True)) / self.scale
            for axis in turned_axes(self.rotation)
        )
        return (x, y, z)

    def ball(self, center: Vector, radius: float) -> Ball:
        """A ball of the formula's own space, as the object has it in the scene."""
        axes = turned_axes(self.rotation)
        x, y, z = (
            place + self.scale * sum(c * axis[i] for c, axis in zip(center, axes, strict=True))
            for i, place in enumerate(self.position)
        )
        return (x, y, z), self.scale * radius


class Solid(Simple):
    """A body with an inside."""

    rotation: Angles = Field(
        (0.0, 0.0, 0.0), description="about the x axis of space, then y, then z, degrees"
    )
    scale: Sides = Field((1.0, 1.0, 1.0), description="factors along its own axes, before it is rotated")

    @property
    @abstractmethod
    def half_sides(self) -> Vector:
        """Of the box around it, along its own axes, before `scale`."""

    @property
    def axes(self) -> tuple[Vector, Vector, Vector]:
        """From its middle to the ends of its own three axes, scene units."""
        found = []
        for axis, half, factor in zip(turned_axes(self.rotation), self.half_sides, self.scale, strict=True):
            x, y, z = axis
            found.append((x * half * factor, y * half * factor, z * half * factor))
        return found[0], found[1], found[2]

    @property
    def ball(self) -> Ball:
        """Around it."""
        return self.position, math.hypot(*(length(axis) for axis in self.axes))

    def own_place(self, point: Vector) -> Vector:
        """A point in units of `axes` from its middle."""
        offset = [p - q for p, q in zip(point, self.position, strict=True)]
        x, y, z = (
            sum(o * a for o, a in zip(offset, axis, strict=True)) / sum(a * a for a in axis)
            for axis in self.axes
        )
        return (x, y, z)


class SphereObject(Solid):
    """A ball, or with `scale` an ellipsoid."""

    tag = "sphere"
    type: Literal["sphere"] = "sphere"
    radius: Length = Field(0.5, description="scene units")

    @property
    def half_sides(self) -> Vector:
        """As of every solid."""
        return (self.radius, self.radius, self.radius)

    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""
        return length(self.own_place(point)) < 1


class BoxObject(Solid):
    """A box."""

    tag = "box"
    type: Literal["box"] = "box"
    size: Sides = Field((1.0, 1.0, 1.0), description="its sides, scene units")

    @property
    def half_sides(self) -> Vector:
        """As of every solid."""
        x, y, z = self.size
        return (x / 2, y / 2, z / 2)

    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""
        return max(abs(x) for x in self.own_place(point)) < 1


class CylinderObject(Solid):
    """A cylinder with lids; its axis is z before it is rotated."""

    tag = "cylinder"
    type: Literal["cylinder"] = "cylinder"
    radius: Length = Field(0.25, description="scene units")
    height: Length = Field(1.0, description="from lid to lid, scene units")

    @property
    def half_sides(self) -> Vector:
        """As of every solid."""
        return (self.radius, self.radius, self.height / 2)

    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""
        x, y, z = self.own_place(point)
        return x * x + y * y < 1 and abs(z) < 1


class VolumeObject(ObjectBase):
    """A grid of values from a file: a surface where they pass a level, or along paths a cloud."""

    tag = "volume"
    type: Literal["volume"] = "volume"
    file: str = Field(min_length=1, description="its values: a NRRD or NPY file beside the scene")
    size: Length | None = Field(
        None, description="how long its longest side is, scene units; null: as the file says"
    )
    rotation: Angles = Field(
        (0.0, 0.0, 0.0), description="about the x axis of space, then y, then z, degrees"
    )
    scale: Sides = Field((1.0, 1.0, 1.0), description="factors along its own axes, before it is rotated")
    level: Number | None = Field(
        None, description="value at the surface; null: the middle of the range of values"
    )
    transfer: Transfer = Field(
        default_factory=dict,
        validate_default=True,
        description="with `opacity` it is a cloud, with lighting.mode path: opacity, colour and light of its values",
    )
    anisotropy: Annotated[float, Field(strict=True, ge=-0.95, le=0.95)] = Field(
        0.0, description="of a cloud: light is scattered 0 all around, 0.95 straight on, below 0 back"
    )

    @property
    def is_cloud(self) -> bool:
        """Whether light goes through it; else it has a surface."""
        return self.transfer.opacity is not None

    @model_validator(mode="before")
    @classmethod
    def _is_not_joined(cls, values: Any) -> Any:
        if isinstance(values, dict) and "join" in values:
            raise problem("is not for volumes, which stand beside the set; remove it", "join")
        return values

    @model_validator(mode="after")
    def _has_one_color(self) -> Self:
        if self.transfer.color is not None and not self.is_cloud:
            raise problem("needs opacity, since a surface has its material's color", "transfer.color")
        if self.is_cloud and self.material is not None:
            raise problem("is for surfaces; a cloud, which transfer.opacity makes, has none", "material")
        return self


AnyObject: TypeAlias = (
    PlaneObject | WaterObject | SphereObject | BoxObject | CylinderObject | FormulaObject | VolumeObject
)
SceneObject = Annotated[
    Annotated[PlaneObject, Tag("plane")]
    | Annotated[WaterObject, Tag("water")]
    | Annotated[SphereObject, Tag("sphere")]
    | Annotated[BoxObject, Tag("box")]
    | Annotated[CylinderObject, Tag("cylinder")]
    | Annotated[FormulaObject, Tag("formula")]
    | Annotated[VolumeObject, Tag("volume")],
    chosen_by("type", "sphere"),
]


def _fitting(name: str) -> str:
    if not name.isprintable() or name.isspace() or "." in name:
        raise problem("an object's name must be printable text on one line, without a dot")
    return name


ObjectName = Annotated[str, Field(strict=True, min_length=1, max_length=MAX_NAME), AfterValidator(_fitting)]
Objects = Annotated[dict[ObjectName, SceneObject], Field(max_length=MAX_OBJECTS)]
