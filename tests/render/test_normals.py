"""Normals from a pixel's points: planes and spheres whose normals are known, NumPy's least squares, missing points."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.device.structs import Precision
from tests.render import normals_oracle as oracle
from tests.render.normals_kernel import (
    GRID,
    PRECISIONS,
    Masks,
    Normals,
    epsilon,
    lanes_of,
    run,
    variants,
)
from tests.small_kernels import Floats

# Every choice of found points of a 3 x 3 grid.
SUBSETS: Masks = np.array(list(itertools.product((False, True), repeat=9)))
VIEWER = [0.0, 0.0, 1.0]


def all_found(points: Floats) -> Masks:
    return np.ones(points.shape[:2], bool)


def planes(slopes: Floats, offsets: Floats, footprints: Floats) -> tuple[Floats, Floats]:
    """Points (n, count, 3) of planes through the origin, and their normals (n, 3)."""
    places = offsets * footprints[:, None, None]
    depths = np.einsum("na,nca->nc", slopes, places)
    normals = oracle.unit(np.concatenate([-slopes, np.ones((len(slopes), 1))], axis=1))
    return np.concatenate([places, depths[..., None]], axis=-1), normals


def sphere_points(angle: float, footprint: float, offsets: Floats) -> Floats:
    """Points of the unit sphere seen `angle` from its middle, relative to the point in the pixel's centre; x to its rim."""
    x, y = np.sin(angle) + footprint * offsets[:, 0], footprint * offsets[:, 1]
    height = np.sqrt(1 - x**2 - y**2) - np.cos(angle)
    return np.stack([footprint * offsets[:, 0], y, height], axis=-1)[None]


def assert_safe(normals: Floats, usable: Masks, slack: float) -> None:
    """Never NaN, length 1, towards the viewer; straight at the viewer where unusable."""
    assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() <= slack
    assert (normals[..., 2] > 0).all()
    assert (normals[~usable] == VIEWER).all()


def assert_all_safe(found: Normals, slack: float) -> None:
    for normals, usable in (*found.methods().values(), (found.eight, found.eight_usable)):
        assert_safe(normals, usable, slack)
    assert np.isfinite(found.residual).all()
    assert (found.residual >= 0).all()
    assert (found.residual[~found.plane_usable] == 0).all()


def test_planes_are_exact() -> None:
    """Every normal of a tilted plane is the plane's, at any footprint, for every lane count and number type."""
    random = np.random.default_rng(1)
    slopes = random.normal(size=(203, 2)) * 10.0 ** random.uniform(-3, 3, (203, 1))
    footprints = 10.0 ** random.uniform(-7, 3, 203)
    points, normals = planes(slopes, GRID, footprints)
    for precision, lanes in variants():
        found = run(points, all_found(points), precision, lanes)
        for name, (got, usable) in found.methods().items():
            assert usable.all(), (name, precision, lanes)
            assert np.abs(got - normals).max() <= 4 * epsilon(precision), (name, precision, lanes)
        assert found.eight_usable.all()
        assert np.abs(found.eight - normals[:, None]).max() <= 4 * epsilon(precision)
        assert (found.residual <= 2 * epsilon(precision) * footprints).all()


@pytest.mark.parametrize("angle", [0.3, 0.8, 1.2])
def test_spheres(angle: float) -> None:
    """Errors fall with the square of the footprint; that of the one triangle, low in the pixel, with the footprint."""
    expected = np.array([np.sin(angle), 0, np.cos(angle)])
    errors: dict[str, list[float]] = {"plane": [], "triangle": [], "mean": []}
    for footprint in (0.02, 0.01):
        points = sphere_points(angle, footprint, GRID)
        found = run(points, all_found(points), "float64", 1)
        for name, (normals, _) in found.methods().items():
            errors[name].append(float(np.linalg.norm(normals[0] - expected)))
    ratios = {name: coarse / fine for name, (coarse, fine) in errors.items()}
    assert ratios == pytest.approx({"plane": 4, "triangle": 2, "mean": 4}, rel=0.05)
    assert max(error[1] for error in errors.values()) < 0.02


@pytest.mark.parametrize("count", [3, 4, 9, 25, 64])
def test_least_squares_of_any_points(count: int) -> None:
    """Random places and heights, compared with NumPy's least squares about the mean."""
    points = np.random.default_rng(count).normal(size=(101, count, 3))
    points[..., 2] *= 3
    points = points.astype(np.float32).astype(np.float64)
    thin = np.array([oracle.thinness(each) for each in points])
    normals, residuals = oracle.least_squares(points)
    for precision, lanes in variants():
        found = run(points, all_found(points), precision, lanes)
        assert (found.plane_usable == (thin > oracle.THINNEST)).all()
        bound = (8 * epsilon(precision) / np.sqrt(thin))[found.plane_usable]
        error = np.abs(found.plane - normals).max(axis=1)[found.plane_usable]
        assert (error <= bound).all(), (precision, lanes)
        off = np.abs(found.residual - residuals)[found.plane_usable]
        assert (off <= bound).all(), (precision, lanes)


def test_any_subset_of_a_plane() -> None:
    """Points that are left out change nothing on a plane: a normal is usable unless the rest is on one line."""
    points, normals = planes(np.tile([0.75, -2.5], (512, 1)), GRID * 3, np.full(512, 2.0**-12))
    on_a_line = np.array([oracle.thinness(GRID[there]) < 1e-9 for there in SUBSETS])
    # What is missing may be anything.
    for nothing in (np.nan, np.inf, -3e38):
        given = np.where(SUBSETS[..., None], points, nothing)
        for precision, lanes in variants():
            found = run(given, SUBSETS, precision, lanes)
            assert_all_safe(found, 4 * epsilon(precision))
            assert (found.plane_usable == ~on_a_line).all()
            for got, usable in found.methods().values():
                assert (usable == ~on_a_line).all()
                assert np.abs(got - normals)[usable].max() <= 20 * epsilon(precision)


def test_any_subset_of_a_rough_surface() -> None:
    """The triangles that are whole, or the least-squares plane where none is, as NumPy has them."""
    heights = np.random.default_rng(7).integers(-64, 64, (512, 9)) / 16
    points = np.concatenate([np.tile(GRID * 3, (512, 1, 1)), heights[..., None]], axis=-1)
    missing = np.where(SUBSETS[..., None], points, np.nan)
    plane, residuals = oracle.least_squares(missing)
    expected = {"plane": plane, "triangle": oracle.one_triangle(missing)}
    expected["mean"] = oracle.eight_triangles_normal(missing)
    eight = oracle.eight_triangles(missing)
    for precision, lanes in variants():
        found = run(missing, SUBSETS, precision, lanes)
        assert_all_safe(found, 4 * epsilon(precision))
        for name, (got, usable) in found.methods().items():
            assert (usable == np.isfinite(expected[name]).all(axis=1)).all(), name
            assert np.abs(got - expected[name])[usable].max() <= 50 * epsilon(precision), name
        assert (found.eight_usable == np.isfinite(eight).all(axis=2)).all()
        assert np.abs(found.eight - eight)[found.eight_usable].max() <= 4 * epsilon(precision)
        there = found.plane_usable
        assert np.abs(found.residual - residuals)[there].max() <= 50 * epsilon(precision)


def test_shading_can_be_averaged_from_the_eight() -> None:
    """The mean of shadings differs from the shading of the mean by what the bend of the surface says."""
    # A ridge along y: z = -|x|. The normals are (-1, 0, 1) and (1, 0, 1) over sqrt(2), four each.
    points = np.concatenate([GRID * 3, -np.abs(GRID[:, :1] * 3)], axis=1)[None]
    light = np.array([1.0, 0.0, 0.0])
    found = run(points, all_found(points), "float64", 1)
    shaded = np.maximum(found.eight[0] @ light, 0).mean()
    assert shaded == pytest.approx(np.sqrt(0.5) / 2, abs=1e-15)
    np.testing.assert_allclose(found.mean[0], VIEWER, atol=1e-15)
    told = oracle.eight_triangles_shading(points, lambda normals: np.maximum(normals @ light, 0)[..., None])
    assert told[0, 0] == pytest.approx(shaded, abs=1e-15)


_ALONG, _BEND = np.arange(9.0)[:, None] - 4, np.random.default_rng(3).normal(size=(9, 1))
# Points (9, 3) that tell no plane.
LINES: dict[str, Floats] = {
    "one place": np.tile([0.1, 0.7, 0.3], (9, 1)),
    "the origin": np.zeros((9, 3)),
    "one place, any depth": np.concatenate([np.full((9, 2), 0.3), _BEND], axis=1),
    "across": np.concatenate([_ALONG, 0 * _ALONG, _BEND], axis=1),
    "upright": np.concatenate([0 * _ALONG, _ALONG, _BEND], axis=1),
    "aslant": np.concatenate([_ALONG / 3, _ALONG / 7, _BEND], axis=1),
    "aslant, elsewhere": np.concatenate([_ALONG / 3 + 0.1, _ALONG / 7 - 0.7, _BEND], axis=1),
    "steep": np.concatenate([_ALONG * 1e-3, _ALONG, 1e5 * _BEND], axis=1),
}


@pytest.mark.parametrize("case", LINES)
def test_points_on_a_line(case: str) -> None:
    points = LINES[case][None] * 1e-4
    for precision, lanes in variants():
        found = run(points, all_found(points), precision, lanes)
        assert_all_safe(found, 4 * epsilon(precision))
        for name, (_, usable) in found.methods().items():
            assert not usable.any(), name
        assert not found.eight_usable.any()


def bits_of(found: Normals) -> Floats:
    """All normals, shape (n, 11, 3)."""
    single = np.stack([found.plane, found.triangle, found.mean], axis=1)
    return np.concatenate([single, found.eight], axis=1)


def test_scale_changes_nothing() -> None:
    """Scaled by a power of two, every normal is the same to the last bit, every residual is scaled."""
    random = np.random.default_rng(11)
    points = random.normal(size=(128, 9, 3)).astype(np.float32).astype(np.float64)
    points[:, :, :2] = (GRID + random.uniform(-0.05, 0.05, (128, 9, 2))).astype(np.float32)
    there = random.random((128, 9)) < 0.8
    for precision in PRECISIONS:
        lanes = lanes_of(precision)
        base = run(points, there, precision, lanes)
        assert base.plane_usable.mean() > 0.9
        for power in (-46, -23, 10, 36):
            scaled = run(points * 2.0**power, there, precision, lanes)
            assert np.array_equal(bits_of(base), bits_of(scaled)), (precision, power)
            assert np.array_equal(base.residual * 2.0**power, scaled.residual)


def test_means_do_not_cancel() -> None:
    """A pixel whose points all lie a thousand footprints from the reference loses only what rounds off the points."""
    random = np.random.default_rng(13)
    # Whole numbers below 2^11: float32 holds them, their places and heights without rounding.
    heights = random.integers(-8, 9, (128, 9)).astype(np.float64)
    points = np.concatenate([np.tile(GRID * 3, (128, 1, 1)), heights[..., None]], axis=-1)
    normals, residuals = oracle.least_squares(points)
    for precision in PRECISIONS:
        for shift in ([1000.0, -500.0, 2000.0], [-2000.0, 0.0, 0.0]):
            found = run(points + np.array(shift), all_found(points), precision, lanes_of(precision))
            # The mean rounds to 2^-24 of the shift, once for every point.
            bound = 2000 * epsilon(precision)
            assert np.abs(found.plane - normals).max() <= bound
            assert np.abs(found.residual - residuals).max() <= 9 * bound


def test_small_residuals_are_exact() -> None:
    """A residual of 1e-5 of the heights has lost only what rounds off the heights: it is no difference of sums."""
    ripple = np.array([1.0, 0, -1, 0, 0, 0, -1, 0, 1])  # at a right angle to 1, x and y
    slopes = np.array([[4.0, 2.0], [0.0, -8.0]])
    points, normals = planes(slopes, GRID * 3, np.ones(2))
    height = 2.0**-16
    points[..., 2] += height * ripple
    expected = height * np.sqrt(4 / 9) * normals[:, 2]
    for precision in PRECISIONS:
        found = run(points, all_found(points), precision, lanes_of(precision))
        np.testing.assert_allclose(found.residual, expected, rtol=0.1 if precision == "float32" else 1e-9)


def test_a_column_that_is_upright_but_for_rounding() -> None:
    """Two first points whose x differ by 1e-18 have no slope over x that what follows could be measured by."""
    for size in (1e-7, 1.0, 1e3, 1e12):
        for sliver in (1e-22, 2e-19, 1e-18, 1e-12, 1e-9):
            column = [[sliver, -size], [0.0, size], [size, 0.0], [size, size / 2], [-size, size / 4]]
            points = np.tile(np.array([[x, y, 2 * x - 3 * y] for x, y in column]), (2, 1, 1))
            there = np.arange(5) < np.array([[3], [5]])
            normal = oracle.unit(np.array([-2.0, 3.0, 1.0]))
            for precision in PRECISIONS:
                found = run(points, there, precision, lanes_of(precision))
                assert found.plane_usable.all(), (size, sliver)
                assert np.abs(found.plane - normal).max() <= 8 * epsilon(precision), (size, sliver)
                assert (found.residual <= 8 * epsilon(precision) * size).all()


def test_perspective_silhouette() -> None:
    """Rays that miss the near ball and find a wall behind it, however far: every triangle tells a normal."""
    random = np.random.default_rng(19)
    behind = 10.0 ** random.uniform(0, 4, (200, 1))
    depths = np.where(random.random((200, 9)) < 0.5, 1.0, behind) + random.uniform(0, 1e-3, (200, 9))
    ways = oracle.unit(np.concatenate([GRID * 1e-3, -np.ones((9, 1))], axis=1))
    points = ways * depths[..., None] + [0, 0, 1]  # relative to the ball
    for precision, lanes in variants():
        found = run(points, all_found(points), precision, lanes)
        assert_all_safe(found, 4 * epsilon(precision))
        assert found.mean_usable.all()
        assert found.eight_usable.all()


# What a search may hand over, far beyond what it should.
NUMBERS = st.floats(-1e12, 1e12) | st.sampled_from([0.0, 1.0, -1.0, 1e-7, 1e-20, 1e-38, 1e12])


@settings(max_examples=300)
@given(
    st.sampled_from(["float32", "float64"]),
    st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS, st.booleans()), min_size=9, max_size=40),
)
def test_any_points_are_safe(precision: Precision, points: list[tuple[float, float, float, bool]]) -> None:
    """Whatever is found, wherever: no NaN, length 1, towards the viewer, and (0, 0, 1) where nothing can be told."""
    given = np.array([point[:3] for point in points])[None]
    there = np.array([point[3] for point in points])[None]
    assert_all_safe(run(given, there, precision, lanes_of(precision)), 1e-6)
