"""A film as thin as waves of light are long, on the boundary of the body."""

from typing import Annotated

from pydantic import Field, Tag

from clfractal.schema.fields import Usual
from clfractal.schema.mapped import FORM, FractionMap, NumberMap
from clfractal.schema.material import IorMap, Part

Thickness = Annotated[float, Field(strict=True, ge=0, le=1000, allow_inf_nan=False)]
ThicknessMap = Annotated[Annotated[Thickness, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]


class ThinFilm(Part):
    """A film on the boundary of the body, under the coat, whose colours are those of interference: soap, oil, oxides."""

    place = 25
    costly = ("weight",)
    counts_by_weight = True
    weight: FractionMap = Field(0.0, description="part of the surface that has it")
    thickness: Annotated[ThicknessMap, Usual(0, 1)] = Field(
        0.5, description="micrometres; one of several has hardly any colour"
    )
    ior: Annotated[IorMap, Usual(1, 3)] = Field(1.4, description="index of refraction")
