"""Combines the two pictures of a stereo scene: side by side, interlaced, or as an anaglyph.

Everything is in linear light (the framebuffer's, or developed for a screen), and in coordinates of the finished
picture: a region equals the same part of the whole. A store of each eye's picture goes in, `Composed` comes out and is
written like any other picture, a few rows at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from typing import Any, Literal

import numpy as np

from clfractal.images.develop import Development, developed
from clfractal.images.modes import BELOW, BESIDE, PICKED, eye_size, picture_size
from clfractal.images.tiled import Bands, Floats, Picture
from clfractal.images.tiles import Region
from clfractal.scene.stereo import APART as APART
from clfractal.scene.stereo import Mode, Stereo

Side = Literal["left", "right"]
Planes = Mapping[str, Floats]
Place = tuple[slice, slice]

# Of one eye's picture: a composed one has no camera of its own.
_OF_AN_EYE = ("worldToCamera", "worldToNDC", "view")
# Of the tiles of one picture: several have other tiles together, though they may be told alike.
_OF_TILES = ("tileDevices",)


def composed_channels(stereo: Stereo, channels: Sequence[str]) -> tuple[str, ...]:
    """The channels of the finished picture, of those that the eyes' have: an anaglyph mixes colours and nothing else.

    Raises:
        SceneError: an anaglyph of pictures without R, G and B.
    """
    stereo.check_channels(channels)
    if not stereo.mixes_colors or stereo.mode in PICKED:
        return tuple(channels)
    return tuple(name for name in channels if name in "RGBA")


def eye_regions(stereo: Stereo, image: tuple[int, int], region: Region) -> dict[Side, Region | None]:
    """The part of each eye's picture that a region of the finished one is made of; None of an eye that it does not need.

    Raises:
        ValueError: the region is not inside the finished picture.
    """
    if not region.inside(*picture_size(stereo, image)):
        raise ValueError(f"{region} is not inside a picture of {picture_size(stereo, image)}")
    mode = stereo.mode
    if mode in ("left", "right"):
        return {"left": region if mode == "left" else None, "right": region if mode == "right" else None}
    width, height = eye_size(stereo, image)
    if mode in BESIDE:
        first, second = (_part(region, from_x, 0, width, height) for from_x in (0, width))
    elif mode in BELOW:
        first, second = (_part(region, 0, from_y, width, height) for from_y in (0, height))
    elif mode in PICKED:
        few = (min(region.height, 2), min(region.width, 2))  # rows and columns of every parity
        places = _places(mode, (region.x, region.y), few)
        first, second = (region if of_eye else None for of_eye in places)
    else:
        first = second = region
    if _swapped(stereo):
        first, second = second, first
    return {"left": first, "right": second}


def compose(
    stereo: Stereo, left: Planes, right: Planes, origin: tuple[int, int] = (0, 0)
) -> dict[str, Floats]:
    """The finished picture, or some rows of it.

    Args:
        left, right: channel -> float32 of shape (rows, columns), the part of each eye's picture that is shown
            (`eye_regions`); empty for an eye that is not.
        origin: x, y of the first pixel in the finished picture, which parities are counted from.

    Raises:
        ValueError: a mode of which nothing is composed, or no picture at all.
    """
    mode = stereo.mode
    if mode in APART:
        raise ValueError(f"{mode} keeps the two eyes' pictures apart")
    if mode in ("left", "right"):
        return dict(left if mode == "left" else right)
    first, second = (right, left) if _swapped(stereo) else (left, right)
    channels = composed_channels(stereo, tuple(first or second))
    if mode == "anaglyph":
        return _anaglyph(stereo, left, right, channels)
    if mode in PICKED:
        return {name: _picked(stereo, name, first, second, origin) for name in channels}
    axis = 1 if mode in BESIDE else 0
    shown = [planes for planes in (first, second) if planes]
    return {name: np.concatenate([planes[name] for planes in shown], axis=axis) for name in channels}


class Composed:
    """The finished picture of two eyes' stores, made as it is read; see `Framebuffer` for its attributes.

    Args:
        image: the scene's `image`, see `eye_size`.
        left, right: what holds the parts that `eye_regions` tells; None of an eye that is not needed.
        region: the part of the finished picture; all of it if None.
        header: added to what both pictures' headers agree in; the cameras are told only if one eye is shown alone.

    Raises:
        SceneError: as of `composed_channels`.
        ValueError: a store is missing or holds another part, or nothing is composed in this mode.
    """

    def __init__(
        self,
        stereo: Stereo,
        image: tuple[int, int],
        left: Picture | None,
        right: Picture | None,
        region: Region | None = None,
        header: Mapping[str, Any] | None = None,
    ) -> None:
        if stereo.mode in APART:
            raise ValueError(f"{stereo.mode} keeps the two eyes' pictures apart")
        self.stereo = stereo
        self.display = picture_size(stereo, image)
        self.region = region or Region(0, 0, *self.display)
        wanted = eye_regions(stereo, image, self.region)
        stores: dict[Side, Picture | None] = {"left": left, "right": right}
        for side, store in stores.items():
            part = wanted[side]
            if part is not None and (store is None or store.region != part):
                raise ValueError(f"the {side} eye's picture must hold {part}, got {store and store.region}")
        self.left = left if wanted["left"] else None
        self.right = right if wanted["right"] else None
        needed = [store for store in (self.left, self.right) if store is not None]
        if len({store.channels for store in needed}) > 1:
            raise ValueError("both eyes' pictures must have the same channels")
        self.channels: tuple[str, ...] = composed_channels(stereo, needed[0].channels)
        alone = stereo.mode in ("left", "right")
        agreed = agreed_header([store.header for store in needed])
        kept = {key: value for key, value in agreed.items() if alone or key not in _OF_AN_EYE}
        self.header: dict[str, Any] = {**kept, **(header or {})}

    def bands(self) -> Bands:
        """The picture from top to bottom, some rows at a time: (first_row, channel -> rows).

        Raises:
            FileError: a store cannot be read.
        """
        if self.stereo.mode in BELOW:
            yield from self._one_below_the_other()
            return
        left, right = (iter(store.bands()) if store else None for store in (self.left, self.right))
        row = self.region.y
        while row < self.region.bottom:
            pair = [next(bands)[1] if bands else {} for bands in (left, right)]
            planes = compose(self.stereo, pair[0], pair[1], (self.region.x, row))
            yield row, planes
            row += len(planes[self.channels[0]])

    def developed_parts(self, development: Development) -> Picture:
        """The picture of both eyes' pictures, each of them developed."""
        return self._of(lambda store: developed(store, development))

    def _of(self, change: Callable[[Picture], Picture]) -> Composed:
        """The same of other stores."""
        found = copy(self)
        found.left, found.right = (store and change(store) for store in (self.left, self.right))
        return found

    def _one_below_the_other(self) -> Bands:
        row = self.region.y
        for side in ("right", "left") if _swapped(self.stereo) else ("left", "right"):
            store = self.left if side == "left" else self.right
            for _, band in store.bands() if store else ():
                shown: list[Planes] = [band, {}] if side == "left" else [{}, band]
                planes = compose(self.stereo, shown[0], shown[1], (self.region.x, row))
                yield row, planes
                row += len(planes[self.channels[0]])


def agreed_header(headers: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What all of some pictures' headers tell alike, and what is so of the picture that they make."""
    first, *others = headers
    return {
        key: value
        for key, value in first.items()
        if not (others and key in _OF_TILES)
        and all(key in other and np.array_equal(other[key], value) for other in others)
    }


def _swapped(stereo: Stereo) -> bool:
    return stereo.swap and stereo.mode not in ("left", "right", *APART)


def _part(region: Region, from_x: int, from_y: int, width: int, height: int) -> Region | None:
    """The part of a region that lies in an eye's picture put at (from_x, from_y), in that picture's coordinates."""
    left, right = max(region.x - from_x, 0), min(region.right - from_x, width)
    top, bottom = max(region.y - from_y, 0), min(region.bottom - from_y, height)
    return Region(left, top, right - left, bottom - top) if right > left and bottom > top else None


def _places(mode: Mode, origin: tuple[int, int], shape: tuple[int, ...]) -> tuple[list[Place], list[Place]]:
    """Where the first and the second eye's pixels are in an array (rows, columns) that begins at the origin, x and y.

    The first eye's are those of even rows, columns, or sums of both.
    """
    x, y = origin
    every, halves = slice(None), (slice(0, None, 2), slice(1, None, 2))
    if mode == "rows":
        places = [(halves[y % 2], every)], [(halves[1 - y % 2], every)]
    elif mode == "columns":
        places = [(every, halves[x % 2])], [(every, halves[1 - x % 2])]
    else:
        same = (x + y) % 2
        places = (
            [(halves[0], halves[same]), (halves[1], halves[1 - same])],
            [(halves[0], halves[1 - same]), (halves[1], halves[same])],
        )
    first, second = ([place for place in of_eye if _holds_pixels(place, shape)] for of_eye in places)
    return first, second


def _holds_pixels(place: Place, shape: tuple[int, ...]) -> bool:
    return all(len(range(*part.indices(length))) for part, length in zip(place, shape, strict=True))


def _picked(stereo: Stereo, name: str, first: Planes, second: Planes, origin: tuple[int, int]) -> Floats:
    """One channel of a picture in which each pixel is one of either eye's."""
    result = np.empty_like((first or second)[name])
    places = _places(stereo.mode, origin, result.shape)
    colored = stereo.mode == "anaglyph_chessboard" and name in "RGB"
    for planes, of_eye, color in zip((first, second), places, stereo.colors, strict=True):
        passed = np.float32(color["RGB".index(name)] if colored else 1.0)
        for place in of_eye:
            if passed == 0:  # a primary that a filter blocks is black, however bright it is
                result[place] = 0
            else:
                np.multiply(planes[name][place], passed, out=result[place])
    return result


def _anaglyph(stereo: Stereo, left: Planes, right: Planes, channels: Sequence[str]) -> dict[str, Floats]:
    """Colours mixed by the matrices.

    Covered where either eye's picture is: so no colour becomes lighter than its coverage, and none is lost.
    """
    from clfractal.images.anaglyph import matrices, mix

    by = matrices(stereo.method, stereo.glasses)
    first, second = (right, left) if stereo.swap else (left, right)
    # Stored as planes, with the colours as the last axis of the view.
    colors = [np.moveaxis(np.stack([planes[name] for name in "RGB"]), 0, -1) for planes in (first, second)]
    mixed = mix(colors[0], colors[1], by)
    result = {name: mixed[..., component] for component, name in enumerate("RGB")}
    if "A" in channels:
        result["A"] = np.fmax(left["A"], right["A"])
    return {name: result[name] for name in channels}
