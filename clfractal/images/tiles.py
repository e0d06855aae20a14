"""How a picture is cut into tiles, and in which order they are rendered.

Picture coordinates: whole pixels, (0, 0) is the top left pixel of the full picture, y points down.
Tiles are TILE x TILE pixels and aligned to the picture's origin, not to the region: a pixel lies in the same
place of the same tile whether the whole picture or a part of it is rendered, so both give the same numbers.
Tiles at the rim of the region are cut to it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

TILE = 32
"""Side of a tile, in pixels."""


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle of pixels in picture coordinates; `x`, `y` is its top left pixel.

    Raises:
        ValueError: it holds no pixel, or begins left of or above the picture.
    """

    x: int
    y: int
    width: int
    height: int

    def __post_init__(self) -> None:
        if self.x < 0 or self.y < 0 or self.width < 1 or self.height < 1:
            raise ValueError(f"a region needs at least one pixel inside the picture, got {self}")

    @property
    def right(self) -> int:
        """First column right of the region."""
        return self.x + self.width

    @property
    def bottom(self) -> int:
        """First row below the region."""
        return self.y + self.height

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.width * self.height

    def inside(self, width: int, height: int) -> bool:
        """Whether a picture of `width` x `height` pixels holds all of the region."""
        return self.right <= width and self.bottom <= height


@dataclass(frozen=True, slots=True)
class Tile:
    """One tile, cut to the region; `x`, `y` in picture coordinates, `index` row-major over the grid."""

    index: int
    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class TileGrid:
    """The tiles that cover a region, numbered row by row from the top left one.

    A picture of 16384 x 16384 pixels has 262,144 tiles: `boxes` and `order_from_center` work on arrays,
    `tile` makes one object when it is needed.
    """

    region: Region

    @property
    def first_column(self) -> int:
        """Column of the leftmost tile, counted from the picture's left rim."""
        return self.region.x // TILE

    @property
    def first_row(self) -> int:
        """Row of the topmost tile, counted from the picture's top."""
        return self.region.y // TILE

    @property
    def columns(self) -> int:
        """Number of tiles side by side."""
        return (self.region.right - 1) // TILE - self.first_column + 1

    @property
    def rows(self) -> int:
        """Number of tiles one above the other."""
        return (self.region.bottom - 1) // TILE - self.first_row + 1

    @property
    def count(self) -> int:
        """Number of tiles."""
        return self.columns * self.rows

    def tile(self, index: int) -> Tile:
        """The tile numbered `index`.

        Raises:
            IndexError: there is no such tile.
        """
        if not 0 <= index < self.count:
            raise IndexError(f"tile {index} of {self.count}")
        row, column = divmod(index, self.columns)
        region = self.region
        left = max((self.first_column + column) * TILE, region.x)
        top = max((self.first_row + row) * TILE, region.y)
        right = min((self.first_column + column + 1) * TILE, region.right)
        bottom = min((self.first_row + row + 1) * TILE, region.bottom)
        return Tile(index, left, top, right - left, bottom - top)

    def boxes(self, indices: npt.ArrayLike | None = None) -> npt.NDArray[np.int32]:
        """The tiles as an array of shape (n, 4): x, y, width, height; of all tiles, or of those named."""
        chosen = np.arange(self.count) if indices is None else np.asarray(indices, dtype=np.int64)
        row, column = np.divmod(chosen, self.columns)
        region = self.region
        left = np.maximum((self.first_column + column) * TILE, region.x)
        top = np.maximum((self.first_row + row) * TILE, region.y)
        right = np.minimum((self.first_column + column + 1) * TILE, region.right)
        bottom = np.minimum((self.first_row + row + 1) * TILE, region.bottom)
        return np.stack([left, top, right - left, bottom - top], axis=-1).astype(np.int32)

    def order_from_center(self) -> npt.NDArray[np.int32]:
        """All tile indices, nearest to the region's centre first; ties by index.

        Distances are compared in whole half-pixels, so the order is the same on every machine.
        """
        return _order_from_center(self)


@lru_cache(maxsize=8)
def _order_from_center(grid: TileGrid) -> npt.NDArray[np.int32]:
    """Kept, and not to be written to: frames of a film ask for the same again and again."""
    boxes, region = grid.boxes().astype(np.int64), grid.region
    across = 2 * boxes[:, 0] + boxes[:, 2] - (2 * region.x + region.width)
    down = 2 * boxes[:, 1] + boxes[:, 3] - (2 * region.y + region.height)
    order = np.argsort(across * across + down * down, kind="stable").astype(np.int32)
    order.setflags(write=False)
    return order
