"""How much the surface bulges."""

from clfractal.schema.quantity import ColoringKind


class CurvatureColoring(ColoringKind):
    """the mean curvature over `step`, one over scene units, above 0 on hills"""

    place = 70
    known = "by_formula"
    keys = ("step",)
    of_scenes = False
