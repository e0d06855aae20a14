"""Objects beside the set, by name: shapes, water, formulas and volumes."""

import math
from collections.abc import Callable, Iterable
from functools import reduce
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import Field, model_validator

from clfractal.scene.formula import FormulaSpec
from clfractal.scene.volume import Transfer
from clfractal.schema.base import (
    Amount,
    Coordinate,
    Direction,
    Fraction,
    Length,
    Number,
    Section,
    Vector,
    cross,
    length,
    problem,
    rule,
    unit,
)
from clfractal.schema.fields import SCALE, Usual
from clfractal.schema.kinds import in_order, members, one_of
from clfractal.schema.names import ObjectName
from clfractal.schema.shape import Angles, Ball, Joined, Level, ObjectBase, Sides, Solid, turned_axes

MAX_OBJECTS = 64
MAX_FORMULAS = 8
"""Most objects that are formulas: each one's text is a part of the programs."""
MAX_VOLUMES = 8
"""Most objects that are volumes: a ray looks for each one's surface, or goes through each one's cloud."""
MAX_VALUES = 1 << 28
"""Most values of all volumes' grids together: what their places are counted in, and a gigabyte of memory."""


class Waves(Section):
    """Waves of many lengths, which travel as on deep water; `time` moves them."""

    height: Amount = Field(
        0.1, description="mean of the highest third of waves, from trough to crest, scene units; 0: flat"
    )
    length: Annotated[Length, SCALE] = Field(
        1.0, description="about the distance between the largest crests, scene units"
    )
    direction: Direction = Field((1.0, 0.0, 0.0), description="where they travel to; not along the normal")
    spread: Annotated[float, Usual(0, 90)] = Field(
        30.0, ge=0, le=180, description="how far their directions differ from it, degrees"
    )
    choppiness: Fraction = Field(0.5, description="0: crests are as round as troughs; 1: they are sharper")
    seed: int = Field(0, ge=0, le=2**31 - 1, description="chooses the waves")
    time: Coordinate = Field(0.0, description="seconds, if scene units are metres")


class WaterObject(Level):
    """A plane without an end, on which waves travel."""

    tag = "water"
    title = "Water"
    place = 20
    of_rays = True
    type: Literal["water"] = "water"
    waves: Waves = Field(default_factory=dict, validate_default=True, description="its waves")

    @rule
    def _travels_somewhere(self) -> None:
        if length(cross(unit(self.waves.direction), unit(self.normal))) < 1e-6:
            raise problem("must not be along the normal", "waves.direction")


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


def ball_around(objects: Iterable[ObjectBase], of_volume: "Callable[[VolumeObject], Ball]") -> Ball:
    """The ball around all objects that have an end; without any, the unit ball around the origin."""
    balls = [
        each.ball if isinstance(each, Solid) else of_volume(each)
        for each in objects
        if isinstance(each, (Solid, VolumeObject))
    ]
    return reduce(ball_of_both, balls) if balls else ((0.0, 0.0, 0.0), 1.0)


class FormulaObject(Joined):
    """The set of another formula, or of the same one at another place."""

    tag = "formula"
    title = "Formula"
    place = 80
    type: Literal["formula"] = "formula"
    formula: FormulaSpec = Field(description="as the scene's own")
    rotation: Angles = Field(
        (0.0, 0.0, 0.0), description="about the x axis of space, then y, then z, degrees"
    )
    scale: Annotated[Length, SCALE] = Field(1.0, description="factor on the formula's own size")

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


class VolumeObject(ObjectBase):
    """A grid of values from a file: a surface where they pass a level, or along paths a cloud."""

    tag = "volume"
    title = "Volume"
    place = 90
    of_rays = True
    type: Literal["volume"] = "volume"
    file: str = Field(min_length=1, description="its values: a NRRD or NPY file beside the scene")
    size: Annotated[Length, SCALE] | None = Field(
        None, description="how long its longest side is, scene units; null: as the file says"
    )
    rotation: Angles = Field(
        (0.0, 0.0, 0.0), description="about the x axis of space, then y, then z, degrees"
    )
    scale: Annotated[Sides, SCALE] = Field(
        (1.0, 1.0, 1.0), description="factors along its own axes, before it is rotated"
    )
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

    @rule
    def _has_one_color(self) -> None:
        if self.transfer.color is not None and not self.is_cloud:
            raise problem("needs opacity, since a surface has its material's color", "transfer.color")
        if self.is_cloud and self.material is not None:
            raise problem("is for surfaces; a cloud, which transfer.opacity makes, has none", "material")


_KINDS: list[type[ObjectBase]] = [*members("shapes"), WaterObject, FormulaObject, VolumeObject]
KINDS = in_order(_KINDS)
if TYPE_CHECKING:
    SceneObject: TypeAlias = ObjectBase
else:
    SceneObject = one_of(KINDS, "type", "sphere")
Objects = Annotated[dict[ObjectName, SceneObject], Field(max_length=MAX_OBJECTS)]
