"""A clear layer over the body."""

from typing import Annotated

from pydantic import Field

from clfractal.schema.fields import Usual
from clfractal.schema.mapped import FractionMap, ReflectanceMap
from clfractal.schema.material import WHITE, IorMap, Part


class Coat(Part):
    """A clear layer over the body."""

    place = 30
    counts_by_weight = True
    weight: FractionMap = Field(0.0, description="part of the surface that has it")
    color: ReflectanceMap = Field(WHITE, description="what passes through it, there and back")
    roughness: FractionMap = Field(0.0, description="of its highlight")
    ior: Annotated[IorMap, Usual(1, 3)] = Field(1.6, description="index of refraction")
    darkening: FractionMap = Field(
        1.0, description="how much the body is darkened by light that the coat throws back to it"
    )
