"""How far along a direction."""

from clfractal.schema.quantity import ColoringKind


class HeightColoring(ColoringKind):
    """the place along `direction`"""

    place = 50
    keys = ("direction",)
    of_scenes = False
