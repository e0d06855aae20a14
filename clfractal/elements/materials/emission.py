"""Light of a material's own."""

from typing import Annotated, Any

from pydantic import Field, Tag

from clfractal.schema.base import Color
from clfractal.schema.fields import Usual
from clfractal.schema.mapped import FORM, AmountMap, ColorMap, Map
from clfractal.schema.material import WHITE, Part

ShineMap = Annotated[Annotated[Color, Tag("given")] | Annotated[ColorMap, Tag("map")], FORM]


class Emission(Part):
    """Light of the material's own."""

    place = 70
    zero_if_matt = ("luminance",)
    luminance: Annotated[AmountMap, Usual(0, 4)] = Field(0.0, description="radiance, as of `background`")
    color: ShineMap = Field(WHITE, description="factor on the luminance, linear Rec. 709")

    def packed(self) -> dict[str, Any]:
        """Where both are the same everywhere, the colour is the light's, and the luminance a factor that says nothing."""
        if isinstance(self.luminance, Map) or isinstance(self.color, Map):
            return super().packed()
        return {"luminance": 1.0, "color": tuple(self.luminance * part for part in self.color)}
