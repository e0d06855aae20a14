"""Colours of any primaries and white as linear Rec. 709."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

_STRONGEST = 100.0  # largest factor between primaries that are still colours
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
_REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # ITU-R BT.709-6, items 1.3 and 1.4

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]


def in_rec709(pixels: Floats, given: object) -> Floats:
    """Colours of the primaries and white that a header names, in those of Rec. 709, adapted to its white.

    Args:
        given: x and y of red, green, blue and white. Anything else, and what are no colours, says nothing.
    """
    if not isinstance(given, tuple) or np.allclose(given, _REC709, atol=2e-3):
        return pixels
    if not np.isfinite(given).all() or given[7] <= 0:
        return pixels  # without a white point the header cannot be used
    try:
        matrix = np.linalg.solve(_to_xyz(_REC709), _adaptation(given) @ _to_xyz(given))
    except np.linalg.LinAlgError:
        return pixels
    if not np.isfinite(matrix).all() or np.abs(matrix).max() > _STRONGEST:
        return pixels
    return np.ascontiguousarray(pixels @ matrix.T.astype(np.float32))


def from_xyz(pixels: Floats) -> Floats:
    """CIE XYZ as Rec. 709."""
    return np.ascontiguousarray(pixels @ np.linalg.inv(_to_xyz(_REC709)).T.astype(np.float32))


def _to_xyz(chromaticities: tuple[float, ...]) -> Doubles:
    """The matrix from RGB to CIE XYZ, the white's Y being 1 (SMPTE RP 177-1993)."""
    x, y = np.array(chromaticities[0::2]), np.array(chromaticities[1::2])
    columns = np.stack([x, y, 1 - x - y])
    white = columns[:, 3] / y[3]
    primaries = columns[:, :3]
    return primaries * np.linalg.solve(primaries, white)


def _adaptation(chromaticities: tuple[float, ...]) -> Doubles:
    """From a file's white to that of Rec. 709, by the Bradford transform (ICC.1:2010, annex E)."""
    whites = [
        _BRADFORD @ np.array([x / y, 1.0, (1 - x - y) / y]) for x, y in (chromaticities[6:], _REC709[6:])
    ]
    return np.linalg.solve(_BRADFORD, np.diag(whites[1] / whites[0]) @ _BRADFORD)
