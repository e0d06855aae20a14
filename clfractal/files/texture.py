"""Reads pictures that surfaces show: PNG, JPEG, WebP, TIFF and BMP by Pillow, and OpenEXR."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.errors import FileError, Where
from clfractal.files.exr_header import MAGIC, read_header
from clfractal.files.regular import read_bytes
from clfractal.files.srgb import decode

MAX_SIDE = 4096
BRIGHTEST = 1e6

_MOST_BYTES = 256 << 20
# Not all that Pillow knows: some it hands to other programs.
_FORMATS = ("PNG", "JPEG", "WEBP", "TIFF", "BMP")

Floats = npt.NDArray[np.float32]


def read_texture(path: Path) -> tuple[Floats, bool]:
    """The pixels of a picture, shape (height, width, 3): linear Rec. 709, finite, none below 0; its top row first;
    and whether the file has codes.

    The codes of all but OpenEXR are sRGB's. Transparency is of no account. Negative numbers of OpenEXR become 0.

    Raises:
        FileError: it cannot be read, is no picture or a damaged one, or is too large.
    """
    data = read_bytes(path, limit=_MOST_BYTES)
    return (_exr(path), False) if data.startswith(MAGIC) else (_photo(path, data), True)


def _photo(path: Path, data: bytes) -> Floats:
    # Here, since few scenes have textures.
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of Pillow, on pictures that are too large
            with Image.open(io.BytesIO(data), formats=_FORMATS) as picture:
                _check_size(path, *picture.size)
                if picture.mode.startswith("I"):  # 16 bits
                    grey = np.asarray(picture, np.float64)[..., None] / 65_535
                    codes = np.broadcast_to(grey, (*grey.shape[:2], 3))
                else:
                    codes = np.asarray(picture.convert("RGB"), np.float64) / 255
    except FileError:
        raise
    except Exception as error:  # Pillow raises many kinds for damaged files
        raise FileError("is no picture, or a damaged one", Where(str(path)), details=str(error)) from error
    return np.ascontiguousarray(decode(codes), np.float32)


def _exr(path: Path) -> Floats:
    from clfractal.files.exr import read_exr

    header = read_header(path)
    window = header.values().get("dataWindow")
    if not isinstance(window, tuple) or len(window) != 4:
        raise FileError("is damaged: its header lacks required attributes", Where(str(path)))
    _check_size(path, window[2] - window[0] + 1, window[3] - window[1] + 1)
    names = "RGB" if set("RGB") <= set(header.channels) else "YYY"
    if not set(names) <= set(header.channels):
        raise FileError("must have the channels R, G and B, or Y", Where(str(path)))
    planes, _ = read_exr(path, tiles=True)
    pixels = np.stack([np.asarray(planes[name], np.float32) for name in names], axis=-1)
    if not np.isfinite(pixels).all() or pixels.max() > BRIGHTEST:
        raise FileError(f"must have finite numbers, at most {BRIGHTEST:,.0f}", Where(str(path)))
    return np.maximum(pixels, np.float32(0))


def _check_size(path: Path, width: int, height: int) -> None:
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise FileError(
            f"must be at most {MAX_SIDE:,} pixels wide and high, got {width:,} x {height:,}", Where(str(path))
        )
