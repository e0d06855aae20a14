"""Runs the functions of `bsdf.h` on one material over packets of directions and of random numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from clfractal.device.select import Device, choose
from clfractal.device.structs import Precision
from clfractal.scene.materials import PbrMaterial
from clfractal.shading.materials import PBR, material_values, pbr_text, scattering_defines
from clfractal.shading.scattering import albedo_tables, glass_tables
from tests.small_kernels import LOADS, Floats, SmallKernels

_TEXT = """\
#include "device/lanes.h"
#include "formulas/numbers/real.h"
#include "device/vectors.h"
#include "structs.h"
#include "integrators/sampling.h"
#include "shading/color.h"
#include "shading/bsdf.h"
#include "elements/materials/costly"
#include "shading/bsdf_bumped.h"

"""
_SCATTER = """\
#define PUT_COLOR(place, c)               \\
    store(out + (place) * count, c.r);     \\
    store(out + (place + 1) * count, c.g); \\
    store(out + (place + 2) * count, c.b)

// Planes of `count` numbers. In: viewer, light (x, y, z each), choice, u, v, wall. Out: value and density of the light's
// direction; the sampled direction, its density, its value. `leans`: the normal of a relief.
__kernel void scatter(__global const scalar *in, __global scalar *out, __constant struct Pbr *material,
                      __global const float *albedos, __constant scalar *leans, int count, int inside, int relief) {
    const int lane = (int)get_global_id(0) * LANES;
    in += lane;
    out += lane;
    const vec viewer = vec_of(load(in), load(in + count), load(in + 2 * count));
    const vec light = vec_of(load(in + 3 * count), load(in + 4 * count), load(in + 5 * count));
    const vec normal = vec_of(R(0.0), R(0.6), R(0.8));
    pbr p = pbr_of(material, color_splat(material->base_color));
    p.inside = (real)((scalar)inside);
    bsdf b = bsdf_at(&p, vec_splat(leans), viewer, albedos);
    if (relief) bsdf_lean(&b, normal);
    color value;
    real density;
    scatter_value(&b, &light, albedos, &value, &density);
    PUT_COLOR(0, value);
    store(out + 3 * count, density);
    const real wall = load(in + 9 * count);
    const vec chosen = scatter_sample(&b, load(in + 6 * count), load(in + 7 * count), load(in + 8 * count), wall);
    color there;
    scatter_value(&b, &chosen, albedos, &there, &density);
    store(out + 4 * count, chosen.x);
    store(out + 5 * count, chosen.y);
    store(out + 6 * count, chosen.z);
    store(out + 7 * count, density);
    PUT_COLOR(8, there);
}
"""

NORMAL = np.array([0.0, 0.6, 0.8])
"""The normal of the surface in these tests."""


@cache
def _kernels(device: Device, precision: Precision, lanes: int) -> SmallKernels:
    return SmallKernels(
        device,
        _TEXT + LOADS + _SCATTER,
        precision,
        lanes,
        generated={"structs.h": PBR.c_text(), "pbr.h": pbr_text()},
        defines={"PALETTE_SIZE": 256, **scattering_defines()},
    )


@dataclass(frozen=True, slots=True)
class Answers:
    """Value (f times the cosine) and density of directions; sampled directions, their densities and values."""

    value: Floats
    density: Floats
    chosen: Floats
    chosen_density: Floats
    chosen_value: Floats


def turned(local: Floats) -> Floats:
    """Directions given around z, shape (n, 3), around the surface's normal."""
    side = np.array([1.0, 0.0, 0.0])
    return np.asarray(local @ np.stack([side, np.cross(NORMAL, side), NORMAL]))


def ask(
    material: PbrMaterial,
    viewer: Floats,
    light: Floats,
    numbers: Floats | None = None,
    *,
    precision: Precision = "float32",
    lanes: int = 1,
    inside: bool = False,
    leans: Floats | None = None,
) -> Answers:
    """Runs the kernel on world directions, shape (n, 3) or (1, 3) each, and numbers in (0, 1), shape (n, 3), or (n, 4) with
    a relief.

    The normal is on the viewer's side, also where the viewer is `inside` glass; `leans`: that of a relief.
    """
    weight = material.transmission.weight
    glass = not isinstance(weight, float) or weight > 0
    tables = np.concatenate([albedo_tables(), glass_tables()]) if glass else albedo_tables()
    kernels = _kernels(choose(), precision, lanes)
    given = max(len(viewer), len(light), 0 if numbers is None else len(numbers))
    columns = np.full((10, given), 0.5)
    columns[0:3] = viewer.T
    columns[3:6] = light.T
    if numbers is not None:
        columns[6 : 6 + numbers.shape[1]] = numbers.T
    planes = kernels.planes(columns, 0.5)
    result = np.full((11, planes.shape[1]), np.nan, precision)
    kernels.run(
        "scatter",
        planes,
        result,
        PBR.array(precision, [material_values(material)]),
        tables,
        np.array(NORMAL if leans is None else leans, precision),
        np.int32(planes.shape[1]),
        np.int32(inside),
        np.int32(leans is not None),
        result=result,
    )
    found = result[:, :given].astype(np.float64)
    return Answers(found[:3].T, found[3], found[4:7].T, found[7], found[8:11].T)
