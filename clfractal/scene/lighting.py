"""What lights a scene: lights, an environment, and the fog between the eye and the surface."""

from typing import Annotated, Literal, Self

from pydantic import Field, Tag, model_validator

from clfractal.scene.base import Amount, Color, Position, Reflectance, Section, chosen_by, length, problem

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


class Sky(Section):
    """A clear sky over level ground by its physics: molecules, aerosol and ozone scatter the sun's light.

    Its azimuths are those of maps: 0 is +y, 90 is +x.
    """

    sun_elevation: float = Field(45.0, ge=-6, le=90, description="of the sun over the horizon, degrees")
    sun_azimuth: float = Field(
        0.0, ge=-36_000, le=36_000, description="of the sun, from +y towards +x, degrees"
    )
    turbidity: float = Field(
        3.0, ge=1, le=10, description="haze: 1 is air without dust, 2 is clear, 8 is hazy"
    )
    ground_color: Reflectance = Field((0.25, 0.24, 0.22), description="linear Rec. 709")
    sun: bool = Field(True, description="whether the sun's disc is there; false: the sky's own light only")


class Environment(Section):
    """A picture of everything around, infinitely far away; it lights the set, and is seen in mirrors and behind the set."""

    name: MapName | None = Field(None, description="an environment map that comes with the program")
    file: MapName | None = Field(
        None, description="a latitude-longitude EXR picture, in the scene's folder or below"
    )
    sky: Sky | None = Field(None, description="a physical sky")
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
        given = [key for key in ("name", "file", "sky") if getattr(self, key) is not None]
        if not given:
            raise problem("needs one of name, file or sky")
        if len(given) > 1:
            raise problem(f"cannot be combined with {given[0]}: give one of name, file or sky", given[1])
        return self


class Fog(Section):
    """Fog absorbs light on its way to the eye and replaces it by its own colour, exponentially with distance."""

    color: Color = Field((0.5, 0.55, 0.6), description="linear Rec. 709")
    density: float = Field(
        0.1, ge=0, le=1e6, description="per scene unit; the fraction exp(-density * distance) of light passes"
    )
    background: bool = Field(True, description="whether the fog also covers the background")
