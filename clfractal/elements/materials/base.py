"""The body of a material."""

from pydantic import Field

from clfractal.schema.mapped import FractionMap, ReflectanceMap
from clfractal.schema.material import Part


class Base(Part):
    """The body: diffuse, or a metal."""

    place = 10
    zero_if_matt = ("metalness", "diffuse_roughness")
    weight: FractionMap = Field(1.0, description="factor on the colour")
    color: ReflectanceMap | None = Field(
        None, description="linear Rec. 709; null: the colouring's, or `material.color`"
    )
    metalness: FractionMap = Field(0.0, description="0: a dielectric, 1: a metal")
    diffuse_roughness: FractionMap = Field(0.0, description="of the diffuse body; 0: Lambert's")
