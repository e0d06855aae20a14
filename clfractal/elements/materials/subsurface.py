"""A medium below the boundary."""

from pydantic import Field

from clfractal.schema.mapped import FractionMap, ReflectanceMap
from clfractal.schema.material import DepthMap, ForwardMap, Part


class Subsurface(Part):
    """A medium below the boundary, in the place of the diffuse body: skin, wax, marble."""

    place = 60
    counts_by_weight = True
    weight: FractionMap = Field(0.0, description="part of the diffuse body that light goes into")
    color: ReflectanceMap = Field(
        (0.8, 0.8, 0.8), description="what comes out of a thick body in all, linear Rec. 709"
    )
    radius: DepthMap = Field(
        0.1, description="how far light goes between two scatterings, in the mean, scene units"
    )
    radius_scale: ReflectanceMap = Field(
        (1.0, 0.5, 0.25), description="factor on the radius for red, green and blue"
    )
    scatter_anisotropy: ForwardMap = Field(
        0.0, description="where light is sent: 0 all around, 0.99 straight on, below 0 back"
    )
