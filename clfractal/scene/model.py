"""The schema of a scene: frozen, strict models whose attribute names are the keys of a scene file.

Right-handed space, z up, scene units; angles in degrees; colours linear Rec. 709. Every key but `version`, `formula`
and `camera` has a default. A renderer, a light or a camera that has a `type` (or `projection`) is one class here and
one entry in its union: a new one is added by writing its class and naming it there.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from clfractal.errors import unknown_name
from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS

if TYPE_CHECKING:
    from clfractal.formulas.language import Chain

MAX_SIDE = 65_536
MAX_PIXELS = 2**30
MAX_LIGHTS = 64
MAX_LINKS = 64

Vector: TypeAlias = tuple[float, float, float]

Coordinate = Annotated[float, Field(strict=True, ge=-1e6, le=1e6, allow_inf_nan=False)]
Position = Annotated[tuple[Coordinate, Coordinate, Coordinate], Field(strict=False)]
Fraction = Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)]
Amount = Annotated[float, Field(strict=True, ge=0, le=1e6, allow_inf_nan=False)]
Color = Annotated[tuple[Amount, Amount, Amount], Field(strict=False)]
Reflectance = Annotated[tuple[Fraction, Fraction, Fraction], Field(strict=False)]
Number = Annotated[float, Field(strict=True, ge=-1e12, le=1e12, allow_inf_nan=False)]
Radius = Annotated[float, Field(strict=True, gt=0, le=1e6, allow_inf_nan=False)]
Bailout = Annotated[float, Field(strict=True, gt=0, le=1e12, allow_inf_nan=False)]


def problem(message: str, at: str = "") -> PydanticCustomError:
    """An error of ours inside a validator, at the key `at` of the model that raises it."""
    return PydanticCustomError("clfractal", "{message}", {"message": message, "at": at})


def _known_channel(name: str) -> str:
    if name not in CHANNELS:
        raise problem(unknown_name("channel", name, CHANNELS))
    return name


ChannelName = Annotated[
    str,
    Field(strict=True, max_length=100, json_schema_extra={"enum": list(CHANNELS)}),
    AfterValidator(_known_channel),
]


def _tag(key: str, default: str) -> Discriminator:
    """Chooses a class of a union by the word under `key`; without the key it is `default`."""

    def choose(value: Any) -> str:
        found = value.get(key, default) if isinstance(value, Mapping) else getattr(value, key, default)
        return found if isinstance(found, str) else repr(found)

    return Discriminator(choose, custom_error_context={"key": key})


def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _length(a: Vector) -> float:
    return float((a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) ** 0.5)


class Section(BaseModel):
    """A mapping of the scene: unknown keys are errors, values keep their types, nothing changes after reading.

    `tag` is the word that chooses the class where several share a place.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
    tag: ClassVar[str] = ""


class ChainLink(Section):
    """One member of a chain: a formula and how many times it is applied before the next one's turn."""

    name: str | None = Field(None, min_length=1, max_length=200, description="a formula of the library")
    file: str | None = Field(
        None, min_length=1, max_length=1000, description="a formula file beside the scene"
    )
    inline: dict[str, Any] | None = Field(None, description="a formula, written here")
    count: int = Field(1, ge=1, le=1000, description="applications in a row")
    parameters: dict[str, Number] = Field(default_factory=dict, description="values of its parameters")
    julia: Annotated[tuple[Coordinate, ...], Field(strict=False, min_length=3, max_length=4)] | None = Field(
        None, description="the added constant: a number for each variable"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        _check_source(self, ("name", "file", "inline"))
        return self


class FormulaSpec(Section):
    """Which formula is drawn, and how far it is iterated. Exactly one of name, file, inline and chain is given."""

    name: str | None = Field(None, min_length=1, max_length=200, description="a formula of the library")
    file: str | None = Field(
        None, min_length=1, max_length=1000, description="a formula file beside the scene"
    )
    inline: dict[str, Any] | None = Field(None, description="a formula, written here")
    chain: (
        Annotated[tuple[ChainLink, ...], Field(strict=False, min_length=1, max_length=MAX_LINKS)] | None
    ) = Field(None, description="formulas applied in turn")
    parameters: dict[str, Number] = Field(default_factory=dict, description="values of its parameters")
    iterations: int = Field(30, ge=1, le=1_000_000, description="most applications of the formula")
    bailout: Bailout | None = Field(None, description="escape radius of counts and inside tests")
    distance_bailout: Bailout | None = Field(None, description="escape radius of distances")
    julia: Annotated[tuple[Coordinate, ...], Field(strict=False, min_length=3, max_length=4)] | None = Field(
        None, description="the added constant: a number for each variable"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        _check_source(self, ("name", "file", "inline", "chain"))
        if self.chain is not None and self.parameters:
            raise problem("belong to the members of a chain, not to the chain", "parameters")
        return self


def _check_source(spec: Section, keys: tuple[str, ...]) -> None:
    given = [key for key in keys if getattr(spec, key) is not None]
    listing = ", ".join(keys[:-1]) + f" or {keys[-1]}"
    if not given:
        raise problem(f"needs one of {listing}")
    if len(given) > 1:
        raise problem(f"cannot stand beside {given[0]}: give one of {listing}", given[1])


class Image(Section):
    """Size of the picture in pixels."""

    width: int = Field(1024, ge=1, le=MAX_SIDE, description="pixels")
    height: int = Field(1024, ge=1, le=MAX_SIDE, description="pixels")

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if self.width * self.height > MAX_PIXELS:
            raise problem(f"must be at most {MAX_PIXELS:,} pixels, got {self.width} x {self.height}")
        return self


class _Camera(Section):
    position: Position = Field((0.0, -3.0, 0.0), description="where the camera is, scene units")
    target: Position = Field(
        (0.0, 0.0, 0.0), description="the point in the middle of the picture, scene units"
    )
    up: Position = Field((0.0, 0.0, 1.0), description="the direction that is up in the picture")

    @model_validator(mode="after")
    def _looks_somewhere(self) -> Self:
        view = _minus(self.target, self.position)
        size = max(1e-300, *(abs(x) for x in (*self.target, *self.position)))
        if _length(view) <= 1e-14 * size:
            raise problem("must differ from camera.position", "target")
        if _length(self.up) < 1e-12:
            raise problem("must not be zero", "up")
        if _length(_cross(view, self.up)) <= 1e-6 * _length(view) * _length(self.up):
            raise problem("must not be parallel to the view, from camera.position to camera.target", "up")
        return self


class PerspectiveCamera(_Camera):
    """All rays leave one point."""

    tag = "perspective"
    projection: Literal["perspective"] = "perspective"
    fov: float = Field(45.0, ge=1e-6, lt=180, description="vertical angle of view, degrees")


class OrthographicCamera(_Camera):
    """All rays are parallel."""

    tag = "orthographic"
    projection: Literal["orthographic"] = "orthographic"
    height: float = Field(3.0, ge=1e-12, le=1e6, description="height of the picture, scene units")


Camera = Annotated[
    Annotated[PerspectiveCamera, Tag("perspective")] | Annotated[OrthographicCamera, Tag("orthographic")],
    _tag("projection", "perspective"),
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
        1.2, ge=1, lt=2, description="factor on steps, taken back where it is unsafe"
    )
    step_scale: Annotated[float, Field(strict=True, gt=0, le=2)] | None = Field(
        None, description="factor on distances; the formula's own if null"
    )
    bounds: Ball | None = Field(None, description="where to look; the formula's own if null")
    samples: int = Field(1, ge=1, le=65_536, description="rays per pixel")
    seed: int = Field(0, ge=0, le=2**32 - 1, description="chooses the places of the samples in a pixel")


# With one class there is nothing to choose; a second makes this a union like Camera's.
Renderer = Annotated[Annotated[SurfaceRenderer, Tag("surface")], _tag("type", "surface")]


class _Light(Section):
    color: Color = Field((1.0, 1.0, 1.0), description="linear Rec. 709")
    intensity: Amount = Field(1.0, description="factor on the colour")
    shadow: bool = Field(True, description="whether it is blocked by the set")


class DirectionalLight(_Light):
    """Light from infinitely far away."""

    tag = "directional"
    type: Literal["directional"] = "directional"
    direction: Position = Field((-1.0, 1.0, -1.0), description="where the light travels to")

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Self:
        if _length(self.direction) < 1e-12:
            raise problem("must not be zero", "direction")
        return self


class PointLight(_Light):
    """Light from a point."""

    tag = "point"
    type: Literal["point"] = "point"
    position: Position = Field(description="scene units")
    falloff: Literal["none", "inverse_square"] = Field("none", description="how it weakens with distance")


Light = Annotated[
    Annotated[DirectionalLight, Tag("directional")] | Annotated[PointLight, Tag("point")],
    _tag("type", "directional"),
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

    `solid`: material.color. `normal`: the normal's x, y, z as red, green, blue, from -1..1 to 0..1. `iterations`: the
    palette at frac(scale * smooth escape count + offset).
    """

    by: Literal["solid", "normal", "iterations"] = Field("solid", description="what chooses the colour")
    palette: (
        Annotated[str, Field(min_length=1, max_length=200), Tag("name")]
        | Annotated[tuple[Stop, ...], Field(strict=False, min_length=1, max_length=256), Tag("stops")]
    ) = Field(
        "viridis",
        discriminator=Discriminator(lambda value: "name" if isinstance(value, str) else "stops"),
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


class Scene(Section):
    """A picture to be made: one formula, one camera, one way of looking."""

    version: Literal[1] = Field(description="version of this schema")
    formula: FormulaSpec
    image: Image = Image()
    camera: Camera
    renderer: Renderer = SurfaceRenderer()
    lights: Annotated[tuple[Light, ...], Field(strict=False, max_length=MAX_LIGHTS)] = (DirectionalLight(),)
    material: Material = Material()
    coloring: Coloring = Coloring()
    background: (
        Annotated[Gradient, Tag("gradient")] | Annotated[Literal["transparent"], Tag("transparent")]
    ) = Field(
        Gradient(),
        discriminator=Discriminator(lambda value: "transparent" if isinstance(value, str) else "gradient"),
    )
    output: Output = Output()

    @cached_property
    def chain(self) -> Chain:
        """The formula, ready to be evaluated or written as OpenCL.

        Raises:
            FormulaError: it is wrong; the path says where (a loaded scene's formula has been checked).
        """
        from clfractal.formulas import catalog

        return catalog.resolve(formula_mapping(self.formula))

    def resolved(self) -> dict[str, Any]:
        """Plain data (as for YAML or JSON) with every default filled in; it loads back to an equal scene."""
        plain: dict[str, Any] = self.model_dump(mode="json")
        plain["formula"] = formula_mapping(self.formula, full=True)
        return plain


def formula_mapping(spec: FormulaSpec, *, full: bool = False) -> dict[str, Any]:
    """The formula's part of a scene as plain data, without keys that are not given."""
    plain: dict[str, Any] = spec.model_dump(mode="json", exclude_none=True)
    return plain
