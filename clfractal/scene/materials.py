"""Materials by OpenPBR's names: https://academysoftwarefoundation.github.io/OpenPBR, version 1.1."""

from typing import Annotated

from pydantic import AfterValidator, Field

from clfractal.scene.base import Amount, Color, Fraction, Reflectance, Section, problem

Ior = Annotated[float, Field(strict=True, ge=1, le=10, allow_inf_nan=False)]
WHITE = (1.0, 1.0, 1.0)


class Base(Section):
    """The body of a material: diffuse, or a metal."""

    weight: Fraction = Field(1.0, description="factor on the colour")
    color: Reflectance | None = Field(
        None, description="linear Rec. 709; null: the colouring's, or `material.color`"
    )
    metalness: Fraction = Field(0.0, description="0: a dielectric, 1: a metal")
    diffuse_roughness: Fraction = Field(0.0, description="of the diffuse body; 0: Lambert's")


class Specular(Section):
    """What the body's boundary mirrors."""

    weight: Fraction = Field(1.0, description="factor on the reflectance of a dielectric, straight on")
    color: Reflectance = Field(WHITE, description="a dielectric's tint; a metal's at its edges")
    roughness: Fraction = Field(0.3, description="0: a mirror, 1: no highlight")
    ior: Ior = Field(1.5, description="index of refraction of a dielectric")


class Coat(Section):
    """A clear layer over the body."""

    weight: Fraction = Field(0.0, description="part of the surface that has it")
    color: Reflectance = Field(WHITE, description="what passes through it, there and back")
    roughness: Fraction = Field(0.0, description="of its highlight")
    ior: Ior = Field(1.6, description="index of refraction")
    darkening: Fraction = Field(
        1.0, description="how much the body is darkened by light that the coat throws back to it"
    )


class Fuzz(Section):
    """Short fibres over everything: dust, velvet."""

    weight: Fraction = Field(0.0, description="how dense they are")
    color: Reflectance = Field(WHITE, description="linear Rec. 709")
    roughness: Annotated[float, Field(strict=True, ge=0.25, le=1, allow_inf_nan=False)] = Field(
        0.5, description="how far they stand apart: the larger, the less light gathers at the rim"
    )


class Transmission(Section):
    """Glass in the place of the diffuse body; its roughness is that of `specular`."""

    weight: Fraction = Field(0.0, description="part of the body that is glass")
    color: Reflectance = Field(
        WHITE,
        description="of light that has gone through `depth` of it; with depth 0 a factor at each boundary",
    )
    depth: Annotated[float, Field(strict=True, ge=0, le=1e6, allow_inf_nan=False)] = Field(
        0.0, description="way through the set after which light has that colour, scene units"
    )
    dispersion_scale: Fraction = Field(0.0, description="0: all colours bend alike; 1: by the Abbe number")
    dispersion_abbe_number: Annotated[float, Field(strict=True, ge=1, le=1000, allow_inf_nan=False)] = Field(
        20.0, description="the smaller, the farther colours spread: 20 more than any glass, 60 window glass"
    )


class Emission(Section):
    """Light of the material's own."""

    luminance: Amount = Field(0.0, description="radiance, as of `background`")
    color: Color = Field(WHITE, description="factor on the luminance, linear Rec. 709")


MAX_MATERIALS, MAX_NAME = 64, 100


class PbrMaterial(Section):
    """A material by OpenPBR's layers, for `lighting: {mode: path}`."""

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
    emission: Emission = Field(
        default_factory=dict, validate_default=True, description="light of the material's own"
    )


def _fitting(name: str) -> str:
    if not name.isprintable() or name.isspace() or "." in name:
        raise problem("a material's name must be printable text on one line, without a dot")
    return name


MaterialName = Annotated[str, Field(strict=True, min_length=1, max_length=MAX_NAME), AfterValidator(_fitting)]
Materials = Annotated[dict[MaterialName, PbrMaterial], Field(max_length=MAX_MATERIALS)]
