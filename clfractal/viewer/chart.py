"""A chart for setting up projectors and screens: one picture for each eye, to be shown without parallax.

What it is for: every pixel of the rim must be seen (overscan, keystone); circles must be round and cells square (aspect);
the ramp must have 16 steps, and the striped patch must be as light as the plain one beside it (gamma); the rulers of both
projectors must coincide; and each eye must see its own letter alone (which side is which, crosstalk).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

Pixels = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float32]
Eye = Literal["left", "right"]
Box = tuple[int, int, int, int]
"""Left, top, right, bottom in pixels; right and bottom are the first ones behind it."""

RAMP_STEPS = 16
HALF_LIGHT = 188
"""The sRGB code that sends out half of white's light."""
BARS = ("#ffffff", "#ffff00", "#00ffff", "#00ff00", "#ff00ff", "#ff0000", "#0000ff", "#000000")

_GROUND, _GRID, _LINE, _WHITE = 26.0, 78.0, 190.0, 255.0
_LEAST = (320, 200)
"""Smaller charts have lines and circles only: nothing else could be read."""


def chart(size: tuple[int, int], eye: Eye) -> Pixels:
    """The chart for one eye, shape (height, width, 4), 8-bit sRGB and opaque.

    Both eyes' charts are equal, except inside `marks`.

    Args:
        size: width and height of one eye's whole picture, pixels, at least 1 each.
    """
    width, height = size
    gray = np.full((height, width), _GROUND, np.float32)
    _grid(gray)
    _circles(gray)
    _crosshair(gray)
    if width >= _LEAST[0] and height >= _LEAST[1]:
        _ruler(gray)
    picture = np.empty((height, width, 4), np.uint8)
    picture[..., :3] = np.rint(gray)[..., None]
    if width >= _LEAST[0] and height >= _LEAST[1]:
        _ramp(picture)
        _bars(picture)
        _gamma(picture)
        _label(picture)
        _mark(picture, eye)
    picture[[0, -1], :, :3] = picture[:, [0, -1], :3] = 255
    picture[..., 3] = 255
    return picture


def marks(size: tuple[int, int]) -> tuple[Box, ...]:
    """Where the eyes' charts differ: the letters in the corners, and the pointers at the ruler's zero."""
    width, height = size
    if width < _LEAST[0] or height < _LEAST[1]:
        return ()
    return (*(_corner(size, eye) for eye in ("left", "right")), _pointers(size))


def grid_cell(size: tuple[int, int]) -> int:
    """Side of a cell of the grid, whole pixels."""
    return max(4, round(min(size) / 18))


def _axis(length: int) -> Floats:
    """Middles of pixels, from the middle of the picture."""
    return np.arange(length, dtype=np.float32) + np.float32(0.5 - length / 2)


def _unit(size: tuple[int, int]) -> int:
    """Width of a thin line: a pixel up to 1080 rows, two for twice as many."""
    return max(1, round(min(size) / 1080))


def _line(distance: Floats, width: float) -> Floats:
    """How much of each pixel a line covers, from the distance of its middle."""
    return np.clip(np.float32(width / 2 + 0.5) - np.abs(distance), 0, 1)


def _blend(gray: Floats, covered: Floats, value: float) -> None:
    gray += covered * (np.float32(value) - gray)


def _grid(gray: Floats) -> None:
    height, width = gray.shape
    cell, unit = grid_cell((width, height)), _unit((width, height))
    _blend(gray, _ticks(_axis(width), cell, unit)[None, :], _GRID)
    _blend(gray, _ticks(_axis(height), cell, unit)[:, None], _GRID)


def _ticks(along: Floats, step: int, width: float) -> Floats:
    """Lines at equal distances from the middle."""
    off = along - step * np.rint(along / step)
    return _line(off.astype(np.float32), width)


def circles(size: tuple[int, int]) -> list[tuple[float, float, float]]:
    """Middles (x, y, from the picture's top left) and radii of the circles' lines, pixels."""
    width, height = size
    cell = grid_cell(size)
    large, small = 8 * cell, 2 * cell
    across, down = width / 2 - 2.5 * cell, height / 2 - 2.5 * cell
    found = [(width / 2, height / 2, float(large)), (width / 2, height / 2, float(small))]
    if float(np.hypot(across, down)) > large + small + cell / 2:
        found += [
            (width / 2 + i * across, height / 2 + j * down, float(small)) for i in (-1, 1) for j in (-1, 1)
        ]
    return found


def _circles(gray: Floats) -> None:
    height, width = gray.shape
    thick = 2.0 * _unit((width, height))
    for x, y, radius in circles((width, height)):
        reach = radius + thick
        left, right = max(0, int(x - reach)), min(width, int(x + reach) + 1)
        top, bottom = max(0, int(y - reach)), min(height, int(y + reach) + 1)
        across = np.arange(left, right, dtype=np.float32) + np.float32(0.5 - x)
        down = np.arange(top, bottom, dtype=np.float32) + np.float32(0.5 - y)
        off = np.hypot(across[None, :], down[:, None]) - np.float32(radius)
        _blend(gray[top:bottom, left:right], _line(off, thick), _LINE)


def _crosshair(gray: Floats) -> None:
    height, width = gray.shape
    thick = 2.0 * _unit((width, height))
    _blend(gray, _line(_axis(width), thick)[None, :], _LINE)
    _blend(gray, _line(_axis(height), thick)[:, None], _LINE)


def _ruler_reach(size: tuple[int, int]) -> int:
    """How far the ruler goes to each side, pixels: whole hundreds of lines' widths."""
    unit = _unit(size)
    return min(4, int(0.42 * size[0] / (100 * unit))) * 100 * unit


def _ruler(gray: Floats) -> None:
    """Ticks along the horizontal line of the cross: one every 10 pixels, longer every 50 and 100."""
    height, width = gray.shape
    unit = _unit((width, height))
    along, down = _axis(width), np.abs(_axis(height))
    reach = _ruler_reach((width, height))
    for every, high in ((10, 5), (50, 9), (100, 14)):
        ticks = _ticks(along, every * unit, unit) * (np.abs(along) <= reach)
        rows = np.flatnonzero(down <= high * unit)
        _blend(gray[rows[0] : rows[-1] + 1], ticks[None, :], _WHITE)


def _centred(size: tuple[int, int], width: int, height: int, y: int) -> Box:
    left = (size[0] - width) // 2
    return left, y, left + width, y + height


def _ramp(picture: Pixels) -> None:
    left, top, right, bottom = ramp_box((picture.shape[1], picture.shape[0]))
    step = (right - left) // RAMP_STEPS
    for number in range(RAMP_STEPS):
        value = round(255 * number / (RAMP_STEPS - 1))
        picture[top:bottom, left + number * step : left + (number + 1) * step, :3] = value


def ramp_box(size: tuple[int, int]) -> Box:
    """Where the grey ramp lies; its width is 16 whole steps."""
    cell = grid_cell(size)
    step = max(4, min(cell * 5 // 8, size[0] * 5 // 8 // RAMP_STEPS))
    return _centred(size, step * RAMP_STEPS, cell, size[1] // 2 + 4 * cell)


def bars_box(size: tuple[int, int]) -> Box:
    """Where the bars of colour lie."""
    left, _, right, _ = ramp_box(size)
    cell = grid_cell(size)
    top = size[1] - size[1] // 2 - 5 * cell
    return left, top, right, top + cell


def _bars(picture: Pixels) -> None:
    left, top, right, bottom = bars_box((picture.shape[1], picture.shape[0]))
    edges = [left + (right - left) * number // len(BARS) for number in range(len(BARS) + 1)]
    for number, color in enumerate(BARS):
        picture[top:bottom, edges[number] : edges[number + 1], :3] = tuple(bytes.fromhex(color[1:]))


def gamma_box(size: tuple[int, int]) -> Box:
    """Where the patch lies that is plain in the middle and striped on both sides."""
    cell = grid_cell(size)
    left, _, right, bottom = ramp_box(size)
    return left, bottom + cell // 4, right, bottom + cell // 4 + cell


def _gamma(picture: Pixels) -> None:
    left, top, right, bottom = gamma_box((picture.shape[1], picture.shape[0]))
    third = (right - left) // 3
    picture[top:bottom, left:right, :3] = (np.arange(bottom - top) % 2 * 255)[:, None, None]
    picture[top:bottom, left + third : right - third, :3] = HALF_LIGHT


@cache
def _font_file() -> Path | None:
    """A font that comes with the panels' library; None if it is laid out otherwise."""
    try:
        import imgui_bundle
    except ImportError:
        return None
    found = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Bold.ttf"
    return found if found.is_file() else None


@cache
def _font(high: int) -> Any:
    from PIL import ImageFont

    file = _font_file()
    return ImageFont.truetype(str(file), high) if file is not None else ImageFont.load_default(high)


def _write(picture: Pixels, text: str, box: Box, high: int, value: int = 255) -> None:
    """Writes a line into the middle of a box, over what is there; it is cut off at the box."""
    from PIL import Image, ImageDraw

    left, top, right, bottom = box
    drawn, font = Image.new("L", (right - left, bottom - top)), _font(high)
    draw = ImageDraw.Draw(drawn)
    x0, y0, x1, y1 = draw.textbbox((0, 0), text, font=font)
    place = ((right - left - x0 - x1) / 2, (bottom - top - y0 - y1) / 2)
    draw.text(place, text, fill=255, font=font)
    covered = np.asarray(drawn, np.float32)[..., None] / 255
    part = picture[top:bottom, left:right, :3]
    part[:] = np.rint(part + covered * (np.float32(value) - part))


def _label(picture: Pixels) -> None:
    """The picture's size above the bars, and numbers below the ruler."""
    size = (picture.shape[1], picture.shape[0])
    cell, unit = grid_cell(size), _unit(size)
    top = bars_box(size)[1] - cell
    box = _centred(size, 5 * cell, cell * 3 // 4, top)
    picture[box[1] : box[3], box[0] : box[2], :3] = int(_GROUND)
    _write(picture, f"{size[0]} x {size[1]}", box, max(9, cell // 2))
    high = max(8, 11 * unit)
    top = size[1] // 2 + 17 * unit
    for pixels in range(100, _ruler_reach(size) // unit + 1, 100):
        for sign in (-1, 1):
            middle = size[0] // 2 + sign * pixels * unit
            box = (middle - 2 * high, top, middle + 2 * high, top + high + 2)
            _write(picture, f"{sign * pixels * unit:+d}", box, high, int(_LINE))


def _corner(size: tuple[int, int], eye: Eye) -> Box:
    """The box of an eye's letter, around the place of the upper corner circle on its side."""
    cell = grid_cell(size)
    margin = cell // 2
    left = margin if eye == "left" else size[0] - margin - 4 * cell
    return left, margin, left + 4 * cell, margin + 4 * cell


def _pointers(size: tuple[int, int]) -> Box:
    cell, unit = grid_cell(size), _unit(size)
    reach = 16 * unit + cell
    return _centred(size, 2 * cell, 2 * reach, (size[1] + 1) // 2 - reach)


def _mark(picture: Pixels, eye: Eye) -> None:
    size = (picture.shape[1], picture.shape[0])
    cell = grid_cell(size)
    _write(picture, eye[0].upper(), _corner(size, eye), 2 * cell)
    left, top, right, bottom = _pointers(size)
    # A filled triangle whose tip is on zero: above the ruler for the left eye, below it for the right one.
    across = np.abs(np.arange(left, right, dtype=np.float32) + np.float32(0.5 - size[0] / 2))
    down = np.arange(top, bottom, dtype=np.float32) + np.float32(0.5 - size[1] / 2)
    beyond = (-down if eye == "left" else down) - 16 * _unit(size)
    inside = (across[None, :] <= 0.5 * beyond[:, None]) & (beyond[:, None] <= cell)
    picture[top:bottom, left:right, :3][inside] = 255


def mixed_chart(size: tuple[int, int], mode: str) -> Pixels:
    """The chart of one eye (`left`, `right`), or of both in a way of showing them on one area.

    Interlaced ways take the eyes' pixels in turn, an anaglyph the red of the left eye and the rest of the right one's: so
    each eye must see its own letter alone.
    """
    if mode in ("left", "right"):
        return chart(size, "left" if mode == "left" else "right")
    left, right = chart(size, "left"), chart(size, "right")
    found = left.copy()
    if mode == "anaglyph":
        found[..., 1:] = right[..., 1:]
        return found
    rows, columns = np.indices(left.shape[:2])
    odd = {"rows": rows, "columns": columns}.get(mode, rows + columns) % 2 == 1
    found[odd] = right[odd]
    return found
