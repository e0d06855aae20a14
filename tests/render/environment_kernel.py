"""Runs every function of `kernels/environment.h` over packets of directions and of random numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl
import pytest

from clfractal.device import compiler, program
from clfractal.device.select import Device, choose
from clfractal.device.source import flatten
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.renderers import records
from clfractal.renderers.declarations import struct_text
from clfractal.renderers.environment import PackedEnvironment, material_fields
from clfractal.scene.lighting import Environment

Floats = npt.NDArray[np.floating[Any]]

_TEXT = """\
#include "lanes.h"
#include "numbers/real.h"
#include "vectors.h"
#include "structs.h"
#include "shade.h"
#include "sampling.h"
#include "environment.h"

INLINE real load(__global const scalar *from) {
    scalar each[LANES];
    for (int lane = 0; lane < LANES; ++lane) each[lane] = from[lane];
    return lanes_load(each);
}
INLINE void store(__global scalar *to, real value) {
    scalar each[LANES];
    lanes_store(value, each);
    for (int lane = 0; lane < LANES; ++lane) to[lane] = each[lane];
}

// Planes of `count` numbers. In: x, y, z, u, v. Out: red, green, blue, density; the sample's x, y, z, density.
__kernel void environment(__global const scalar *in, __global scalar *out, __global const float *map,
                          __constant struct Material *material, int count) {
    const int lane = (int)get_global_id(0) * LANES;
    in += lane;
    out += lane;
    const vec direction = vec_of(load(in), load(in + count), load(in + 2 * count));
    const color light = environment_color(direction, material, map);
    store(out, light.r);
    store(out + count, light.g);
    store(out + 2 * count, light.b);
    store(out + 3 * count, environment_density(direction, material, map));
    real density;
    const vec sample = environment_sample(load(in + 3 * count), load(in + 4 * count), material, map, &density);
    store(out + 4 * count, sample.x);
    store(out + 5 * count, sample.y);
    store(out + 6 * count, sample.z);
    store(out + 7 * count, density);
}
"""


def settings_of(**values: Any) -> Environment:
    """A scene's environment with these values; which map it names does not matter here."""
    return Environment.model_validate({"name": "studio", **values})


@cache
def _program(device: Device, precision: Precision, lanes: int) -> Any:
    defines = {"LANES": lanes, "REAL_IS_DOUBLE": int(precision == "float64"), "PALETTE_SIZE": 256}
    generated = {"environment.cl": _TEXT, "structs.h": struct_text()}
    flat = flatten("environment.cl", generated=generated, defines=defines)
    return compiler.compile_source(device, flat.text, program.math_flags(precision))


@dataclass(frozen=True, slots=True)
class Answers:
    """`color` and `density` of directions; `sample` and `sample_density` of random numbers."""

    color: Floats
    density: Floats
    sample: Floats
    sample_density: Floats


def ask(
    packed: PackedEnvironment,
    directions: Floats | None = None,
    numbers: Floats | None = None,
    *,
    settings: Environment | None = None,
    precision: Precision = "float32",
    lanes: int = 1,
    has_sun: bool = False,
) -> Answers:
    """Runs the kernel on directions, shape (n, 3), and pairs of numbers in [0, 1), shape (n, 2)."""
    given = len(directions if directions is not None else numbers if numbers is not None else [])
    count = -(-given // lanes) * lanes
    planes = np.zeros((5, count), precision)
    for place, columns in ((slice(0, 3), directions), (slice(3, 5), numbers)):
        if columns is not None:
            planes[place, :given] = columns.T
    material = np.zeros((), records.MATERIAL.dtype(precision))
    for name, value in material_fields(settings or settings_of(), packed).items():
        material[name] = value
    material["environment_sun"] = int(has_sun)
    device = choose()
    result = np.full((8, count), np.nan, precision)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    buffers = [
        cl.Buffer(device.context, flags, hostbuf=np.ascontiguousarray(array).reshape(-1).view(np.uint8))
        for array in (planes, result, packed.data, material.reshape(1))
    ]
    kernel = cl.Kernel(_program(device, precision, lanes), "environment")
    kernel.set_args(*buffers, np.int32(count))
    cl.enqueue_nd_range_kernel(device.queue, kernel, (count // lanes,), (1,))
    cl.enqueue_copy(device.queue, result, buffers[1])
    found = result[:, :given]
    return Answers(found[:3].T, found[3], found[4:7].T, found[7])


VARIANTS: list[tuple[Precision, int]] = [("float32", 1), ("float32", 16), ("float32", 4)]


def check_usable(precision: Precision, lanes: int) -> None:
    """Skips a lane count that the engine would not use: on such a driver aborts, or crashes."""
    if lanes not in accepted_lanes(choose(), precision):
        pytest.skip(f"{choose().info.name} cannot run {lanes} lanes of {precision}")


every_variant = pytest.mark.parametrize(("precision", "lanes"), VARIANTS)
