"""Tiles cover a region once, lie on the picture's own lattice, and come from the centre outwards."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.images.tiles import TILE, Region, TileGrid

regions = st.builds(
    Region, st.integers(0, 200), st.integers(0, 200), st.integers(1, 300), st.integers(1, 300)
)


@given(regions)
def test_every_pixel_is_in_one_tile(region: Region) -> None:
    grid = TileGrid(region)
    covered = np.zeros((region.bottom, region.right), dtype=int)
    for index in range(grid.count):
        tile = grid.tile(index)
        covered[tile.y : tile.y + tile.height, tile.x : tile.x + tile.width] += 1
        assert tile.index == index
        assert 1 <= tile.width <= TILE
        assert tile.x // TILE == (tile.x + tile.width - 1) // TILE
        assert tile.y // TILE == (tile.y + tile.height - 1) // TILE
    inside = covered[region.y :, region.x :]
    assert (inside == 1).all()
    assert covered.sum() == region.pixels


@given(regions)
def test_boxes_are_the_tiles(region: Region) -> None:
    grid = TileGrid(region)
    wanted = [(tile.x, tile.y, tile.width, tile.height) for tile in map(grid.tile, range(grid.count))]
    assert [tuple(box) for box in grid.boxes().tolist()] == wanted
    chosen = list(range(0, grid.count, 3))
    assert [tuple(box) for box in grid.boxes(chosen).tolist()] == wanted[::3]


@given(regions)
def test_tiles_are_numbered_row_by_row(region: Region) -> None:
    boxes = TileGrid(region).boxes()
    assert np.array_equal(np.lexsort((boxes[:, 0], boxes[:, 1])), np.arange(len(boxes)))


@given(regions)
def test_order_goes_from_the_centre_outwards(region: Region) -> None:
    grid = TileGrid(region)
    order = grid.order_from_center()
    assert sorted(order.tolist()) == list(range(grid.count))
    boxes = grid.boxes()[order].astype(float)
    x = boxes[:, 0] + boxes[:, 2] / 2 - (region.x + region.width / 2)
    y = boxes[:, 1] + boxes[:, 3] / 2 - (region.y + region.height / 2)
    distances = np.hypot(x, y)
    assert (np.diff(distances) >= -1e-9).all()


def test_the_largest_picture() -> None:
    grid = TileGrid(Region(0, 0, 16384, 16384))
    assert grid.count == 262_144
    first = grid.tile(int(grid.order_from_center()[0]))
    assert (first.x, first.y) == (8160, 8160)
    assert grid.tile(grid.count - 1).x == 16384 - TILE


def test_wrong_regions_and_indices() -> None:
    for wrong in ((-1, 0, 1, 1), (0, -1, 1, 1), (0, 0, 0, 1), (0, 0, 1, 0)):
        with pytest.raises(ValueError, match="region"):
            Region(*wrong)
    grid = TileGrid(Region(0, 0, 33, 33))
    for index in (-1, 4):
        with pytest.raises(IndexError):
            grid.tile(index)
