"""The way that the surface faces."""

from typing import Any

from clfractal.schema.quantity import ColoringKind


class NormalColoring(ColoringKind):
    """the normal's x, y, z as red, green, blue, from -1..1 to 0..1; of maps its part along `direction`"""

    place = 20
    keys = ("direction",)
    uses_palette = False
    of_volumes = of_surface = True
    low = -1.0
    hint = "The normal's x, y and z as red, green and blue."

    @staticmethod
    def own_colors(normals: Any, plain: Any) -> Any:
        """As of every kind."""
        half = normals.dtype.type(0.5)
        return half + half * normals
