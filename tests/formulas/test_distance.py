"""Distances against solids whose distance is known, and as lower bounds for the library; derivatives and escape counts."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from clfractal.formulas import catalog
from clfractal.formulas.backends import Dual, DualBackend, NumpyBackend, constant_dual, seeded
from clfractal.formulas.chain import Chain
from clfractal.formulas.evaluate import evaluate
from clfractal.formulas.reference import (
    apply,
    constant_of,
    distance,
    escape,
    mp_escape,
    mp_jacobian,
    mp_orbit,
)
from tests.formulas.escape_tables import CASES, TABLES, chain_of
from tests.formulas.orbits import start_at
from tests.formulas.own_formulas import BALL

Float = NDArray[np.float64]


def points(count: int, size: float, seed: int = 1) -> Float:
    return np.random.default_rng(seed).uniform(-size, size, (count, 3))


def test_the_ball_has_hubbard_and_douadys_estimate() -> None:
    # |z_n| = |p|^(2^n), so the potential G is log|p| and |z| log|z| / (2 g) = |p| log|p| / 2 after any count. The
    # solid of 20 applications is the level set at L = log(4) / 2^20, and the distance is bounded by a half plane's
    # near it, a ball's far off.
    p = points(500, 2)
    r = np.linalg.norm(p, axis=1)
    got, gradient = distance(catalog.load_chain(BALL), p, 20)
    potential, level = np.log(r), math.log(4) / 2**20
    share = (1 - (level / potential) ** 2) / (1 + potential / 2 + potential**2 / 12)
    expected = np.where(r > math.exp(level), 0.5 * r * potential * share, 0)
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-12)
    exact = np.maximum(r - math.exp(level), 0)
    np.testing.assert_array_less(got, exact + 1e-12)
    np.testing.assert_allclose(2 * got, exact, rtol=0.01, atol=1e-5)
    outside = r > 1.001
    normal = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(normal[outside], (p / r[:, None])[outside], atol=1e-12)


def boxes(p: Float, centres: list[tuple[float, float, float]], half: float) -> Float:
    best = np.full(len(p), np.inf)
    for centre in centres:
        q = np.abs(p - np.array(centre)) - half
        best = np.minimum(best, np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0))
    nearest: Float = np.maximum(best, 0)
    return nearest


@pytest.mark.parametrize(
    ("name", "kept"), [("vicsek_cross", lambda n: n in (0, 1)), ("menger_sponge", lambda n: n >= 2)]
)
def test_the_first_step_of_a_cube_fractal_has_the_distance_of_its_boxes(name: str, kept: Any) -> None:
    # Of the 27 small cubes the cross keeps those off the centre along at most one axis, the sponge the rest.
    thirds = (-2 / 3, 0.0, 2 / 3)
    centres = [
        (x, y, z) for x in thirds for y in thirds for z in thirds if kept(sum(c != 0 for c in (x, y, z)))
    ]
    p = points(3000, 1.3)
    got, _ = distance(catalog.load_chain(name), p, 1)
    exact = boxes(p, centres, 1 / 3)
    assert ((got == 0) == (exact < 1e-12)).all()
    if name == "vicsek_cross":
        np.testing.assert_allclose(got, exact, atol=1e-12)
    assert (got <= exact + 1e-12).all()


@pytest.mark.parametrize("name", ["sierpinski_tetrahedron", "octahedral_ifs"])
def test_polyhedral_shapes_are_lower_bounds(name: str) -> None:
    # After no application the solid is the polyhedron itself.
    p = points(2000, 1.5)
    got, _ = distance(catalog.load_chain(name), p, 5)
    signs = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
    if name == "sierpinski_tetrahedron":
        hull = np.max([-(p @ np.array(s)) - 1 for s in signs], axis=0) / math.sqrt(3)
    else:
        hull = (np.abs(p).sum(axis=1) - 1) / math.sqrt(3)
    # The fractal lies in its hull, and every corner of the hull is in the fractal.
    assert (got >= hull - 1e-9).all()
    corners = np.array(signs if name == "sierpinski_tetrahedron" else np.concatenate([np.eye(3), -np.eye(3)]))
    to_corner = np.linalg.norm(p[:, None] - corners[None], axis=2).min(axis=1)
    assert (got <= to_corner + 1e-9).all()


@pytest.mark.parametrize("name", catalog.names())
def test_hardly_any_safe_step_ends_inside(name: str) -> None:
    chain = catalog.load_chain(name)
    p = np.array(chain.center) + points(1200, chain.radius, seed=3)
    step, gradient = distance(chain, p, 12)
    assert np.isfinite(step).all()
    assert (step >= 0).all()
    outside = (step > 1e-3 * chain.radius) & (np.linalg.norm(gradient, axis=1) > 0)
    p, step = p[outside], step[outside]
    inward = -gradient[outside] / np.linalg.norm(gradient[outside], axis=1, keepdims=True)
    aim = inward + 0.5 * np.random.default_rng(4).normal(size=p.shape)
    aim /= np.linalg.norm(aim, axis=1, keepdims=True)
    after, _ = distance(chain, p + aim * (chain.step_scale * step)[:, None], 12)
    assert len(p) > 300
    # A step that ends inside brackets the surface. Those of the Mandelbulb are as long as no ray is lost.
    assert (after == 0).mean() < (0.03 if name == "mandelbulb" else 0.005)


@pytest.mark.parametrize("name", catalog.names())
def test_distances_are_numbers_at_extreme_points(name: str) -> None:
    chain = catalog.load_chain(name)
    values = (0.0, 1e-30, 1.0, -1.0, 1e4, -1e6)
    p = np.array([[x, y, z] for x in values for y in values for z in values])
    got, _ = distance(chain, p, 10)
    assert not np.isnan(got).any()
    assert (got >= 0).all()


# --- derivatives: forward duals against finite differences ---


# Formulas whose map is a similarity of space in every point, so that one number is the whole derivative.
SIMILAR = [
    *("menger_sponge", "sierpinski_tetrahedron", "octahedral_ifs", "vicsek_cross"),
    *("kaleidoscopic_ifs", "polyhedral_ifs", "mandelbox", "twisted_box"),
    *("cantor_dust", "mosely_snowflake", "jerusalem_cube", "turned_menger", "menger_tesseract"),
    *("hexadecachoron_flake", "inverted_sponge", "mandelbox_4d", "amazing_box_mod", "octahedral_box"),
    "pseudo_kleinian_4d",
]
QUATERNIONS = ["quaternion_julia", "quaternion_mandelbrot"]


def points_of(chain: Chain, count: int, seed: int = 4) -> np.ndarray[Any, np.dtype[np.float64]]:
    points = np.random.default_rng(seed).uniform(-1, 1, (count, 3)) * chain.radius * 0.7
    return np.round(points, 6)


@pytest.mark.parametrize("name", catalog.names())
def test_mpmath_duals_match_finite_differences(name: str) -> None:
    chain = catalog.load_chain(name)
    with mpmath.workdps(60):
        h = mpmath.mpf(10) ** -25
        for point in points_of(chain, 4):
            jacobian = mp_jacobian(chain, list(point), 3, digits=60)
            for axis in range(3):
                ahead, behind = (
                    mp_orbit(
                        chain, [c + (step if i == axis else 0) for i, c in enumerate(point)], 3, digits=60
                    )
                    for step in (h, -h)
                )
                for row, (a, b) in enumerate(zip(ahead[-1], behind[-1], strict=True)):
                    difference = float((a - b) / (2 * h))
                    assert float(jacobian[row][axis]) == pytest.approx(difference, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", catalog.names())
def test_numpy_duals_match_mpmath_duals(name: str) -> None:
    chain = catalog.load_chain(name)
    points = points_of(chain, 20)
    backend = DualBackend(NumpyBackend())
    state, c = start_at(chain, seeded(list(points.T)), backend)
    with np.errstate(all="ignore"):
        for application in range(3):
            bound = chain.link_at(application).bound
            constant = constant_of(bound, c)
            state = apply(bound, state, constant, backend, number=application, carried=chain.carried)
    for index, point in enumerate(points):
        exact = mp_jacobian(chain, list(point), 3)
        scale = max(1.0, *(abs(float(value)) for row in exact for value in row))
        for got, row in zip(state, exact, strict=True):
            partials = constant_dual(got, 3).partials
            for value, expected in zip(partials, row, strict=True):
                number = float(np.broadcast_to(value, len(points))[index])
                assert number == pytest.approx(float(expected), abs=1e-9 * scale)


def jacobian_and_rule(name: str, count: int = 12, number: int = 1) -> list[tuple[Any, float]]:
    """Jacobians of the map alone by the state, and the scalar rule with dr = 1 and nothing added, in an application."""
    bound = catalog.load_chain(name).first
    formula = bound.formula
    size = len(formula.variables)
    states = np.random.default_rng(8).uniform(-2, 2, (count, size))
    found = []
    for state in states:
        names: dict[str, Any] = {**bound.values, "n": float(number)}
        names.update(zip(formula.variables, seeded([np.array([c]) for c in state]), strict=True))
        backend = DualBackend(NumpyBackend())
        with np.errstate(all="ignore"):
            for let, node in formula.let:
                names[let] = evaluate(node, names, backend)
            rows = [constant_dual(evaluate(node, names, backend), size).partials for node in formula.map]
            names.update(dr=1.0, added=0.0)
            assert formula.derivative is not None
            rule = evaluate(formula.derivative, names, backend)
        jacobian = np.array([[float(np.ravel(value)[0]) for value in row] for row in rows])
        value = rule.value if isinstance(rule, Dual) else rule
        found.append((jacobian, float(np.ravel(value)[0])))
    return found


@pytest.mark.parametrize("name", SIMILAR)
def test_the_scalar_rule_is_the_jacobian_where_the_map_is_a_similarity(name: str) -> None:
    for jacobian, rule in [*jacobian_and_rule(name), *jacobian_and_rule(name, number=0)]:
        np.testing.assert_allclose(
            jacobian.T @ jacobian, rule**2 * np.eye(len(jacobian)), atol=1e-9 * rule**2
        )


@pytest.mark.parametrize("name", QUATERNIONS)
def test_the_scalar_rule_bounds_the_jacobian_of_quaternion_powers(name: str) -> None:
    for jacobian, rule in jacobian_and_rule(name):
        assert np.linalg.norm(jacobian, ord=2) == pytest.approx(rule, rel=1e-9)


@pytest.mark.parametrize("power", [2, 3, 8, 2.5])
def test_the_mandelbulb_rule_is_the_derivative_along_the_axis(power: float) -> None:
    # On the polar axis the map is z -> z**power, so dz/dC follows n z**(n - 1) dz/dC + 1 exactly.
    chain = catalog.load_chain("mandelbulb", {"power": power})
    rule = chain.first.derivative
    assert rule is not None
    z, dr = 0.83, 1.0
    for applications in (2, 3, 4):
        dr = float(evaluate(rule, {**chain.first.values, "x": 0.0, "y": 0.0, "z": z, "dr": dr}))
        z = z**power + 0.83
        assert float(mp_jacobian(chain, [0, 0, 0.83], applications)[2][2]) == pytest.approx(dr, rel=1e-12)


def test_a_julia_set_adds_nothing_to_the_derivative() -> None:
    julia = catalog.load_chain({"name": "mandelbulb", "julia": [0.1, 0.2, 0.3]}).first
    point = catalog.load_chain("mandelbulb").first
    names = {**point.values, "x": 0.0, "y": 0.0, "z": 0.5, "dr": 3.0}
    assert julia.derivative is not None
    assert point.derivative is not None
    assert float(evaluate(point.derivative, names)) - float(evaluate(julia.derivative, names)) == 1.0


# --- counts, against the reference tables and 40 digits ---


@pytest.mark.parametrize("case", sorted(CASES))
def test_every_count_of_the_tables(case: str) -> None:
    table = np.loadtxt(TABLES / f"{case}.csv", delimiter=",", skiprows=1)
    assert len(table) >= CASES[case].get("points", 60)
    setting = CASES[case]
    count, inside = escape(chain_of(case), table[:, :3], int(setting["iterations"]), setting["bailout"])
    np.testing.assert_array_equal(count, table[:, 3])
    np.testing.assert_array_equal(inside, table[:, 4] == 1)


@pytest.mark.parametrize("name", catalog.names())
def test_counts_agree_with_40_digits(name: str) -> None:
    chain = catalog.load_chain(name)
    points = np.random.default_rng(2).uniform(-1, 1, (12, 3)) * chain.radius * 0.6
    count, inside = escape(chain, points, 8)
    for point, n, stays in zip(points, count, inside, strict=True):
        assert mp_escape(chain, list(point), 8) == (n, stays)


def test_the_start_counts_as_the_design_says() -> None:
    bulb = catalog.load_chain("mandelbulb")
    points = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    assert [a.tolist() for a in escape(bulb, points, 9)] == [[9, 1], [True, False]]
    assert [a.tolist() for a in escape(bulb, points, 1)] == [[1, 1], [True, False]]
    julia = catalog.load_chain({"name": "mandelbulb", "julia": [0.1, 0.2, 0.3]})
    assert [a.tolist() for a in escape(julia, points, 9)] == [[9, 0], [True, False]]
    sponge = catalog.load_chain("menger_sponge")
    assert [a.tolist() for a in escape(sponge, points, 3)] == [[1, 0], [False, False]]


def test_a_point_that_leaves_at_the_limit_has_the_limit_as_count_and_is_outside() -> None:
    bulb = catalog.load_chain("mandelbulb")
    point = np.array([[1.3, 0.0, 0.0]])
    count, inside = escape(bulb, point, 50)
    assert not inside[0]
    at_limit = escape(bulb, point, int(count[0]))
    assert (int(at_limit[0][0]), bool(at_limit[1][0])) == (int(count[0]), False)
    assert bool(escape(bulb, point, int(count[0]) - 1)[1][0])


@pytest.mark.parametrize("name", catalog.names())
def test_extreme_points_give_no_nan_and_no_warning(name: str) -> None:
    chain = catalog.load_chain(name)
    values = (0.0, -0.0, 1e-300, 1.0, -1.0, 1e6, 1e150, 1e300)
    points = np.array([[x, y, z] for x in values for y in values for z in values])
    count, inside = escape(chain, points, 6)
    assert ((count >= 0) & (count <= 6)).all()
    far = np.abs(points).max(axis=1) > 1e4
    assert not inside[far].any()


def test_a_chain_takes_its_formulas_in_turn() -> None:
    bulb, box = catalog.load_chain("mandelbulb"), catalog.load_chain("mandelbox")
    both = catalog.load_chain(
        {"chain": [{"name": "mandelbulb", "count": 2}, {"name": "mandelbox"}], "bailout": 1e6}
    )
    point = [0.3, 0.2, -0.4]
    orbit = mp_orbit(both, point, 4)
    from clfractal.formulas.reference import MpmathBackend, apply

    names = [link.bound.formula.name for link in map(both.link_at, range(4))]
    assert names == ["mandelbulb", "mandelbulb", "mandelbox", "mandelbulb"]
    backend = MpmathBackend()
    state = orbit[0]
    for n, chain in enumerate((bulb, bulb, box, bulb)):
        state = tuple(apply(chain.first, state, point, backend))
        for got, expected in zip(orbit[n + 1], state, strict=True):
            assert float(got) == pytest.approx(float(expected), rel=1e-12)
