"""Formulas at points on the device: every reference count at every lane count, and distances against the oracle."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from clfractal.device.orbit import EXTRA_APPLICATIONS
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.formulas import catalog, reference
from clfractal.formulas.chain import Chain
from clfractal.formulas.opencl import write_formula
from clfractal.integrators import points
from tests.devices import check_usable, device
from tests.formulas.escape_tables import CASES, TABLES, chain_of
from tests.formulas.opencl_batch import at_points, batch_text, formula_kernels, orbit_files
from tests.render.point_checks import Floats, agree, orbit_bytes
from tests.small_kernels import SmallKernels

PRECISIONS: tuple[Precision, ...] = ("float32", "float64")


def only(kernel: str) -> str:
    """`points.cl` after the formula, with one of its two kernels: the other would be compiled for nothing."""
    text = orbit_files("formulas/points.cl")
    parts = re.split(r"^(?=__kernel )", text, flags=re.MULTILINE)
    kept = [part for part in parts[1:] if part.startswith(f"__kernel void {kernel}(")]
    assert len(kept) == 1
    return parts[0] + kept[0]


def table(case: str) -> Floats:
    return np.asarray(np.loadtxt(TABLES / f"{case}.csv", delimiter=",", skiprows=1))


# --- escape counts ---


@lru_cache
def count_texts() -> tuple[dict[str, int], str]:
    """Which formula of the batch a table needs, and the batch: some tables share a formula's text."""
    formulas = {case: write_formula(chain_of(case)) for case in sorted(CASES)}
    different = {formula.text: formula for formula in formulas.values()}
    places = {case: list(different).index(formula.text) for case, formula in formulas.items()}
    return places, batch_text(list(different.values()), only("escape_counts"))


@lru_cache
def count_program(precision: Precision, lanes: int) -> SmallKernels:
    return formula_kernels(device(), count_texts()[1], precision, lanes)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("case", sorted(CASES))
def test_every_count_of_the_tables_at_every_lane_count(case: str, precision: Precision) -> None:
    check_usable(precision)
    rows, setting, chain = table(case), CASES[case], chain_of(case)
    constants = np.array(write_formula(chain).constants, precision)
    orbit = orbit_bytes(chain, int(setting["iterations"]), precision, setting["bailout"])
    tried = accepted_lanes(device(), precision)
    assert tried
    for lanes in tried:
        kernel = f"escape_counts_f{count_texts()[0][case]}"
        built = count_program(precision, lanes)
        out = at_points(built, kernel, rows[:, :3], 2, orbit, constants, kind="int32")
        np.testing.assert_array_equal(out[0], rows[:, 3], f"counts, {lanes} lanes")
        np.testing.assert_array_equal(out[1] == 1, rows[:, 4] == 1, f"inside, {lanes} lanes")


@pytest.mark.parametrize("case", ["hast_power2", "hast_edges", "mandelbox_scale2", "mandelbox_scale-1.5"])
def test_the_function_for_lists_of_points(case: str) -> None:
    rows, setting = table(case), CASES[case]
    count, inside = points.escape(
        chain_of(case),
        rows[:, :3],
        int(setting["iterations"]),
        device=device(),
        lanes=accepted_lanes(device(), "float32")[-1],
        bailout=setting["bailout"],
    )
    assert count.dtype == np.int64
    assert inside.dtype == np.bool_
    np.testing.assert_array_equal(count, rows[:, 3])
    np.testing.assert_array_equal(inside, rows[:, 4] == 1)


def escape(array: Any, **options: Any) -> tuple[list[int], list[bool]]:
    lanes = accepted_lanes(device(), "float32")[-1]
    count, inside = points.escape(chain_of("hast_power2"), array, 40, device=device(), lanes=lanes, **options)
    return count.tolist(), inside.tolist()


def test_lists_of_any_length_and_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = table("hast_power2")
    for length in (0, 1, 63, 64, 65):
        assert escape(rows[:length, :3]) == (rows[:length, 3].tolist(), (rows[:length, 4] == 1).tolist())
    monkeypatch.setattr(points, "LAUNCH_POINTS", 100)
    assert escape(rows[:, :3]) == (rows[:, 3].tolist(), (rows[:, 4] == 1).tolist())


def test_a_smaller_bailout_ends_earlier_and_the_limit_is_kept() -> None:
    rows = table("hast_power2")[:, :3]
    early, usual = (np.array(escape(rows, bailout=bailout)[0]) for bailout in (2.0, 4.0))
    assert (early <= usual).all()
    assert (early < usual).any()
    lanes = accepted_lanes(device(), "float32")[-1]
    for limit in (1, 2, 7):
        got = points.escape(chain_of("hast_power2"), rows, limit, device=device(), lanes=lanes)
        expected = reference.escape(chain_of("hast_power2"), rows, limit)
        np.testing.assert_array_equal(got[0], expected[0])
        np.testing.assert_array_equal(got[1], expected[1])


@pytest.mark.parametrize(
    ("array", "words"),
    [
        ([[1.0, 2.0]], r"shape \(n, 3\), got \(1, 2\)"),
        ([1.0, 2.0, 3.0], r"shape \(n, 3\), got \(3,\)"),
        ([[0.0, np.nan, 0.0]], "finite"),
        ([[0.0, np.inf, 0.0]], "finite"),
    ],
)
def test_arrays_that_are_no_points(array: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        escape(array)


# --- distances ---

NAMES = catalog.names()
ITERATIONS = 10


@lru_cache
def distance_program() -> SmallKernels:
    formulas = [write_formula(catalog.load_chain(name)) for name in NAMES]
    return formula_kernels(device(), batch_text(formulas, only("distances")), "float64", 1)


def points_of(chain: Chain) -> Floats:
    random = np.random.default_rng(12)
    return random.uniform(-0.8, 0.8, (200, 3)) * chain.radius + chain.center


@pytest.mark.parametrize("name", NAMES)
def test_distances_and_normals(name: str) -> None:
    check_usable("float64")
    chain = catalog.load_chain(name)
    formula, here = write_formula(chain), points_of(chain)
    orbit = orbit_bytes(chain, ITERATIONS, "float64", None)
    kernel = f"distances_f{NAMES.index(name)}"
    constants = np.array(formula.constants, "float64")
    step, full, *rest = at_points(distance_program(), kernel, here, 7, orbit, constants)
    normal, inside = np.array(rest[:3]).T, rest[4] == 1
    expected, gradient = reference.distance(chain, here, ITERATIONS)
    agree(full, normal, expected, gradient)
    # The distance that rays march by: positive outside, of the same size as the Jacobian's.
    assert np.isfinite(step).all()
    assert (step >= 0).all()
    np.testing.assert_array_equal(inside, full == 0)
    outside = (full > 0) & (step > 0)
    assert outside.sum() > 20
    assert 0.2 < np.median(step[outside] / full[outside]) < 5
    if not formula.has_derivative:
        np.testing.assert_array_equal(step, full)


@pytest.mark.parametrize("name", ["mandelbulb", "menger_sponge", "bulbox"])
def test_distances_in_float32(name: str) -> None:
    chain = catalog.load_chain(name)
    here = points_of(chain)
    lanes = accepted_lanes(device(), "float32")[-1]
    found = points.distances(chain, here, 5, device=device(), lanes=lanes)
    expected, gradient = reference.distance(chain, here, 5)
    agree(found.full, found.normal, expected, gradient, 2e-3)
    assert ((found.smooth >= 0) & (found.smooth <= 5 + EXTRA_APPLICATIONS)).all()
    np.testing.assert_array_equal(found.inside, found.full == 0)
    assert found.inside.any()
    length = np.linalg.norm(found.normal, axis=1)
    assert not length[found.inside].any()
    np.testing.assert_allclose(length[~found.inside], 1, atol=1e-5)


def test_no_point_gives_nan() -> None:
    values = (0.0, -0.0, 1e-30, 1.0, -1.0, 1e6, 1e15)
    here = np.array([[x, y, z] for x in values for y in values for z in values])
    lanes = accepted_lanes(device(), "float32")[-1]
    found = points.distances(catalog.load_chain("mandelbulb"), here, 5, device=device(), lanes=lanes)
    for plane in (found.step, found.full, found.smooth, found.normal):
        assert not np.isnan(plane).any()
