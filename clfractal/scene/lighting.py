"""What lights a scene: lights, an environment, and the fog between the eye and the surface."""

from typing import Annotated, Literal, Self

from pydantic import Field, Tag, model_validator

from clfractal.scene.base import (
    Amount,
    Color,
    Coordinate,
    Length,
    Position,
    Reflectance,
    Section,
    chosen_by,
    length,
    problem,
)

MAX_LIGHTS = 64


class LightBase(Section):
    """Keys that every light has."""

    color: Color = Field((1.0, 1.0, 1.0), description="linear Rec. 709")
    intensity: Amount = Field(1.0, description="factor on the colour")
    shadow: bool = Field(True, description="whether the set blocks this light")
    angular_size: float = Field(
        0.0,
        ge=0,
        le=170,
        description="diameter of the light as seen from the surface, degrees; 0: hard shadows",
    )
    rays: Annotated[int, Field(strict=True, ge=1, le=1024)] | None = Field(
        None, description="shadow rays per sample for a soft shadow; null: 8. A hard shadow takes one"
    )

    @property
    def used_rays(self) -> int:
        """Shadow rays per sample: one for a hard shadow, because further rays would be the same."""
        if self.angular_size == 0:
            return 1
        return self.rays if self.rays is not None else 8


class DirectionalLight(LightBase):
    """Light from infinitely far away."""

    tag = "directional"
    type: Literal["directional"] = "directional"
    direction: Position = Field((-1.0, 1.0, -1.0), description="direction in which the light travels")

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
    falloff: Literal["none", "inverse_square"] = Field(
        "none", description="how the light weakens with distance"
    )


Light = Annotated[
    Annotated[DirectionalLight, Tag("directional")] | Annotated[PointLight, Tag("point")],
    chosen_by("type", "directional"),
]
Lights = Annotated[tuple[Light, ...], Field(strict=False, max_length=MAX_LIGHTS)]

MapName = Annotated[str, Field(strict=True, min_length=1, max_length=1000)]


class Environment(Section):
    """A picture of everything around, infinitely far away; it lights the set, and is seen in mirrors and behind the set."""

    name: MapName | None = Field(None, description="an environment map that comes with the program")
    file: MapName | None = Field(
        None, description="a latitude-longitude EXR picture, in the scene's folder or below"
    )
    intensity: Amount = Field(1.0, description="factor on the environment's light")
    rotation: float = Field(
        0.0, ge=-360, le=360, description="rotation of the environment about the z axis, degrees"
    )
    background: bool = Field(
        True, description="true: visible behind the set; false: `background` is visible there"
    )
    rays: int = Field(
        8, ge=0, le=1024, description="rays per sample for the environment's light; 0: it lights nothing"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if self.name is None and self.file is None:
            raise problem("needs one of name or file")
        if self.name is not None and self.file is not None:
            raise problem("cannot be combined with name: give one of name or file", "file")
        return self


class Scattering(Section):
    """Light that the fog sends on to the eye; what stands between it and a light throws shadows into the fog."""

    color: Reflectance = Field(
        (1.0, 1.0, 1.0), description="part of each light that is scattered and not absorbed, linear Rec. 709"
    )
    anisotropy: float = Field(
        0.0,
        ge=-0.95,
        le=0.95,
        description="above 0 light goes on forwards, as in mist; below 0 back; 0: everywhere alike",
    )


class Fog(Section):
    """Fog absorbs light on its way to the eye and replaces it by its own colour, exponentially with distance."""

    color: Color = Field((0.5, 0.55, 0.6), description="linear Rec. 709")
    density: float = Field(
        0.1, ge=0, le=1e6, description="per scene unit; the fraction exp(-density * distance) of light passes"
    )
    height: Length | None = Field(
        None,
        description="how much higher the density is 1/e, about a third, scene units; null: it is the same everywhere",
    )
    base: Coordinate = Field(
        0.0, description="how far up from the origin the fog has this density, with `height`, scene units"
    )
    up: Position = Field((0.0, 0.0, 1.0), description="the direction in which it gets thinner, with `height`")
    scattering: Scattering | None = Field(
        None, description="shafts of light: what the fog scatters of each light; null: `color` alone"
    )
    background: bool = Field(True, description="whether the fog also covers the background")

    @model_validator(mode="after")
    def _has_an_up(self) -> Self:
        if length(self.up) < 1e-12:
            raise problem("must not be zero", "up")
        return self
