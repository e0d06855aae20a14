"""Colours by escape counts, as `kernels/shading/escape_colors.h` reads them."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clfractal.device.structs import Field
from clfractal.scene.cut_plane import EscapeColors

ESCAPE_COLORS = [
    Field("inverse_limit", "real", 0, "one over the most applications, or over their logarithm"),
    Field("scale", "real", 0, "palettes from count 0 to the limit"),
    Field("offset", "real", 0, "start in the palette"),
    Field("inside", "real", 3, "linear Rec. 709"),
    Field("repeat", "int", 0, "1: the palette begins again after its end; 0: its ends go on"),
    Field("curve", "int", 0, "CURVE_LINEAR, CURVE_ROOT or CURVE_LOG"),
]

CURVES = ("linear", "root", "log")


def escape_colors_values(colors: EscapeColors, iterations: int) -> dict[str, object]:
    """The fields of the colours of counts up to `iterations`."""
    # With a limit of 1 every count is 1, whose logarithm is 0.
    divisor = math.log(max(iterations, 2)) if colors.curve == "log" else iterations
    return {
        "inverse_limit": 1 / divisor,
        "scale": colors.scale,
        "offset": colors.offset,
        "inside": colors.inside,
        "repeat": int(colors.repeat),
        "curve": CURVES.index(colors.curve),
    }


def escape_palette(colors: EscapeColors) -> npt.NDArray[np.float32]:
    """The palette, shape (256, 3), linear Rec. 709.

    Raises:
        SceneError: no palette has its name.
    """
    from clfractal.scene.palette import named_table

    return np.ascontiguousarray(named_table(colors.palette), np.float32)
