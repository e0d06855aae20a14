"""How uneven the surface is within a pixel."""

from clfractal.schema.quantity import ColoringKind


class ResidualColoring(ColoringKind):
    """how far the pixel's points are from the plane fitted to them, in footprints"""

    title = "Roughness (residual)"
    place = 40
    known = "with_points"
    of_maps = False
    least_points = 4
    unit = "pixel footprints"
    usual_scale = "1 to 5"
