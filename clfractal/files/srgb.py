"""Linear light to and from the numbers a screen wants: the sRGB transfer function, IEC 61966-2-1, clause 5.2.

Eight bits are too few for a smooth dark gradient: rounding alone would show it as bands. So the
rounding to 8 bits is dithered with a fixed pattern that depends on the pixel's place in the picture
only: a crop of a picture equals the crop's own render. A value that 8 bits hold exactly stays so.
"""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]
Bits = Literal[8, 16]

# The table for 8 bits is indexed by the leading bits of the float itself (exponent and 13 bits of the
# fraction): equally fine, relative to the value, in shadows and lights, and the index costs no arithmetic.
TABLE_SHIFT = 23 - 13
TABLE_LOWEST = int(np.float32(2.0**-16).view(np.int32)) >> TABLE_SHIFT  # below: code 0.05 of 255, taken as 0
TABLE_ONE = int(np.float32(1.0).view(np.int32)) >> TABLE_SHIFT


def encode(linear: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Linear light, 0 to 1, to the sRGB code value, 0 to 1."""
    small = linear <= 0.0031308
    return np.where(small, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)


def decode(code: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """sRGB code value, 0 to 1, to linear light, 0 to 1."""
    return np.where(code <= 0.04045, code / 12.92, ((np.maximum(code, 0.04045) + 0.055) / 1.055) ** 2.4)


@cache
def table8() -> npt.NDArray[np.uint16]:
    """Code values in 1/256 of an 8-bit step (0 to 65280) for every index from `TABLE_LOWEST` to `TABLE_ONE`."""
    steps = 1 << (23 - TABLE_SHIFT)
    index = np.arange(TABLE_LOWEST, TABLE_LOWEST + steps, dtype=np.int32)
    # The middle of each interval of floats that share an index, of the lowest power of 2; the others are multiples, and
    # a product is much less than a root.
    middle = ((index << TABLE_SHIFT) + (1 << (TABLE_SHIFT - 1))).view(np.float32).astype(np.float64)
    octaves = 2.0 ** np.arange((TABLE_ONE - TABLE_LOWEST) // steps)[:, None]
    code = middle ** (1 / 2.4) * (1.055 * octaves ** (1 / 2.4)) - 0.055
    linear = middle * octaves
    np.multiply(linear, 12.92, out=code, where=linear <= 0.0031308)
    code *= 255 * 256
    table = np.empty(code.size + 1, np.uint16)
    table[:-1] = np.rint(code, out=code).reshape(-1)
    table[0], table[-1] = 0, 255 * 256  # the last one is of 1 itself
    return table


@lru_cache(maxsize=4)
def _pattern(columns: int, components: int, left: int) -> npt.NDArray[np.uint16]:
    """Bayer's 16 x 16 ordered dither (Bayer 1973): thresholds for 32 rows, from column `left` on.

    The thresholds, 4 to 251 of 256, keep away from both ends by more than the table's error (below 3),
    so exact values stay exact. Repeated for each component: adding arrays of one shape is faster.
    """
    order = np.zeros((1, 1), dtype=np.int64)
    for _ in range(4):
        order = np.concatenate(
            [
                np.concatenate([4 * order, 4 * order + 2], axis=1),
                np.concatenate([4 * order + 3, 4 * order + 1], axis=1),
            ]
        )
    thresholds = (4 + order * 248 // 256).astype(np.uint16)
    places = (np.arange(columns * components) // components + left) % 16
    return np.tile(thresholds.take(places, axis=1), (2, 1)).reshape(32, columns, components)


def encode8(linear: Floats, *, origin: tuple[int, int] = (0, 0)) -> npt.NDArray[np.uint8]:
    """Linear light to dithered 8-bit sRGB.

    Args:
        linear: shape (rows, columns, components); values are limited to 0..1, NaN counts as 0.
        origin: the picture coordinates (x, y) of the first pixel, which fix the dither pattern.
    """
    rows, columns, components = linear.shape
    pattern = _pattern(columns, components, origin[0] % 16)
    result = np.empty(linear.shape, dtype=np.uint8)
    # In pieces of at most 16 rows, which stay in the processor's cache.
    for first in range(0, rows, 16):
        last = min(first + 16, rows)
        index = np.fmax(linear[first:last], np.float32(0)).view(np.int32)
        np.right_shift(index, TABLE_SHIFT, out=index)
        np.clip(index, TABLE_LOWEST, TABLE_ONE, out=index)
        index -= TABLE_LOWEST
        code = table8().take(index)
        top = (origin[1] + first) % 16
        code += pattern[top : top + last - first]
        code >>= 8
        result[first:last] = code
    return result


def encode16(linear: Floats) -> npt.NDArray[np.uint16]:
    """Linear light to 16-bit sRGB, rounded to nearest; values are limited to 0..1, NaN counts as 0."""
    limited = np.fmin(np.fmax(linear, np.float32(0)), np.float32(1))
    small = limited <= np.float32(0.0031308)
    code = np.maximum(limited, np.float32(0.0031308)) ** np.float32(1 / 2.4)
    code *= np.float32(1.055 * 65535)
    code -= np.float32(0.055 * 65535)
    np.multiply(limited, np.float32(12.92 * 65535), out=code, where=small)
    return np.rint(code).astype(np.uint16)


def codes(
    band: Floats, bits: Bits, *, alpha: bool = False, origin: tuple[int, int] = (0, 0)
) -> npt.NDArray[Any]:
    """The numbers of a picture file: uint8, dithered, or uint16, of the band's shape.

    Args:
        band: shape (rows, columns, 3), or 4 with `alpha`: linear Rec. 709, and with `alpha` premultiplied by the fourth.
        bits: of each number.
        alpha: whether the colours are to be divided by their coverage, which is not light and stored as it is.
        origin: see `encode8`.
    """
    straight = _straight(band) if alpha else band
    found: npt.NDArray[Any] = encode8(straight, origin=origin) if bits == 8 else encode16(straight)
    if alpha:
        # Coverage needs neither the transfer function nor dithering.
        largest = np.float32((1 << bits) - 1)
        found[..., 3] = np.rint(np.fmin(np.fmax(band[..., 3], 0), 1) * largest)
    return found


def _straight(band: Floats) -> Floats:
    """Colours divided by their coverage (PNG specification, third edition, section 12.4.1; RFC 9649 for WebP)."""
    result = band.copy()
    coverage = np.fmin(band[..., 3:], np.float32(1))
    with np.errstate(over="ignore"):  # a division by almost 0 gives infinity, which is limited to 1 later
        np.divide(band[..., :3], coverage, out=result[..., :3], where=coverage > 0)
    return result
