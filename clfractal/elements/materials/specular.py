"""What the boundary of the body mirrors."""

from typing import Annotated

from pydantic import Field

from clfractal.schema.base import Direction
from clfractal.schema.fields import Usual
from clfractal.schema.mapped import FractionMap, ReflectanceMap
from clfractal.schema.material import WHITE, IorMap, Part


class Specular(Part):
    """What the body's boundary mirrors."""

    place = 20
    costly = ("anisotropy",)
    weight: FractionMap = Field(1.0, description="factor on the reflectance of a dielectric, straight on")
    color: ReflectanceMap = Field(WHITE, description="a dielectric's tint; a metal's at its edges")
    roughness: FractionMap = Field(0.3, description="0: a mirror, 1: no highlight")
    anisotropy: FractionMap = Field(
        0.0,
        description="OpenPBR's roughness anisotropy: how far highlights, and light through rough glass, are drawn out along"
        " `tangent`; 0: even; seen along paths",
    )
    tangent: Direction = Field(
        (1.0, 0.0, 0.0),
        description="direction in space, laid onto the surface, in which highlights are drawn out: across brush marks",
    )
    ior: Annotated[IorMap, Usual(1, 3)] = Field(1.5, description="index of refraction of a dielectric")
