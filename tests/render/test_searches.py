"""The two searches for the surface, `distance` and `steps`, against each other and against the boundary of the inside test.

Few iterations make solids that are hardly anywhere thinner than a step. What is, `steps` may miss; so may it miss what a
ray's cone touches but the ray does not meet. Each such pixel has to be explained with the inside test in NumPy.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.formulas.catalog import names
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from tests.devices import check_usable
from tests.render.programs import compile_all
from tests.render.shots import (
    BALL,
    BALL_RADIUS,
    ORTHOGRAPHIC,
    SOLIDS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    Floats,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
)
from tests.scenes import scene_of
from tests.voxels import grids

Bools = npt.NDArray[np.bool_]

SIDE = 32
CHANNELS = ("A", "Z", "P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z", "iterations", "steps")
# The hit distance in footprints. Distances are too small by a factor of some 2 to 4, and along a ray that grazes the
# surface a small one is long: a twentieth of a footprint brings both searches within a footprint nearly everywhere.
DETAIL = 0.05
# High degrees and large scales make thin parts at few iterations already; few iterations of the Mandelbox fill its bounds.
ITERATIONS = {
    "mandelbulb": 3,
    "mengerbulb": 3,
    "sierpinski_tetrahedron": 3,
    "vicsek_cross": 3,
    "mandelbox": 8,
    "aexion": 2,
    "mandalay_box": 2,
    # Until all mirrors have been met, distances are those to other edges.
    "polychoron": 16,
}
USUAL_ITERATIONS = 4
# Sheets, needles, twigs and ridges that are thinner than a step nearly everywhere: steps see little of them.
THIN = ("apollonian", "fractal_tree", "pseudo_kleinian", "riemann_sphere")
# One of each kind: an inside by escape, with Jacobians or a scalar derivative, in three dimensions or four, of a chain, and
# one of folded boxes; a shape, whose inside is the last one's; and one whose orbits leave the range of numbers at once. The
# others are combinations.
KINDS = (
    "hast",
    "mandelbulb",
    "quaternion_julia",
    "mengerbulb",
    "mandelbox",
    "sierpinski_tetrahedron",
    "kaleidoscopic_ifs",
    "riemann_sphere",
)
every_formula = pytest.mark.parametrize(
    "name",
    [*KINDS, *(pytest.param(name, marks=pytest.mark.combination) for name in names() if name not in KINDS)],
)
# The share of pixels whose solid distance may miss. Of KINDS only the Mengerbulb misses some: stretches of at most 0.4
# footprints, where its step scale of 1.3 is too long for so few applications (0.8 misses none, in a quarter more steps).
SLIPS, MISSED = 0.005, ("mengerbulb",)
# A map that jumps, where another axis is nearest: no distance holds on the other side.
JUMPS = {"square_by_axis": 0.02}
EPSILON = {"float32": 2.0**-23, "float64": 2.0**-52}


def scene_for(name: str, search: str, step: float | None = None) -> Scene:
    """A formula of the library from the side, in the middle of the picture."""
    formula = {"name": name, "iterations": ITERATIONS.get(name, USUAL_ITERATIONS)}
    bounds = scene_of(formula, ORTHOGRAPHIC).bounds
    center, radius = np.array(bounds[0]), bounds[1]
    camera = {
        "position": (center + radius * np.array([1.1, -2.1, 1.3])).tolist(),
        "target": center.tolist(),
        "fov": 40,
    }
    renderer: dict[str, Any] = {"search": search, "detail": DETAIL}
    if step is not None:
        renderer["step"] = step * radius
    # Coloured as most scenes of the library are, whose programs have the same text.
    return scene_of(
        formula, camera, (SIDE, SIDE), lights=[], coloring={"by": "iterations"}, renderer=renderer
    )


def inside(scene: Scene, points: Floats) -> Bools:
    """Which points belong to the solid of the scene's applications within its bounds, in float64."""
    center, radius = scene.bounds
    bounded = np.linalg.norm(points - np.asarray(center), axis=-1) <= radius
    return np.asarray(bounded & grids.inside(scene.chain, points, scene.formula.iterations))


@dataclass(frozen=True)
class Found:
    """What one search finds along the rays through the pixels' middles; arrays of shape (SIDE, SIDE)."""

    scene: Scene
    framebuffer: Framebuffer
    origin: Floats
    direction: Floats
    footprint: Floats  # at the point found
    hit: Bools
    t: Floats
    normals: Floats

    @property
    def step(self) -> float:
        """Of the search by steps, scene units."""
        radius = self.scene.bounds[1]
        return self.scene.surface.step or radius / 100

    def along(self, t: Floats, chosen: Bools) -> Floats:
        """Points of the chosen rays at distances t, shape (n,) or (n, m)."""
        distance = t[..., None]
        origin, way = self.origin[chosen], self.direction[chosen]
        if t.ndim == 2:
            origin, way = origin[:, None], way[:, None]
        return np.asarray(origin + distance * way)


def found_by(device: Device, scene: Scene, precision: Precision = "float32") -> Found:
    framebuffer = shoot(scene, device, precision, channels=CHANNELS)
    origin, direction, spread = rays(scene)
    t = ((points_of(framebuffer) - origin) * direction).sum(-1)
    return Found(
        scene, framebuffer, origin, direction, spread * t, framebuffer["A"] > 0, t, normals_of(framebuffer)
    )


@lru_cache
def both(device: Device, name: str) -> tuple[Found, Found]:
    """By distance and by steps."""
    scenes = [scene_for(name, search) for search in ("distance", "steps")]
    compile_all(scenes, device)
    return found_by(device, scenes[0]), found_by(device, scenes[1])


@every_formula
def test_both_searches_show_the_same_solid(device: Device, name: str) -> None:
    """Where steps hits, distance hits too. Depths agree to a footprint and a step, or else distance has stopped earlier:
    within a footprint of the solid, of which that ray crosses no part that is longer than a step."""
    near, far = both(device, name)
    assert name in THIN or far.hit.sum() > 0.08 * far.hit.size
    assert np.isfinite(stacked(near.framebuffer, CHANNELS[2:])).all()
    assert np.isfinite(stacked(far.framebuffer, CHANNELS[2:])).all()
    missed = 0.0 if name in KINDS and name not in MISSED else JUMPS.get(name, SLIPS)
    assert (far.hit & ~near.hit).sum() <= missed * far.hit.sum()

    shared = far.hit & near.hit
    apart = far.t - near.t
    slack = near.footprint + far.step
    # Nothing that a step would see is passed by distances.
    assert (apart[shared] <= -slack[shared]).mean() <= missed
    # What distance alone sees: thin, or beside the ray.
    early = near.hit & (~far.hit | (apart > slack))
    if name not in THIN:
        assert (apart < slack)[shared].mean() > 0.85
        assert early.sum() <= 0.18 * near.hit.sum()
        assert unexplained(near, early) == 0
    assert longest_crossing(near, far, early) <= 1.05 * far.step


@every_formula
def test_steps_end_at_the_boundary(device: Device, name: str) -> None:
    """The point found is the last one outside: bisecting the inside test from there on ends where it began, but for the
    rounding of a number of float32 (of the point, and of an orbit of a few applications)."""
    _, far = both(device, name)
    check_boundary(far, "float32")


@pytest.mark.parametrize("name", ["hast", pytest.param("menger_sponge", marks=pytest.mark.combination)])
def test_steps_in_float64(device: Device, name: str) -> None:
    """As precise as float32 channels tell: half of their last digit."""
    check_usable("float64")
    exact = found_by(device, scene_for(name, "steps"), "float64")
    check_boundary(exact, "float64")
    _, usual = both(device, name)
    assert (exact.hit != usual.hit).mean() < 0.01


@pytest.mark.parametrize("step", [0.04, 0.002])
@pytest.mark.parametrize("name", ["hast", "mandelbox", "sierpinski_tetrahedron"])
def test_other_steps(device: Device, name: str, step: float) -> None:
    """A finer step misses less and never finds anything farther away than a coarse one; its cost is in the channel."""
    near, usual = both(device, name)
    other = found_by(device, scene_for(name, "steps", step))
    fine, coarse = (other, usual) if step < 0.01 else (usual, other)
    both_hit = fine.hit & coarse.hit
    assert (coarse.hit & ~fine.hit).sum() <= 0.002 * SIDE**2  # between two steps of the fine one, by chance
    assert (fine.t[both_hit] < coarse.t[both_hit] + fine.step + 1e-5).mean() > 0.995
    check_boundary(other, "float32")
    shared = other.hit & near.hit
    assert (other.t[shared] > near.t[shared] - near.footprint[shared] - other.step).all()
    # Every ray that crosses the bounds takes its chord's steps, until it hits.
    _, radius = other.scene.bounds
    missed = ~other.hit & (other.framebuffer["steps"] > 0)
    first, nearest = to_sphere(other.origin, other.direction, other.scene.bounds[0], radius)
    chord = 2 * np.sqrt(np.maximum(radius**2 - nearest**2, 0))
    np.testing.assert_allclose(
        other.framebuffer["steps"][missed], np.floor(chord / other.step)[missed] + 1, rtol=1e-3, atol=1.01
    )
    assert (other.framebuffer["steps"][other.hit] <= ((other.t - first) / other.step)[other.hit] + 45).all()


def test_powers_that_differ_from_place_to_place(device: Device) -> None:
    """The Riemann sphere's radius grows by powers from 2 to 16. Three applications leave a smooth body: no orbit out of the
    range of numbers may be taken for a wall before it, nor one power more beyond the limit for a rim that is not there."""
    camera = {"position": [3.4, -1.6, -1.15], "target": [0, 0, 0], "fov": 30}
    near, far = (
        found_by(
            device,
            scene_of(
                {"name": "riemann_sphere", "iterations": 3},
                camera,
                (SIDE, SIDE),
                lights=[],
                coloring={"by": "iterations"},
                renderer={"search": search, "bounds": {"radius": 1.1}},
            ),
        )
        for search in ("distance", "steps")
    )
    assert far.hit.mean() > 0.5
    assert (near.hit == far.hit).mean() > 0.995
    shared = near.hit & far.hit
    assert (np.abs(near.t - far.t) < near.footprint + far.step)[shared].mean() > 0.995


def test_steps_of_a_ball(device: Device) -> None:
    """The closed form: what a ray meets, to the precision of float32, unless it passes through less than a step of it."""
    scene = scene_of(BALL, ORTHOGRAPHIC, (SIDE, SIDE), renderer={"search": "steps"})
    ball = found_by(device, scene)
    distance, nearest = to_sphere(ball.origin, ball.direction, (0, 0, 0), BALL_RADIUS)
    chord = 2 * np.sqrt(np.maximum(BALL_RADIUS**2 - nearest**2, 0))
    assert not (ball.hit & (nearest > BALL_RADIUS + 1e-6)).any()
    assert ball.hit[chord > ball.step * 1.001].all()
    cosine = np.sqrt(1 - (nearest / BALL_RADIUS).clip(0, 1) ** 2)
    error = np.abs(ball.t - distance)[ball.hit] * cosine[ball.hit]
    assert error.max() < 8 * EPSILON["float32"]
    # From within, the eye itself is the surface.
    inner = {"position": [0.2, 0.1, 0], "target": [0.2, 0.4, 0.1]}
    within = shoot(scene_of(BALL, inner, (SIDE, SIDE), renderer={"search": "steps"}), device)
    assert (within["A"] == 1).all()
    assert np.abs(within["Z"]).max() < 1e-6


def test_steps_arrive_from_where_numbers_are_coarser_than_they(device: Device) -> None:
    camera = {**ORTHOGRAPHIC, "position": [0, -1e6, 0], "target": [0, 0, 0]}
    scene = scene_of(BALL, camera, (SIDE, SIDE), lights=[], renderer={"search": "steps", "step": 0.01})
    found = found_by(device, scene)
    assert EPSILON["float32"] * 1e6 > 0.01
    _, nearest = to_sphere(found.origin, found.direction, [0, 0, 0], BALL_RADIUS)
    sure = np.abs(nearest - BALL_RADIUS) > 0.1  # scene units: what a depth of some 0.25 does near the rim
    np.testing.assert_array_equal(found.hit[sure], (nearest < BALL_RADIUS)[sure])


def test_shadows_of_steps_begin_small(device: Device) -> None:
    """Place by place: steps of a ray to a light grow from the size of a pixel to the whole step, half as long again each
    time. Here a whole step at once would pass most of the ball that hovers over the box."""
    step, detail = 0.57, 0.25
    scene = scene_of(
        SOLIDS,
        {**ORTHOGRAPHIC, "position": [0.4, -2, 1.6]},
        lights=[{"direction": [0, 0, -1]}],
        material={"ambient": 0, "diffuse": 1, "specular": 0, "color": [1, 1, 1]},
        renderer={"search": "steps", "step": step, "detail": detail},
    )
    framebuffer = shoot(scene, device)
    footprint = rays(scene)[2][0, 0]
    points = points_of(framebuffer)
    ground = (
        (framebuffer["A"] == 1) & (np.abs(points[..., 2]) < 1e-3) & (np.abs(points[..., :2]) < 1.15).all(-1)
    )
    assert ground.sum() > 600
    places, pace = [0.0], footprint
    while places[-1] < 2:
        places.append(places[-1] + pace)
        pace = min(1.5 * pace, step)
    height = points[ground][:, None, 2] + 3 * detail * footprint + np.array(places)
    across = np.linalg.norm(points[ground][:, :2] - SPHERE_CENTER[:2], axis=-1)
    depth = SPHERE_RADIUS - np.hypot(across[:, None], height - SPHERE_CENTER[2]).min(axis=1)
    sure = np.abs(depth) > 2e-3
    assert sure.mean() > 0.97
    np.testing.assert_array_equal((framebuffer["R"][ground] == 0)[sure], (depth > 0)[sure])
    assert (across[depth > 0] > 0.8 * SPHERE_RADIUS).sum() > 10


def check_boundary(found: Found, precision: Precision) -> None:
    """Bisects the inside test in float64 around each point that steps ended at."""
    hit, scene = found.hit, found.scene
    t = found.t[hit]
    # The boundary is a surface: an error across it is longer along a ray that grazes it.
    cosine = np.abs((found.normals * found.direction).sum(-1))[hit].clip(0.02)
    size = float(np.linalg.norm(found.scene.camera.position)) + found.scene.bounds[1]
    # Channels are float32, whatever the rays are.
    rounding = (24 if precision == "float32" else 1) * EPSILON["float32"] * size / cosine
    low, high = t - rounding, t + rounding
    crosses = ~inside(scene, found.along(low, hit)) & inside(scene, found.along(high, hit))
    # Where a feature is thinner than that, or a fold makes orbits differ, rounding decides.
    assert crosses.mean() > 0.97
    for _ in range(20):
        middle = (low + high) / 2
        within = inside(scene, found.along(middle, hit))
        low, high = np.where(within, low, middle), np.where(within, middle, high)
    error = (np.abs(t - high) * cosine / (EPSILON["float32"] * size))[crosses]
    assert np.median(error) < (2 if precision == "float32" else 0.5)


def longest_crossing(near: Found, far: Found, early: Bools) -> float:
    """The longest way through the solid, scene units, on the rays of the chosen pixels between where distance and steps end
    (ten steps where steps finds nothing)."""
    places, longest = 20, 0.0
    for start, end, pixel in zip(near.t[early], far.t[early], np.argwhere(early), strict=True):
        way = (end - start if far.hit[tuple(pixel)] else 10 * far.step) - 1e-4
        chosen = np.zeros_like(early)
        chosen[tuple(pixel)] = True
        t = start + np.arange(0, way, far.step / places)
        within = inside(far.scene, far.along(t[None], chosen)[0])
        runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], within, [0]]))))[::2]
        longest = max([longest, *((runs - 1) * far.step / places)])
    return longest


def unexplained(near: Found, early: Bools) -> int:
    """Pixels that distance hits before steps does although no solid point is found within a footprint of where."""
    random = np.random.default_rng(3)
    left = early.copy()
    for scale in (0.1, 0.3, 1.0):
        if not left.any():
            break
        reach = scale * near.footprint[left]
        ball = random.normal(size=(int(left.sum()), 1500, 3))
        ball *= (random.random(ball.shape[:2]) ** (1 / 3) / np.linalg.norm(ball, axis=-1))[..., None]
        points = points_of(near.framebuffer)[left][:, None] + reach[:, None, None] * ball
        solid = inside(near.scene, points.reshape(-1, 3)).reshape(ball.shape[:2]).any(axis=1)
        left[left] = ~solid
    return int(left.sum())
