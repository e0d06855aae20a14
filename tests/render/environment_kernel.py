"""Runs every function of `environment.h` over packets of directions and of random numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device, choose, has_float64
from clfractal.device.structs import Precision
from clfractal.integrators import records
from clfractal.integrators.declarations import struct_text
from clfractal.scene.lighting import Environment
from clfractal.shading.environment import PackedEnvironment, material_fields
from tests.small_kernels import LOADS, Floats, SmallKernels

_TEXT = """\
#include "device/lanes.h"
#include "formulas/numbers/real.h"
#include "device/vectors.h"
#include "structs.h"
#include "shading/shade.h"
#include "integrators/sampling.h"
#include "shading/environment.h"
"""
_ENVIRONMENT = """\
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
def _kernels(device: Device, precision: Precision, lanes: int) -> SmallKernels:
    text = _TEXT + LOADS + _ENVIRONMENT
    return SmallKernels(
        device,
        text,
        precision,
        lanes,
        generated={"structs.h": struct_text()},
        defines={"PALETTE_SIZE": 256},
    )


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
    kernels = _kernels(choose(), precision, lanes)
    columns = np.zeros((5, given))
    for place, numbered in ((slice(0, 3), directions), (slice(3, 5), numbers)):
        if numbered is not None:
            columns[place] = numbered.T
    planes = kernels.planes(columns)
    material = np.zeros((), records.MATERIAL.dtype(precision))
    for name, value in material_fields(settings or settings_of(), packed).items():
        material[name] = value
    material["environment_sun"] = int(has_sun)
    result = np.full((8, planes.shape[1]), np.nan, precision)
    count = np.int32(planes.shape[1])
    kernels.run("environment", planes, result, packed.data, material, count, result=result)
    found = result[:, :given]
    return Answers(found[:3].T, found[3], found[4:7].T, found[7])


VARIANTS: list[tuple[Precision, int]] = [("float32", 1), ("float32", 16), ("float32", 4)]
if has_float64(choose().info):
    VARIANTS += [("float64", 8)]


every_variant = pytest.mark.parametrize(("precision", "lanes"), VARIANTS)
