"""Pictures as objects of other libraries: Pillow and xarray."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from clfractal.errors import FileError, Where
from clfractal.files.channels import CHANNELS
from clfractal.images.outputs import png_bytes
from clfractal.images.tiled import Floats, Picture

if TYPE_CHECKING:
    from xarray import Dataset


def to_image(picture: Picture) -> Image.Image:
    """A picture with R, G, B as an image of Pillow: the pixels of an 8-bit PNG; RGBA if its background is transparent."""
    with Image.open(io.BytesIO(png_bytes(picture))) as image:
        return image.copy()


def to_xarray(picture: Picture, planes: Mapping[str, Floats]) -> Dataset:
    """A picture's channels, given as `planes`, as variables of a data set over (y, x). The arrays are not copied.

    The coordinates `x` and `y` are the middles of the pixels, in pixels from the top left corner of the whole picture. A
    variable's attribute `description` says what it is, and in which unit. Texts and numbers of the header are
    attributes of the data set, of kinds that netCDF can store.

    Raises:
        FileError: xarray is not installed.
    """
    try:
        from xarray import Dataset
    except ImportError:
        raise FileError("needs xarray: pip install xarray", Where("Framebuffer.to_xarray")) from None
    region = picture.region
    coordinates = {
        "y": ("y", np.arange(region.y, region.bottom) + 0.5, {"units": "pixels"}),
        "x": ("x", np.arange(region.x, region.right) + 0.5, {"units": "pixels"}),
    }
    variables: dict[str, Any] = {
        name: (("y", "x"), plane, {"description": CHANNELS[name].description})
        for name, plane in planes.items()
    }
    facts: dict[str, Any] = {
        key: int(value) if isinstance(value, bool) else value
        for key, value in picture.header.items()
        if isinstance(value, (str, int, float))
    }
    return Dataset(variables, coordinates, facts)
