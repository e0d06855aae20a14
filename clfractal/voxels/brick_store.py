"""From evaluated bricks to a grid: which are kept, their samples and normals, and the table over them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.scene.grid_place import GridPlace
from clfractal.voxels.grid import DTYPES, NO_NORMAL, SAMPLE_BYTES, Grid, GridStats, Kind
from clfractal.voxels.lattice import (
    BRICK_STRIDE,
    EXTENT,
    Lattice,
    Places,
    evaluated_bricks_of,
    pack_places,
)
from clfractal.voxels.octree import empty_cubes, touched
from clfractal.voxels.pool import allocate, plan_pools, upload
from clfractal.voxels.programs import Built

OUTSIDE, INSIDE, MIXED = 0, 1, 2


@dataclass(frozen=True, slots=True, eq=False)
class Evaluated:
    """The bricks whose voxels have been evaluated.

    Attributes:
        places: where they are among the lattice's evaluated bricks; `at` the same, shape (n, 3).
        full: where bricks are, shape (m, 3), that are inside as a whole and were not evaluated.
        samples: their voxels, on the device.
        bricks: `places` on the device.
        numbers: of each place its number among them, `ALL_OUTSIDE`, or `ALL_INSIDE` (in `full`), on the device, x fastest.
        scale: factor from a value to what is stored.
        whole: the value of a voxel that is inside as a whole.
        opaque: the least value that counts as inside.
    """

    places: Places
    at: npt.NDArray[np.int64]
    full: npt.NDArray[np.int64]
    samples: cl.Buffer
    bricks: cl.Buffer
    numbers: cl.Buffer
    scale: float
    whole: float
    opaque: float


def store(
    device: Device,
    lattice: Lattice,
    evaluated: Evaluated,
    *,
    kept: Kind,
    range: tuple[float, float],
    classify: Built | None,
    keep: Built,
    stats: GridStats,
    tell: Callable[[str, int, int], None],
    show_outside: bool = False,
    refine: Built | None = None,
    constants: Sequence[cl.Buffer] = (),
    token: CancelToken | None = None,
) -> Grid:
    """The grid of evaluated bricks. Those outside as a whole are left out, those inside as a whole share a slot.

    `classify` finds them; without it every brick is kept. With `show_outside` those outside as a whole share a slot, too,
    but for those that touch the surface's bricks: they are stored for their normals, which reach that far. `refine`
    replaces normals at the surface, with the formula's `constants`.

    Raises:
        DeviceError: status 2 if what is kept does not fit.
        Stopped: the token was set.
    """
    extent = extent_buffer(device, lattice.place, kept, evaluated.scale, evaluated.whole, evaluated.opaque)
    count = len(evaluated.places)
    milliseconds = refining = 0.0
    within = (evaluated.at < np.array(lattice.bricks)).all(axis=1)
    classes = np.full(count, MIXED, np.uint8)
    if classify is not None and count:
        found = device.buffer(count, "classes of bricks")
        milliseconds += classify.run(
            device,
            "checking the grid's bricks",
            [
                found,
                evaluated.bricks,
                np.int32(0),
                np.int32(count),
                evaluated.samples,
                evaluated.numbers,
                extent,
            ],
            2,
            count,
            first_part=4096,
            token=token,
        )
        with device.failures("checking the grid's bricks"):
            cl.enqueue_copy(device.queue, classes, found)
    solid_slot = 0 if classify is not None else None
    outside_slot = 1 if classify is not None and show_outside else None
    first_slot = sum(slot is not None for slot in (solid_slot, outside_slot))
    mixed = np.flatnonzero(within & (classes == MIXED))
    full = evaluated.full[(evaluated.full < np.array(lattice.bricks)).all(axis=1)]
    solid = np.concatenate([evaluated.at[within & (classes == INSIDE)], full])
    stored = evaluated.at[mixed]
    bz, by, bx = lattice.bricks[::-1]
    entries = np.full((bz, by, bx), -1, np.int32)
    entries[stored[:, 2], stored[:, 1], stored[:, 0]] = first_slot + np.arange(len(mixed), dtype=np.int32)
    entries[solid[:, 2], solid[:, 1], solid[:, 0]] = 0
    places = evaluated.places[mixed]
    if outside_slot is not None:
        z, y, x = np.nonzero((entries < 0) & touched(entries >= first_slot))
        entries[z, y, x] = first_slot + len(places) + np.arange(len(x), dtype=np.int32)
        places = np.append(places, pack_places(x, y, z))
        entries[entries < 0] = outside_slot
    entries = empty_cubes(entries)

    count = len(places)
    slots = first_slot + count
    sizes = (SAMPLE_BYTES[kept], 4)
    others = evaluated.samples.size + 4 * entries.size
    parts = plan_pools(device, slots, sizes, others, f"a grid with {slots} stored bricks")
    values = allocate(device, parts, sizes[0], "the grid's values")
    normals = allocate(device, parts, sizes[1], "the grid's normals")
    table = upload(device, entries, "the grid's table", "storing the grid")
    if solid_slot is not None:
        _store_whole(device, values[0], normals[0], kept, solid_slot, inside=True)
    if outside_slot is not None:
        _store_whole(device, values[0], normals[0], kept, outside_slot, inside=False)
    for (first, after), value_part, normal_part in zip(parts.ranges(), values, normals, strict=True):
        low, high = max(first - first_slot, 0), after - first_slot
        if high <= low:
            continue
        part = upload(device, places[low:high], "places", "storing the grid")
        numbers = [np.int32(each) for each in (0, high - low, max(first_slot - first, 0))]
        milliseconds += keep.run(
            device,
            "storing the grid",
            [value_part, normal_part, part, *numbers, evaluated.samples, evaluated.numbers, extent],
            3,
            high - low,
            first_part=1024,
            done=partial(_tell_from, tell, "store", low, count),
            token=token,
        )
        if refine is not None:
            refining += refine.run(
                device,
                "finding normals",
                [normal_part, part, *numbers, *constants],
                2,
                high - low,
                first_part=16,
                done=partial(_tell_from, tell, "normals", low, count),
                token=token,
            )
    stats = replace(
        stats,
        stored_bricks=count,
        solid_bricks=len(solid),
        store_ms=milliseconds,
        normals_ms=refining,
    )
    return Grid(
        lattice.place,
        kept,
        range,
        device,
        parts,
        entries,
        table,
        values,
        normals,
        solid_slot,
        outside_slot,
        stats=stats,
    )


def _tell_from(tell: Callable[[str, int, int], None], stage: str, before: int, total: int, done: int) -> None:
    tell(stage, before + done, total)


def extent_buffer(
    device: Device,
    place: GridPlace,
    kept: Kind,
    scale: float,
    whole: float,
    opaque: float,
    first_layer: int = 0,
) -> cl.Buffer:
    """The struct of the kernels that store bricks, on the device."""
    # Of a length that is about 1 in voxels, whatever the scene's unit: only the gradient's direction matters.
    across = min(place.spacing) * place.inverse
    record = EXTENT.value(
        "float32",
        {
            "bricks": evaluated_bricks_of(place.shape),
            "last": [n - 1 for n in place.shape],
            "first_layer": first_layer,
            "whole": whole,
            "opaque": opaque,
            "floats": int(kept == "float"),
            "scale": scale,
            **dict(zip(("normal_x", "normal_y", "normal_z"), across, strict=True)),
        },
    )
    return upload(device, record, "the grid's extent")


def _store_whole(
    device: Device, values: cl.Buffer, normals: cl.Buffer, kept: Kind, slot: int, *, inside: bool
) -> None:
    """A slot that bricks share: inside or outside as a whole, without normals."""
    value = np.full(BRICK_STRIDE, (255 if kept == "byte" else 1) if inside else 0, DTYPES[kept])
    normal = np.full((BRICK_STRIDE, 4), (NO_NORMAL, NO_NORMAL, NO_NORMAL, 255 if inside else 0), np.uint8)
    with device.failures("storing the grid"):
        for buffer, samples in ((values, value), (normals, normal)):
            cl.enqueue_copy(device.queue, buffer, samples, dst_offset=slot * samples.nbytes)
