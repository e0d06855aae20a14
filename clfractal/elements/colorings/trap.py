"""How near an orbit comes to a shape."""

from clfractal.schema.quantity import ColoringKind


class TrapColoring(ColoringKind):
    """the smallest distance of the orbit from a shape"""

    title = "Orbit trap"
    place = 100
    known = "by_formula"
    keys = ("trap",)
    of_objects = True
    unit = "the unit of z"
    usual_scale = "0.5 to 5"
