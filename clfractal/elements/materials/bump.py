"""A relief that only light sees."""

from typing import Annotated

from pydantic import Field, Tag

from clfractal.schema.base import Coordinate, Length
from clfractal.schema.fields import Usual
from clfractal.schema.mapped import FORM, NumberMap
from clfractal.schema.material import Part

HeightMap = Annotated[Annotated[Coordinate, Tag("given")] | Annotated[NumberMap, Tag("map")], FORM]


class Bump(Part):
    """A relief that only light sees: the surface stays where it is, and its shading normal is that of the relief."""

    place = 80
    zero_if_matt = ()
    at_spots = False
    height: Annotated[HeightMap, Usual(-0.1, 0.1)] = Field(
        0.0, description="of the relief over the surface, scene units; below 0: in it; only slopes are seen"
    )
    width: Annotated[Length, Usual(0.001, 1)] | None = Field(
        None,
        description="least distance over which slopes are measured, scene units; null: a pixel's, or a texture's",
    )
