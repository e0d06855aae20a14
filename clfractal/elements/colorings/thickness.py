"""How thick the set is."""

from clfractal.schema.quantity import ColoringKind


class ThicknessColoring(ColoringKind):
    """from where `along` enters the set to where it leaves it, scene units"""

    place = 80
    known = "by_formula"
    keys = ("along", "step")
    ways = ("view", "normal")
    unit = "scene units"
    usual_scale = "0.5 to 5"
