"""Where voxels are, the octree's table, bricks in parts, grids of arrays that others made, and which blocks may be seen."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from clfractal.device.select import has_float64
from clfractal.device.structs import Precision
from clfractal.errors import STATUS_BAD_INPUT, DeviceError
from clfractal.integrators.volume import transfer_table, unseen_sample, value_range, volume_record
from clfractal.scene.volume import Box
from clfractal.shading.transfer import TRANSFER_SIZE
from clfractal.voxels import dense, grid, programs
from clfractal.voxels.blocks import BLOCK_BYTES, seen_blocks
from clfractal.voxels.dense import grid_from_dense
from clfractal.voxels.grid import Grid
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
from tests.calls import counted
from tests.device.struct_layout import verify
from tests.devices import device
from tests.voxels.grids import filled, place_of, volume_scene


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
    # A hundredth of this is usual; one place after the other would take seconds.
    assert time.process_time() - start < 1


@pytest.mark.conformance
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_the_device_lays_structs_out_as_we_do(precision: Precision) -> None:
    if precision == "float32" or has_float64(device().info):
        verify(device(), (LATTICE, EXTENT), precision)


# --- bricks in parts ---


def of_bits() -> Grid:
    """Radius 3 looks two octants away, and the box's sides cut the solid."""
    box = {"center": [0.3, 0.2, -0.1], "size": [1.6, 1.4, 1.2]}
    return filled(volume_scene("mandelbulb", 4, resolution=44, box=box, normal_radius=3))


def of_shares() -> Grid:
    return filled(volume_scene("mandelbulb", 4, resolution=30, value="coverage", normal_radius=1))


def of_counts() -> Grid:
    return filled(volume_scene("mandelbulb", 4, resolution=20, value="iterations", store="float"))


def of_an_array() -> Grid:
    values = np.random.default_rng(3).normal(size=(19, 25, 33)).astype(np.float32)
    return grid_from_dense(values, device(), place=place_of(values, (1, 1, 2)), normal_radius=2)


@pytest.mark.parametrize("made", [of_bits, of_shares, of_counts, of_an_array])
def test_parts_of_bricks(made: Callable[[], Grid], monkeypatch: pytest.MonkeyPatch) -> None:
    whole = made()
    monkeypatch.setattr(programs, "takes_parts", lambda device: True)
    parts = made()
    np.testing.assert_array_equal(parts.table_entries, whole.table_entries)
    np.testing.assert_array_equal(parts.dense(), whole.dense())
    # Compilers round sums of products in different places, and so a direction that is hardly one may differ.
    off = np.abs(parts.dense_normals().astype(int) - whole.dense_normals().astype(int)).max(axis=-1)
    assert np.unique(whole.dense_normals()).size > 100
    assert (off <= 1).mean() > 0.999


@pytest.mark.parametrize("made", [of_counts, of_an_array])
def test_a_grid_is_read_in_pieces(made: Callable[[], Grid], monkeypatch: pytest.MonkeyPatch) -> None:
    """Never as a whole: its pool is as large as the array that is made of it."""
    whole = made()
    values, normals = whole.dense(), whole.dense_normals()
    monkeypatch.setattr(grid, "_PIECE", 10_000)
    copies = counted(monkeypatch, cl, "enqueue_copy")
    np.testing.assert_array_equal(whole.dense(), values)
    np.testing.assert_array_equal(whole.dense_normals(), normals)
    assert len(copies) > 10
    assert max(target.nbytes for _, target, *_ in copies) <= 10_000


# --- grids of others ---


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


# --- which blocks may be seen ---


RAMPS = {
    "from 0.2": [{"at": 0.2, "opacity": 0}, {"at": 0.8, "opacity": 1}],
    "a step": [{"at": 0.5, "opacity": 0}, {"at": 0.5, "opacity": 1}],
    "far off": [{"at": 1e6, "opacity": 0}, {"at": 1e6 + 0.7, "opacity": 0}, {"at": 1e6 + 1, "opacity": 1}],
}


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("parts", [1, 2])
def test_blocks_against_their_definition(
    dtype: type[Any], parts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sparse samples, and one that is not a number."""
    random = np.random.default_rng(5)
    values = (random.uniform(0, 200, (21, 30, 26)) * (random.random((21, 30, 26)) < 0.03)).astype(dtype)
    if dtype == np.float32:
        values[3, 4, 5] = np.nan
    slots = 3 * 4 * 4
    monkeypatch.setattr(device(), "info", replace(device().info, max_alloc=736 * 4 * -(-slots // parts)))
    grid = grid_from_dense(values, device(), place=place_of(values, (1, 1, 1)))
    assert len(grid.values) == parts
    found = np.empty(BLOCK_BYTES * grid.parts.slots, np.uint8)
    cl.enqueue_copy(device().queue, found, seen_blocks(grid, 60.0))
    padded = np.pad(values, (0, 8), mode="edge")
    for (z, y, x), slot in np.ndenumerate(grid.table_entries):
        brick = padded[8 * z : 8 * z + 9, 8 * y : 8 * y + 9, 8 * x : 8 * x + 9]
        octants = found[BLOCK_BYTES * slot : BLOCK_BYTES * (slot + 1)]
        for k, j, i in np.ndindex(4, 4, 4):
            block = brick[2 * k : 2 * k + 3, 2 * j : 2 * j + 3, 2 * i : 2 * i + 3]
            octant = octants[4 * (k >> 1) + 2 * (j >> 1) + (i >> 1)]
            bit = octant >> (4 * (k & 1) + 2 * (j & 1) + (i & 1)) & 1
            assert bit == (not (block <= 60).all())
    assert 0 < np.unpackbits(found).mean() < 1


@pytest.mark.parametrize("ramp", RAMPS)
def test_nothing_is_seen_up_to_the_unseen_sample(ramp: str) -> None:
    """As a kernel looks places up, in float; and not much further."""
    scene = volume_scene(
        "hast", 20, resolution=16, value="iterations", store="float", transfer={"opacity": RAMPS[ramp]}
    )
    grid = filled(scene)
    sample = np.float32(unseen_sample(scene, grid))
    record = volume_record(scene, grid, "float32")
    opacity = transfer_table(scene, value_range(scene, grid))[:, 0]
    low, scale = np.float32(record["low"]), np.float32(record["range"])
    place = (sample - low) * scale * np.float32(TRANSFER_SIZE - 1)
    first = np.flatnonzero(opacity)[0]
    assert place <= first - 1
    # Rounding far from 0 takes its part.
    assert place > first - 3 - 2 * np.spacing(np.abs(low)) * scale * TRANSFER_SIZE


def test_the_unseen_sample_where_all_or_nothing_is_seen() -> None:
    for opacity, test in ((0.0, np.isposinf), (0.1, np.isnan)):
        scene = volume_scene("hast", 20, resolution=16, transfer={"opacity": [{"at": 0, "opacity": opacity}]})
        assert test(unseen_sample(scene, filled(scene)))
    surface = volume_scene("hast", 20, resolution=16)
    found = unseen_sample(surface, filled(surface))
    assert found == np.nextafter(np.float32(127.5), np.float32(0))
