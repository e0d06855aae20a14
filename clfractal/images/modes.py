"""Stereo modes by how they put two eyes' pictures together, and the sizes that follow from it."""

from __future__ import annotations

from typing import Any

from clfractal.scene.stereo import APART, Mode, Stereo

BESIDE: tuple[Mode, ...] = ("split", "split_half")
BELOW: tuple[Mode, ...] = ("over_under", "over_under_half")
PICKED: tuple[Mode, ...] = ("rows", "columns", "checkerboard", "anaglyph_chessboard")
"""Modes in which each pixel is one of either eye's."""


def eye_size(stereo: Stereo, image: tuple[int, int]) -> tuple[int, int]:
    """Width and height of each eye's picture, pixels; `image` is the scene's `image`.

    Raises:
        ValueError: a size to be halved is odd; scenes are checked for this when they are loaded.
    """
    (width, height), (wide, high) = image, stereo.squeeze
    if width % wide or height % high:
        raise ValueError(f"{width} x {height} pixels cannot be halved for {stereo.mode}")
    return width // wide, height // high


def picture_size(stereo: Stereo, image: tuple[int, int]) -> tuple[int, int]:
    """Width and height of the finished picture, pixels; of one eye's where nothing is composed."""
    width, height = eye_size(stereo, image)
    return width * (2 if stereo.mode in BESIDE else 1), height * (2 if stereo.mode in BELOW else 1)


def is_second(mode: Mode, x: Any, y: Any) -> Any:
    """Whether the second eye's pixels are shown in columns and rows: those of odd rows, columns, or sums of both.

    Args:
        mode: one of PICKED.
        x, y: numbers, or arrays of them.
    """
    return (x * (mode != "rows") + y * (mode != "columns")) % 2 == 1


def eye_at(stereo: Stereo | None, image: tuple[int, int], x: float, y: float) -> tuple[int, float, float]:
    """Which eye's picture (0 left, or nobody's in particular; 1 right) is shown at a place, and the place in that picture.

    Pictures that stay apart count as if they were shown side by side, as a window shows them. An anaglyph shows both eyes'
    at each place: then it is the left one's.

    Args:
        image: the scene's `image`, pixels.
        x, y: a place in the finished picture, pixels from the top left.
    """
    if stereo is None:
        return 0, x, y
    width, height = image
    mode, second = stereo.mode, False
    if mode in BESIDE or mode in APART:
        wide = width // 2 if mode == "split_half" else width
        second = x >= wide
        x -= wide * second
    elif mode in BELOW:
        high = height // 2 if mode == "over_under_half" else height
        second = y >= high
        y -= high * second
    elif mode in ("left", "right"):
        return int(mode == "right"), x, y
    elif mode == "anaglyph":
        return 0, x, y
    else:
        second = bool(is_second(mode, int(x), int(y)))
    return int(second != stereo.swap), x, y
