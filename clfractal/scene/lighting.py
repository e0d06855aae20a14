"""What lights a scene: lights, an environment, and the fog between the eye and the surface."""

from typing import Annotated, Literal, Self

from pydantic import Field, Tag, model_validator

from clfractal.schema.ball import Ball
from clfractal.schema.base import (
    Amount,
    Color,
    Coordinate,
    Direction,
    Fraction,
    Length,
    Position,
    Reflectance,
    Section,
    Vector,
    chosen_by,
    cross,
    length,
    problem,
    unit,
)
from clfractal.schema.fields import Usual
from clfractal.schema.stops import Palette, check_order
from clfractal.schema.temperature import black_body
from clfractal.schema.trap import Trap

MAX_LIGHTS = 64
MAX_PLACES = 20_000


class LightBase(Section):
    """Keys that every light has."""

    color: Color = Field((1.0, 1.0, 1.0), description="linear Rec. 709")
    temperature: Annotated[float, Field(strict=True, ge=1000, le=40000), Usual(1500, 12000)] | None = Field(
        None,
        description="kelvin: the colour of a black body, of luminance 1, in place of `color`; null: `color`",
    )
    intensity: Annotated[Amount, Usual(0, 4)] = Field(1.0, description="factor on the colour")
    shadow: bool = Field(True, description="whether the set blocks this light")
    rays: Annotated[int, Field(strict=True, ge=1, le=1024), Usual(1, 64)] | None = Field(
        None, description="shadow rays per sample for a soft shadow; null: 8. A hard shadow takes one"
    )

    @model_validator(mode="after")
    def _one_color(self) -> Self:
        if self.temperature is not None and self.color != (1.0, 1.0, 1.0):
            raise problem("cannot be combined with color: give one of color or temperature", "temperature")
        return self

    @property
    def used_color(self) -> Vector:
        """Linear Rec. 709: the light's own colour, or that of its temperature."""
        return self.color if self.temperature is None else black_body(self.temperature)

    @property
    def has_size(self) -> bool:
        """Whether its light comes from more than one direction, so that shadows are soft."""
        return True

    @property
    def used_rays(self) -> int:
        """Shadow rays per sample: one for a hard shadow, because further rays would be the same."""
        if not self.has_size:
            return 1
        return self.rays if self.rays is not None else 8


class SmallLight(LightBase):
    """A light that has one direction at each place, or about one."""

    angular_size: Annotated[float, Usual(0, 45)] = Field(
        0.0,
        ge=0,
        le=170,
        description="diameter of the light as seen from the surface, degrees; 0: hard shadows",
    )

    @property
    def has_size(self) -> bool:
        """Whether shadows are soft."""
        return self.angular_size > 0


class DirectionalLight(SmallLight):
    """Light from infinitely far away."""

    tag = "directional"
    type: Literal["directional"] = "directional"
    direction: Direction = Field((-1.0, 1.0, -1.0), description="direction in which the light travels")

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Self:
        if length(self.direction) < 1e-12:
            raise problem("must not be zero", "direction")
        return self


class PointLight(SmallLight):
    """Light from a point."""

    tag = "point"
    type: Literal["point"] = "point"
    position: Position = Field(description="scene units")
    falloff: Literal["none", "inverse_square"] = Field(
        "none", description="how the light weakens with distance"
    )


class SpotLight(SmallLight):
    """Light from a point into a cone."""

    tag = "spot"
    type: Literal["spot"] = "spot"
    position: Position = Field(description="scene units")
    direction: Direction = Field(
        (0.0, 0.0, -1.0), description="axis of the cone, along which the light travels"
    )
    angle: float = Field(40.0, gt=0, le=180, description="full angle of the cone, degrees")
    softness: Fraction = Field(
        0.2, description="part of the cone's half angle over which the light fades at its rim; 0: a sharp rim"
    )
    falloff: Literal["none", "inverse_square"] = Field(
        "inverse_square", description="how the light weakens with distance"
    )

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Self:
        if length(self.direction) < 1e-12:
            raise problem("must not be zero", "direction")
        return self


class SphereLight(LightBase):
    """A ball that shines evenly; `intensity` times the colour is the radiance that it shows."""

    tag = "sphere"
    type: Literal["sphere"] = "sphere"
    position: Position = Field(description="its centre, scene units")
    radius: Length = Field(0.1, description="scene units")
    visible: bool = Field(True, description="whether the eye sees it; mirrors and paths of light always do")


class RectangleLight(LightBase):
    """A rectangle that shines on one side; `intensity` times the colour is the radiance that it shows."""

    tag = "rectangle"
    type: Literal["rectangle"] = "rectangle"
    position: Position = Field(description="its middle, scene units")
    direction: Direction = Field((0.0, 0.0, -1.0), description="where its shining side looks to")
    up: Direction = Field((0.0, 1.0, 0.0), description="about along its height; not along `direction`")
    width: Length = Field(1.0, description="scene units")
    height: Length = Field(1.0, description="scene units")
    visible: bool = Field(True, description="whether the eye sees it; mirrors and paths of light always do")

    @model_validator(mode="after")
    def _has_a_frame(self) -> Self:
        if length(self.direction) < 1e-12:
            raise problem("must not be zero", "direction")
        if length(self.up) < 1e-12:
            raise problem("must not be zero", "up")
        if length(cross(unit(self.direction), unit(self.up))) < 1e-6:
            raise problem("must not be along direction", "up")
        return self

    @property
    def frame(self) -> tuple[Vector, Vector]:
        """Directions of its width and of its height, length 1."""
        side = unit(cross(self.direction, self.up))
        return side, unit(cross(side, self.direction))


class SetLight(LightBase):
    """Small balls that stand on the set, where its orbits come near a trap; each shows `intensity` times the colour."""

    tag = "set"
    type: Literal["set"] = "set"
    intensity: Amount = Field(1.0, description="factor on the colour")
    trap: Trap = Field(
        default_factory=dict,
        validate_default=True,
        description="the shape near which orbits of its places come",
    )
    threshold: Length = Field(0.1, description="largest distance of an orbit from the trap")
    count: Annotated[int, Field(strict=True, ge=1, le=MAX_PLACES)] = Field(
        2000, description="most of these balls; fewer if `spacing` leaves room for fewer"
    )
    spacing: Length | None = Field(
        None, description="least distance between two, scene units; null: as far apart as so many can be"
    )
    within: Ball | None = Field(None, description="ball in which they stand; null: the bounds")
    radius: Length | None = Field(
        None, description="of each ball, scene units; null: 1/200 of the bounds' radius"
    )
    height: Length | None = Field(
        None,
        description="of their middles over the surface, scene units; null: the radius, so that they lie on it",
    )
    palette: Palette | None = Field(
        None, description="colours, times `color`, by the orbit's distance over the threshold; null: `color`"
    )
    visible: bool = Field(True, description="whether the eye sees them; mirrors and paths of light always do")
    seed: Annotated[int, Field(strict=True, ge=0, le=2**32 - 1)] = Field(0, description="chooses the places")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.palette is not None:
            check_order(self.palette)
        return self

    @property
    def used_rays(self) -> int:
        """Shadow rays per sample, each to one of them."""
        return self.rays if self.rays is not None else 8


PlacedLight = PointLight | SpotLight | SphereLight | RectangleLight
Light = Annotated[
    Annotated[DirectionalLight, Tag("directional")]
    | Annotated[PointLight, Tag("point")]
    | Annotated[SpotLight, Tag("spot")]
    | Annotated[SphereLight, Tag("sphere")]
    | Annotated[RectangleLight, Tag("rectangle")]
    | Annotated[SetLight, Tag("set")],
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
        None, description="a latitude-longitude EXR or HDR picture, in the scene's folder or below"
    )
    sky: Sky | None = Field(None, description="a physical sky")
    intensity: Annotated[Amount, Usual(0, 4)] = Field(1.0, description="factor on the environment's light")
    rotation: Annotated[float, Usual(-180, 180)] = Field(
        0.0, ge=-360, le=360, description="rotation of the environment about the z axis, degrees"
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

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        given = [key for key in ("name", "file", "sky") if getattr(self, key) is not None]
        if not given:
            raise problem("needs one of name, file or sky")
        if len(given) > 1:
            raise problem(f"cannot be combined with {given[0]}: give one of name, file or sky", given[1])
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

    @model_validator(mode="after")
    def _has_an_up(self) -> Self:
        if length(self.up) < 1e-12:
            raise problem("must not be zero", "up")
        return self
