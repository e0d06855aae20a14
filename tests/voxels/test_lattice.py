"""Where voxels are, and the octree's table, against definitions."""

from __future__ import annotations

import time

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from clfractal.device.select import has_float64
from clfractal.device.structs import Precision
from clfractal.scene.volume import Box
from clfractal.voxels.lattice import (
    EXTENT,
    LATTICE,
    Lattice,
    all_places,
    lattice_of,
    pack_places,
    unpack_places,
)
from clfractal.voxels.octree import EMPTY, FULL, UNDECIDED, descend, empty_cubes
from tests.device.struct_layout import verify
from tests.devices import device


def test_voxels_of_a_cube() -> None:
    lattice = lattice_of(Box(center=(1.0, 2.0, 3.0), size=4.0), 8)
    assert lattice.shape == (8, 8, 8)
    assert lattice.spacing == (0.5, 0.5, 0.5)
    assert lattice.corner == (-1.0, 0.0, 1.0)
    np.testing.assert_allclose(lattice.axes("float64")[:8], -0.75 + 0.5 * np.arange(8))


def test_cubic_voxels_cover_the_shorter_sides() -> None:
    lattice = lattice_of(Box(center=(0.0, 0.0, 0.0), size=(4.0, 1.1, 0.001)), 40)
    assert lattice.spacing == (0.1, 0.1, 0.1)
    assert lattice.shape == (40, 11, 2)  # 1.1 / 0.1 is above 11 in rounding alone
    np.testing.assert_allclose(np.array(lattice.corner), [-2, -0.55, -0.1])


def test_three_resolutions_stretch_voxels() -> None:
    lattice = lattice_of(Box(center=(0.0, 0.0, 0.0), size=(4.0, 2.0, 1.0)), (8, 2, 5))
    assert lattice.shape == (8, 2, 5)
    assert lattice.spacing == (0.5, 1.0, 0.2)


@pytest.mark.parametrize(
    ("n", "bricks", "evaluated"), [(2, 1, 1), (8, 1, 1), (9, 1, 2), (10, 2, 2), (16, 2, 2), (17, 2, 3)]
)
def test_bricks_span_the_cells_between_voxels(n: int, bricks: int, evaluated: int) -> None:
    lattice = Lattice((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (n, 100, 100))
    assert lattice.bricks == (bricks, 13, 13)
    assert lattice.evaluated_bricks == (evaluated, 13, 13)


def test_coordinates_are_rounded_once_and_the_last_repeats() -> None:
    lattice = lattice_of(Box(center=(-1.7, 1e-9, 0.3), size=(4e-9, 3e-9, 2e-9)), (10, 9, 8))
    axes = lattice.axes("float64", 2)
    x = axes[:32].reshape(2, 16)  # two sub-points, two bricks
    np.testing.assert_array_equal(x[:, 9:], np.repeat(x[:, 9:10], 7, axis=1))
    exact = [-1.7 - 2e-9 + (i + 0.25) * 4e-10 for i in range(10)]
    assert np.abs(x[0, :10] - exact).max() <= 4.5e-16
    assert (np.diff(x[0, :10]) > 3.9e-10).all()
    np.testing.assert_array_equal(lattice.axes("float32", 2), axes.astype(np.float32))


def test_places_travel_in_64_bits() -> None:
    at = np.array([[0, 0, 0], [1, 2, 3], [2047, 2046, 2045], [2**21 - 1, 2**21 - 1, 2**21 - 1]])
    np.testing.assert_array_equal(unpack_places(pack_places(*at.T)), at)
    np.testing.assert_array_equal(
        unpack_places(all_places((3, 2, 2)))[:5], [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0]]
    )


@given(
    st.integers(1, 40), st.integers(1, 40), st.integers(1, 40), st.integers(0, 2**32 - 1), st.floats(0, 0.02)
)
def test_descending_finds_the_bricks_that_hold_something(
    x: int, y: int, z: int, seed: int, share: float
) -> None:
    random = np.random.default_rng(seed)
    held = random.random((z, y, x)) < share
    # Half of the block is inside as a whole.
    whole = np.zeros_like(held)
    whole[: z // 2] = True
    held |= whole

    def classify(nodes: npt.NDArray[np.uint64], cells: int) -> npt.NDArray[np.uint8]:
        side = cells // 8
        spans = [
            tuple(slice(side * n, side * n + side) for n in place[::-1]) for place in unpack_places(nodes)
        ]
        classes = [FULL if whole[s].all() else UNDECIDED if held[s].any() else EMPTY for s in spans]
        return np.array(classes, np.uint8)

    lattice = Lattice((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (8 * x, 8 * y, 8 * z))
    descent = descend(lattice, classify)
    for places, expected in ((descent.open, held & ~whole), (descent.full, whole)):
        found = np.zeros_like(held)
        at = unpack_places(places)
        found[at[:, 2], at[:, 1], at[:, 0]] = True
        assert len(at) == found.sum()
        np.testing.assert_array_equal(found, expected)
    assert descent.looked >= 1


@given(
    arrays.arrays(
        np.int32, arrays.array_shapes(min_dims=3, max_dims=3, max_side=9), elements=st.integers(-1, 1)
    )
)
def test_empty_cubes_against_their_definition(table: npt.NDArray[np.int32]) -> None:
    found = empty_cubes(table)
    for place, entry in np.ndenumerate(table):
        if entry >= 0:
            assert found[place] == entry
            continue
        sides = -1 - int(found[place])
        for octant in range(8):
            side, expected = 1, 0
            # Of the array's axes the last is x, the lowest bit.
            while side < max(table.shape):
                cube = tuple(
                    slice(max(p + 1 - 2 * side, 0), p + 1)
                    if octant >> (2 - axis) & 1
                    else slice(p, p + 2 * side)
                    for axis, p in enumerate(place)
                )
                if (table[cube] >= 0).any():
                    break
                side, expected = 2 * side, expected + 1
            digits = [sides >> (octant + 8 * i) & 1 for i in range(3)]
            assert sum(digit << i for i, digit in enumerate(digits)) == expected


def test_empty_cubes_of_a_long_grid() -> None:
    """A side has three bits: at most 128 bricks."""
    found = empty_cubes(np.full((1, 1, 700), -1, np.int32))
    assert (found == -1 - 0xFFFFFF).all()


def test_empty_cubes_are_quick() -> None:
    table = np.where(np.random.default_rng(0).random((64, 64, 64)) < 0.02, 1, -1).astype(np.int32)
    empty_cubes(table)
    start = time.process_time()
    empty_cubes(table)
    # A tenth of this is usual.
    assert time.process_time() - start < 0.1


@pytest.mark.conformance
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_the_device_lays_structs_out_as_we_do(precision: Precision) -> None:
    if precision == "float32" or has_float64(device().info):
        verify(device(), (LATTICE, EXTENT), precision)
