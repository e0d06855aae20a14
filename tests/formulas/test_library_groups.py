"""Kleinian groups of the library: their walls and balls meet as they should, and solids are all images of a first one."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from clfractal.formulas import catalog
from clfractal.formulas.reference import distance, own_distance

Floats = NDArray[np.float64]
# A ball as (bend, bend times middle, what makes it one): its points have bend |p|^2 - 2 (bend middle) p + last <= 0.
Ball = NDArray[np.float64]


def points(count: int, size: float, seed: int = 1) -> Floats:
    return np.random.default_rng(seed).uniform(-size, size, (count, 3))


# --- the sphairahedron ---


HEIGHTS = [(0.6, 0.9), (0.0, 0.0), (-0.5, 0.7)]


def three_balls(b: float, c: float) -> tuple[Floats, Floats]:
    """Middles and radii, from the angles alone: each ball touches a corner line of the prism and meets two walls and the
    other balls at 60 degrees. Found by Newton's method, with no formula for them."""
    corners = np.array([(1, 0), (-0.5, math.sqrt(0.75)), (-0.5, -math.sqrt(0.75))])
    heights = np.array([0, b, c])
    pairs = [(0, 1), (0, 2), (1, 2)]

    def middles(radii: Floats) -> Floats:
        return np.concatenate([(1 - radii)[:, None] * corners, heights[:, None]], axis=1)

    def missed(radii: Floats) -> Floats:
        m = middles(radii)
        return np.array(
            [
                ((m[i] - m[j]) ** 2).sum() - radii[i] ** 2 - radii[j] ** 2 - radii[i] * radii[j]
                for i, j in pairs
            ]
        )

    radii = np.full(3, 0.5)
    for _ in range(60):
        slope = np.array([(missed(radii + 1e-6 * e) - missed(radii - 1e-6 * e)) / 2e-6 for e in np.eye(3)]).T
        radii = radii - np.linalg.solve(slope, missed(radii))
    return middles(radii), radii


@pytest.mark.parametrize("heights", HEIGHTS)
def test_balls_of_the_sphairahedron_meet_walls_and_each_other_at_60_degrees(
    heights: tuple[float, float],
) -> None:
    middles, radii = three_balls(*heights)
    walls = -np.array([(1, 0, 0), (-0.5, math.sqrt(0.75), 0), (-0.5, -math.sqrt(0.75), 0)])
    for i, j in itertools.permutations(range(3), 2):
        # The distance of the middle from the wall x.n = 1/2 is the radius' part by the cosine of the angle.
        assert 0.5 - middles[i] @ walls[j] == pytest.approx(radii[i] * math.cos(math.pi / 3), abs=1e-9)
    chain = catalog.load_chain("sphairahedron", {"height_b": heights[0], "height_c": heights[1]})
    # A point and its image in each wall and ball are in the same solid, and the distance changes by the stretching.
    p = points(120, 1.5)
    p[:, 2] += sum(heights) / 3
    got = own_distance(chain, p, 25)
    assert 10 < (got == 0).sum() < 110
    for wall in walls:
        image = p - 2 * ((p @ wall) - 0.5)[:, None] * wall
        np.testing.assert_allclose(own_distance(chain, image, 25), got, atol=1e-8)
    for middle, radius in zip(middles, radii, strict=True):
        stretch = radius**2 / ((p - middle) ** 2).sum(axis=1)
        image = middle + stretch[:, None] * (p - middle)
        same = (own_distance(chain, image, 25) == 0) == (got == 0)
        # Beside points whose orbits are longer than the limit.
        assert same.mean() > 0.98


# --- the group with a cusp ---


def image_of_ball(ball: Ball, matrix: Floats) -> Ball:
    found: Ball = matrix @ ball
    return found


def inversion() -> Floats:
    """(x, y, z) to (x, -y, z)/|.|^2, for balls."""
    return np.array([[0, 0, 0, 0, 1.0], [0, 1, 0, 0, 0], [0, 0, -1, 0, 0], [0, 0, 0, 1, 0], [1, 0, 0, 0, 0]])


def shift(move: Floats) -> Floats:
    """By a vector: the middle times the bend is moved by it, and the last number follows."""
    found = np.eye(5)
    found[1:4, 0] = move
    found[4, 0] = move @ move
    found[4, 1:4] = 2 * move
    return found


def contains(ball: Ball, p: Floats, by: float) -> NDArray[np.bool_]:
    """Whether points are in a ball or half space, at least `by` within."""
    bend, vector, last = ball[0], ball[1:4], ball[4]
    if abs(bend) < 1e-9:
        found: NDArray[np.bool_] = (last - 2 * p @ vector) / (2 * np.linalg.norm(vector)) <= -by
        return found
    radius = math.sqrt(max(vector @ vector - bend * last, 0)) / abs(bend)
    apart = np.linalg.norm(p - vector / bend, axis=1)
    kept: NDArray[np.bool_] = apart <= radius - by if bend > 0 else apart >= radius + by
    return kept


@pytest.mark.parametrize("move", [(0.05, 1.9, 0.1), (0.0, 2.0, 0.0), (-0.05, 1.95, 0.15)])
def test_the_ground_and_its_images_are_the_solid_of_the_group(move: tuple[float, float, float]) -> None:
    m = np.array(move)
    forward = shift(m) @ inversion()
    maps = [forward, np.linalg.inv(forward), shift(np.array([2.0, 0, 0])), shift(np.array([-2.0, 0, 0]))]
    # The half spaces y <= 0 and y >= move_y.
    ground, vault = np.array([0, 0, -0.5, 0, 0]), np.array([0, 0, 0.5, 0, m[1]])
    assert contains(ground, np.array([[0, -1.0, 0], [0, 1, 0]]), 0.1).tolist() == [True, False]
    assert contains(vault, np.array([[0, m[1] + 1, 0], [0, 1, 0]]), 0.1).tolist() == [True, False]
    np.testing.assert_allclose(forward @ ground, vault, atol=1e-12)
    balls = {tuple(np.round(each, 7) + 0.0): each for each in (ground, vault)}
    last = list(balls.values())
    for _ in range(5):
        after = []
        for ball, by in itertools.product(last, maps):
            image = image_of_ball(ball, by)
            key = tuple(np.round(image, 7) + 0.0)
            if key not in balls and np.abs(image[0]) < 60:
                balls[key] = image
                after.append(image)
        last = after
    assert len(balls) > 60
    chain = catalog.load_chain(
        "maskit_kleinian", dict(zip(("move_x", "move_y", "move_z"), move, strict=True))
    )
    p = points(4000, 1.0, seed=3) * [1, 1.2, 0.6] + [0, m[1] / 2, 0]
    got = own_distance(chain, p, 40)
    deep = np.any([contains(ball, p, 1e-3) for ball in balls.values()], axis=0)
    assert deep.sum() > 300
    assert (got[deep] == 0).all()
    # What is no such ball's is small: the rest of the solid are balls of longer words.
    rest = ~np.any([contains(ball, p, -1e-3) for ball in balls.values()], axis=0)
    assert (got[rest] > 0).mean() > 0.85


# --- folds of four dimensions ---


def test_the_pseudo_kleinian_of_four_dimensions_holds_that_of_three() -> None:
    """Where the fourth coordinate is 0 it stays 0, and the folds are those of space."""
    shape = {"size": 0.71, "box_x": 0.63, "box_y": 0.79, "box_z": 0.88, "tube": 0.93, "sheet": 0.2}
    four = catalog.load_chain("pseudo_kleinian_4d", {**shape, "offset": 0})
    p = points(500, 2)
    z = p.copy()
    for _ in range(6):
        for axis, wall in enumerate((0.63, 0.79, 0.88)):
            z[:, axis] = np.where(
                z[:, axis] > wall,
                2 * wall - z[:, axis],
                np.where(z[:, axis] < -wall, -2 * wall - z[:, axis], z[:, axis]),
            )
        z *= np.maximum(0.71 / (z**2).sum(axis=1, keepdims=True), 1)
    across = np.hypot(z[:, 0], z[:, 1])
    inside = (across <= 0.93) & (np.abs(z[:, 2]) <= 0.2)
    got, _ = distance(four, p, 6)
    assert inside.sum() > 20
    np.testing.assert_array_equal(got == 0, inside)
