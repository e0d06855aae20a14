"""A sheet: many small pictures in one, each with its name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from clfractal.files.srgb import decode
from clfractal.images.framebuffer import Framebuffer

Pixels: TypeAlias = npt.NDArray[np.uint8]

# Pixels between pictures, the grey between them, and the height of letters as a part of a picture's.
_GAP, _GREY = 8, 24
_LETTERS, _LEAST_LETTERS, _MOST_LETTERS = 1 / 15, 10, 20


def sheet_of(pictures: Sequence[Pixels], names: Sequence[str]) -> Framebuffer:
    """All pictures in rows, as a framebuffer that any kind of picture file can be made of.

    The sheet has about as many rows as columns, but four columns at least if there are so many pictures.

    Args:
        pictures: sRGB, each of shape (height, width, 3), all of one size.
        names: written into the upper left corner of each.
    """
    from PIL import Image, ImageDraw, ImageFont

    across = min(len(pictures), max(4, round(len(pictures) ** 0.5)))
    down = -(-len(pictures) // across)
    height, width = pictures[0].shape[:2]
    letters = round(min(max(height * _LETTERS, _LEAST_LETTERS), _MOST_LETTERS))
    font = ImageFont.load_default(letters)
    size = (across * (width + _GAP) + _GAP, down * (height + _GAP) + _GAP)
    sheet = Image.new("RGB", size, (_GREY, _GREY, _GREY))
    draw = ImageDraw.Draw(sheet)
    for number, (picture, name) in enumerate(zip(pictures, names, strict=True)):
        x = _GAP + number % across * (width + _GAP)
        y = _GAP + number // across * (height + _GAP)
        sheet.paste(Image.fromarray(picture), (x, y))
        place = (x + letters / 2, y + letters / 4)
        draw.text(place, name, font=font, fill="white", stroke_width=2, stroke_fill="black")
    light = decode(np.asarray(sheet, np.float64) / 255).astype(np.float32)
    framebuffer = Framebuffer(("R", "G", "B"), size)
    framebuffer.fill({channel: light[..., index] for index, channel in enumerate("RGB")})
    return framebuffer
