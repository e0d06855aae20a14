"""How far from a place."""

from clfractal.schema.quantity import ColoringKind


class DistanceColoring(ColoringKind):
    """that from `center`, scene units"""

    place = 60
    keys = ("center",)
    of_scenes = False
