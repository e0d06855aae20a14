"""Orbits of every formula in its generated OpenCL, over real and dual numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.formulas import catalog
from clfractal.formulas.chain import Chain
from clfractal.formulas.opencl import FormulaText, write_formula
from clfractal.formulas.reference import carried_at_start, space_to_state
from tests.devices import device
from tests.formulas.grown import GROWN
from tests.formulas.opencl_batch import at_points, batch_text, formula_kernels
from tests.small_kernels import LOADS, Floats, SmallKernels

# Of |z|: beyond it an orbit has ended in every use of these functions.
FAR = 1000.0

STEPS = 3

# A formula with every unusual part: four variables, a slice, f(0) other than 0, every function.
UNUSUAL: dict[str, Any] = {
    "title": "Unusual",
    "reference": "none",
    "variables": ["x", "y", "z", "w"],
    "parameters": {"p": {"type": "real", "default": 1.7, "minimum": 0, "maximum": 9}},
    "let": {"q": "where(x > 0 and not y >= 0.1, mod(x*y, 0.3), exp(-x*x))"},
    "map": [
        "x*x - y*y + cos(p)*y + 0.25",
        "atan2(y, x)/(1 + z*z) - q + clamp(z, -0.2, 0.3)*sign(w)*floor(3*y)",
        "max(x*z, y, 0.1) - asin(y/3)*sqrt(abs(w)) + acos(w/9)*sin(z)",
        "(x*x + y*y)**(p/2) + log(1 + z*z) - tan(w/4) + (2 + y)**1.5 + atan(min(x, w))",
    ],
    "slice": {"w": "x*y + p"},
    "add": "point",
    "degree": 2,
    "bounds": {"center": [0, 0, 0], "radius": 1.5},
    "bailout": 4,
}

SPECS: dict[str, Any] = {
    **{name: name for name in catalog.names()},
    "hast, power 8": {"name": "hast", "parameters": {"power": 8}},
    "mandelbulb, power 2.5": {"name": "mandelbulb", "parameters": {"power": 2.5}},
    "mandelbulb, turned": {
        "name": "mandelbulb",
        "parameters": {"power": 3, "theta_phase": 0.4, "phi_phase": -1.1},
    },
    "mandelbulb, Julia": {"name": "mandelbulb", "parameters": {"power": 4}, "julia": [0.3, -0.2, 0.6]},
    "unusual": {"inline": UNUSUAL},
    "with the point inside": {
        "inline": {**UNUSUAL, "map": ["x*x + point_y", "y*point_x - z", "z*z", "w*point_z"]}
    },
    "with the constant of a Julia set inside": {
        "inline": {**UNUSUAL, "map": ["x*x + point_y", "y*point_x - z", "z*z", "w*point_z"]},
        "julia": [0.3, -0.2, 0.6, 0.1],
    },
    **GROWN,
}

# The states of every step, over real and dual numbers, and the scalar derivative.
ORBITS = (
    f"\n{LOADS}"
    """\
INLINE void store_dual(__global scalar *to, int stride, dual value) {
    store(to, value.v);
    store(to + stride, value.dx);
    store(to + 2 * stride, value.dy);
    store(to + 3 * stride, value.dz);
}
#define STORE(s) store(to, z.s); store_dual(to + stride, stride, dual_z.s); to += 5 * stride;
__kernel void orbits(__global const scalar *points, __global scalar *result, int stride, int counted,
                     __constant const scalar *k) {
    const int first = (int)get_global_id(0) * LANES;
    points += first;
    const vec point = vec_of(load(points), load(points + stride), load(points + 2 * stride));
    state c, z;
    dual_state dual_c, dual_z;
    start(point, k, &c, &z);
    dual_start(point, k, &dual_c, &dual_z);
    real growth = R(1.0);
    __global scalar *to = result + first;
    for (int n = 0; n <= STEPS; ++n) {
        STORE(s0) STORE(s1) STORE(s2)
#if STATE_SIZE == 4
        STORE(s3)
#endif
        store(to, growth);
        to += stride;
        const state before = z;
        z = apply(n + counted, z, c, k);
        dual_z = dual_apply(n + counted, dual_z, dual_c, k);
#if HAS_DERIVATIVE
        // The state that goes with the scalar rule is the same one, or there is no growth.
        const state beside = apply_derivative(n + counted, before, c, &growth, k);
        growth = pick(equal(beside.s0, z.s0) | is_nan(z.s0), growth, (real)(NAN));
        growth = pick(equal(beside.s1, z.s1) | is_nan(z.s1), growth, (real)(NAN));
#endif
    }
}
"""
)


@dataclass(frozen=True)
class Orbit:
    """What a kernel gave, for each step (first axis) and point (last)."""

    values: Floats  # (steps, size, n)
    dual_values: Floats  # (steps, size, n)
    jacobian: Floats  # (steps, size, 3, n)
    growth: Floats  # (steps, n)


@lru_cache
def chain_of(name: str) -> Chain:
    return catalog.load_chain(SPECS[name])


@lru_cache
def texts(form: str) -> dict[str, FormulaText]:
    """Both ways to write the map over dual numbers."""
    if form == "jacobian":
        return {name: write_formula(chain_of(name), dual_map="jacobian") for name in SPECS}
    return {name: write_formula(chain_of(name), dual_map="operations") for name in SPECS}


def points_of(chain: Chain) -> Floats:
    """Points that float32 has exactly, most of them anywhere within the bounds, some on axes and planes."""
    points = np.random.default_rng(3).uniform(-0.7, 0.7, (16, 3)) * chain.radius + chain.center
    points[10:13, 1] = 0.0
    points[13:15, :2] = 0.0
    points[15] = 0.0
    return points.astype(np.float32).astype(np.float64)


@lru_cache
def kernels_of(form: str, precision: Precision) -> SmallKernels:
    lanes = accepted_lanes(device(), precision)
    chosen = lanes[min(1, len(lanes) - 1)]
    text = f"#define STEPS {STEPS}\n" + batch_text(list(texts(form).values()), ORBITS)
    return formula_kernels(device(), text, precision, chosen)


@lru_cache
def orbit(name: str, form: str, precision: Precision) -> Orbit:
    chain, formula = chain_of(name), texts(form)[name]
    number, size = list(SPECS).index(name), chain.size
    constants = np.array(formula.constants, precision)
    planes = (STEPS + 1) * (5 * size + 1)
    points = points_of(chain)
    counted = np.int32(chain.starts_counted)
    out = at_points(kernels_of(form, precision), f"orbits_f{number}", points, planes, counted, constants)
    each = out.reshape(STEPS + 1, 5 * size + 1, len(points)).astype(np.float64)
    states = each[:, :-1].reshape(STEPS + 1, size, 5, len(points))
    return Orbit(states[:, :, 0], states[:, :, 1], states[:, :, 2:], each[:, -1])


def start_at(chain: Chain, columns: list[Any], backend: Any) -> tuple[list[Any], list[Any]]:
    point = list(space_to_state(chain, columns, backend))
    z = [np.zeros_like(point[0].value)] * chain.size if chain.add == "point" else list(point)
    return [*z, *carried_at_start(chain, point, backend)], point
