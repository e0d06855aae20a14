"""What lights a scene: lights, an environment, and the fog between the eye and the surface."""

from typing import TYPE_CHECKING, Annotated, TypeAlias

from pydantic import Field

from clfractal.schema.base import (
    Amount,
    Color,
    Coordinate,
    Direction,
    Length,
    Reflectance,
    Section,
    check_one_of,
    problem,
    rule,
)
from clfractal.schema.fields import Usual
from clfractal.schema.kinds import members, one_of
from clfractal.schema.light import LightBase

MAX_LIGHTS = 4096
"""Most lights of a scene."""
MAX_ASKED = 64
"""Most of those that are all asked at each place: with `lighting.mode: direct`."""

# Kinds of lights are what the folder holds.
if TYPE_CHECKING:
    Light: TypeAlias = LightBase
else:
    Light = one_of(members("lights"), "type", "directional")
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
        None, description="a picture in latitude and longitude, in the scene's folder or below"
    )
    sky: Sky | None = Field(None, description="a physical sky")
    intensity: Annotated[Amount, Usual(0, 4)] = Field(1.0, description="factor on the environment's light")
    rotation: Annotated[float, Usual(-180, 180)] = Field(
        0.0, ge=-360, le=360, description="rotation of the environment about `up`, degrees"
    )
    up: Direction = Field((0.0, 0.0, 1.0), description="where the picture's top is; a sky's is +z")
    mirrored: bool = Field(False, description="true: left and right of the picture change places")
    stretch: bool = Field(
        False, description="true: a `file` of any shape is stretched; false: it is twice as wide as high"
    )
    background: bool = Field(
        True, description="true: visible behind the set; false: `background` is visible there"
    )
    rays: Annotated[int, Usual(0, 64)] = Field(
        8, ge=0, le=1024, description="rays per sample for the environment's light; 0: it lights nothing"
    )

    @property
    def has_sun(self) -> bool:
        """Whether the sun's disc stands before the map."""
        return self.sky is not None and self.sky.sun

    @property
    def is_upright(self) -> bool:
        """Whether the picture's top is at +z, however long that direction is."""
        return self.up[0] == self.up[1] == 0 and self.up[2] > 0

    @rule
    def _one_source(self) -> None:
        check_one_of(self, "name", "file", "sky")
        if self.sky is not None and not self.is_upright:
            raise problem("must be [0, 0, 1] with sky: its ground is level", "up")
        if self.sky is not None and self.mirrored:
            raise problem("cannot be combined with sky: turn that by sun_azimuth", "mirrored")
        if self.stretch and self.file is None:
            raise problem("needs a file", "stretch")


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
    density: Annotated[float, Usual(0.001, 10)] = Field(
        0.1, ge=0, le=1e6, description="per scene unit; the fraction exp(-density * distance) of light passes"
    )
    height: Length | None = Field(
        None,
        description="how much higher the density is 1/e, about a third, scene units; null: it is the same everywhere",
    )
    base: Coordinate = Field(
        0.0, description="how far up from the origin the fog has this density, with `height`, scene units"
    )
    up: Direction = Field(
        (0.0, 0.0, 1.0), description="the direction in which it gets thinner, with `height`"
    )
    scattering: Scattering | None = Field(
        None, description="shafts of light: what the fog scatters of each light; null: `color` alone"
    )
    background: bool = Field(True, description="whether the fog also covers the background")
