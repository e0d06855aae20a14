"""Orbits that a march leaves under way, and goes on with beside later ones: they end as they would have ended alone."""

from __future__ import annotations

import numpy as np
import pytest

from clfractal.device.structs import Precision
from clfractal.formulas import catalog
from clfractal.formulas.chain import Chain
from clfractal.formulas.opencl import write_formula
from tests.devices import check_usable, device
from tests.formulas.opencl_batch import HEAD, formula_kernels, orbit_files
from tests.formulas.orbits import chain_of
from tests.render.point_checks import orbit_bytes
from tests.small_kernels import LOADS, Floats

# One packet whose lanes take point after point, as rays take step after step; and each point by itself.
KERNELS = (
    LOADS
    + """\
#define FOUND 7
INLINE void put(__global scalar *result, int stride, const int *places, uint bits, clearance c, surface_point s) {
    const real found[FOUND] = {c.step, c.end.count, pick(c.end.inside, R(1.0), R(0.0)), c.near,
                               s.gradient.x, s.gradient.y, s.gradient.z};
    for (int i = 0; i < FOUND; ++i) {
        scalar each[LANES];
        lanes_store(found[i], each);
        for (int lane = 0; lane < LANES; ++lane)
            if ((bits >> lane) & 1u) result[i * stride + places[lane]] = each[lane];
    }
}
__kernel void in_turn(__global const scalar *points, __global scalar *result, int stride, orbit_record orbit, constants k) {
    if (get_global_id(0) != 0) return;
    int places[LANES], left = 0;
    scalar at[3][LANES];
    for (int lane = 0; lane < LANES; ++lane) places[lane] = lane;
    march_orbit o = {0};
    mask late = less(R(1.0), R(0.0));
    for (int step = 0; step < 100 * stride; ++step) {
        uint busy = 0;
        for (int lane = 0; lane < LANES; ++lane) {
            const int place = min(places[lane], stride - 1);
            busy |= (places[lane] < stride ? 1u : 0u) << lane;
            for (int axis = 0; axis < 3; ++axis) at[axis][lane] = points[axis * stride + place];
        }
        if (busy == 0) {
            result[FOUND * stride] = (scalar)left;
            return;
        }
        surface_point surface;
        surface.gradient = vec_of(R(0.0), R(0.0), R(0.0));
        const clearance found = orbit_step(&o, vec_load(at), lanes_of_bits(busy), &late, orbit, k, &surface);
        late &= lanes_of_bits(busy);
        left += bits_count(lanes_bits(late));
        const uint ended = busy & ~lanes_bits(late);
        put(result, stride, places, ended, found, surface);
        for (int lane = 0; lane < LANES; ++lane) places[lane] += (ended >> lane) & 1u ? LANES : 0;
    }
}
__kernel void alone(__global const scalar *points, __global scalar *result, int stride, orbit_record orbit, constants k) {
    const int first = (int)get_global_id(0) * LANES;
    int places[LANES];
    for (int lane = 0; lane < LANES; ++lane) places[lane] = first + lane;
    const vec point = vec_of(load(points + first), load(points + stride + first), load(points + 2 * stride + first));
    surface_point surface;
    surface.gradient = vec_of(R(0.0), R(0.0), R(0.0));
    const mask all = equal(R(0.0), R(0.0));
    const clearance found = HAS_DERIVATIVE ? orbit_distance(point, all, orbit, k)
                                           : orbit_dual_distance(point, all, OF_DISTANCE, orbit, k, &surface);
    put(result, stride, places, ALL_LANES, found, surface);
}
"""
)
POINTS = 512
EXTENT = {"mandelbox": 7.0}
FOUND = 7


def results(
    chain: Chain, precision: Precision, lanes: int, iterations: int, extent: float
) -> tuple[Floats, Floats, int]:
    """What is found in turn and alone, and how many times a lane's orbit was left under way."""
    formula = write_formula(chain)
    kernels = formula_kernels(device(), HEAD + formula.text + orbit_files() + KERNELS, precision, lanes)
    points = np.random.default_rng(5).uniform(-extent, extent, (3, POINTS)).astype(precision)
    orbit = orbit_bytes(chain, iterations, precision, None)
    in_turn, alone = (
        kernels.run(
            kernel, points, out, np.int32(POINTS), orbit, np.array(formula.constants, precision), result=out
        )
        for kernel in ("in_turn", "alone")
        for out in [np.full((FOUND + 1, POINTS), np.nan, precision)]
    )
    return in_turn[:FOUND], alone[:FOUND], int(in_turn[FOUND, 0])


@pytest.mark.parametrize("iterations", [3, 12, 60])
@pytest.mark.parametrize(
    ("precision", "lanes"), [("float32", 16), ("float32", 8), ("float64", 8), ("float32", 4)]
)
@pytest.mark.parametrize("name", ["mandelbulb", "hast", "mandelbox", "unusual"])
def test_in_turn_as_alone(name: str, precision: Precision, lanes: int, iterations: int) -> None:
    check_usable(precision)
    in_turn, alone, left = results(chain_of(name), precision, lanes, iterations, EXTENT.get(name, 1.3))
    np.testing.assert_array_equal(in_turn, alone)
    # Of a Mandelbox an application costs less than a step of the march.
    assert (left > 0) == (lanes >= 8 and name != "mandelbox")


def test_turns_of_several_formulas_are_never_left() -> None:
    chain = catalog.load_chain(
        {"chain": [{"name": "mandelbulb"}, {"name": "hast", "count": 2}], "bailout": 4}
    )
    in_turn, alone, left = results(chain, "float32", 16, 12, 1.3)
    np.testing.assert_array_equal(in_turn, alone)
    assert left == 0
