"""Distances against solids whose distance is known, and as lower bounds for the library."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clfractal.formulas import catalog
from clfractal.formulas.reference import distance
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
