"""What a formula carries beside z."""

from clfractal.schema.quantity import ColoringKind


class CarriedColoring(ColoringKind):
    """a number of the formula's `state`, as it is when the orbit ends"""

    title = "Carried number"
    place = 110
    known = "by_formula"
    keys = ("number",)
    of_objects = True
    unit = "the formula's own"
    usual_scale = "0.1 to 5"
