"""Reads environment maps: pictures of everything around, by latitude and longitude.

The top row looks straight up, the bottom row straight down; from left to right the columns go around once,
and the picture's middle is straight ahead (kernels/shading/environment.h says how that lies in a scene). Pixels are
areas: the middle of the first column stands half a pixel right of the picture's left side. OpenEXR's own
words (ImfEnvmap.h) put the middles of the outermost pixels on the sides and poles; maps are not made like
that, and the difference is half a pixel.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.files.atomic import ContentError
from clfractal.files.picture import read_picture

MAX_WIDTH = 16_384
BRIGHTEST = 1e9
"""Of a pixel: sums of brighter ones would leave the range of float32."""

Floats = npt.NDArray[np.float32]


def read_environment(path: str | Path, *, stretch: bool = False) -> Floats:
    """The pixels of a latitude-longitude map, shape (height, 2 height, 3): linear Rec. 709, finite, none below 0.

    Where a picture is transparent it brings no light.

    Args:
        stretch: a picture of any shape will do, (height, width, 3).

    Raises:
        FileError: it cannot be read, is no picture or a damaged one, or no such map.
    """

    def check(width: int, height: int) -> None:
        if not stretch and (width < 1 or width != 2 * height):
            raise ContentError(
                "must be twice as wide as high, as latitude-longitude maps are, "
                f"got {width} x {height} pixels; stretch: true takes any shape"
            )
        if width > MAX_WIDTH:
            raise ContentError(f"is too large: {width:,} pixels wide, at most {MAX_WIDTH:,}")
        if height > MAX_WIDTH // 2:
            raise ContentError(f"is too large: {height:,} pixels high, at most {MAX_WIDTH // 2:,}")
        if width < 1 or height < 1:
            raise ContentError(f"has no pixels: {width} x {height}")

    return read_picture(path, check, BRIGHTEST).on_black
