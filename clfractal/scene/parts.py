"""The parts of a scene around its formula: picture, camera, renderer, lights, material, colours and output.

A camera, renderer or light with a `projection` or `type` is one class here and one entry in its union; a new
kind is added by writing its class and naming it there.
"""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, Tag, model_validator

from clfractal.errors import unknown_name
from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS
from clfractal.scene.base import (
    Amount,
    Color,
    Coordinate,
    Fraction,
    Position,
    Reflectance,
    Section,
    chosen_by,
    chosen_by_word,
    cross,
    length,
    minus,
    problem,
)

MAX_SIDE = 65_536
MAX_PIXELS = 2**30
MAX_LIGHTS = 64

Radius = Annotated[float, Field(strict=True, gt=0, le=1e6, allow_inf_nan=False)]


class Image(Section):
    """Size of the picture in pixels."""

    width: int = Field(1024, ge=1, le=MAX_SIDE, description="pixels")
    height: int = Field(1024, ge=1, le=MAX_SIDE, description="pixels")

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if self.width * self.height > MAX_PIXELS:
            raise problem(f"must be at most {MAX_PIXELS:,} pixels, got {self.width} x {self.height}")
        return self


class CameraBase(Section):
    """What every camera has."""

    position: Position = Field((0.0, -3.0, 0.0), description="where the camera is, scene units")
    target: Position = Field(
        (0.0, 0.0, 0.0), description="the point in the middle of the picture, scene units"
    )
    up: Position = Field((0.0, 0.0, 1.0), description="the direction that is up in the picture")

    @model_validator(mode="after")
    def _looks_somewhere(self) -> Self:
        view = minus(self.target, self.position)
        size = max(1e-300, *(abs(x) for x in (*self.target, *self.position)))
        if length(view) <= 1e-14 * size:
            raise problem("must differ from camera.position", "target")
        if length(self.up) < 1e-12:
            raise problem("must not be zero", "up")
        if length(cross(view, self.up)) <= 1e-6 * length(view) * length(self.up):
            raise problem("must not be parallel to the view, from camera.position to camera.target", "up")
        return self


class PerspectiveCamera(CameraBase):
    """All rays leave one point."""

    tag = "perspective"
    projection: Literal["perspective"] = "perspective"
    fov: float = Field(45.0, ge=1e-6, lt=180, description="vertical angle of view, degrees")


class OrthographicCamera(CameraBase):
    """All rays are parallel."""

    tag = "orthographic"
    projection: Literal["orthographic"] = "orthographic"
    height: float = Field(3.0, ge=1e-12, le=1e6, description="height of the picture, scene units")


Camera = Annotated[
    Annotated[PerspectiveCamera, Tag("perspective")] | Annotated[OrthographicCamera, Tag("orthographic")],
    chosen_by("projection", "perspective"),
]


class Ball(Section):
    """A ball in space that holds everything to be seen."""

    center: Position = Field((0.0, 0.0, 0.0), description="scene units")
    radius: Radius = Field(description="scene units")


class SurfaceRenderer(Section):
    """The boundary of the set, found by marching along each ray by a bound of the distance."""

    tag = "surface"
    type: Literal["surface"] = "surface"
    detail: float = Field(
        1.0, ge=0.01, le=100, description="distance that counts as a hit, in pixel footprints"
    )
    max_steps: int = Field(1000, ge=1, le=100_000, description="most distance evaluations along a ray")
    over_relaxation: float = Field(
        1.3, ge=1, lt=2, description="factor on steps, taken back where it is unsafe"
    )
    step_scale: Annotated[float, Field(strict=True, gt=0, le=2)] | None = Field(
        None, description="factor on distances; the formula's own if null"
    )
    bounds: Ball | None = Field(None, description="where to look; the formula's own if null")
    samples: int = Field(1, ge=1, le=65_536, description="rays per pixel")
    seed: int = Field(0, ge=0, le=2**32 - 1, description="chooses the places of the samples in a pixel")
    precision: Literal["auto", "float32", "float64"] = Field(
        "auto", description="number type of the rays; auto: float64 where pixels are too fine for float32"
    )


# With one class there is nothing to choose; a second makes this a union like Camera's.
Renderer = Annotated[Annotated[SurfaceRenderer, Tag("surface")], chosen_by("type", "surface")]


class LightBase(Section):
    """What every light has."""

    color: Color = Field((1.0, 1.0, 1.0), description="linear Rec. 709")
    intensity: Amount = Field(1.0, description="factor on the colour")
    shadow: bool = Field(True, description="whether it is blocked by the set")


class DirectionalLight(LightBase):
    """Light from infinitely far away."""

    tag = "directional"
    type: Literal["directional"] = "directional"
    direction: Position = Field((-1.0, 1.0, -1.0), description="where the light travels to")

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Self:
        if length(self.direction) < 1e-12:
            raise problem("must not be zero", "direction")
        return self


class PointLight(LightBase):
    """Light from a point."""

    tag = "point"
    type: Literal["point"] = "point"
    position: Position = Field(description="scene units")
    falloff: Literal["none", "inverse_square"] = Field("none", description="how it weakens with distance")


Light = Annotated[
    Annotated[DirectionalLight, Tag("directional")] | Annotated[PointLight, Tag("point")],
    chosen_by("type", "directional"),
]


class Material(Section):
    """How the surface answers light: the thesis's Phong model (Eq. 5)."""

    color: Reflectance = Field(
        (0.8, 0.7, 0.6), description="linear Rec. 709; replaced by a coloring other than solid"
    )
    ambient: Amount = Field(0.1, description="part of each light that reaches everywhere")
    diffuse: Amount = Field(0.9, description="part that is scattered")
    specular: Amount = Field(0.3, description="part that is mirrored")
    shininess: float = Field(30.0, ge=0.1, le=1e5, description="exponent of the highlight")


class Stop(Section):
    """A colour at a place of a palette; between two stops colours are mixed in linear light."""

    at: Fraction = Field(description="place in the palette, 0 to 1")
    color: Color = Field(description="linear Rec. 709")


class Coloring(Section):
    """Where the material's colour comes from.

    `solid`: material.color. `normal`: the normal's x, y, z as red, green, blue, from -1..1 to 0..1.
    `iterations`: the palette at frac(scale * smooth escape count + offset).
    """

    by: Literal["solid", "normal", "iterations"] = Field("solid", description="what chooses the colour")
    palette: (
        Annotated[str, Field(min_length=1, max_length=200), Tag("name")]
        | Annotated[tuple[Stop, ...], Field(strict=False, min_length=1, max_length=256), Tag("stops")]
    ) = Field(
        "viridis",
        discriminator=chosen_by_word("name", "stops"),
        description="a palette's name, or stops in order of `at`",
    )
    scale: Coordinate = Field(0.1, description="palettes per unit")
    offset: Coordinate = Field(0.0, description="start in the palette")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if not isinstance(self.palette, str):
            for index in range(1, len(self.palette)):
                if self.palette[index].at < self.palette[index - 1].at:
                    raise problem("must not be below the stop before it", f"palette.{index}.at")
        return self


class Gradient(Section):
    """What is seen past the set, from the top of the picture to its bottom."""

    tag = "gradient"
    top: Color = Field((0.25, 0.35, 0.5), description="linear Rec. 709")
    bottom: Color = Field((0.02, 0.02, 0.03), description="linear Rec. 709")


def _known_channel(name: str) -> str:
    if name not in CHANNELS:
        raise problem(unknown_name("channel", name, CHANNELS))
    return name


ChannelName = Annotated[
    str,
    Field(strict=True, max_length=100, json_schema_extra={"enum": list(CHANNELS)}),
    AfterValidator(_known_channel),
]


class Output(Section):
    """What is written."""

    exposure: float = Field(
        0.0, ge=-100, le=100, description="stops: PNG colours are multiplied by 2**exposure"
    )
    channels: Annotated[tuple[ChannelName, ...], Field(strict=False, min_length=1, max_length=64)] = Field(
        DEFAULT_CHANNELS, description="channels of an EXR"
    )
    precision: dict[ChannelName, Literal["half", "float"]] = Field(
        default_factory=dict, description="an EXR's numbers, by channel, where not as usual for the channel"
    )
    png_bits: Literal[8, 16] = Field(8, description="bits of a PNG's channel")

    @model_validator(mode="after")
    def _different(self) -> Self:
        for index, channel in enumerate(self.channels):
            if channel in self.channels[:index]:
                raise problem(f"channel {channel!r} is given twice", f"channels.{index}")
        return self

    @property
    def half_channels(self) -> frozenset[str]:
        """The channels that an EXR stores with 16 bits."""
        return frozenset(
            name
            for name, channel in CHANNELS.items()
            if self.precision.get(name, channel.precision) == "half"
        )


Background = Annotated[
    Annotated[Gradient, Tag("gradient")] | Annotated[Literal["transparent"], Tag("transparent")],
    chosen_by_word("transparent", "gradient"),
]
Lights = Annotated[tuple[Light, ...], Field(strict=False, max_length=MAX_LIGHTS)]
