"""Grids filled on the device against NumPy, voxel by voxel, and octree fills against brute ones."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.errors import STATUS_BAD_INPUT, DeviceError
from tests.calls import raising
from tests.devices import check_usable, device
from tests.voxels.grids import ROUNDED, differing_voxels, filled, inside, volume_scene, voxel_points


def check_inside(grid: Any, scene: Any, share: float = ROUNDED) -> None:
    dense = grid.dense()
    nx, ny, nz = grid.shape
    assert dense.shape == (nz, ny, nx)
    assert dense.dtype == np.uint8
    assert set(np.unique(dense)) <= {0, 255}
    expected = inside(scene.chain, voxel_points(grid.place), scene.formula.iterations)
    assert 0.005 < expected.mean() < 0.995
    assert (dense.astype(bool) != expected).mean() <= share


@pytest.mark.parametrize(("formula", "iterations"), [("hast", 20), ("mandelbulb", 6)])
def test_every_voxel_against_numpy(formula: str, iterations: int) -> None:
    scene = volume_scene(formula, iterations, resolution=64)
    check_inside(filled(scene), scene)


def test_sides_that_are_no_multiples_of_bricks() -> None:
    box = {"center": [-0.3, 0.1, 0.0], "size": [2.6, 2.0, 1.9]}
    # 41 = 5 * 8 + 1: the last layer belongs to no brick as its own.
    for resolution in [(41, 33, 50), (10, 2, 9), (2, 40, 3)]:
        scene = volume_scene("hast", 20, resolution=resolution, box=box)
        grid = filled(scene)
        assert grid.shape == resolution
        check_inside(grid, scene, 1e-3)


def test_every_lane_count_gives_the_same_grid() -> None:
    scene = volume_scene("hast", 20, resolution=48, box={"size": 2.6})
    grids = [filled(scene, lanes=lanes) for lanes in accepted_lanes(device(), "float32")]
    check_inside(grids[0], scene)
    for grid in grids[1:]:
        # Compilers fuse products and sums in different places.
        assert (grid.dense() != grids[0].dense()).mean() <= ROUNDED


def test_float64() -> None:
    check_usable("float64")
    precision: Precision = "float64"
    scene = volume_scene("hast", 20, resolution=48, box={"size": 2.6})
    check_inside(filled(scene, precision=precision), scene, 0)
    # 10^9 times smaller: neighbours differ in the tenth digit of their coordinates.
    zoom = [{"center": [-0.75, 0.0, 0.05], "scale": 2e3}, {"center": [-0.75, 0.0, 0.05], "scale": 5e5}]
    deep = volume_scene("hast", 20, resolution=24, zoom=zoom)
    grid = filled(deep, precision=precision)
    expected = inside(deep.chain, voxel_points(grid.place), 20)
    np.testing.assert_array_equal(grid.dense() > 0, expected)


@pytest.mark.parametrize(
    ("formula", "iterations", "settings"),
    [
        ("hast", 40, {}),
        ("hast", 60, {"zoom": [{"center": [-1.0, 0.3, 0.1], "scale": 20}]}),
        ("mandelbulb", 10, {}),
        ("mandelbulb", 10, {"zoom": [{"center": [0.6, 0.6, 0.4], "scale": 8}]}),
        ("mandelbox", 12, {}),
        ("quaternion_julia", 30, {}),
        ("quaternion_julia", 60, {"zoom": [{"center": [0.4, 0.5, 0.2], "scale": 6}]}),
        ("menger_sponge", 5, {}),
    ],
)
def test_octree_against_brute(formula: str, iterations: int, settings: dict[str, Any]) -> None:
    scene = volume_scene(formula, iterations, resolution=128, **settings)
    octree = filled(scene)
    brute = filled(volume_scene(formula, iterations, resolution=128, fill="brute", **settings))
    assert brute.stats.evaluated_voxels == 128**3
    assert brute.stats.nodes == 0
    assert octree.stats.evaluated_voxels < brute.stats.evaluated_voxels
    assert 0 < octree.stats.stored_bricks < 16**3
    # At most one in a million.
    assert differing_voxels(octree, brute) <= 128**3 // 1_000_000
    np.testing.assert_array_equal(octree.table_entries < 0, brute.table_entries < 0)


def test_coverage_is_the_share_of_points_inside() -> None:
    settings = {"resolution": 24, "value": "coverage", "sub_points": 3, "box": {"size": 2.6}}
    scene = volume_scene("hast", 12, **settings)
    grid = filled(scene)
    share = np.zeros((24, 24, 24))
    thirds = (1 / 6, 0.5, 5 / 6)
    for x, y, z in itertools.product(thirds, thirds, thirds):
        share += inside(scene.chain, voxel_points(grid.place, (x, y, z)), 12)
    off = np.abs(grid.dense() - np.rint(share / 27 * 255))
    assert (off > 0).mean() < 1e-3
    assert off.max() <= 20  # two of 27 points
    assert ((share > 0) & (share < 27)).sum() > 500
    exact = filled(volume_scene("hast", 12, store="float", **settings))
    assert exact.dense().dtype == np.float32
    np.testing.assert_array_equal(np.rint(exact.dense() * 255), grid.dense())


def test_iterations_are_smooth_counts() -> None:
    from clfractal.integrators import points

    settings = {"resolution": (24, 20, 17), "value": "iterations", "box": {"size": [3.0, 2.5, 2.0]}}
    scene = volume_scene("hast", 16, store="float", **settings)
    grid = filled(scene, lanes=accepted_lanes(device(), "float32")[-1])
    assert (grid.table_entries >= 0).all()
    at = voxel_points(grid.place)
    lanes = accepted_lanes(device(), "float32")[-1]
    expected = points.distances(scene.chain, at.reshape(-1, 3), 16, device=device(), lanes=lanes).smooth
    expected = np.minimum(expected, 16)
    assert (np.abs(grid.dense().reshape(-1) - expected) > 1e-3).mean() < 1e-3
    assert grid.range == (0.0, 16.0)
    kept = filled(volume_scene("hast", 16, **settings)).dense()
    assert kept.dtype == np.uint8
    assert (np.abs(kept - np.rint(grid.dense() * (255 / 16))) > 1).sum() == 0


def test_bricks_that_are_uniform_are_not_stored() -> None:
    scene = volume_scene("mandelbulb", 6, resolution=96)
    grid = filled(scene)
    dense = grid.dense()
    padded = np.pad(dense, (0, 1), mode="edge")
    assert grid.solid_slot == 0
    for (z, y, x), entry in np.ndenumerate(grid.table_entries):
        brick = padded[8 * z : 8 * z + 9, 8 * y : 8 * y + 9, 8 * x : 8 * x + 9]
        assert (entry < 0) == (brick == 0).all()
        assert (entry == 0) == (brick == 255).all()
    stored = grid.table_entries[grid.table_entries > 0]
    np.testing.assert_array_equal(np.sort(stored), np.arange(1, grid.parts.slots))
    assert grid.stats.solid_bricks == (grid.table_entries == 0).sum()
    assert grid.stats.stored_bricks == len(stored)


def test_a_grid_that_is_empty_or_full() -> None:
    empty = filled(volume_scene("hast", 20, resolution=20, box={"center": [5, 5, 5], "size": 1.0}))
    assert (empty.table_entries < 0).all()
    assert not empty.dense().any()
    full = filled(volume_scene("hast", 20, resolution=20, box={"size": 0.1}))
    assert (full.table_entries == 0).all()
    assert (full.dense() == 255).all()


def test_pools_in_several_buffers(monkeypatch: pytest.MonkeyPatch) -> None:
    from dataclasses import replace

    scene = volume_scene("hast", 20, resolution=64)
    whole = filled(scene)
    slots = whole.parts.slots
    info = replace(device().info, max_alloc=736 * 4 * (slots // 3))
    monkeypatch.setattr(device(), "info", info)
    parts = filled(scene)
    assert parts.parts.count == len(parts.values) == len(parts.normals) == 4
    np.testing.assert_array_equal(parts.dense(), whole.dense())
    np.testing.assert_array_equal(parts.dense_normals(), whole.dense_normals())


@pytest.mark.parametrize(
    "settings",
    [
        {"resolution": 16384},
        {"resolution": 4096, "fill": "brute"},
        {"resolution": 2048, "value": "iterations"},
    ],
)
def test_too_large_a_grid_is_refused_before_anything_is_done(
    settings: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    monkeypatch.setattr(device(), "info", replace(device().info, memory=2**31, max_alloc=2**31))
    monkeypatch.setattr(Device, "buffer", None)
    with pytest.raises(DeviceError, match=r"a grid of .* voxels needs [\d.]+ GiB of .* has 2\.0 GiB") as told:
        filled(volume_scene("hast", 20, **settings), lanes=8)
    assert told.value.status == STATUS_BAD_INPUT


def test_progress_and_an_interrupt_in_it() -> None:
    scene = volume_scene("hast", 20, resolution=64)
    seen: list[tuple[str, int, int]] = []
    filled(scene, progress=lambda *each: seen.append(each))
    assert {stage for stage, _, _ in seen} == {"octree", "fill", "store"}
    assert all(0 <= done <= total for _, done, total in seen)

    with pytest.raises(KeyboardInterrupt):
        filled(scene, progress=raising(KeyboardInterrupt))
