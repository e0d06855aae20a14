"""`sampling.h` and `phase.h`: the sequence of random points, what is made of it, and where media scatter light to."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from tests.render.sampler import Array, Sampler, samplers
from tests.render.sequence import stochastic_points, truth
from tests.small_kernels import Floats

EPSILON = {"float32": 2.0**-23, "float64": 2.0**-52}
DIGITS = {"float32": 23, "float64": 31}
WIDTH = 3.0
BLACKMAN_HARRIS = np.array([0.35875, 0.48829, 0.14128, 0.01168])


def points_sampler() -> Sampler:
    return next(each for each in samplers() if each.precision == "float32" and each.lanes > 1)


def grid_of_pixels(side: int) -> tuple[Array, Array]:
    y, x = np.divmod(np.arange(side * side), side)
    return x, y


# The sequence.


@pytest.mark.parametrize(("seed", "purpose"), [(0, 0), (1, 5), (2**32 - 1, 70)])
def test_sequence_is_the_scrambled_sobol_sequence_bit_for_bit(seed: int, purpose: int) -> None:
    random = np.random.default_rng(7)
    x, y = random.integers(0, 16384, (2, 256))
    index = np.concatenate([np.arange(64), random.integers(0, 2**32, 190), [2**31, 2**32 - 1]])
    first, second, pixel = truth(x, y, index, seed, purpose)
    for sampler in samplers():
        digits = DIGITS[sampler.precision]
        wanted = (np.stack([first, second]) >> (32 - digits)).astype(np.float64) + 0.5
        got, _, seeds = sampler.squares(x, y, index, seed, purpose)
        np.testing.assert_array_equal(seeds, pixel)
        np.testing.assert_array_equal(got, wanted * 2.0**-digits)


def test_no_number_is_0_or_1() -> None:
    lowest = np.array([0, 1, 511, 512, 2**31 - 1, 2**24, 12345, 0xAAAAAAAA])
    index = np.concatenate([lowest, 2**32 - 1 - lowest])
    for sampler in samplers():
        _, unit, _ = sampler.squares(index, index, index)
        assert unit.min() == 0.5 ** (DIGITS[sampler.precision] + 1)
        assert unit.max() == 1 - unit.min()
        np.testing.assert_array_equal(unit[:8] + unit[8:], 1.0)
        np.testing.assert_allclose(unit, index / 2.0**32, atol=0.51 * 2.0 ** -DIGITS[sampler.precision])


def test_every_elementary_interval_holds_one_point() -> None:
    index = np.arange(3 * 1024)
    for pixel in range(8):
        points, _, _ = samplers()[0].squares(np.full(1, pixel), np.full(1, 3 * pixel), index, purpose=pixel)
        for m in range(1, 11):
            for begin in (0, 2**m, 2 * 2**m):
                block = points[:, begin : begin + 2**m]
                for i in range(m + 1):
                    column, row = np.floor(block * [[2.0**i], [2.0 ** (m - i)]])
                    assert len(set((column * 2 ** (m - i) + row).tolist())) == 2**m


def test_pixels_purposes_and_seeds_know_nothing_of_each_other() -> None:
    """Of the truth that kernels have to the bit."""
    x, y = grid_of_pixels(64)

    def squares(x: Array, y: Array, seed: int = 0, purpose: int = 0) -> Array:
        return np.stack(truth(x, y, np.zeros_like(x), seed, purpose)[:2]) / 2.0**32

    here, bound = squares(x, y), 4.5 / math.sqrt(len(x))
    others = {
        "right": squares(x + 1, y),
        "below": squares(x, y + 1),
        "diagonal": squares(y, x),
        "purpose": squares(x, y, purpose=1),
        "light": squares(x, y, purpose=2),
        "seed": squares(x, y, seed=1),
        "far seed": squares(x, y, seed=0x9E3779B9),
    }
    for name, there in others.items():
        kept = x != y if name == "diagonal" else np.full(len(x), True)
        correlation = np.corrcoef(np.concatenate([here[:, kept], there[:, kept]]))[:2, 2:]
        assert np.abs(correlation).max() < bound, name
        assert (here[:, kept] == there[:, kept]).mean() < 0.01, name
    assert abs(np.corrcoef(here)[0, 1]) < bound


def test_pixels_have_seeds_of_their_own() -> None:
    """Of 2^18 random seeds some 8 pairs agree: more than 30 has a chance below 1e-8."""
    x, y = grid_of_pixels(512)
    seeds = truth(x, y, np.zeros_like(x), 0, 0)[2]
    assert len(seeds) - len(np.unique(seeds)) < 30
    # No row of pixels is another one, shifted.
    rows = [set(row.tolist()) for row in seeds.reshape(512, 512)]
    assert max(len(rows[0] & row) for row in rows[1:]) < 4


# Filters.


def blackman_harris_area(t: Array) -> Array:
    """The integral of the density from -1/2 to t."""
    k = np.arange(1, 4)
    sines = np.sin(2 * np.pi * np.multiply.outer(k, t))
    return np.asarray(0.5 + t + (BLACKMAN_HARRIS[1:] / (2 * np.pi * k)) @ sines / BLACKMAN_HARRIS[0])


AREAS = {
    "box": lambda t: t + 0.5,
    "tent": lambda t: np.where(t < 0, 2 * (t + 0.5) ** 2, 1 - 2 * (0.5 - t) ** 2),
    "blackman_harris": blackman_harris_area,
}


def place_of_area(name: str, u: Array) -> Array:
    """By bisection."""
    low, high = np.full_like(u, -0.5), np.full_like(u, 0.5)
    for _ in range(60):
        middle = (low + high) / 2
        beyond = AREAS[name](middle) > u
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return (low + high) / 2


X_AXIS = np.array([[1.0], [0.0], [0.0]])


@pytest.mark.parametrize("name", list(AREAS))
def test_filter_places_pass_the_wanted_area(name: str) -> None:
    near_the_edge = 2.0 ** -np.arange(2, 25)
    u = np.concatenate([np.arange(1, 1000) / 1000, near_the_edge, 1 - near_the_edge, [0.5 + 2**-24]])
    u = np.resize(u.astype(np.float32), 1056).astype(np.float64)
    for sampler in samplers():
        places = sampler.shapes(u, 1 - u, X_AXIS, np.zeros(1), WIDTH)[name]
        across, below = places / WIDTH
        assert np.abs(across).max() <= 0.5
        bound = 1e-6 if sampler.precision == "float32" else 1e-11
        assert np.abs(AREAS[name](across) - u).max() < bound
        if sampler.precision == "float64":
            # Area tells little where the filter hardly has any: there the place itself must be right.
            assert np.abs(across - place_of_area(name, u)).max() < 1e-11
        assert np.abs(across + below).max() < 1e-3
        order = np.argsort(u, kind="stable")
        assert np.diff(across[order]).min() > -1e-6


def test_filter_places_of_0_and_1_are_the_edges() -> None:
    u = np.resize([0.0, 1.0], 16)
    for sampler in samplers():
        found = sampler.shapes(u, u, X_AXIS, np.zeros(1), WIDTH)
        for name in AREAS:
            np.testing.assert_allclose(found[name], [(u - 0.5) * WIDTH] * 2, atol=2e-3 * WIDTH)


# The points of a pixel.


@pytest.mark.parametrize("side", [1, 3, 8])
def test_grid_is_exact(side: int) -> None:
    x, y = grid_of_pixels(4)
    got = points_sampler().points(x, y, side * side, rows=side)
    steps = ((2 * np.arange(side) + 1 - side) / np.float32(2 * side)).astype(np.float32)
    below, across = np.meshgrid(steps, steps, indexing="ij")
    for pixel in range(16):
        np.testing.assert_array_equal(got[:, 0, pixel], across.ravel())
        np.testing.assert_array_equal(got[:, 1, pixel], below.ravel())
    if side == 3:
        np.testing.assert_array_equal(steps, np.array([-1, 0, 1], np.float32) / np.float32(3))


@pytest.mark.parametrize(("count", "seed"), [(4, 0), (7, 1), (64, 2**32 - 1)])
def test_stochastic_points_are_those_of_the_sequence(count: int, seed: int) -> None:
    x, y = grid_of_pixels(64)
    wanted = np.stack(stochastic_points(x, y, count, seed))
    for sampler in samplers():
        got = sampler.points(x, y, count, seed)
        np.testing.assert_allclose(np.moveaxis(got, 0, -1), wanted, atol=2.0**-23)


# Directions.


def unit_axes() -> Array:
    """Awkward axes first: the poles, either zero, next to the poles; then random ones. Shape (3, 64)."""
    tiny = np.array([1e-4, 1e-7, 1e-20, 0.0])
    poles = [(t, -t, sign) for t in tiny for sign in (1.0, -1.0)]
    equator = [(1.0, 0.0, 0.0), (0.0, -1.0, -0.0), (0.6, 0.8, -1e-9), (-0.6, 0.8, -0.0)]
    random = np.random.default_rng(2).normal(size=(64 - len(poles) - len(equator), 3))
    axes = np.concatenate([poles, equator, random])
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True)).T


def test_frames_are_orthonormal_and_right_handed() -> None:
    for sampler in samplers():
        axis = unit_axes().astype(sampler.precision)
        found = sampler.shapes(np.array([0.3]), np.array([0.7]), axis, np.zeros(1), 1.0)
        frame = np.stack([found["side"], found["up"], axis.astype(np.float64)])
        products = np.einsum("ian,jan->nij", frame, frame)
        assert np.abs(products - np.eye(3)).max() < 6 * EPSILON[sampler.precision]
        assert np.abs(np.cross(frame[0], frame[1], axis=0) - frame[2]).max() < 6 * EPSILON[sampler.precision]


def test_disk_is_the_concentric_map() -> None:
    (u, v), _, _ = samplers()[0].squares(np.array([1]), np.array([2]), np.arange(4096))
    u[:4], v[:4] = [0.5, 0.5, 0.25, 0.75], [0.5, 0.75, 0.25, 0.25]
    a, b = 2 * u - 1, 2 * v - 1
    # The square's outline at max(|a|, |b|) becomes a circle, each of its sides a quarter of it.
    radius = np.maximum(np.abs(a), np.abs(b))
    with np.errstate(invalid="ignore", divide="ignore"):
        angle = np.where(np.abs(a) >= np.abs(b), b / a, 2 - a / b) * np.pi / 4
    signed = np.where(np.abs(a) >= np.abs(b), a, b)
    wanted = np.where(radius > 0, signed * np.stack([np.cos(angle), np.sin(angle)]), 0.0)
    for sampler in samplers():
        got = sampler.shapes(u, v, X_AXIS, np.zeros(1), 1.0)["disk"]
        assert np.abs(got - wanted).max() < 2 * EPSILON[sampler.precision]
    rings, sectors = got[0] ** 2 + got[1] ** 2, np.arctan2(got[1], got[0])
    cells = np.histogram2d(rings, sectors, bins=[8, 16], range=[(0, 1), (-np.pi, np.pi)])[0]
    assert np.abs(cells - 32).max() <= 8  # a random set would differ by some 17


@pytest.mark.parametrize("degrees", [0.01, 0.53, 30.0, 170.0, 360.0])
def test_cones_are_filled_evenly(degrees: float) -> None:
    """`degrees` is the whole opening angle; the spread is made without cancellation, as on the host."""
    half = math.radians(degrees) / 2
    spread = 2 * math.sin(half / 2) ** 2
    for sampler in samplers():
        (u, v), _, _ = sampler.squares(np.array([5]), np.array([6]), np.arange(4096))
        axis = np.resize(unit_axes(), (3, 4096)) if degrees > 1 else np.repeat(unit_axes()[:, [40]], 4096, 1)
        axis = axis.astype(sampler.precision).astype(np.float64)
        got = sampler.shapes(u, v, axis, np.full(1, spread), 1.0)
        direction, (x, y) = got["cone"], got["disk"]
        epsilon = EPSILON[sampler.precision]
        assert np.abs(np.linalg.norm(direction, axis=0) - 1).max() < 4 * epsilon
        # Half the chord from the axis is sin(angle / 2), whose square is the height below the top, halved.
        height = ((direction - axis) ** 2).sum(0) / 2
        rounding = 2 * epsilon / (2 * math.sin(half / 2))
        assert np.abs(height / spread - (x**2 + y**2)).max() < 4 * rounding
        assert (height <= spread * (1 + 4 * rounding)).all()
        # Archimedes: uniform on the sphere is uniform in height.
        assert stats.kstest(height / spread, "uniform").statistic < 0.01
        around = np.arctan2((got["up"] * direction).sum(0), (got["side"] * direction).sum(0))
        assert np.abs(np.exp(1j * around) - np.exp(1j * np.arctan2(y, x))).max() < 0.02


def test_hemisphere_is_cosine_weighted() -> None:
    for sampler in samplers():
        (u, v), _, _ = sampler.squares(np.array([8]), np.array([1]), np.arange(4096))
        axis = unit_axes()
        for which in (1, 5, 30):
            normal = axis[:, [which]].astype(sampler.precision).astype(np.float64)
            direction = sampler.shapes(u, v, normal, np.zeros(1), 1.0)["hemisphere"]
            assert np.abs(np.linalg.norm(direction, axis=0) - 1).max() < 6 * EPSILON[sampler.precision]
            cosine = (direction * normal).sum(0)
            assert cosine.min() > 0
            # Density cos/pi per steradian: the square of the cosine is uniform, the mean direction 2/3 of the normal.
            assert stats.kstest(cosine**2, "uniform").statistic < 0.01
            np.testing.assert_allclose(direction.mean(1), 2 / 3 * normal[:, 0], atol=2e-3)


COUNT = 1 << 14
NEARLY_EVEN = 0.0005  # taken as 0


def below(cosine: Floats, g: float) -> Floats:
    """The part of light that is scattered to smaller cosines."""
    if abs(g) < 1e-3:
        return (1 + cosine) / 2
    root = np.sqrt(1 + g * g - 2 * g * cosine)
    return np.asarray((1 - g * g) / (2 * g) * (1 / root - 1 / (1 + g)))


@pytest.mark.parametrize("g", [-0.99, -0.6, -0.01, 0.0, NEARLY_EVEN, 0.3, 0.9, 0.99])
def test_cosines_are_those_of_henyey_and_greenstein(g: float) -> None:
    u = (np.arange(COUNT) + 0.5) / COUNT
    axis = np.array([0.48, -0.6, 0.64])
    for sampler in samplers():
        cosine, density, direction = sampler.turns(u, np.roll(u, 5000), axis[:, None], np.array(g))
        exact = sampler.precision == "float64"
        # Rounding counts for less the wider the lobe is.
        assert abs(cosine.mean() - g) < (1e-4 if exact and g != NEARLY_EVEN else 1e-3)
        part = below(cosine, g)
        rising = part if part[-1] > part[0] else 1 - part
        assert np.abs(rising - u).max() < (2e-3 if exact else 0.01)
        step = 1e-6
        inner = np.abs(cosine) < 0.99
        slope = (below(cosine + step, g) - below(cosine - step, g)) / (2 * step)
        assert np.allclose(density[inner], slope[inner] / (2 * math.pi), rtol=2e-3)
        assert np.abs(np.linalg.norm(direction, axis=0) - 1).max() < 1e-5
        assert np.abs(axis @ direction - cosine).max() < 1e-5


def test_lanes_may_differ() -> None:
    """Each lane has a medium of its own."""
    u = np.full(COUNT, 0.25)
    values = np.resize([0.0, 0.5, -0.8, 0.95], COUNT)
    before = np.array([0.0, 0.0, 1.0])[:, None]
    for sampler in samplers():
        cosine = sampler.turns(u, u, before, values)[0]
        for g in np.unique(values):
            alone = sampler.turns(u, u, before, np.array(g))[0]
            assert np.array_equal(cosine[values == g], alone[values == g])
