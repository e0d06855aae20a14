"""Reads pictures that scenes name, around the set or on surfaces: of light, and of a screen's codes.

Files are known by their first bytes, whatever they are called.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.files.atomic import ContentError, reading
from clfractal.files.exr_header import MAGIC as EXR
from clfractal.files.exr_header import ExrHeader, read_header
from clfractal.files.primaries import from_xyz, in_rec709
from clfractal.files.radiance import MAGIC as RADIANCE
from clfractal.files.radiance import radiance_pixels, read_radiance_header

_MOST_BYTES = 8 << 30  # of all channels, as they lie in memory while the file is read
_CUBE = b"\x01"  # value of the attribute `envmap`
_LONGEST = 12

Floats = npt.NDArray[np.float32]
CheckSize = Callable[[int, int], None]
"""Raises ContentError for a width and height in pixels; it is asked before any pixel is read."""


@dataclass(frozen=True, slots=True)
class Picture:
    """What a file shows.

    Attributes:
        pixels: shape (height, width, 3), the top row first: linear Rec. 709, finite, none below 0.
        coverage: shape (height, width), 0 where the picture is transparent to 1; None: it covers all.
        has_codes: whether the file has sRGB's codes, which stand for numbers where these are wanted.
    """

    pixels: Floats
    coverage: Floats | None = None
    has_codes: bool = False

    @property
    def on_black(self) -> Floats:
        """The pixels where nothing is behind the picture."""
        return self.pixels if self.coverage is None else self.pixels * self.coverage[..., None]


def read_picture(path: str | Path, check_size: CheckSize, brightest: float) -> Picture:
    """A picture of any of the kinds.

    Of OpenEXR the channels are R, G and B, or Y alone for grey light; half or float, in any compression, by rows or by
    tiles. Where the file names other primaries, colours are turned into Rec. 709, adapted to its white. Negative numbers
    become 0: light cannot be negative, but resampling and colours outside Rec. 709 cause negative numbers even in good
    pictures. Codes of PNG, JPEG, WebP, TIFF and BMP are sRGB's, see `coded`.

    Args:
        brightest: the largest number that a pixel may have.

    Raises:
        FileError: it cannot be read, is none of these files or a damaged one, is too large, or has numbers that are none.
    """
    with reading(path) as stream:
        begin = stream.read(_LONGEST)
        if begin.startswith(EXR):
            picture = Picture(_of_exr(path, check_size))
        elif begin.startswith(RADIANCE):
            picture = Picture(_of_radiance(begin + stream.read(), check_size))
        else:
            # Here, since few scenes have such pictures.
            from clfractal.files.coded import read_coded

            stream.seek(0)
            pixels, coverage = read_coded(stream, check_size)
            return Picture(pixels, coverage, has_codes=True)
        _check_numbers(picture.pixels, brightest)
        np.maximum(picture.pixels, 0.0, out=picture.pixels)
        return picture


def _of_exr(path: str | Path, check_size: CheckSize) -> Floats:
    header = read_header(path)
    _check_header(header, check_size)
    from clfractal.files.exr import read_exr

    planes, values = read_exr(path, tiles=True)
    names = "RGB" if set("RGB") <= set(planes) else "YYY"
    pixels = np.stack([np.asarray(planes[name], np.float32) for name in names], axis=-1)
    return in_rec709(pixels, values.get("chromaticities")) if names == "RGB" else pixels


def _of_radiance(data: bytes, check_size: CheckSize) -> Floats:
    header = read_radiance_header(data)
    check_size(*header.size)
    pixels = radiance_pixels(data, header)
    return from_xyz(pixels) if header.is_xyz else in_rec709(pixels, header.primaries)


def _check_header(header: ExrHeader, check_size: CheckSize) -> None:
    """Checks everything in the header before any pixel is read."""
    window = header.values().get("dataWindow")
    envmap = header.attributes.get("envmap")
    if not isinstance(window, tuple) or len(window) != 4 or not header.channels:
        raise ContentError("is damaged: its header lacks required attributes")
    width, height = window[2] - window[0] + 1, window[3] - window[1] + 1
    if envmap is not None and envmap.data == _CUBE:
        raise ContentError("is a cube map; an environment is a latitude-longitude map")
    check_size(width, height)
    whole = header.values().get("displayWindow")
    if whole != window and isinstance(whole, tuple) and len(whole) == 4:
        shown = f"{width} x {height} of {whole[2] - whole[0] + 1} x {whole[3] - whole[1] + 1} pixels"
        raise ContentError(f"holds only a part of its picture, or more than it: {shown}")
    if not set("RGB") <= set(header.channels) and "Y" not in header.channels:
        found = ", ".join(header.channels[:10])
        raise ContentError(f"must have the channels R, G and B, or Y; it has {found[:200]}")
    if 4 * width * height * len(header.channels) > _MOST_BYTES:
        raise ContentError(f"is too large: {len(header.channels)} channels of {width} x {height} pixels")


def _check_numbers(pixels: Floats, brightest: float) -> None:
    """Refuses numbers that cannot be light: an error here is better than spots in a picture."""
    # Both results are NaN if any number is.
    limits = pixels.min(initial=0.0), pixels.max(initial=0.0)
    if -np.inf < limits[0] and limits[1] <= brightest:
        return
    for what, wrong in (
        ("of NaN", np.isnan(pixels)),
        ("of infinite brightness", np.isinf(pixels)),
        (f"brighter than {brightest:g}", pixels > brightest),
    ):
        found = wrong.any(axis=-1)
        count = int(found.sum())
        if count:
            row, column = divmod(int(found.argmax()), found.shape[1])
            pixel = "pixel" if count == 1 else "pixels"
            place = f"the first in column {column}, row {row} (counted from 0 at the top left)"
            raise ContentError(f"has {count:,} {pixel} {what}, {place}")
