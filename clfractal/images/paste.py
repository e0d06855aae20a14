"""Several views in one picture, put into their places as it is read, a few rows at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from clfractal.images.compose import agreed_header
from clfractal.images.tiled import Bands, Floats, Picture
from clfractal.images.tiles import TILE, Region
from clfractal.scene.layout import Place


class Pasted:
    """A picture of several; see `Framebuffer` for its attributes. It needs memory for some rows of each.

    Args:
        stores: the views' pictures, each with the part of it that lies in the region; a later one covers earlier ones.
        places: where each view's whole picture stands.
        display: width and height of the finished picture, pixels.
        region: the part of it that is made.
        fill: of each channel what it has where no view is.
        header: of the whole; what all views' headers agree in if None.
    """

    def __init__(
        self,
        stores: Sequence[Picture],
        places: Sequence[Place],
        display: tuple[int, int],
        region: Region,
        fill: Mapping[str, float],
        header: Mapping[str, Any] | None = None,
    ) -> None:
        self.stores, self.places = stores, places
        self.display, self.region = display, region
        self.fill = dict(fill)
        self.channels: tuple[str, ...] = tuple(fill)
        agreed = agreed_header([store.header for store in stores]) if stores else {}
        seconds = sum(store.header.get("seconds", 0.0) for store in stores)
        self.header: dict[str, Any] = {**agreed, **(header or {}), "seconds": seconds}

    def bands(self) -> Bands:
        """The picture from top to bottom, at most a row of tiles at a time: (first_row, channel -> rows).

        Raises:
            FileError: a store cannot be read.
        """
        readers = [_Rows(store, place) for store, place in zip(self.stores, self.places, strict=True)]
        region = self.region
        for top in range(region.y, region.bottom, TILE):
            rows = min(TILE, region.bottom - top)
            band = {
                name: np.full((rows, region.width), value, np.float32) for name, value in self.fill.items()
            }
            for reader in readers:
                reader.put(band, top, region.x)
            yield top, band


class _Rows:
    """Reads a store's bands as far as they are needed, and keeps what is left of one for the next rows."""

    def __init__(self, store: Picture, place: Place) -> None:
        self.bands = iter(store.bands())
        # In coordinates of the finished picture.
        self.left, self.top = place.x + store.region.x, place.y + store.region.y
        self.bottom = place.y + store.region.bottom
        self.waiting: dict[str, Floats] = {}
        self.next_row = self.top

    def put(self, band: dict[str, Floats], top: int, left: int) -> None:
        """Puts the rows that a band of the finished picture shows into it."""
        height = next(iter(band.values())).shape[0]
        first, last = max(top, self.next_row), min(top + height, self.bottom)
        while first < last:
            if not self.waiting:
                _, self.waiting = next(self.bands)
            have = next(iter(self.waiting.values())).shape[0]
            count = min(have, last - first)
            for name, plane in band.items():
                part = self.waiting[name]
                columns = slice(self.left - left, self.left - left + part.shape[1])
                plane[first - top : first - top + count, columns] = part[:count]
            self.waiting = {name: part[count:] for name, part in self.waiting.items()} if count < have else {}
            first += count
        self.next_row = max(self.next_row, last)
