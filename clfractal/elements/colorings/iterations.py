"""How often the formula is applied."""

from clfractal.schema.quantity import ColoringKind


class IterationsColoring(ColoringKind):
    """the smooth escape count"""

    place = 30
    of_surface = True
    counts_applications = True
    unit = "applications"
    usual_scale = "0.02 to 0.2"
