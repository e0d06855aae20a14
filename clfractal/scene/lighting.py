"""What lights a scene: lights, an environment, and the fog between the eye and the surface."""

from typing import Annotated, Literal, Self

from pydantic import Field, Tag, model_validator

from clfractal.scene.base import Amount, Color, Position, Section, chosen_by, length, problem

MAX_LIGHTS = 64


class LightBase(Section):
    """What every light has."""

    color: Color = Field((1.0, 1.0, 1.0), description="linear Rec. 709")
    intensity: Amount = Field(1.0, description="factor on the colour")
    shadow: bool = Field(True, description="whether it is blocked by the set")
    angular_size: float = Field(
        0.0, ge=0, le=170, description="its diameter as the surface sees it, degrees; 0 makes hard shadows"
    )
    rays: Annotated[int, Field(strict=True, ge=1, le=1024)] | None = Field(
        None, description="rays of a soft shadow, for each sample, 8 if null; a hard one takes one"
    )

    @property
    def used_rays(self) -> int:
        """Shadow rays for each sample: all of a hard shadow's would be the same."""
        if self.angular_size == 0:
            return 1
        return self.rays if self.rays is not None else 8


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
Lights = Annotated[tuple[Light, ...], Field(strict=False, max_length=MAX_LIGHTS)]

MapName = Annotated[str, Field(strict=True, min_length=1, max_length=1000)]


class Environment(Section):
    """A picture of everything around, infinitely far away: it lights the set, is mirrored by it and seen past it."""

    name: MapName | None = Field(None, description="a map that travels with the program")
    file: MapName | None = Field(
        None, description="a latitude-longitude EXR picture, in the scene's folder or below"
    )
    intensity: Amount = Field(1.0, description="factor on its light")
    rotation: float = Field(0.0, ge=-360, le=360, description="turns it about the z axis, degrees")
    background: bool = Field(True, description="whether it is seen past the set; else the background is")
    rays: int = Field(
        8, ge=0, le=1024, description="rays for its light, for each sample; 0: it lights nothing"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if self.name is None and self.file is None:
            raise problem("needs one of name or file")
        if self.name is not None and self.file is not None:
            raise problem("cannot stand beside name: give one of name or file", "file")
        return self


class Fog(Section):
    """Light lost on the way to the eye, and the fog's own colour in its place: exponential with distance."""

    color: Color = Field((0.5, 0.55, 0.6), description="linear Rec. 709")
    density: float = Field(
        0.1, ge=0, le=1e6, description="per scene unit: exp(-density * distance) of the light comes through"
    )
    background: bool = Field(True, description="whether it covers what is seen past the set")
