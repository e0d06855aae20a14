"""Quantities that choose colours, and palettes on the device: against solids whose answer is known, and NumPy's orbits."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import has_float64
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.formulas.opencl import write_formula
from clfractal.integrators import records
from clfractal.integrators.lanes import best_lanes
from clfractal.scene.model import Scene
from clfractal.shading.kind_numbers import kind_text
from tests.devices import device
from tests.formulas.grown import CARRIED
from tests.formulas.opencl_batch import HEAD, at_points, formula_kernels, orbit_files
from tests.render.normals_oracle import unit
from tests.render.shots import BALL, BALL_RADIUS, PERSPECTIVE, SOLIDS
from tests.render.traps import (
    TRAP_FORMULAS,
    Floats,
    carried_by_numpy,
    trap_by_numpy,
    trap_distances,
    trap_scene,
)
from tests.scenes import BALL_ITERATIONS, scene_of
from tests.small_kernels import LOADS, SmallKernels
from tests.variants import one_of

LIMIT = 3.0  # the diameter of the ball's bounds
STEP = LIMIT / 200
TOLERANCE = {"float32": 4e-6, "float64": 1e-4 * STEP}

LOAD = f"""
{LOADS}
INLINE vec load_vec(__global const scalar *planes, int stride, int first) {{
    planes += first;
    return vec_of(load(planes), load(planes + stride), load(planes + 2 * stride));
}}
"""

_VECTOR = {
    "variables": {"v": 3},
    "state": {"p": {"start": "vec(0, 0, 0)", "next": "p + v"}, "still": 3},
    "map": "2*fold(v, 0.5)",
    "add": "none",
    "bounds": {"radius": 2},
    "bailout": 1,
}
# Formulas whose carried numbers colours follow.
CARRYING: dict[str, dict[str, Any]] = {
    "carried": {"inline": CARRIED},
    "a hybrid": {"chain": [{"name": "hast"}, {"inline": CARRIED}]},
    "of a vector": {"inline": _VECTOR},
}

QUANTITIES = """
__kernel void quantities(__global const scalar *points, __global scalar *result, int stride,
                         __global const scalar *normals, __global const scalar *views,
                         __constant const struct Material *material, __constant const struct Orbit *orbit,
                         __constant const scalar *k) {
    const int first = (int)get_global_id(0) * LANES;
    const vec point = load_vec(points, stride, first);
    // A lane with no normal takes no part.
    const vec normal = load_vec(normals, stride, first), view = load_vec(views, stride, first);
    const mask active = less(R(0.0), vec_dot(normal, normal));
    const real found = material->known == KNOWN_BY_FORMULA
        ? coloring_quantity(point, normal, view, R(0.002), active, material, orbit, k)
        : value_known(material->coloring, point, normal, R(7.25), R(0.5), normal);
    store(result + first, found);
}
"""

TRAP_KERNEL = """
__kernel void traps(__global const scalar *points, __global scalar *result, int stride,
                    __constant const struct Material *material, __constant const struct Orbit *orbit,
                    __constant const scalar *k) {
    const int first = (int)get_global_id(0) * LANES;
    const vec point = load_vec(points, stride, first);
    for (int shape = 0; shape < 4; ++shape) {
        const trap near = {shape + 1, vec_splat(material->trap_center), vec_splat(material->trap_direction),
                           (real)(material->trap_radius)};
        store(result + shape * stride + first, orbit_near(near, point, equal(R(0.0), R(0.0)), orbit, k));
    }
}
"""

COLORS = """
__kernel void colors(__global const scalar *points, __global scalar *result, int stride,
                     __constant const struct Material *material, __global const float *palette) {
    const int first = (int)get_global_id(0) * LANES;
    const color found = palette_color(palette_place(load_vec(points, stride, first).x, material),
                                      material->palette_repeat, palette);
    store(result + first, found.r);
    store(result + stride + first, found.g);
    store(result + 2 * stride + first, found.b);
}
"""


def usable(precision: Precision) -> Precision:
    """A device without float64 shows what it can in float32."""
    return precision if has_float64(device().info) else "float32"


@lru_cache
def compiled(text: str, precision: Precision, lanes: int) -> SmallKernels:
    return formula_kernels(device(), text, precision, lanes)


def build(scene: Scene, kernel: str, precision: Precision, lanes: int) -> SmallKernels:
    """A kernel behind the scene's formula and the headers. What changes only numbers builds nothing anew."""
    head = kind_text() + "#define PALETTE_SIZE 256\n"
    headers = orbit_files("integrators/sampling.h", "shading/coloring.h", "shading/shade.h")
    return compiled(HEAD + head + write_formula(scene.chain).text + headers + LOAD + kernel, precision, lanes)


def uploaded(scene: Scene, precision: Precision) -> list[npt.NDArray[Any]]:
    orbit = records.orbit_record(scene.chain, scene.formula.iterations, precision)
    raw = [records.material_record(scene, precision), orbit]
    return [
        *(record.reshape(1).view(np.uint8) for record in raw),
        np.array(write_formula(scene.chain).constants, precision),
    ]


def quantity(
    scene: Scene,
    points: Floats,
    normals: Floats,
    views: Floats,
    precision: Precision = "float32",
    lanes: int | None = None,
) -> Floats:
    """The scene's quantity at points, with a footprint of 0.002, a smooth count of 7.25 and a residual of 0.5."""
    lanes = lanes or best_lanes(device(), precision)
    built = build(scene, QUANTITIES, precision, lanes)
    ways = [built.planes(each.T) for each in (normals, views)]
    arguments = [*ways, *uploaded(scene, precision)]
    planes = at_points(built, "quantities", points, 1, *arguments)
    return np.asarray(planes[0], float)


def ball(formula: Mapping[str, Any] = BALL, **coloring: Any) -> Scene:
    return scene_of(formula, PERSPECTIVE, coloring=coloring)


def units(count: int, seed: int = 1) -> Floats:
    return unit(np.random.default_rng(seed).normal(size=(count, 3)))


def views_onto(normals: Floats) -> Floats:
    """Directions that meet a surface with these normals from outside, none at a grazing angle."""
    views = units(len(normals), seed=2)
    views[(views * normals).sum(1) > 0] *= -1
    return unit(views - 0.5 * normals)


def chord(points: Floats, ways: Floats, radius: float) -> tuple[Floats, Floats]:
    """Where lines through points enter and leave a ball around the origin, distances along unit `ways`."""
    middle = -(points * ways).sum(1)
    half = np.sqrt(radius**2 - np.square(points + middle[:, None] * ways).sum(1))
    return middle - half, middle + half


NORMALS = units(200)
VIEWS = views_onto(NORMALS)
POINTS = NORMALS * (BALL_RADIUS + 1e-3)  # half a footprint outside
MIRRORED = VIEWS - 2 * (VIEWS * NORMALS).sum(1, keepdims=True) * NORMALS
WAYS_OUT = {"normal": NORMALS, "view": -VIEWS, "reflection": MIRRORED}


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("along", ["normal", "view"])
def test_thickness_of_a_ball(along: str, precision: Precision) -> None:
    precision = usable(precision)
    found = quantity(ball(by="thickness", along=along), POINTS, NORMALS, VIEWS, precision)
    enter, leave = chord(POINTS, -WAYS_OUT[along], BALL_RADIUS)
    np.testing.assert_allclose(found, leave - enter, rtol=0, atol=TOLERANCE[precision])
    if along == "normal":
        np.testing.assert_allclose(found, 2 * BALL_RADIUS, rtol=0, atol=TOLERANCE[precision])


def test_every_lane_count_gives_the_same_and_idle_lanes_change_nothing() -> None:
    normals = NORMALS.copy()
    normals[::3] = 0
    scene = ball(by="thickness", along="view")
    each = [quantity(scene, POINTS, normals, VIEWS, lanes=n) for n in accepted_lanes(device(), "float32")]
    whole = quantity(scene, POINTS, NORMALS, VIEWS)
    working = np.arange(len(NORMALS)) % 3 > 0
    for found in each:
        np.testing.assert_array_equal(found[working], whole[working])
        assert not found[~working].any()


def test_thickness_is_bounded_and_needs_an_entrance() -> None:
    small = scene_of(
        BALL,
        PERSPECTIVE,
        coloring={"by": "thickness"},
        renderer={"bounds": {"center": [0, 0, 0], "radius": 0.6}},
    )
    np.testing.assert_allclose(quantity(small, POINTS, NORMALS, VIEWS), 1.2, rtol=1e-6)
    # Away from the ball, and from further outside than a step.
    assert not quantity(ball(by="thickness"), POINTS, -NORMALS, VIEWS).any()
    assert not quantity(ball(by="thickness"), POINTS + 0.05 * NORMALS, NORMALS, VIEWS).any()
    # Rough sets begin several footprints behind what counts as their surface.
    found = quantity(ball(by="thickness", step=0.005), POINTS + 0.015 * NORMALS, NORMALS, VIEWS)
    np.testing.assert_allclose(found, 2 * BALL_RADIUS, rtol=0, atol=TOLERANCE["float32"])


def test_a_coarse_step_is_enough_for_a_ball_and_a_fine_one_for_a_thin_wall() -> None:
    coarse = quantity(ball(by="thickness", step=0.7), POINTS, NORMALS, VIEWS)
    np.testing.assert_allclose(coarse, 2 * BALL_RADIUS, rtol=0, atol=1e-4 * 0.7)
    wall = {**SOLIDS, "shape": "abs(z) - 0.004"}
    points = np.array([[0.1, 0.2, 0.0041], [-0.4, 0.3, 0.0049]])
    up = np.tile([0.0, 0.0, 1.0], (2, 1))
    found = quantity(ball(wall, by="thickness", step=0.005), points, up, -up)
    np.testing.assert_allclose(found, 0.008, rtol=0, atol=1e-6)


def test_thickness_of_solids_given_by_their_shape() -> None:
    """A box of height 0.5 with its top at z = 0, and a sphere of radius 0.3."""
    points = np.array([[-0.5, 0.4, 0.001], [0.2, -0.1, 1.201]])
    up = np.tile([0.0, 0.0, 1.0], (2, 1))
    found = quantity(ball(SOLIDS, by="thickness"), points, up, -up)
    np.testing.assert_allclose(found, [0.5, 0.6], rtol=0, atol=1e-5)


@pytest.mark.parametrize("along", ["normal", "view", "reflection"])
def test_distance_of_a_layer_around_the_ball_and_of_one_within(along: str) -> None:
    for layer in (1, 5, BALL_ITERATIONS, 9, 12):
        scene = ball(by="layer_distance", along=along, layer=layer)
        found = quantity(scene, POINTS, NORMALS, VIEWS)
        radius = 4.0 ** (2.0**-layer)
        if layer < BALL_ITERATIONS:
            expected = chord(POINTS, WAYS_OUT[along], radius)[1]
        elif layer == BALL_ITERATIONS:
            expected = np.zeros(len(POINTS))
        else:
            expected = chord(POINTS, -WAYS_OUT[along], radius)[0]
        assert (expected < LIMIT).all()
        np.testing.assert_allclose(found, expected, rtol=0, atol=TOLERANCE["float32"])


def test_what_surface_cl_knows_already() -> None:
    assert (quantity(ball(by="iterations"), POINTS, NORMALS, VIEWS) == 7.25).all()
    nine = scene_of(BALL, PERSPECTIVE, coloring={"by": "residual"}, renderer={"points": {"count": 9}})
    assert (quantity(nine, POINTS, NORMALS, VIEWS) == 0.5).all()


@pytest.mark.parametrize("name", TRAP_FORMULAS)
def test_traps_against_numpy(name: str) -> None:
    precision = usable("float64")
    scene = trap_scene(name)
    lanes = best_lanes(device(), precision)
    points = np.random.default_rng(3).uniform(-0.9, 0.9, (64, 3))
    built = build(scene, TRAP_KERNEL, precision, lanes)
    found = at_points(built, "traps", points, 4, *uploaded(scene, precision))
    expected = trap_by_numpy(scene, points)
    assert np.isfinite(expected).all()
    tolerance = 1e-10 if precision == "float64" else 1e-3
    np.testing.assert_allclose(found, expected, rtol=tolerance, atol=tolerance)


def test_an_orbit_that_starts_outside_has_its_start() -> None:
    scene = trap_scene("quaternion_julia")
    lanes = best_lanes(device(), "float32")
    built = build(scene, TRAP_KERNEL, "float32", lanes)
    point = np.array([[0.0, 7.0, 0.0]])
    found = at_points(built, "traps", point, 4, *uploaded(scene, "float32"))
    np.testing.assert_allclose(found[:, 0], trap_distances(point[0]), rtol=1e-6)


@pytest.mark.parametrize("name", ["carried", "a hybrid", "of a vector"])
def test_carried_numbers_against_numpy(name: str) -> None:
    """Of points within and outside, each number by its name."""
    precision = usable("float64")
    formula = {**CARRYING[name], "iterations": 6}
    points = np.random.default_rng(3).uniform(-1.1, 1.1, (64, 3))
    chain = scene_of(formula, PERSPECTIVE).chain
    expected = carried_by_numpy(chain, points, 6)
    assert sum(len(set(each)) > 9 for each in expected.values()) > 1
    assert (np.linalg.norm(points, axis=1) > chain.bailout).sum() > 4 or name != "of a vector"
    normals = np.ones((64, 3))
    for each in (None, *expected):
        scene = scene_of(formula, PERSPECTIVE, coloring={"by": "carried", "number": each})
        found = quantity(scene, points, normals, normals, precision)
        wanted = expected[each or chain.carried[0]]
        tolerance = 1e-10 if precision == "float64" else 1e-3
        np.testing.assert_allclose(found, wanted, rtol=tolerance, atol=tolerance)


def colors(scene: Scene, table: Floats, quantities: Floats) -> Floats:
    """Colours of quantities in a palette of shape (256, 3), shape (n, 3)."""
    lanes = best_lanes(device(), "float32")
    built = build(scene, COLORS, "float32", lanes)
    points = np.stack([quantities, quantities, quantities], axis=1)
    material = uploaded(scene, "float32")[0]
    return at_points(built, "colors", points, 3, material, table.astype(np.float32)).T.astype(float)


RAMP = np.stack([np.arange(256) / 255, 1 - np.arange(256) / 255, np.full(256, 0.25)], axis=1)


def test_a_palette_that_ends() -> None:
    scene = ball(by="iterations", scale=0.25, offset=0.5, repeat=False)
    quantities = np.concatenate([np.linspace(-2, 2, 1001), [-1e30, -5, 2.001, 1e30, np.inf, -np.inf]])
    place = np.clip(0.25 * quantities + 0.5, 0, 1)
    expected = np.stack([place, 1 - place, np.full_like(place, 0.25)], axis=1)
    np.testing.assert_allclose(colors(scene, RAMP, quantities), expected, atol=1e-5)


def test_a_palette_that_repeats_has_no_jump() -> None:
    """Its last colour blends into its first within one 256th."""
    scene = ball(by="iterations", scale=0.5, offset=-0.25)
    quantities = np.linspace(-3, 5, 20_001)
    found = colors(scene, RAMP, quantities)
    place = 256 * ((0.5 * quantities - 0.25) % 1)
    red = np.interp(place, np.arange(257), np.append(RAMP[:, 0], RAMP[0, 0]))
    np.testing.assert_allclose(found[:, 0], red, atol=2e-4)
    # Even the steepest part, the seam, is followed: 4e-4 / 2 of a palette goes 256 times that far.
    assert np.abs(np.diff(found[:, 0])).max() < 256 * 0.5 * 4e-4 + 1e-3


def test_what_is_no_number_has_a_colour() -> None:
    for repeat in (True, False):
        found = colors(ball(by="iterations", repeat=repeat), RAMP, np.array([np.nan, np.inf, -np.inf, 1e38]))
        assert np.isfinite(found).all()
