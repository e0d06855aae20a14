"""How far the surface of another count is."""

from clfractal.schema.quantity import ColoringKind


class LayerDistanceColoring(ColoringKind):
    """from the surface to the surface after `layer` iterations, scene units"""

    title = "Distance to a layer"
    place = 90
    known = "by_formula"
    keys = ("along", "step", "layer")
    unit = "scene units"
    usual_scale = "1 to 20"
