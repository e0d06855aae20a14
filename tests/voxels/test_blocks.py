"""Which blocks of stored bricks may be seen, and up to which sample nothing is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

from clfractal.integrators.volume import transfer_table, unseen_sample, value_range, volume_record
from clfractal.shading.transfer import TRANSFER_SIZE
from clfractal.voxels.blocks import BLOCK_BYTES, seen_blocks
from clfractal.voxels.dense import grid_from_dense
from tests.devices import device
from tests.voxels.grids import filled, place_of, volume_scene

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
