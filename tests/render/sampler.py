"""Runs the functions of `sampling.h` and `phase.h` for lists of pixels and numbers."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.select import Device, choose, has_float64
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from tests.small_kernels import LOADS, SmallKernels

Array = npt.NDArray[Any]

# Planes that `shapes` writes, in this order.
SHAPES = {
    "box": 2,
    "tent": 2,
    "blackman_harris": 2,
    "disk": 2,
    "cone": 3,
    "hemisphere": 3,
    "side": 3,
    "up": 3,
}

_TEXT = """\
#include "device/lanes.h"
#include "device/vectors.h"
#include "integrators/sampling.h"
#include "shading/phase.h"
"""
_SAMPLES = """\
__kernel void squares(__global const int *pixels, __global scalar *result, int n, uint seed, uint purpose) {
    const int at = (int)get_global_id(0) * LANES;
    int x[LANES], y[LANES], index[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        x[lane] = pixels[at + lane];
        y[lane] = pixels[n + at + lane];
        index[lane] = pixels[2 * n + at + lane];
    }
    const bits seeds = pixel_seed(x, y, seed, purpose);
    real u, v;
    unit_square(bits_load(index), seeds, &u, &v);
    store(result + at, u);
    store(result + n + at, v);
    store(result + 2 * n + at, unit_of_bits(bits_load(index)));
    store(result + 3 * n + at, real_of_bits(seeds >> 16));
    store(result + 4 * n + at, real_of_bits(seeds & 0xffffu));
}

__kernel void shapes(__global const scalar *numbers, __global scalar *result, int n, scalar width) {
    const int at = (int)get_global_id(0) * LANES;
    numbers += at;
    const real u = load(numbers), v = load(numbers + n), spread = load(numbers + 5 * n);
    const vec axis = vec_of(load(numbers + 2 * n), load(numbers + 3 * n), load(numbers + 4 * n));
    real planes[20];
    for (int filter = 0; filter < 3; ++filter)
        filter_offset(u, v, filter, (real)(width), planes + 2 * filter, planes + 2 * filter + 1);
    unit_disk(u, v, planes + 6, planes + 7);
    vec found[4];
    found[0] = cone_direction(axis, spread, u, v);
    found[1] = hemisphere_direction(axis, u, v);
    make_frame(axis, found + 2, found + 3);
    for (int one = 0; one < 4; ++one) {
        planes[8 + 3 * one] = found[one].x;
        planes[9 + 3 * one] = found[one].y;
        planes[10 + 3 * one] = found[one].z;
    }
    for (int plane = 0; plane < 20; ++plane) store(result + plane * n + at, planes[plane]);
}

__kernel void turns(__global const scalar *numbers, __global scalar *result, int n) {
    const int at = (int)get_global_id(0) * LANES;
    numbers += at;
    const real u = load(numbers), v = load(numbers + n), g = load(numbers + 5 * n);
    const vec before = vec_of(load(numbers + 2 * n), load(numbers + 3 * n), load(numbers + 4 * n));
    const vec found = phase_direction(before, u, v, g);
    const real cosine = phase_cosine(u, g);
    const real planes[5] = {cosine, phase_of(cosine, g), found.x, found.y, found.z};
    for (int plane = 0; plane < 5; ++plane) store(result + plane * n + at, planes[plane]);
}
"""

_POINTS = """
__kernel void points(__global const int *pixels, __global scalar *result, int n, int count, int rows, uint seed) {
    const int at = (int)get_global_id(0) * LANES;
    int x[LANES], y[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        x[lane] = pixels[at + lane];
        y[lane] = pixels[n + at + lane];
    }
    const bits seeds = pixel_seed(x, y, seed, PURPOSE_POINTS);
    for (int point = 0; point < count; ++point) {
        real across, below;
        point_offset(point, count, rows, seeds, &across, &below);
        store(result + 2 * point * n + at, across);
        store(result + (2 * point + 1) * n + at, below);
    }
}
"""


class Sampler:
    """The program for one precision and lane count."""

    def __init__(self, device: Device, precision: Precision, lanes: int) -> None:
        self.precision, self.lanes = precision, lanes
        self._kernels = SmallKernels(device, _TEXT + LOADS + _SAMPLES + _POINTS, precision, lanes)

    def squares(
        self, x: Array, y: Array, index: Array, seed: int = 0, purpose: int = 0
    ) -> tuple[Array, Array, Array]:
        """For each pixel: the point of the square (2, n), the index as a unit number (n,), the seed (n,)."""
        pixels = np.stack(np.broadcast_arrays(x, y, index)).astype(np.uint32).view(np.int32)
        planes = self._run("squares", pixels, 5, np.uint32(seed), np.uint32(purpose))
        seeds = planes[3].astype(np.int64) << 16 | planes[4].astype(np.int64)
        return planes[:2], planes[2], seeds

    def shapes(self, u: Array, v: Array, axis: Array, spread: Array, width: float) -> dict[str, Array]:
        """Everything made of points (n,) of the square, by name; axes have the shape (3, n)."""
        numbers = np.stack(np.broadcast_arrays(u, v, *axis, spread)).astype(self.precision)
        planes = self._run("shapes", numbers, sum(SHAPES.values()), np.dtype(self.precision).type(width))
        parts = np.split(planes, np.cumsum(list(SHAPES.values()))[:-1])
        return dict(zip(SHAPES, parts, strict=True))

    def turns(self, u: Array, v: Array, before: Array, g: Array) -> tuple[Array, Array, Array]:
        """Of light from directions (3, n) that a medium scatters: cosines (n,), their densities (n,), directions (3, n)."""
        numbers = np.stack(np.broadcast_arrays(u, v, *before, g)).astype(self.precision)
        planes = self._run("turns", numbers, 5)
        return planes[0], planes[1], planes[2:]

    def points(self, x: Array, y: Array, count: int, seed: int = 0, rows: int = 0) -> Array:
        """Offsets of each pixel's points, shape (count, 2, n): on a grid of so many rows, or stochastic ones."""
        pixels = np.stack(np.broadcast_arrays(x, y)).astype(np.int32)
        planes = self._run("points", pixels, 2 * count, np.int32(count), np.int32(rows), np.uint32(seed))
        return planes.reshape(count, 2, -1)

    def _run(self, name: str, given: Array, planes: int, *settings: Any) -> Array:
        """The planes that a kernel writes, shape (planes, n), in float64; n is a multiple of the lanes."""
        n = given.shape[1]
        assert n % self.lanes == 0
        result = np.full((planes, n), np.nan, self.precision)
        self._kernels.run(name, given, result, np.int32(n), *settings, result=result)
        return result.astype(np.float64)


@lru_cache
def samplers() -> list[Sampler]:
    """One for each number type and lane count that the device accepts."""
    device = choose()
    precisions: list[Precision] = ["float32", "float64"] if has_float64(device.info) else ["float32"]
    found = [
        Sampler(device, precision, lanes)
        for precision in precisions
        for lanes in accepted_lanes(device, precision)
    ]
    assert found
    return found
