"""The volume renderer's settings: the box, the values of its voxels, and how rays sample them."""

from collections.abc import Mapping
from math import prod
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, Tag

from clfractal.errors import SceneError, Where
from clfractal.scene.sampled import Sampled
from clfractal.schema.base import Color, Fraction, Position, Section, Vector, chosen_by_list, problem, rule
from clfractal.schema.fields import SCALE, Usual
from clfractal.schema.stops import IN_ORDER

MAX_RESOLUTION = 16_384
Side = Annotated[int, Field(strict=True, ge=2, le=MAX_RESOLUTION)]
Sides = Annotated[tuple[Side, Side, Side], Field(strict=False)]
Resolution = Annotated[
    Annotated[Side, Tag("one")] | Annotated[Sides, Tag("three")],
    Field(discriminator=chosen_by_list("three", "one")),
]
Length = Annotated[float, Field(strict=True, gt=0, le=1e6, allow_inf_nan=False)]
Lengths = Annotated[tuple[Length, Length, Length], Field(strict=False)]
Size = Annotated[
    Annotated[Length, Tag("one")] | Annotated[Lengths, Tag("three")],
    Field(discriminator=chosen_by_list("three", "one")),
]


class Box(Section):
    """A box in space, its sides along the axes."""

    center: Position = Field((0.0, 0.0, 0.0), description="scene units")
    size: Annotated[Size, SCALE] = Field(
        4.0, description="lengths of the sides, scene units; one number for a cube"
    )

    @property
    def sides(self) -> Vector:
        """Lengths of the sides, scene units."""
        return self.size if isinstance(self.size, tuple) else (self.size, self.size, self.size)


class Zoom(Section):
    """A smaller box within the one before."""

    center: Position = Field(description="middle of the smaller box, scene units")
    scale: Annotated[float, Field(strict=True, ge=1, le=1e15, allow_inf_nan=False), SCALE] = Field(
        description="length of the sides of the box before, divided by this box's"
    )


class OpacityStop(Section):
    """An opacity at a value of a voxel; between two stops it is interpolated."""

    at: float = Field(ge=-1e12, le=1e12, description="value of a voxel at this stop")
    opacity: Fraction = Field(description="opacity over the length of a voxel's side, 0 to 1")


class ColorStop(Section):
    """A colour at a value of a voxel; between two stops colours are interpolated in linear light."""

    at: float = Field(ge=-1e12, le=1e12, description="value of a voxel at this stop")
    color: Color = Field(description="linear Rec. 709")


class EmissionStop(Section):
    """Light of its own at a value of a voxel; between two stops it is interpolated."""

    at: float = Field(ge=-1e12, le=1e12, description="value of a voxel at this stop")
    emission: Color = Field(
        description="light that the length of a voxel's side adds where nothing dims it, linear Rec. 709"
    )


class Transfer(Section):
    """Opacity, colour and emission of the voxels' values."""

    opacity: (
        Annotated[tuple[OpacityStop, ...], Field(strict=False, min_length=1, max_length=256), IN_ORDER] | None
    ) = Field(None, description="stops in order of `at`; null: a surface at the renderer's level")
    color: (
        Annotated[tuple[ColorStop, ...], Field(strict=False, min_length=1, max_length=256), IN_ORDER] | None
    ) = Field(None, description="stops in order of `at`; null: the material's colour")
    emission: (
        Annotated[tuple[EmissionStop, ...], Field(strict=False, min_length=1, max_length=256), IN_ORDER]
        | None
    ) = Field(None, description="stops in order of `at`, beside `opacity`; null: nothing shines by itself")

    @rule
    def _has_depth(self) -> None:
        if self.emission is not None and self.opacity is None:
            raise problem("needs opacity, since a surface at a level has no depth that shines", "emission")

    @property
    def visible(self) -> tuple[tuple[float, bool], ...]:
        """Values in order, and whether there is something to see at each; between two of them, where one is to be seen.

        Empty where a surface is shown.
        """
        if self.opacity is None:
            return ()
        values = sorted({*(stop.at for stop in self.opacity), *(stop.at for stop in self.emission or ())})
        return tuple((at, self.shows(at)) for at in values)

    def shows(self, value: float) -> bool:
        """Whether a value has an opacity or an emission; where one of them jumps, on either side."""
        opaque = [(stop.at, stop.opacity) for stop in self.opacity or ()]
        shining = [(stop.at, max(stop.emission)) for stop in self.emission or ()]
        return any(_shows(stops, value) for stops in (opaque, shining) if stops)


def _shows(stops: list[tuple[float, float]], value: float) -> bool:
    """Whether a function through stops in order is above 0 at a value, on either side of it."""
    here = [amount for at, amount in stops if at == value]
    if here:
        return max(here) > 0
    before = [amount for at, amount in stops if at < value][-1:] or [stops[0][1]]
    after = [amount for at, amount in stops if at > value][:1] or [stops[-1][1]]
    return before[0] > 0 or after[0] > 0


class VolumeRenderer(Sampled):
    """Rays through a grid of voxels, front to back, until nothing shines through."""

    tag = "volume"
    title = "Volume"
    place = 20
    has_own_colors = True
    # The grid takes a moment to fill, so the first one is small.
    first: ClassVar[Mapping[str, Any]] = {"resolution": 192}
    type: Literal["volume"] = "volume"
    box: Box | None = Field(
        None, description="the box that is filled; null: a cube around the formula's bounds"
    )
    zoom: Annotated[tuple[Zoom, ...], Field(strict=False, max_length=64)] = Field(
        (), description="smaller boxes, each within the one before; the last is shown as large as the first"
    )
    resolution: Annotated[Resolution, Usual(32, 2048)] = Field(
        512, description="voxels along the longest side, or along x, y and z"
    )
    file: str | None = Field(
        None,
        min_length=1,
        description="a grid to show instead of the formula: a NRRD or NPY file beside the scene",
    )
    value: Literal["inside", "coverage", "iterations"] = Field(
        "inside",
        description="what a voxel holds: is its middle inside, which part is inside, or its smooth count",
    )
    sub_points: int = Field(3, ge=1, le=16, description="points along each side of a voxel for `coverage`")
    store: Literal["byte", "float"] = Field("byte", description="how values are stored: in 8 bits or in 32")
    fill: Literal["octree", "brute"] = Field(
        "octree", description="skip regions that distances show to be empty, or evaluate every voxel"
    )
    normals: Literal["gradient", "least_squares", "exact"] = Field(
        "gradient",
        description="normals by central differences, by a plane fitted in a voxel, or by the Jacobian",
    )
    normal_radius: int = Field(
        1, ge=0, le=4, description="radius of the low-pass filter before `gradient`, voxels; 0: none"
    )
    interpolation: Literal["trilinear", "nearest"] = Field(
        "trilinear", description="how values between the middles of voxels are found"
    )
    step: Annotated[float, Field(strict=True, ge=0.01, le=4), Usual(0.1, 2)] = Field(
        0.5, description="step along a ray, in sides of a voxel"
    )
    level: Annotated[float, Field(strict=True, ge=-1e12, le=1e12)] | None = Field(
        None, description="value at the surface; null: the middle of the range of values"
    )
    opacity_limit: Annotated[float, Field(strict=True, gt=0, le=1), Usual(0.5, 1)] = Field(
        0.99, description="opacity at which a ray ends"
    )
    transfer: Transfer = Field(
        default_factory=dict, validate_default=True, description="opacity and colour of the voxels' values"
    )
    anisotropy: Annotated[float, Field(strict=True, ge=-0.95, le=0.95)] = Field(
        0.0,
        description="where light is scattered to, with lighting.mode path: 0 all around, 0.95 straight on, below 0 back",
    )
    shadows: bool = Field(
        False, description="whether lights with `shadow: true` cast shadows inside the grid"
    )

    def value_range(self, iterations: int) -> tuple[float, float]:
        """The least and the largest value of a grid that is filled, with a formula of at most `iterations`."""
        return 0.0, float(iterations) if self.value == "iterations" else 1.0

    def used_level(self, low: float, high: float) -> float:
        """The value of the surface of a grid with values from `low` to `high`."""
        return (low + high) / 2 if self.level is None else self.level

    def check_level(self, low: float, high: float) -> None:
        """Raises SceneError if no surface at the level is possible in a grid with values from `low` to `high`."""
        if self.level is not None and not low < self.level <= high:
            raise SceneError(
                f"must be above {low:g} and at most {high:g}, the ends of the grid's values, got {self.level:g}",
                Where(path="renderer.level"),
            )

    @property
    def magnification(self) -> float:
        """How many times larger the first box is than the smallest."""
        return prod(zoom.scale for zoom in self.zoom)
