"""Lights on the set, of which kernels read a list (`kernels/shading/set_lights.h`)."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from clfractal.schema.ball import Ball
from clfractal.schema.base import Amount, Length
from clfractal.schema.light import LightBase
from clfractal.schema.stops import Palette
from clfractal.schema.trap import Trap

MAX_PLACES = 20_000


class SetLight(LightBase):
    """Small balls that stand on the set, where its orbits come near a trap; each shows `intensity` times the colour.

    They are for surface renderers.
    """

    about = "of many balls on the set"
    place = 60
    is_seen = True
    beside = ("within", "palette")
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

    def controls(self, radius: float) -> Mapping[str, Mapping[str, Any]]:
        """As of every light."""
        small = float(f"{radius / 200:.2g}")
        return {
            "spacing": {"auto": "even", "start": 4 * small},
            "radius": {"auto": "1/200 of the bounds", "start": small},
            "height": {"auto": "radius", "start": small},
        }

    @property
    def used_rays(self) -> int:
        """Shadow rays per sample, each to one of them."""
        return self.rays if self.rays is not None else 8
