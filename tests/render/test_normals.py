"""Normals from a pixel's points: planes and spheres whose normals are known, NumPy's least squares, missing points."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest

from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from tests.devices import device
from tests.render import normals_oracle as oracle
from tests.render.normals_kernel import Masks, Normals, run
from tests.small_kernels import Floats

PRECISIONS: tuple[Precision, ...] = ("float32", "float64")
GRID = oracle.grid_offsets(3)
# Every choice of found points of a 3 x 3 grid.
SUBSETS: Masks = np.array(list(itertools.product((False, True), repeat=9)))
VIEWER = [0.0, 0.0, 1.0]


def epsilon(precision: Precision) -> float:
    return float(np.finfo(precision).eps)


def lanes_of(precision: Precision) -> int:
    return accepted_lanes(device(), precision)[-1]


def variants() -> Iterator[tuple[Precision, int]]:
    for precision in PRECISIONS:
        for lanes in accepted_lanes(device(), precision):
            yield precision, lanes


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


def assert_safe(normals: Floats, usable: Masks, precision: Precision) -> None:
    """Never NaN, length 1, towards the viewer; straight at the viewer where unusable."""
    assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() <= 4 * epsilon(precision)
    assert (normals[..., 2] > 0).all()
    assert (normals[~usable] == VIEWER).all()


def assert_all_safe(found: Normals, precision: Precision) -> None:
    for normals, usable in (*found.methods().values(), (found.eight, found.eight_usable)):
        assert_safe(normals, usable, precision)
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
            assert_all_safe(found, precision)
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
        assert_all_safe(found, precision)
        for name, (got, usable) in found.methods().items():
            assert (usable == np.isfinite(expected[name]).all(axis=1)).all(), name
            assert np.abs(got - expected[name])[usable].max() <= 50 * epsilon(precision), name
        assert (found.eight_usable == np.isfinite(eight).all(axis=2)).all()
        assert np.abs(found.eight - eight)[found.eight_usable].max() <= 4 * epsilon(precision)
        there = found.plane_usable
        assert np.abs(found.residual - residuals)[there].max() <= 50 * epsilon(precision)


def test_the_eight_triangles_and_their_corners() -> None:
    """Triangle k lies between points k and k + 1 counterclockwise from the upper left; its slopes are those two heights."""
    heights = np.array([0.0, 2.0, 8.0, -1.0, 0.0, 3.0, 5.0, -4.0, 1.0])
    points = np.concatenate([GRID * 3, heights[:, None]], axis=1)[None]
    # Left of the upper left one: z falls by 1 to the left, rises by 1 upwards from there. z = x + y there, N = (-1, -1, 1).
    first = oracle.unit(np.array([-1.0, -1.0, 1.0]))
    # Between upper middle (2) and upper left (0): z = 2 y + 2 x.
    last = oracle.unit(np.array([-2.0, -2.0, 1.0]))
    found = run(points, all_found(points), "float64", 1)
    np.testing.assert_allclose(found.eight[0, [0, 7]], [first, last], atol=1e-15)
    for missing in range(9):
        there = all_found(points)
        there[0, missing] = False
        flags = run(points, there, "float64", 1).eight_usable[0]
        if missing == oracle.CENTER:
            assert not flags.any()
        else:
            place = oracle.AROUND.index(missing)
            assert sorted(np.flatnonzero(~flags)) == sorted([(place - 1) % 8, place])


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


def lines() -> dict[str, Floats]:
    """Points (9, 3) that tell no plane."""
    along = np.arange(9.0)[:, None] - 4
    bend = np.random.default_rng(3).normal(size=(9, 1))
    return {
        "one place": np.tile([0.1, 0.7, 0.3], (9, 1)),
        "the origin": np.zeros((9, 3)),
        "one place, any depth": np.concatenate([np.full((9, 2), 0.3), bend], axis=1),
        "across": np.concatenate([along, 0 * along, bend], axis=1),
        "upright": np.concatenate([0 * along, along, bend], axis=1),
        "aslant": np.concatenate([along / 3, along / 7, bend], axis=1),
        "aslant, elsewhere": np.concatenate([along / 3 + 0.1, along / 7 - 0.7, bend], axis=1),
        "steep": np.concatenate([along * 1e-3, along, 1e5 * bend], axis=1),
    }


@pytest.mark.parametrize("case", lines())
def test_points_on_a_line(case: str) -> None:
    points = lines()[case][None] * 1e-4
    for precision, lanes in variants():
        found = run(points, all_found(points), precision, lanes)
        assert_all_safe(found, precision)
        for name, (_, usable) in found.methods().items():
            assert not usable.any(), name
        assert not found.eight_usable.any()


def test_fewer_than_three_points() -> None:
    points = np.random.default_rng(5).normal(size=(46, 9, 3))
    found = np.zeros((46, 9), bool)
    for pixel, pair in enumerate(itertools.combinations_with_replacement(range(9), 2)):
        found[pixel, list(pair)] = True
    found[45] = False
    for precision, lanes in variants():
        got = run(points, found, precision, lanes)
        assert_all_safe(got, precision)
        assert not any(usable.any() for _, usable in got.methods().values())


def bits_of(found: Normals) -> list[Floats]:
    return [found.plane, found.triangle, found.mean, found.eight]


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
            for a, b in zip(bits_of(base), bits_of(scaled), strict=True):
                assert np.array_equal(a, b), (precision, power)
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


def test_neighbours_do_not_matter() -> None:
    """A pixel's normals are the same bits whatever the other lanes of its packet hold."""
    random = np.random.default_rng(17)
    points = random.normal(size=(64, 9, 3))
    there = random.random((64, 9)) < 0.7
    points[~there] = np.nan
    for precision, lanes in variants():
        base = run(points, there, precision, lanes)
        for order in (random.permutation(64), random.permutation(64)):
            moved = run(points[order], there[order], precision, lanes)
            for a, b in zip(bits_of(base), bits_of(moved), strict=True):
                assert np.array_equal(a[order], b)
            assert np.array_equal(base.residual[order], moved.residual)


def test_perspective_silhouette() -> None:
    """Rays that miss the near ball and find a wall behind it: normals stay unit vectors towards the viewer."""
    random = np.random.default_rng(19)
    behind = 10.0 ** random.uniform(0, 4, (200, 1))
    depths = np.where(random.random((200, 9)) < 0.5, 1.0, behind) + random.uniform(0, 1e-3, (200, 9))
    points = oracle.perspective_points(GRID, 1e-3, depths)
    points[..., 2] += 1  # relative to the ball
    for precision, lanes in variants():
        found = run(points, all_found(points), precision, lanes)
        assert_all_safe(found, precision)
        assert found.mean_usable.all()
        assert found.eight_usable.all()
