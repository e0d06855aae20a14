"""Materials by OpenPBR's names: https://academysoftwarefoundation.github.io/OpenPBR, version 1.1."""

from typing import Annotated, Self

from pydantic import Field, Tag, model_validator

from clfractal.schema.base import Color, Coordinate, Length, problem
from clfractal.schema.fields import Usual
from clfractal.schema.mapped import FORM, AmountMap, ColorMap, FractionMap, Mapped, NumberMap, ReflectanceMap
from clfractal.schema.names import MaterialName

Ior = Annotated[float, Field(strict=True, ge=1, le=10, allow_inf_nan=False)]
IorMap = Annotated[Annotated[Ior, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
Stand = Annotated[float, Field(strict=True, ge=0.25, le=1, allow_inf_nan=False)]
StandMap = Annotated[Annotated[Stand, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
Depth = Annotated[float, Field(strict=True, ge=0, le=1e6, allow_inf_nan=False)]
DepthMap = Annotated[Annotated[Depth, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
Abbe = Annotated[float, Field(strict=True, ge=1, le=1000, allow_inf_nan=False)]
Forward = Annotated[float, Field(strict=True, ge=-0.99, le=0.99)]
ForwardMap = Annotated[Annotated[Forward, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
AbbeMap = Annotated[Annotated[Abbe, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
HeightMap = Annotated[Annotated[Coordinate, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]
ShineMap = Annotated[Annotated[Color, Tag("given")] | Annotated[ColorMap, Tag("map")], FORM]
WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)


class Base(Mapped):
    """The body of a material: diffuse, or a metal."""

    weight: FractionMap = Field(1.0, description="factor on the colour")
    color: ReflectanceMap | None = Field(
        None, description="linear Rec. 709; null: the colouring's, or `material.color`"
    )
    metalness: FractionMap = Field(0.0, description="0: a dielectric, 1: a metal")
    diffuse_roughness: FractionMap = Field(0.0, description="of the diffuse body; 0: Lambert's")


class Specular(Mapped):
    """What the body's boundary mirrors."""

    weight: FractionMap = Field(1.0, description="factor on the reflectance of a dielectric, straight on")
    color: ReflectanceMap = Field(WHITE, description="a dielectric's tint; a metal's at its edges")
    roughness: FractionMap = Field(0.3, description="0: a mirror, 1: no highlight")
    ior: Annotated[IorMap, Usual(1, 3)] = Field(1.5, description="index of refraction of a dielectric")


class Coat(Mapped):
    """A clear layer over the body."""

    weight: FractionMap = Field(0.0, description="part of the surface that has it")
    color: ReflectanceMap = Field(WHITE, description="what passes through it, there and back")
    roughness: FractionMap = Field(0.0, description="of its highlight")
    ior: Annotated[IorMap, Usual(1, 3)] = Field(1.6, description="index of refraction")
    darkening: FractionMap = Field(
        1.0, description="how much the body is darkened by light that the coat throws back to it"
    )


class Fuzz(Mapped):
    """Short fibres over everything: dust, velvet."""

    weight: FractionMap = Field(0.0, description="how dense they are")
    color: ReflectanceMap = Field(WHITE, description="linear Rec. 709")
    roughness: StandMap = Field(
        0.5, description="how far they stand apart: the larger, the less light gathers at the rim"
    )


class Transmission(Mapped):
    """Glass in the place of the diffuse body; its roughness is that of `specular`."""

    weight: FractionMap = Field(0.0, description="part of the body that is glass")
    color: ReflectanceMap = Field(
        WHITE,
        description="of light that has gone through `depth` of it; with depth 0 a factor at each boundary",
    )
    depth: DepthMap = Field(
        0.0, description="way through the set after which light has that colour, scene units"
    )
    scatter: ReflectanceMap = Field(
        BLACK,
        description="how often light is scattered on the way through `depth`, in the mean; needs a `depth`",
    )
    scatter_anisotropy: ForwardMap = Field(
        0.0, description="where `scatter` sends light: 0 all around, 0.99 straight on, below 0 back"
    )
    dispersion_scale: FractionMap = Field(0.0, description="0: all colours bend alike; 1: by the Abbe number")
    dispersion_abbe_number: AbbeMap = Field(
        20.0, description="the smaller, the farther colours spread: 20 more than any glass, 60 window glass"
    )

    @model_validator(mode="after")
    def _deep_enough(self) -> Self:
        if self.scatter != BLACK and self.depth == 0:
            raise problem("needs a depth above 0: scattering is told for the way through it", "scatter")
        return self


class Subsurface(Mapped):
    """A medium below the boundary, in the place of the diffuse body: skin, wax, marble."""

    weight: FractionMap = Field(0.0, description="part of the diffuse body that light goes into")
    color: ReflectanceMap = Field(
        (0.8, 0.8, 0.8), description="what comes out of a thick body in all, linear Rec. 709"
    )
    radius: DepthMap = Field(
        0.1, description="how far light goes between two scatterings, in the mean, scene units"
    )
    radius_scale: ReflectanceMap = Field(
        (1.0, 0.5, 0.25), description="factor on the radius for red, green and blue"
    )
    scatter_anisotropy: ForwardMap = Field(
        0.0, description="where light is sent: 0 all around, 0.99 straight on, below 0 back"
    )


class Emission(Mapped):
    """Light of the material's own."""

    luminance: Annotated[AmountMap, Usual(0, 4)] = Field(0.0, description="radiance, as of `background`")
    color: ShineMap = Field(WHITE, description="factor on the luminance, linear Rec. 709")


class Bump(Mapped):
    """A relief that only light sees: the surface stays where it is, and its shading normal is that of the relief."""

    height: Annotated[HeightMap, Usual(-0.1, 0.1)] = Field(
        0.0, description="of the relief over the surface, scene units; below 0: in it; only slopes are seen"
    )
    width: Annotated[Length, Usual(0.001, 1)] | None = Field(
        None,
        description="least distance over which slopes are measured, scene units; null: a pixel's, or a texture's",
    )


MAX_MATERIALS = 64


class PbrMaterial(Mapped):
    """A material by OpenPBR's layers, for `lighting: {mode: path}`; or a blend of two others."""

    base: Base = Field(default_factory=dict, validate_default=True, description="the body")
    specular: Specular = Field(
        default_factory=dict, validate_default=True, description="what the body's boundary mirrors"
    )
    coat: Coat = Field(default_factory=dict, validate_default=True, description="a clear layer over the body")
    fuzz: Fuzz = Field(
        default_factory=dict, validate_default=True, description="short fibres over everything"
    )
    transmission: Transmission = Field(
        default_factory=dict, validate_default=True, description="glass in the place of the diffuse body"
    )
    subsurface: Subsurface = Field(
        default_factory=dict,
        validate_default=True,
        description="a medium below the boundary, in the place of the diffuse body",
    )
    emission: Emission = Field(
        default_factory=dict, validate_default=True, description="light of the material's own"
    )
    bump: Bump = Field(
        default_factory=dict, validate_default=True, description="a relief that only light sees"
    )
    blend: Annotated[tuple[MaterialName, ...], Field(strict=False, min_length=2, max_length=2)] | None = (
        Field(
            None,
            description="names of two materials that this one is made of; it has no layers of its own then",
        )
    )
    mask: FractionMap = Field(0.5, description="of a blend: 0 is the first one, 1 the second")

    @model_validator(mode="after")
    def _layers_or_blend(self) -> Self:
        if self.blend is None:
            if self.mask != 0.5:
                raise problem("applies to a blend of two materials", "mask")
            return self
        for name in ("base", "specular", "coat", "fuzz", "transmission", "subsurface", "emission", "bump"):
            given = getattr(self, name)
            if given != type(given)():
                raise problem("cannot be combined with blend: a blend takes its layers from others", name)
        return self


Materials = Annotated[dict[MaterialName, PbrMaterial], Field(max_length=MAX_MATERIALS)]
