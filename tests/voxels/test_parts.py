"""Bricks stored in parts, as on a GPU, are the bricks that are stored as a whole."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

from clfractal.voxels import grid, programs
from clfractal.voxels.dense import grid_from_dense
from clfractal.voxels.grid import Grid
from tests.devices import device
from tests.voxels.grids import filled, place_of, volume_scene


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
    read: list[int] = []
    copy = cl.enqueue_copy

    def counted(queue: cl.CommandQueue, target: Any, source: Any, **settings: Any) -> Any:
        read.append(target.nbytes)
        return copy(queue, target, source, **settings)

    monkeypatch.setattr(grid, "_PIECE", 10_000)
    monkeypatch.setattr(cl, "enqueue_copy", counted)
    np.testing.assert_array_equal(whole.dense(), values)
    np.testing.assert_array_equal(whole.dense_normals(), normals)
    assert len(read) > 10
    assert max(read) <= 10_000
