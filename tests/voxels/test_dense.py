"""Grids of arrays that others made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clfractal.errors import STATUS_BAD_INPUT, DeviceError
from clfractal.voxels import dense
from clfractal.voxels.dense import grid_from_dense
from tests.devices import device
from tests.voxels.grids import place_of

CORNER, SPACING = (1.0, 2.0, 3.0), (0.5, 0.25, 1.0)


def noise(shape: tuple[int, int, int]) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Values from 0 to 200, most of them in one half of the block."""
    values = np.random.default_rng(1).uniform(0, 200, shape)
    values[: shape[0] // 2] *= 0.1
    return values


@pytest.mark.parametrize("shape", [(1, 1, 1), (2, 9, 17), (16, 8, 33), (40, 21, 30)])
def test_every_value_is_kept(shape: tuple[int, int, int]) -> None:
    values = noise(shape)
    for array in (values.astype(np.uint8), values.astype(np.float32), values.astype(np.int16), values > 100):
        grid = grid_from_dense(array, device(), place=place_of(array, SPACING, CORNER))
        assert grid.shape == shape[::-1]
        assert (grid.corner, grid.spacing) == (CORNER, SPACING)
        assert grid.kind == ("byte" if array.dtype in (np.uint8, np.bool_) else "float")
        np.testing.assert_array_equal(grid.dense(), array)
        assert (grid.table_entries >= 0).all()


def test_bricks_below_the_threshold_are_left_out() -> None:
    values = noise((40, 21, 30)).astype(np.float32)
    grid = grid_from_dense(values, device(), place=place_of(values, SPACING, CORNER), threshold=30)
    padded = np.pad(values, (0, 8), mode="edge")
    for (z, y, x), entry in np.ndenumerate(grid.table_entries):
        brick = padded[8 * z : 8 * z + 9, 8 * y : 8 * y + 9, 8 * x : 8 * x + 9]
        assert (entry >= 0) == (brick.max() > 30)
    assert 0 < grid.stats.stored_bricks < grid.table_entries.size
    found = grid.dense()
    assert ((found == values) | (found == grid.background)).all()
    assert (found == values)[values > 30].all()
    kept = found == values
    np.testing.assert_array_equal((grid.dense_normals()[..., 3] == 255)[kept], (values > 30)[kept])


@pytest.mark.parametrize("axis", [0, 1, 2], ids="zyx")
def test_a_brick_is_seen_by_its_ninth_layer(axis: int) -> None:
    """Between middles of voxels the ninth layer belongs to a brick, too: a voxel there makes both bricks visible."""
    for place, bricks in ((7, (0,)), (8, (0, 1)), (9, (1,)), (16, (1, 2))):
        values = np.zeros((25, 25, 25), np.float32)
        at = [4, 4, 4]
        at[axis] = place
        values[tuple(at)] = 1
        grid = grid_from_dense(values, device(), place=place_of(values, SPACING, CORNER), threshold=0.5)
        expected = np.zeros((3, 3, 3), bool)
        for brick in bricks:
            expected[tuple(brick if a == axis else 0 for a in range(3))] = True
        np.testing.assert_array_equal(grid.table_entries >= 0, expected)


def test_an_array_in_slabs_and_pools_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    values = noise((70, 21, 30)).astype(np.uint8)
    whole = grid_from_dense(
        values, device(), place=place_of(values, SPACING, CORNER), threshold=10, normal_radius=3
    )
    monkeypatch.setattr(dense, "SLAB_BYTES", 24 * values[0].nbytes)
    slots = whole.parts.slots
    monkeypatch.setattr(device(), "info", replace(device().info, max_alloc=736 * 4 * -(-slots // 3)))
    parts = grid_from_dense(
        values, device(), place=place_of(values, SPACING, CORNER), threshold=10, normal_radius=3
    )
    assert len(parts.values) == 3
    np.testing.assert_array_equal(parts.dense(), whole.dense())
    np.testing.assert_array_equal(parts.dense_normals(), whole.dense_normals())
    # The ninth layer of a brick is its neighbour's first, in another slab too: the whole array has the neighbour's.
    for pool, dense_values, dtype, more in (
        (parts.values, whole.dense(), np.uint8, ()),
        (parts.normals, whole.dense_normals(), np.uint8, (4,)),
    ):
        for place, samples in parts._stored(pool, dtype, more):
            own = dense_values[place]
            np.testing.assert_array_equal(samples[tuple(slice(n) for n in own.shape[:3])], own)


def test_values_that_are_no_numbers() -> None:
    values = np.ones((12, 12, 12), np.float32)
    values[4, 5, 6] = np.nan
    values[8, 8, 8] = np.inf
    grid = grid_from_dense(values, device(), place=place_of(values, SPACING, CORNER), threshold=0.5)
    np.testing.assert_array_equal(grid.dense(), values)
    assert (grid.dense_normals()[4, 5, 6] == (128, 128, 128, 0)).all()


@pytest.mark.parametrize(
    "array", [np.zeros((3, 3)), np.zeros((0, 2, 2)), np.zeros((2, 2, 2), complex), [["a"]]]
)
def test_arrays_that_are_no_volumes(array: object) -> None:
    with pytest.raises(ValueError, match="values must"):
        grid_from_dense(array, device(), place=place_of(array, SPACING, CORNER))  # type: ignore[arg-type]


def test_too_large_an_array(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device(), "info", replace(device().info, memory=2**20, max_alloc=2**20))
    values = np.zeros((96, 96, 96), np.uint8)
    with pytest.raises(DeviceError, match=r"a grid of 96 x 96 x 96 voxels needs .* has 1\.0 MiB") as told:
        grid_from_dense(values, device(), place=place_of(values, SPACING, CORNER))
    assert told.value.status == STATUS_BAD_INPUT
