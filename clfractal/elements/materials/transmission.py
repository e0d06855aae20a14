"""Glass in the place of the diffuse body."""

from typing import Annotated

from pydantic import Field, Tag

from clfractal.schema.base import problem, rule
from clfractal.schema.mapped import FORM, FractionMap, NumberMap, ReflectanceMap
from clfractal.schema.material import BLACK, WHITE, DepthMap, ForwardMap, Part

Abbe = Annotated[float, Field(strict=True, ge=1, le=1000, allow_inf_nan=False)]
AbbeMap = Annotated[Annotated[Abbe, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]


class Transmission(Part):
    """Glass in the place of the diffuse body; its roughness is that of `specular`."""

    place = 50
    counts_by_weight = True
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

    @rule
    def _deep_enough(self) -> None:
        if self.scatter != BLACK and self.depth == 0:
            raise problem("needs a depth above 0: scattering is told for the way through it", "scatter")
