"""Anaglyphs: two pictures in one, for an eye each behind its own coloured filter.

A pixel of the anaglyph is L @ left + R @ right: two 3 x 3 matrices on columns of linear Rec. 709. A filter passes some of
the display's primaries; every other primary that reaches the eye shows it the other eye's picture, as a ghost.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]
Matrix = npt.NDArray[np.float64]
Filter = tuple[float, float, float]
"""The part of the light of the display's red, green and blue that passes."""
Method = Literal["color", "half_color", "gray", "dubois"]
Glasses = Literal["red_cyan", "green_magenta", "amber_blue"]

IDEAL: dict[Glasses, tuple[Filter, Filter]] = {
    "red_cyan": ((1.0, 0.0, 0.0), (0.0, 1.0, 1.0)),
    "green_magenta": ((0.0, 1.0, 0.0), (1.0, 0.0, 1.0)),
    "amber_blue": ((1.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
}
"""Filters for the left and the right eye that pass each primary as a whole or not at all."""

LUMINANCE: Filter = (0.2126, 0.7152, 0.0722)
"""Of linear Rec. 709: Recommendation ITU-R BT.709-6, item 3.2."""

# Least-squares projection: what the eyes see through the filters comes as near as it can, in CIE XYZ, to what they
# would see of their own pictures without them. Method: E. Dubois, "A projection method to generate anaglyph stereo
# images", ICASSP 2001; figures for liquid crystal displays: his "Conversion of a Stereo Pair to Anaglyph with the
# Least-Squares Projection Method", 2009, and the two for other glasses that he published after it.
_DUBOIS: dict[Glasses, tuple[list[list[float]], list[list[float]]]] = {
    "red_cyan": (
        [[0.437, 0.449, 0.164], [-0.062, -0.062, -0.024], [-0.048, -0.050, -0.017]],
        [[-0.011, -0.032, -0.007], [0.377, 0.761, 0.009], [-0.026, -0.093, 1.234]],
    ),
    "green_magenta": (
        [[-0.062, -0.158, -0.039], [0.284, 0.668, 0.143], [-0.015, -0.027, 0.021]],
        [[0.529, 0.705, 0.024], [-0.016, -0.015, -0.065], [0.009, 0.075, 0.937]],
    ),
    "amber_blue": (
        [[1.062, -0.205, 0.299], [-0.026, 0.908, 0.068], [-0.038, -0.173, 0.022]],
        [[-0.016, -0.123, -0.017], [0.006, 0.062, -0.017], [0.094, 0.185, 0.911]],
    ),
}

# Larger and infinite numbers are replaced by this one: it is far brighter than any light, and sums of it are finite.
_LIGHTEST = np.float32(1e30)


def matrices(method: Method, glasses: Glasses) -> tuple[Matrix, Matrix]:
    """What is made of the left and of the right eye's colour, each of shape (3, 3); white becomes white.

    - color: each primary from the eye whose filter passes it.
    - half_color: the same, but the eye whose filter passes one primary alone gets its luminance there.
    - gray: each eye gets its luminance, in the primaries that its filter passes.
    - dubois: the least-squares projection, see above; negative coefficients make up for what filters leak.
    """
    if method == "dubois":
        left, right = (np.array(matrix) for matrix in _DUBOIS[glasses])
        # The published figures have three digits: without this, white would be 0.999 in some primary.
        sums = (left + right).sum(axis=1, keepdims=True)
        return left / sums, right / sums
    found = []
    for passed in IDEAL[glasses]:
        one_primary = sum(passed) == 1
        by_luminance = method == "gray" or (method == "half_color" and one_primary)
        found.append(np.outer(passed, LUMINANCE) if by_luminance else np.diag(passed))
    return found[0], found[1]


def mix(left: Floats, right: Floats, by: tuple[Matrix, Matrix]) -> Floats:
    """The anaglyph of two pictures of one shape (..., 3), linear Rec. 709; nothing is darker than black.

    NaN counts as 0 and an infinite number as a very large one, so that the result is finite.
    """
    pictures = (_limited(left), _limited(right))
    result: Floats = np.zeros_like(left, np.float32)  # in memory as `left` is: planes stay planes
    product = np.empty(left.shape[:-1], np.float32)
    for row in range(3):
        total = result[..., row]
        for picture, matrix in zip(pictures, by, strict=True):
            for column in np.flatnonzero(matrix[row]):
                np.multiply(picture[..., column], np.float32(matrix[row, column]), out=product)
                total += product
    np.maximum(result, np.float32(0), out=result)
    return result


def _limited(picture: Floats) -> Floats:
    """Numbers within +-`_LIGHTEST`, and no NaN."""
    # Nearly every picture is within the limits, so two quick comparisons come first; NaN fails both.
    if picture.size == 0 or (picture.min() >= -_LIGHTEST and picture.max() <= _LIGHTEST):
        return picture
    return np.clip(np.where(np.isnan(picture), np.float32(0), picture), -_LIGHTEST, _LIGHTEST)
