"""Runs every function of `normals.h` over packets of pixels, each with its own points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from tests.devices import device
from tests.render.normals_oracle import grid_offsets
from tests.small_kernels import LOADS, Floats, SmallKernels

Masks = npt.NDArray[np.bool_]

GRID = grid_offsets(3)
PRECISIONS: tuple[Precision, ...] = ("float32", "float64")


def lanes_of(precision: Precision) -> int:
    return accepted_lanes(device(), precision)[-1]


def epsilon(precision: Precision) -> float:
    return float(np.finfo(precision).eps)


@cache
def variants() -> list[tuple[Precision, int]]:
    """Every number type and lane count."""
    return [(each, lanes) for each in PRECISIONS for lanes in accepted_lanes(device(), each)]


_TEXT = """\
#include "device/lanes.h"
#include "device/vectors.h"
#include "integrators/march/normals.h"
"""
_NORMALS = """\
INLINE void store_normal(__global scalar *to, int pixels, vec normal, mask usable) {
    store(to, normal.x);
    store(to + pixels, normal.y);
    store(to + 2 * pixels, normal.z);
    store(to + 3 * pixels, pick(usable, R(1.0), R(0.0)));
}

// Planes of `pixels` numbers: points[count][x, y, z, found], results[11 normals and the residual].
__kernel void normals(__global const scalar *points, __global scalar *results, int pixels, int count) {
    const int lane = (int)get_global_id(0) * LANES;
    vec compass[9];
    mask found[9];
    plane_sums sums = plane_none();
    for (int i = 0; i < count; ++i) {
        __global const scalar *from = points + 4 * i * pixels + lane;
        const vec point = vec_of(load(from), load(from + pixels), load(from + 2 * pixels));
        const mask here = less(R(0.5), load(from + 3 * pixels));
        sums = plane_add(sums, here, point);
        if (i < 9) {
            compass[i] = point;
            found[i] = here;
        }
    }
    for (int i = count; i < 9; ++i) {
        compass[i] = vec_of(R(0.0), R(0.0), R(0.0));
        found[i] = less(R(1.0), R(0.0));
    }
    __global scalar *to = results + lane;
    mask usable;
    real residual;
    vec normal = normal_of_plane(sums, &residual, &usable);
    store_normal(to, pixels, normal, usable);
    normal = triangle_normal(compass, found, &usable);
    store_normal(to + 4 * pixels, pixels, normal, usable);
    normal = eight_mean(compass, found, &usable);
    store_normal(to + 8 * pixels, pixels, normal, usable);
    vec eight[8];
    mask each[8];
    eight_normals(compass, found, eight, each);
    for (int i = 0; i < 8; ++i) store_normal(to + (12 + 4 * i) * pixels, pixels, eight[i], each[i]);
    store(to + 44 * pixels, residual);
}
"""


@dataclass(frozen=True)
class Normals:
    """Results for n pixels. Normals have the shape (n, 3), of the eight triangles (n, 8, 3); flags without the 3."""

    plane: Floats
    plane_usable: Masks
    triangle: Floats
    triangle_usable: Masks
    mean: Floats
    mean_usable: Masks
    eight: Floats
    eight_usable: Masks
    residual: Floats

    def methods(self) -> dict[str, tuple[Floats, Masks]]:
        """The normals that a pixel has one of, by name."""
        return {
            "plane": (self.plane, self.plane_usable),
            "triangle": (self.triangle, self.triangle_usable),
            "mean": (self.mean, self.mean_usable),
        }


@cache
def _kernels(precision: Precision, lanes: int) -> SmallKernels:
    return SmallKernels(device(), _TEXT + LOADS + _NORMALS, precision, lanes)


def run(points: Floats, found: Masks, precision: Precision, lanes: int) -> Normals:
    """Normals of pixels with points of shape (n, count, 3), of which those in `found` (n, count) exist."""
    pixels, count = found.shape
    kernels = _kernels(precision, lanes)
    columns = np.full((count, 4, pixels), np.nan)
    columns[:, :3] = points.transpose(1, 2, 0)
    columns[:, 3] = found.T
    padded = kernels.planes(columns, np.nan)
    results = np.full((45, padded.shape[2]), np.nan, precision)
    kernels.run("normals", padded, results, np.int32(padded.shape[2]), np.int32(count), result=results)
    each = results[:44, :pixels].astype(np.float64).T.reshape(pixels, 11, 4)
    usable = each[..., 3] == 1
    return Normals(
        plane=each[:, 0, :3],
        plane_usable=usable[:, 0],
        triangle=each[:, 1, :3],
        triangle_usable=usable[:, 1],
        mean=each[:, 2, :3],
        mean_usable=usable[:, 2],
        eight=each[:, 3:, :3],
        eight_usable=usable[:, 3:],
        residual=results[44, :pixels].astype(np.float64),
    )
