"""Reads pictures of codes, as cameras and painters write them, by Pillow: PNG, JPEG, WebP, TIFF and BMP.

Codes are sRGB's, or those of the colour profile that a file carries; cameras that were held upright say so (Exif's
orientation). Pillow has 8 bits of each colour; the lower halves of 16 bits are read as a picture of their own.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageCms, ImageOps, UnidentifiedImageError
from PIL.ImageFile import ImageFile

from clfractal.files.atomic import ContentError
from clfractal.files.srgb import decode

if TYPE_CHECKING:
    from PIL.Image import Image as Photo

# Not all that Pillow knows: some it hands to other programs.
_FORMATS = ("PNG", "JPEG", "WEBP", "TIFF", "BMP")
_MOST_BYTES = 1 << 30
_LOWER_HALVES = {"RGB;16B": "RGB;16L", "RGBA;16B": "RGBA;16L"}
"""How Pillow names a PNG's pixels of 16 bits when it takes their upper bytes, and those of which it takes the others."""
_ORIENTATION = 0x0112
_SIDEWAYS = (5, 6, 7, 8)

Floats = npt.NDArray[np.float32]
Codes = npt.NDArray[np.uint8 | np.uint16]


def read_coded(stream: BinaryIO, check_size: Callable[[int, int], None]) -> tuple[Floats, Floats | None]:
    """The pixels as linear Rec. 709, shape (height, width, 3), and how far they cover, shape (height, width), if not fully.

    Args:
        check_size: raises ContentError for a width and height; it is asked before any pixel is read.

    Raises:
        ContentError: it is none of these files or a damaged one, or too large.
    """
    data = stream.read(_MOST_BYTES + 1)
    if len(data) > _MOST_BYTES:
        raise ContentError(f"is too large: at most {_MOST_BYTES:,} bytes")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of Pillow, on pictures that are large or odd
            with _opened(data) as picture:
                if picture.mode == "F":
                    raise ContentError("has numbers in the place of codes; an EXR is read as such")
                check_size(*(picture.size[::-1] if _is_sideways(picture) else picture.size))
                codes = _codes(picture, data)
                check_size(codes.shape[1], codes.shape[0])
    except (ContentError, MemoryError):
        raise
    except Image.DecompressionBombError as error:
        raise ContentError(
            "is too large: its header says so many pixels as only harmful files have"
        ) from error
    except UnidentifiedImageError as error:
        raise ContentError("is not an EXR, HDR, PNG, JPEG, WebP, TIFF or BMP, or is damaged") from error
    except Exception as error:  # Pillow raises many kinds for damaged files
        raise ContentError("is damaged: its pixels cannot be read") from error
    return _light(codes)


def _opened(data: bytes) -> ImageFile:
    found = Image.open(io.BytesIO(data), formats=_FORMATS)
    assert isinstance(found, ImageFile)
    return found


def _is_sideways(picture: ImageFile) -> bool:
    # (Of a PNG without it Pillow would read all pixels, to look behind them; a TIFF's size is of the upright picture.)
    told = picture.format != "TIFF" and (picture.format != "PNG" or "exif" in picture.info)
    return told and picture.getexif().get(_ORIENTATION) in _SIDEWAYS


def _codes(picture: ImageFile, data: bytes) -> Codes:
    """Shape (height, width, 1, 3 or 4): grey, colours, colours and coverage; 8 or 16 bits."""
    if picture.mode.startswith("I"):  # 16 bits of grey
        grey = np.clip(np.asarray(_upright(picture)), 0, 0xFFFF)
        return np.asarray(grey[..., None], np.uint16)
    lower = _LOWER_HALVES.get(_raw_mode(picture))
    if lower is not None and _is_srgb(picture):
        with _opened(data) as other:
            tile: Any = (*other.tile[0][:3], lower)
            other.tile = [tile]
            halves = [np.asarray(_upright(each)).astype(np.uint16) for each in (picture, other)]
        return np.asarray(halves[0] << 8 | halves[1], np.uint16)
    covers = "A" in picture.getbands() or "transparency" in picture.info
    colors = _upright(picture).convert("RGBA" if covers else "RGB")
    return np.asarray(colors if _is_srgb(picture) else _in_srgb(colors, picture.info["icc_profile"]))


def _raw_mode(picture: ImageFile) -> str:
    tile: Any = picture.tile[0] if picture.format == "PNG" and picture.tile else None
    return str(tile[3]) if tile is not None else ""


def _upright(picture: Photo) -> Photo:
    return ImageOps.exif_transpose(picture)


def _is_srgb(picture: Photo) -> bool:
    """Whether its codes are sRGB's: it says so, or nothing that can be read."""
    profile = picture.info.get("icc_profile")
    if not profile:
        return True
    try:
        found = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        return found.profile.xcolor_space.strip() != "RGB" or "srgb" in (
            ImageCms.getProfileDescription(found).lower()
        )
    except (ImageCms.PyCMSError, OSError, ValueError):
        return True


def _in_srgb(colors: Photo, profile: bytes) -> Photo:
    """The colours of another profile as sRGB's codes; those beyond it are cut. Coverage stays."""
    changed = ImageCms.profileToProfile(
        colors.convert("RGB"),
        ImageCms.ImageCmsProfile(io.BytesIO(profile)),
        ImageCms.createProfile("sRGB"),
        renderingIntent=ImageCms.Intent.RELATIVE_COLORIMETRIC,
    )
    assert changed is not None  # as it is not made in place
    if "A" in colors.getbands():
        changed.putalpha(colors.getchannel("A"))
    return changed


def _light(codes: Codes) -> tuple[Floats, Floats | None]:
    linear = _decoded(8 * codes.dtype.itemsize)
    colors = codes[..., :3]
    if colors.shape[-1] == 1:
        colors = np.broadcast_to(colors, (*codes.shape[:2], 3))
    if codes.shape[-1] < 4:
        return linear[colors], None
    coverage = codes[..., 3].astype(np.float32) / np.float32(np.iinfo(codes.dtype).max)
    return linear[colors], coverage


@cache
def _decoded(bits: int) -> Floats:
    """The light of each code."""
    largest = (1 << bits) - 1
    return decode(np.arange(largest + 1) / largest).astype(np.float32)
