"""Interfaces of objects that hold a picture: the engine writes tiles to them, files are made from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from clfractal.images.provenance import Provenance, RenderDevice
from clfractal.images.tiles import Region, Tile, TileGrid

Floats = npt.NDArray[np.float32]
Bands = Iterator[tuple[int, dict[str, Floats]]]


class Picture(Protocol):
    """A picture that can be written to files."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels, in the order of a tile's first axis."""

    @property
    def display(self) -> tuple[int, int]:
        """Width and height of the whole picture, in pixels."""

    @property
    def region(self) -> Region:
        """The part of the picture that is held."""

    @property
    def header(self) -> dict[str, Any]:
        """The header of picture files; see `Framebuffer`."""

    def bands(self) -> Bands:
        """The picture from top to bottom, some rows at a time; one row of tiles of a store.

        Gives (first_row, channel name -> float32 of shape (rows, region width)); first_row in picture
        coordinates. Pixels of missing tiles have the channel's fill value.
        """


class TiledStore(Picture, Protocol):
    """Where the engine puts finished tiles and from where files are written."""

    @property
    def grid(self) -> TileGrid:
        """The tiles of the region."""

    @property
    def done(self) -> npt.NDArray[np.bool_]:
        """For each tile, whether it is finished; not to be written to."""

    @property
    def provenance(self) -> Provenance:
        """Which devices made the tiles, if several did."""

    def put_tiles(
        self, indices: npt.NDArray[np.int32], framebuffer: Floats, render_device: RenderDevice | None = None
    ) -> None:
        """Stores whole tiles: float32 of shape (tiles, channels, TILE, TILE), as far as they lie in the region.

        Args:
            render_device: the device that made them, where several render the picture.
        """

    def tell(self, key: str, value: Any) -> None:
        """Adds an entry to the header."""


def check_tile(array: Floats, tile: Tile, channels: Sequence[str]) -> None:
    """Raises ValueError if an array does not fit its tile: a mistake of the program, not of the user."""
    expected = (len(channels), tile.height, tile.width)
    if array.shape != expected:
        raise ValueError(f"tile {tile.index} needs shape {expected}, got {array.shape}")
