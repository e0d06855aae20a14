"""A grid from an array of values, of any origin: the visible bricks, with gradient normals."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.select import Device
from clfractal.scene.grid_place import GridPlace
from clfractal.voxels import programs
from clfractal.voxels.brick_store import extent_buffer
from clfractal.voxels.grid import SAMPLE_BYTES, Grid, GridStats, Kind
from clfractal.voxels.lattice import BRICK, bricks_of, pack_places
from clfractal.voxels.octree import empty_cubes
from clfractal.voxels.pool import allocate, plan_pools, upload

# Bytes of the array that are on the device at a time, beside the grid.
SLAB_BYTES = 1 << 28


def grid_from_dense(
    array: npt.ArrayLike,
    device: Device,
    *,
    place: GridPlace,
    threshold: float | None = None,
    normal_radius: int = 1,
    on_compile: Callable[[str], None] | None = None,
) -> Grid:
    """A grid of values that are given.

    Args:
        array: real numbers of shape (nz, ny, nx), at least one along each axis; uint8 is kept as it is, any other type
            becomes float32.
        device: where the grid shall be.
        place: where the voxels are; of the array's shape.
        threshold: bricks whose values are all at or below it cannot be seen and are not stored; None stores all. Values
            above it count as inside (a normal's fourth byte); with None all do.
        normal_radius: of the low-pass filter before normals, voxels, 0 to 4.
        on_compile: told a line if the program has to be compiled first.

    Raises:
        ValueError: an array of another shape or type.
        DeviceError: status 2, told before anything is uploaded, if the grid does not fit; status 3, the device failed.
    """
    values = np.asarray(array)
    if values.ndim != 3 or 0 in values.shape:
        raise ValueError(f"values must have shape (nz, ny, nx), got {values.shape}")
    if values.dtype.kind not in "buif":
        raise ValueError(f"values must be real numbers, got {values.dtype}")
    kind: Kind = "byte" if values.dtype in (np.uint8, np.bool_) else "float"
    values = values.astype(np.uint8 if kind == "byte" else np.float32, copy=False)
    nx, ny, nz = values.shape[::-1]
    if (nx, ny, nz) != place.shape:
        raise ValueError(f"a place of {place.shape} voxels is none of values of shape {values.shape}")
    visible = np.ones(bricks_of(place.shape)[::-1], np.bool_)
    if threshold is not None:
        # NaN is not above any number, so it is invisible.
        visible = _brick_maximum(values) > threshold
    least = (
        float(np.nextafter(np.float32(threshold), np.float32(np.inf))) if threshold is not None else -np.inf
    )
    alone, start = programs.takes_parts(device), time.perf_counter()
    recipe = programs.store_recipe("slab", kind, normal_radius, alone=alone)
    entries = np.full(visible.shape, -1, np.int32)
    stored = int(visible.sum())
    entries[visible] = np.arange(stored, dtype=np.int32)
    sizes = (SAMPLE_BYTES[kind], 4)
    layer = nx * ny * sizes[0]
    others = 4 * entries.size + min(values.nbytes, max(SLAB_BYTES, 24 * layer))
    parts = plan_pools(device, stored, sizes, others, f"a grid of {nx} x {ny} x {nz} voxels")
    built = programs.build_all(device, [recipe], on_compile)[0]
    pools = [allocate(device, parts, size, "the grid") for size in sizes]
    slabs = _Slabs(device, place, values, built, least, normal_radius)
    milliseconds = 0.0
    z, y, x = np.nonzero(visible)
    for (first, after), value_part, normal_part in zip(parts.ranges(), *pools, strict=True):
        milliseconds += slabs.store(value_part, normal_part, x[first:after], y[first:after], z[first:after])
    entries = empty_cubes(entries)
    table = upload(device, entries, "the grid's table", "storing the grid")
    stats = GridStats(
        stored_bricks=stored,
        build_ms=built.build_ms,
        store_ms=milliseconds,
        wall_ms=1e3 * (time.perf_counter() - start),
    )
    # (Of NaN alone there is no least value, and `min` takes the threshold.)
    background = (
        float(min(threshold, float(np.fmin.reduce(values, axis=None)))) if threshold is not None else 0.0
    )
    return Grid(
        place,
        kind,
        (0.0, 255.0) if kind == "byte" else (0.0, 1.0),
        device,
        parts,
        entries,
        table,
        pools[0],
        pools[1],
        None,
        background=background,
        stats=stats,
    )


class _Slabs:
    """Stores bricks out of slabs of the array, whole layers of bricks with the voxels around that normals depend on."""

    def __init__(
        self,
        device: Device,
        place: GridPlace,
        values: npt.NDArray[Any],
        built: programs.Built,
        opaque: float,
        normal_radius: int,
    ) -> None:
        self.device, self.place, self.values = device, place, values
        self.kind: Kind = "byte" if values.dtype == np.uint8 else "float"
        self.built, self.opaque, self.reach = built, opaque, normal_radius + 1
        self.layers = max(SLAB_BYTES // (BRICK * values[0].nbytes) - 2, 1)

    def store(
        self,
        values: cl.Buffer,
        normals: cl.Buffer,
        x: npt.NDArray[np.int64],
        y: npt.NDArray[np.int64],
        z: npt.NDArray[np.int64],
    ) -> float:
        """Stores bricks, in order of z, in the slots of one part of the pools; gives milliseconds on the device."""
        milliseconds, place = 0.0, 0
        while place < len(z):
            first = int(z[place])
            after = int(np.searchsorted(z, first + self.layers))
            bottom = max(BRICK * first - self.reach, 0)
            top = BRICK * (first + self.layers) + 1 + self.reach
            part = self.values[bottom:top]
            slab = upload(self.device, part, "a slab of the grid", "storing the grid")
            places = pack_places(x[place:after], y[place:after], z[place:after])
            bricks = upload(self.device, places, "places", "storing the grid")
            extent = extent_buffer(self.device, self.place, self.kind, 1.0, np.inf, self.opaque, bottom)
            milliseconds += self.built.run(
                self.device,
                "storing the grid",
                [values, normals, bricks, *map(np.int32, (0, len(places), place)), slab, slab, extent],
                3,
                len(places),
                first_part=1024,
            )
            place = after
        return milliseconds


def _brick_maximum(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The largest value of each brick's samples, shape (bz, by, bx); NaN counts as the least number."""
    result = values
    if values.dtype.kind == "f":
        result = np.where(np.isnan(values), -np.inf, values)
    for axis in range(3):
        n = result.shape[axis]
        bricks = max((n + BRICK - 2) // BRICK, 1)
        starts = BRICK * np.arange(bricks)
        own = np.maximum.reduceat(result, starts, axis=axis)
        after = np.take(result, np.minimum(starts + BRICK, n - 1), axis=axis)
        result = np.maximum(own, after)
    return result
