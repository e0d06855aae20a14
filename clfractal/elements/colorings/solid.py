"""The material's own colour."""

from typing import Any

from clfractal.schema.quantity import ColoringKind


class SolidColoring(ColoringKind):
    """material.color"""

    title = "One colour"
    place = 10
    of_maps = uses_palette = False
    of_material = True

    @staticmethod
    def own_colors(normals: Any, plain: Any) -> Any:
        """As of every kind."""
        return plain
