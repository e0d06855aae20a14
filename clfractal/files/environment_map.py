"""Reads environment maps: OpenEXR and Radiance pictures of everything around, by latitude and longitude.

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

from clfractal.files.atomic import ContentError, reading
from clfractal.files.exr_header import ExrHeader, read_header
from clfractal.files.radiance import MAGIC, radiance_pixels, read_radiance_header

MAX_WIDTH = 16_384
BRIGHTEST = 1e9
"""Of a pixel: sums of brighter ones would leave the range of float32."""

_MOST_BYTES = 8 << 30  # of all channels, as they lie in memory while the file is read
_STRONGEST = 100.0  # largest factor between primaries that are still colours
_CUBE = b"\x01"  # value of the attribute `envmap`
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
_REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # ITU-R BT.709-6, items 1.3 and 1.4

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]


def read_environment(path: str | Path) -> Floats:
    """The pixels of a latitude-longitude map, shape (height, 2 height, 3): linear Rec. 709, finite, none below 0.

    Of OpenEXR the channels are R, G and B, or Y alone for grey light; half or float, in any compression, by rows or by
    tiles. Radiance's pictures (`.hdr`) are known by their first bytes. Where the file names other primaries, colours
    are turned into Rec. 709, adapted to its white. Negative numbers become 0: light cannot be negative, but resampling
    and colours outside Rec. 709 cause negative numbers even in good maps.

    Raises:
        FileError: it cannot be read, is neither kind of file or a damaged one, or no such map.
    """
    with reading(path) as stream:
        begin = stream.read(len(MAGIC[0]))
        pixels = _of_radiance(begin + stream.read()) if begin.startswith(MAGIC) else _of_exr(path)
        return np.maximum(pixels, 0.0, out=pixels)


def _of_exr(path: str | Path) -> Floats:
    header = read_header(path)
    _check_shape(header)
    from clfractal.files.exr import read_exr

    planes, values = read_exr(path, tiles=True)
    names = "RGB" if set("RGB") <= set(planes) else "YYY"
    pixels = np.stack([np.asarray(planes[name], np.float32) for name in names], axis=-1)
    del planes
    _check_numbers(pixels)
    return _in_rec709(pixels, values.get("chromaticities")) if names == "RGB" else pixels


def _of_radiance(data: bytes) -> Floats:
    header = read_radiance_header(data)
    _check_size(*header.size)
    pixels = radiance_pixels(data, header)
    if header.is_xyz:
        pixels = np.ascontiguousarray(pixels @ np.linalg.inv(_to_xyz(_REC709)).T.astype(np.float32))
    _check_numbers(pixels)
    return pixels if header.is_xyz else _in_rec709(pixels, header.primaries)


def _check_shape(header: ExrHeader) -> None:
    """Checks everything in the header before any pixel is read."""
    window = header.values().get("dataWindow")
    envmap = header.attributes.get("envmap")
    if not isinstance(window, tuple) or len(window) != 4 or not header.channels:
        raise ContentError("is damaged: its header lacks required attributes")
    width, height = window[2] - window[0] + 1, window[3] - window[1] + 1
    if envmap is not None and envmap.data == _CUBE:
        raise ContentError("is a cube map; an environment is a latitude-longitude map")
    _check_size(width, height)
    whole = header.values().get("displayWindow")
    if whole != window and isinstance(whole, tuple) and len(whole) == 4:
        shown = f"{width} x {height} of {whole[2] - whole[0] + 1} x {whole[3] - whole[1] + 1} pixels"
        raise ContentError(f"holds only a part of its picture, or more than it: {shown}")
    if not set("RGB") <= set(header.channels) and "Y" not in header.channels:
        found = ", ".join(header.channels[:10])
        raise ContentError(f"must have the channels R, G and B, or Y; it has {found[:200]}")
    if 4 * width * height * len(header.channels) > _MOST_BYTES:
        raise ContentError(f"is too large: {len(header.channels)} channels of {width} x {height} pixels")


def _check_size(width: int, height: int) -> None:
    if width < 1 or width != 2 * height:
        message = (
            f"must be twice as wide as high, as latitude-longitude maps are, got {width} x {height} pixels"
        )
        raise ContentError(message)
    if width > MAX_WIDTH:
        raise ContentError(f"is too large: {width:,} pixels wide, at most {MAX_WIDTH:,}")


def _check_numbers(pixels: Floats) -> None:
    """Refuses numbers that cannot be light: an error here is better than spots in a picture."""
    # Both results are NaN if any number is.
    limits = pixels.min(initial=0.0), pixels.max(initial=0.0)
    if -np.inf < limits[0] and limits[1] <= BRIGHTEST:
        return
    for what, wrong in (
        ("of NaN", np.isnan(pixels)),
        ("of infinite brightness", np.isinf(pixels)),
        (f"brighter than {BRIGHTEST:g}", pixels > BRIGHTEST),
    ):
        found = wrong.any(axis=-1)
        count = int(found.sum())
        if count:
            row, column = divmod(int(found.argmax()), found.shape[1])
            pixel = "pixel" if count == 1 else "pixels"
            place = f"the first in column {column}, row {row} (counted from 0 at the top left)"
            raise ContentError(f"has {count:,} {pixel} {what}, {place}")


def _in_rec709(pixels: Floats, given: object) -> Floats:
    """Colours of the primaries and white that the header names, in those of Rec. 709."""
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
