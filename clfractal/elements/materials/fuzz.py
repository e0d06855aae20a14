"""Short fibres over everything."""

from typing import Annotated

from pydantic import Field, Tag

from clfractal.schema.mapped import FORM, FractionMap, NumberMap, ReflectanceMap
from clfractal.schema.material import WHITE, Part

Stand = Annotated[float, Field(strict=True, ge=0.25, le=1, allow_inf_nan=False)]
StandMap = Annotated[Annotated[Stand, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]


class Fuzz(Part):
    """Short fibres over everything: dust, velvet."""

    place = 40
    counts_by_weight = True
    weight: FractionMap = Field(0.0, description="how dense they are")
    color: ReflectanceMap = Field(WHITE, description="linear Rec. 709")
    roughness: StandMap = Field(
        0.5, description="how far they stand apart: the larger, the less light gathers at the rim"
    )
