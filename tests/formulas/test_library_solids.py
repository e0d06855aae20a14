"""Solids of the library against ones that are put together from parts: cubes by digits, balls and stems one by one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from clfractal.formulas import catalog
from clfractal.formulas.chain import Chain
from clfractal.formulas.reference import distance, own_distance

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


def points(count: int, size: float, seed: int = 1) -> Floats:
    return np.random.default_rng(seed).uniform(-size, size, (count, 3))


def chain_of(name: str, **parameters: float) -> Chain:
    return catalog.load_chain(name, parameters)


# --- cubes of cubes ---


def to_boxes(p: Floats, centres: Floats, half: Floats | float) -> Floats:
    """Distance to the nearest of some cubes, 0 in them."""
    beyond = np.maximum(
        np.abs(p[:, None] - centres[None]) - np.broadcast_to(half, len(centres))[None, :, None], 0
    )
    found: Floats = np.linalg.norm(beyond, axis=2).min(axis=1)
    return found


def generations(parts: list[tuple[tuple[float, ...], float]], count: int) -> tuple[Floats, Floats]:
    """Centres and half sides of what is left of the cube of half side 1 when each is replaced by `parts`, some times."""
    centres, halves = np.zeros((1, 3)), np.ones(1)
    for _ in range(count):
        centres = np.concatenate([centres + halves[:, None] * np.array(centre) for centre, _ in parts])
        halves = np.concatenate([halves * size for _, size in parts])
    return centres, halves


def signed(*sizes: float) -> list[tuple[float, ...]]:
    """All places with these absolute values in any order."""
    found = set()
    for order in itertools.permutations(sizes):
        for signs in itertools.product((1, -1), repeat=3):
            found.add(tuple(s * v + 0.0 for s, v in zip(signs, order, strict=True)))
    return sorted(found)


K = math.sqrt(2) - 1
CUBES: dict[str, tuple[str, dict[str, float], list[tuple[tuple[float, ...], float]]]] = {
    "dust": ("cantor_dust", {"scale": 3}, [(c, 1 / 3) for c in signed(2 / 3, 2 / 3, 2 / 3)]),
    "thin dust": ("cantor_dust", {"scale": 4}, [(c, 1 / 4) for c in signed(3 / 4, 3 / 4, 3 / 4)]),
    "light snowflake": (
        "mosely_snowflake",
        {"core": 0},
        [(c, 1 / 3) for c in [*signed(2 / 3, 0, 0), *signed(2 / 3, 2 / 3, 0)]],
    ),
    "heavy snowflake": (
        "mosely_snowflake",
        {"core": 1},
        [(c, 1 / 3) for c in [*signed(0, 0, 0), *signed(2 / 3, 0, 0), *signed(2 / 3, 2 / 3, 0)]],
    ),
    "Jerusalem": (
        "jerusalem_cube",
        {},
        [
            *((c, K) for c in signed(1 - K, 1 - K, 1 - K)),
            *((c, K * K) for c in signed(1 - K * K, 1 - K * K, 0)),
        ],
    ),
}
NUMBERS = {"dust": 8, "thin dust": 8, "light snowflake": 18, "heavy snowflake": 19, "Jerusalem": 20}


@pytest.mark.parametrize("case", CUBES)
def test_cubes_of_cubes(case: str) -> None:
    name, parameters, parts = CUBES[case]
    assert len(parts) == NUMBERS[case]
    p = points(3000, 1.2)
    for count in (1, 2):
        got, _ = distance(chain_of(name, **parameters), p, count)
        exact = to_boxes(p, *generations(parts, count))
        np.testing.assert_array_equal(got == 0, exact < 1e-12)
        assert (got == 0).sum() > 20
        # Where two branches meet, the nearer one's cube may be reached first: hardly ever, and by little.
        late = got > exact + 1e-9
        assert late.mean() < 0.03, late.mean()
        assert (got <= exact + 0.12).all(), (got - exact).max()


def cut(p: Floats, turn: float, offset: float) -> Floats:
    """Points of the cut as points of four dimensions."""
    diagonal = np.array([1, 1, 1, 0]) / math.sqrt(3)
    last = np.array([0, 0, 0, 1.0])
    along, across = (
        math.cos(turn) * diagonal + math.sin(turn) * last,
        math.cos(turn) * last - math.sin(turn) * diagonal,
    )
    flat = np.concatenate([p, np.zeros((len(p), 1))], axis=1)
    rest = flat - (flat @ diagonal)[:, None] * diagonal
    found: Floats = rest + (flat @ diagonal)[:, None] * along + offset * across
    return found


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize(("turn", "offset"), [(0, 0.4), (math.pi / 3, 0.5), (0.5, -0.3)])
def test_the_sponge_of_four_dimensions_by_its_digits(dimension: int, turn: float, offset: float) -> None:
    """Of the digits to base 3 of a point's coordinates at most `dimension` are 1 at the same place."""
    p = points(4000, 1.6)
    chain = chain_of("menger_tesseract", dimension=dimension, turn=turn, offset=offset)
    got, _ = distance(chain, p, 2)
    q = (cut(p, turn, offset) + 1) / 2
    inside = ((q > 0) & (q < 1)).all(axis=1)
    for place in (3, 9):
        digit = np.floor(q * place).astype(int) % 3
        inside &= (digit == 1).sum(axis=1) <= dimension
    assert inside.sum() > 20
    np.testing.assert_array_equal(got == 0, inside)


def test_the_flake_of_the_16_cell_by_its_corners() -> None:
    corners = np.array([s for s in itertools.product((1, -1), repeat=4) if math.prod(s) == 1])
    p = points(6000, 1.4)
    for turn, offset in ((0.0, 0.0), (0.6, 0.1)):
        got, _ = distance(chain_of("hexadecachoron_flake", turn=turn, offset=offset), p, 2)
        q = cut(p, turn, offset)
        inside = np.zeros(len(p), bool)
        for one, other in itertools.product(corners, repeat=2):
            small = 4 * (q - one / 2 - other / 4)
            odd = max_odd(small)
            inside |= (np.abs(small).max(axis=1) <= 1) & (odd <= 2)
        assert inside.sum() > 20
        np.testing.assert_array_equal(got == 0, inside)


def max_odd(q: Floats) -> Floats:
    """The largest sum of the coordinates with an odd number of signs changed."""
    signs = np.array([s for s in itertools.product((1, -1), repeat=4) if math.prod(s) == -1])
    found: Floats = (q @ signs.T).max(axis=1)
    return found


def test_a_sponge_turned_inside_out() -> None:
    p = points(4000, 2.2)
    got, _ = distance(chain_of("inverted_sponge", radius=1.2), p, 3)
    q = 1.44 * p / (p**2).sum(axis=1, keepdims=True)
    expected, _ = distance(chain_of("menger_sponge"), q, 3)
    beyond = np.linalg.norm(p, axis=1) < 2.1
    np.testing.assert_array_equal((got == 0)[beyond], (expected == 0)[beyond])
    assert (got == 0).sum() > 100


# --- stems and balls ---


Frame = tuple[Floats, Floats, float]  # axes as rows, origin, size


def rotation(axis: int, angle: float) -> Floats:
    first, second = (axis + 1) % 3, (axis + 2) % 3
    found = np.eye(3)
    found[first, first] = found[second, second] = math.cos(angle)
    found[second, first], found[first, second] = math.sin(angle), -math.sin(angle)
    return found


def mirrors(sectors: int) -> Iterator[Floats]:
    """The symmetries of a regular polygon with so many corners, about z."""
    for turn in range(sectors):
        about = rotation(2, 2 * math.pi * turn / sectors)
        yield about
        yield about @ np.diag([1.0, -1.0, 1.0])


def trees(levels: int, *, branches: int, ratio: float, spread: float, twist: float) -> list[Frame]:
    """A frame for each stem: a point q of the stem at the origin is at origin + size * axes @ q."""
    found: list[Frame] = [(np.eye(3), np.zeros(3), 1.0)]
    last = list(found)
    for _ in range(levels):
        children = []
        for axes, origin, size in last:
            top = origin + size * axes @ np.array([0, 0, 1.0])
            for mirror in mirrors(branches):
                bent = axes @ rotation(2, -twist) @ mirror @ rotation(1, spread)
                children.append((bent, top, size * ratio))
        found += children
        last = children
    return found


def to_stems(p: Floats, stems: list[Frame], thickness: float, ratio: float) -> Floats:
    """Distance to stems, each a row of balls that become smaller."""
    found = np.full(len(p), np.inf)
    for axes, origin, size in stems:
        for h in np.linspace(0, 1, 60):
            middle = origin + size * axes @ np.array([0, 0, h])
            found = np.minimum(
                found, np.linalg.norm(p - middle, axis=1) - size * thickness * (1 - (1 - ratio) * h)
            )
    return found


@pytest.mark.parametrize(
    ("branches", "spread", "twist"), [(3, 0.8, 0), (2, 1.0, 0), (5, 0.9, 0), (4, 0.8, 0.4)]
)
def test_a_tree_is_its_stems(branches: int, spread: float, twist: float) -> None:
    chain = chain_of("fractal_tree", branches=branches, ratio=0.5, spread=spread, twist=twist, thickness=0.06)
    p = np.array(chain.center) + points(500, 1.3, seed=2)
    got = own_distance(chain, p, 2)
    exact = np.maximum(
        to_stems(p, trees(2, branches=branches, ratio=0.5, spread=spread, twist=twist), 0.06, 0.5), 0
    )
    # Twisted trees are alike on both sides of a mirror, so one side's may lack what the other's has.
    assert (got >= exact - 2.5e-3).all()
    assert np.median(np.abs(got - exact)) < 1e-3
    if twist == 0:
        np.testing.assert_allclose(got, exact, atol=2.5e-3)


def flake(levels: int) -> list[tuple[Floats, float]]:
    """Balls of the sphereflake: middles and radii."""
    six = [rotation(2, math.radians(60 * k)) @ rotation(2, math.radians(30)) for k in range(6)]
    three = [rotation(2, math.radians(120 * k)) for k in range(3)]
    down = np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])  # z to the outside, x downwards
    latitude = math.acos(math.sqrt(2 / 3))
    frames: list[Frame] = [(np.eye(3), np.zeros(3), 1.0)]
    found: list[tuple[Floats, float]] = [(np.zeros(3), 1.0)]
    for _ in range(levels):
        children = []
        for axes, origin, size in frames:
            for turn in [*(r @ down for r in six), *(r @ rotation(1, latitude) for r in three)]:
                bent = axes @ turn
                children.append((bent, origin + size * 4 / 3 * bent[:, 2], size / 3))
        found += [(origin, size) for _, origin, size in children]
        frames = children
    return found


def test_a_sphereflake_is_its_balls() -> None:
    balls = flake(2)
    assert len(balls) == 1 + 9 + 81
    p = points(4000, 2)
    exact = np.min([np.linalg.norm(p - middle, axis=1) - radius for middle, radius in balls], axis=0)
    got = own_distance(chain_of("sphereflake"), p, 2)
    np.testing.assert_array_equal(got <= 0, exact <= 0)
    outside = exact > 0
    assert (got <= exact + 1e-12)[outside].all()
    assert np.median((got / exact)[outside]) > 0.9


def test_a_sphereflake_is_not_where_the_bounds_of_its_flakes_touch() -> None:
    middles, radii = np.array([m for m, _ in flake(2)]), np.array([r for _, r in flake(2)])
    largest = middles[np.isclose(radii, 1 / 3)]
    between = (largest[:, None] + largest) / 2
    touching = between[np.isclose(np.linalg.norm(largest[:, None] - largest, axis=2), 4 / 3)]
    assert len(touching) == 2 * 15
    p = np.concatenate([touching, *(touching + 0.05 * step for step in points(200, 1))])
    exact = np.min(np.linalg.norm(p[:, None] - middles, axis=2) - radii, axis=1)
    assert (exact > 0.05).all()
    got = own_distance(chain_of("sphereflake"), p, 2)
    assert (got / exact).min() > 0.3


def soddy(levels: int) -> list[tuple[Floats, float]]:
    """Balls of the packing by Soddy's theorem: of five that touch each other any one has another in its place.

    Bends b and bends times middles of balls 1 to 5 and of the other ball 5 add up alike: b5 + b5' = b1 + b2 + b3 + b4.
    """
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / math.sqrt(3)
    radius = math.sqrt(6) - 2
    first = [np.array([-1.0, 0, 0, 0])]
    first += [np.array([1 / radius, *((1 - radius) / radius * corner)]) for corner in corners]
    found = {tuple(np.round(ball, 9)): ball for ball in first[1:]}
    last = [tuple(first)]
    seen = {frozenset(tuple(np.round(b, 9)) for b in first)}
    for _ in range(levels):
        after = []
        for five in last:
            for k in range(5):
                other = sum(five[:k]) + sum(five[k + 1 :]) - five[k]
                new = (*five[:k], other, *five[k + 1 :])
                key = frozenset(tuple(np.round(b, 9)) for b in new)
                if key not in seen and other[0] > 0:
                    seen.add(key)
                    after.append(new)
                    found[tuple(np.round(other, 9))] = other
        last = after
    return [(ball[1:] / ball[0], 1 / ball[0]) for ball in found.values()]


def test_apollonian_balls_are_soddys() -> None:
    balls = soddy(4)
    assert len(balls) > 100
    middles, radii = np.array([m for m, _ in balls]), np.array([r for _, r in balls])
    # They are a packing.
    apart = np.linalg.norm(middles[:, None] - middles[None], axis=2) - radii[:, None] - radii[None]
    assert apart[~np.eye(len(balls), dtype=bool)].min() > -1e-6
    chain = chain_of("apollonian_balls")
    random = np.random.default_rng(3)
    way = random.normal(size=(len(balls), 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    assert (own_distance(chain, middles + 0.9 * radii[:, None] * way, 40) <= 0).all()
    # One application finds the nine largest, and two no others than those of two exchanges.
    p = points(20_000, 1)
    p = p[np.linalg.norm(p, axis=1) < 0.999]

    def within(levels: int) -> Mask:
        found: Mask = np.any([np.linalg.norm(p - m, axis=1) < r for m, r in soddy(levels)], axis=0)
        return found

    assert len(soddy(1)) == 9
    np.testing.assert_array_equal(own_distance(chain, p, 1) == 0, within(1))
    two = own_distance(chain, p, 2) == 0
    assert (within(1) <= two).all()
    assert (two <= within(2)).all()


# --- honeycombs ---


def lifted(p: Floats, curvature: int) -> Floats:
    """Points of a ball or of space, by stereographic projection, on the hyperboloid (-1) or the sphere (1)."""
    r2 = (p**2).sum(axis=1, keepdims=True)
    found: Floats = np.concatenate([2 * p, 1 - curvature * r2], axis=1) / (1 + curvature * r2)
    return found


def orbit(seed: Floats, generators: list[Floats], most: int) -> Floats:
    """All images of a vector under a group, or the first so many."""
    found = {tuple(np.round(seed, 6) + 0.0): seed}
    last = [seed]
    while last and len(found) < most:
        after = []
        for vector in last:
            for generator in generators:
                image = generator @ vector
                key = tuple(np.round(image, 6) + 0.0)
                if key not in found:
                    found[key] = image
                    after.append(image)
        last = after
    return np.array(list(found.values()))


def coxeter(sides: int, around: int) -> tuple[list[Floats], Floats]:
    """Mirrors of the group [sides, 3, around] from its angles alone, and the form that they keep.

    Normals n1 to n4 have products -cos(pi/m) with their neighbours and 0 else; they are written in the basis of a form.
    """
    gram = np.eye(4)
    for k, order in enumerate((sides, 3, around)):
        gram[k, k + 1] = gram[k + 1, k] = -math.cos(math.pi / order)
    return [np.eye(4) - 2 * np.outer(np.eye(4)[k], gram[k]) for k in range(4)], gram


@pytest.mark.parametrize(
    ("name", "parameters", "order"),
    [
        ("polychoron", {"cells": 5}, (3, 3)),
        ("polychoron", {"cells": 8}, (4, 3)),
        ("polychoron", {"cells": 16}, (3, 4)),
        ("polychoron", {"cells": 120}, (5, 3)),
        ("polychoron", {"cells": 600}, (3, 5)),
        ("hyperbolic_honeycomb", {"sides": 5, "around": 4}, (5, 4)),
        ("hyperbolic_honeycomb", {"sides": 4, "around": 5}, (4, 5)),
        ("hyperbolic_honeycomb", {"sides": 6, "around": 3}, (6, 3)),
    ],
)
def test_corners_of_honeycombs_are_those_of_coxeters_groups(
    name: str, parameters: dict[str, float], order: tuple[int, int]
) -> None:
    """How far corners are from each other, as numbers that do not change with the frame: from the group's angles alone,
    and from where the formula has its knobs."""
    curvature = 1 if name == "polychoron" else -1
    reflections, gram = coxeter(*order)
    # A corner is on all mirrors but the first.
    corner = np.linalg.solve(gram, np.eye(4)[0])
    scale = corner @ gram @ corner
    assert np.sign(scale) == curvature
    images = orbit(corner, reflections, 400)
    products = images @ gram @ corner / scale  # cosines, or hyperbolic cosines
    edge = (
        np.sort(products[products < 1 - 1e-6])[-1]
        if curvature == 1
        else np.sort(products[products > 1 + 1e-6])[0]
    )
    if name == "polychoron":
        assert (
            len(images) == {5: 5, 8: 16, 16: 8, 120: 400, 600: 120}[int(parameters["cells"])]
            or len(images) >= 400
        )
    # On the line from the middle along an edge of the formula the next knob is at that distance.
    around = order[1]
    c = math.cos(math.pi / around)
    s = math.sqrt(0.75 - c * c)
    way = np.array([s, 0, 0.5]) / math.sqrt(s * s + 0.25)
    far = (math.acos if curvature == 1 else math.acosh)(edge)
    reach = (math.tan if curvature == 1 else math.tanh)(far / 2)
    extra = {"turn": 0.0} if curvature == 1 else {}
    chain = chain_of(name, **parameters, **extra, rod=0.005, knob=0.01)
    place = reach * way[None]
    across = np.cross(way, [0.3, 0.5, 0.8])
    across /= np.linalg.norm(across)
    stretch = 1 + curvature * reach**2
    inside = own_distance(chain, place + 0.006 * stretch * across, 12)
    outside = own_distance(chain, place + 0.0125 * stretch * across, 12)
    assert inside == 0
    assert 0.001 * stretch < outside < 0.004 * stretch
    # And half way there is a rod, but no knob.
    half = (math.tan if curvature == 1 else math.tanh)(far / 4) * way[None]
    stretch = (1 + curvature * (half**2).sum()) / 2
    assert own_distance(chain, half + 0.0045 * stretch * across, 12) == 0
    assert own_distance(chain, half + 0.006 * stretch * across, 12) > 0


@pytest.mark.parametrize(
    ("name", "parameters", "order"),
    [
        ("polychoron", {"cells": 5, "turn": 0.5}, (3, 3)),
        ("polychoron", {"cells": 8, "turn": 0.4}, (4, 3)),
        ("polychoron", {"cells": 120, "turn": 0.3}, (5, 3)),
        ("hyperbolic_honeycomb", {"sides": 5, "around": 4}, (5, 4)),
        ("hyperbolic_honeycomb", {"sides": 6, "around": 3}, (6, 3)),
    ],
)
def test_rods_are_tubes_about_all_edges(
    name: str, parameters: dict[str, float], order: tuple[int, int]
) -> None:
    """The mirrors as vectors of four dimensions, which make of one edge all edges; to each the distance of a point."""
    curvature = 1 if name == "polychoron" else -1
    metric = np.diag([1.0, 1, 1, curvature])
    c = math.cos(math.pi / order[1])
    s = math.sqrt(0.75 - c * c)
    angle = math.cos(math.pi / order[0])
    first = np.array([-angle, 0, -angle / (2 * s), 0])
    first[3] = curvature * math.sqrt(abs(1 - first @ first))  # the middle is on its positive side
    normals = [first, np.eye(4)[0], np.eye(4)[1], np.array([-0.5, -c, s, 0])]
    reflections = [np.eye(4) - 2 * np.outer(n, metric @ n) for n in normals]
    corner = np.array([0, 0, 0, 1.0])
    corners = orbit(corner, reflections, 1500)
    nearest = curvature * float(corner @ metric @ (reflections[0] @ corner))
    cosines = curvature * corners @ metric @ corners.T
    one, other = np.nonzero(np.triu(np.abs(cosines - nearest) < 1e-6, 1))
    if name == "polychoron":
        assert len(one) == {5: 10, 8: 32, 120: 1200}[int(parameters["cells"])]
    p = points(500, 0.55 if curvature < 0 else 1.4, seed=5)
    q = lifted(p, curvature)
    if curvature > 0:  # as the formula turns what it shows
        turn = parameters["turn"]
        x, w = (
            q[:, 0] * math.cos(turn) - q[:, 3] * math.sin(turn),
            q[:, 0] * math.sin(turn) + q[:, 3] * math.cos(turn),
        )
        q = np.stack([x, q[:, 1], q[:, 2], w], axis=1)
    # q less its part in the plane of an edge's ends: a vector as long as the distance's (hyperbolic) sine.
    along, across = (q @ metric @ corners[k].T for k in (one, other))
    a = (along - nearest * across * curvature**2) / (curvature * (1 - nearest**2))
    b = (across - nearest * along * curvature**2) / (curvature * (1 - nearest**2))
    squared = curvature - (a * along + b * across)
    sine = np.sqrt(np.maximum(np.where((a >= 0) & (b >= 0), squared, np.inf), 0)).min(axis=1)
    rod = float(np.quantile(sine, 0.3))
    got = own_distance(chain_of(name, **parameters, rod=rod, knob=0.0), p, 14)
    sure = np.abs(sine - rod) > 1e-6
    np.testing.assert_array_equal((got == 0)[sure], (sine < rod)[sure])
