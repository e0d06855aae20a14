"""The surface renderer against closed forms: a ball, a box, a sphere over a box."""

from __future__ import annotations

from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np
import pytest

from benchmarks.truth.losses import measure_losses
from benchmarks.truth.picture import see
from benchmarks.truth.solid import Solid
from clfractal.device.select import Device
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators import march, waves
from clfractal.integrators.kernel import BLOCK
from clfractal.integrators.plan import make_plan
from clfractal.scene.model import Scene
from tests import scenes
from tests.render.shots import (
    BALL,
    BALL_RADIUS,
    CAMERAS,
    CHANNELS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    SOLIDS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    Floats,
    engine_of,
    normals_of,
    plan_of,
    points_of,
    rays,
    render_planned,
    shoot,
    stacked,
    to_sphere,
    view_of,
)
from tests.scenes import scene_of
from tests.variants import combinations

# In float32 coordinates near 1 and depths near 3 come in steps of 1e-7 and 2e-7; some operations add up.
ROUNDING = 2e-6
# Hit distances before the hit: nowhere farther off is light computed. (Near a rim, five above the ball is far before it.)
FARTHEST = 20.0


@pytest.mark.parametrize("formula", [BALL, QUICK_BALL], ids=["jacobian", "scalar rule"])
@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("detail", [1.0, 0.05])
def test_ball(device: Device, formula: dict[str, Any], camera: str, detail: float) -> None:
    """A ray hits where it meets the ball, to a tenth of `detail` footprints; one that passes at less than two may hit,
    one through the ball has to. With `detail` 1, where this ball's radius is some twenty footprints, its normal is that
    at the hit but near the rim, where it is that of a place on the ray before the hit."""
    scene = scene_of(formula, CAMERAS[camera], (80, 60), renderer={"detail": detail})
    framebuffer = shoot(scene, device)
    origin, direction, spread = rays(scene)
    _, nearest = to_sphere(origin, direction, (0, 0, 0), BALL_RADIUS)
    depth_scale = (
        np.where(np.isfinite(framebuffer["Z"]), framebuffer["Z"], 1) if camera == "perspective" else 1.0
    )
    footprint = spread * depth_scale * (1.1 if camera == "perspective" else 1)
    hit = framebuffer["A"] == 1
    slack = 2 * detail * footprint + ROUNDING

    # The silhouette: every ray through the ball hits, none that passes at a distance does.
    assert hit[nearest < BALL_RADIUS].all()
    far_off = nearest > BALL_RADIUS + (2 * detail * spread * 3.2 if camera == "perspective" else slack)
    assert not hit[far_off].any()
    assert 300 < hit.sum() < 0.9 * hit.size

    # On the surface, on the pixel's own ray, and the depth of that.
    points = points_of(framebuffer)
    outside = np.linalg.norm(points, axis=-1) - BALL_RADIUS
    assert (outside + 0.1 * detail * footprint)[hit].min() > -ROUNDING
    assert (outside - slack)[hit].max() < 0
    along = ((points - origin) * direction).sum(-1)
    off_ray = np.linalg.norm(points - origin - along[..., None] * direction, axis=-1)
    assert off_ray[hit].max() < ROUNDING
    view = view_of(scene)
    depth = (points - view.origin) @ view.axis
    np.testing.assert_allclose(framebuffer["Z"][hit], depth[hit], atol=ROUNDING)

    # The gradient of |z| is radial: in a plane with the ray, between that at the hit and that well before it.
    radial, normals = _unit(points), normals_of(framebuffer)
    beside = np.abs((normals * _unit(np.cross(points, direction))).sum(-1))
    turned = np.degrees(2 * np.arcsin(np.linalg.norm(normals - radial, axis=-1)[hit] / 2))
    before = _unit(points - FARTHEST * detail * footprint[..., None] * direction)
    most = np.degrees(2 * np.arcsin(np.linalg.norm(before - radial, axis=-1)[hit] / 2))
    assert np.degrees(beside[hit]).max() < 0.02
    assert (turned < most + 0.02).all()
    assert np.median(turned) < (0.005 if detail < 1 else 0.1)
    assert np.percentile(turned, 70) < (0.01 if detail < 1 else 1)
    assert np.percentile(turned, 99) < (0.04 if detail < 1 else 30)

    # What is not hit.
    miss = ~hit
    assert np.isposinf(framebuffer["Z"][miss]).all()
    assert (framebuffer["A"][miss] == 0).all()
    for name in ("N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "iterations"):
        assert (framebuffer[name][miss] == 0).all(), name
    colours = stacked(framebuffer, [name for name in CHANNELS if name != "Z"])
    assert np.isfinite(colours).all()
    assert not np.isnan(framebuffer["Z"]).any()


@pytest.mark.parametrize("camera", CAMERAS)
def test_box_and_sphere(device: Device, camera: str) -> None:
    """Exact distances (a shape of an IFS without a map): the points lie on the solids, with their normals."""
    scene = scene_of(SOLIDS, CAMERAS[camera], (80, 60), renderer={"detail": 0.05})
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] > 0
    points, normals = points_of(framebuffer)[hit], normals_of(framebuffer)[hit]
    to_center = points - SPHERE_CENTER
    sphere = np.linalg.norm(to_center, axis=-1) - SPHERE_RADIUS
    box = _box_distance(points)
    footprint = (rays(scene)[2] * (framebuffer["Z"] if camera == "perspective" else 1))[hit] * 1.1
    assert np.abs(np.minimum(sphere, box)).max() < (0.055 * footprint).max() + ROUNDING
    on_sphere = sphere < box
    assert on_sphere.sum() > 50
    np.testing.assert_allclose(
        normals[on_sphere], to_center[on_sphere] / (sphere + SPHERE_RADIUS)[on_sphere, None], atol=2e-4
    )
    # Well inside its faces the box has their normals.
    top = ~on_sphere & (np.abs(points[:, 2]) < 0.01) & (np.abs(points[:, :2]).max(-1) < 1.19)
    assert top.sum() > 500
    np.testing.assert_allclose(normals[top], np.broadcast_to([0, 0, 1], normals[top].shape), atol=1e-5)
    front = (
        ~on_sphere
        & (points[:, 1] < -1.199)
        & (np.abs(points[:, 2] + 0.25) < 0.24)
        & (np.abs(points[:, 0]) < 1.19)
    )
    assert front.sum() > 50
    np.testing.assert_allclose(normals[front], np.broadcast_to([0, -1, 0], normals[front].shape), atol=1e-5)


def test_camera_inside_the_bounds_and_inside_the_solid(device: Device) -> None:
    """From between the box and the sphere everything is seen; from within the ball the surface is at the eye."""
    inner = {"position": [-0.9, -0.9, 0.5], "target": [0.2, -0.1, 0.5], "fov": 60}
    framebuffer = shoot(scene_of(SOLIDS, inner), device)
    assert 0.3 < framebuffer["A"].mean() < 1
    assert np.isfinite(stacked(framebuffer, [name for name in CHANNELS if name != "Z"])).all()
    framebuffer = shoot(scene_of(BALL, {**PERSPECTIVE, "position": [0.1, 0.2, 0.1]}, (32, 32)), device)
    assert (framebuffer["A"] == 1).all()
    assert np.abs(framebuffer["Z"]).max() < 1e-3
    np.testing.assert_allclose(np.linalg.norm(normals_of(framebuffer), axis=-1), 1, atol=1e-5)


@pytest.mark.parametrize("camera", CAMERAS)
def test_steps_and_bounds(device: Device, camera: str) -> None:
    """Every ray that enters the bounds takes a step, no other does; steps are whole numbers."""
    scene = scene_of(BALL, CAMERAS[camera], (80, 60))
    framebuffer = shoot(scene, device)
    _, nearest = to_sphere(*rays(scene)[:2], (0, 0, 0), 1.5)
    steps = framebuffer["steps"]
    assert (steps[nearest < 1.4999] >= 1).all()
    assert (steps[nearest > 1.5001] == 0).all()
    assert (nearest > 1.5001).any()
    assert np.array_equal(steps, np.round(steps))


def test_max_steps_ends_a_ray(device: Device) -> None:
    """A ray that is stopped early hits nothing, and says how far it came."""
    framebuffer = shoot(
        scene_of(QUICK_BALL, PERSPECTIVE, (32, 32), renderer={"max_steps": 3, "detail": 0.01}), device
    )
    assert framebuffer["steps"].max() == 3
    assert not framebuffer["A"].any()


def test_bounds_of_the_scene_cut(device: Device) -> None:
    """Bounds smaller than the ball: only what lies in them is searched, and a ray that starts inside hits there."""
    ball: dict[str, Any] = {"center": [0.5, 0, 0], "radius": 0.7}
    scene = scene_of(BALL, ORTHOGRAPHIC, renderer={"bounds": ball, "detail": 0.05})
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] > 0
    _, nearest = to_sphere(*rays(scene)[:2], ball["center"], 0.7)
    assert not hit[nearest > 0.7001].any()
    assert (np.linalg.norm(points_of(framebuffer)[hit] - ball["center"], axis=-1) < 0.7001).all()
    assert hit.sum() > 300


def _unit(vectors: Floats) -> Floats:
    """Vectors (..., 3) at length 1; those without any stay."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True).clip(1e-9))


def _box_distance(points: Floats) -> Floats:
    """Of the box |x|, |y| <= 1.2, -0.5 <= z <= 0."""
    q = np.abs(points - [0, 0, -0.25]) - [1.2, 1.2, 0.25]
    return np.asarray(np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0))


def seen_from(formula: dict[str, Any], far: float, bounds: float | None) -> Scene:
    """A formula from so far away, and with bounds that are so large, in radii of its ball; the picture shows the ball."""
    chain = scenes.scene_of(formula).chain
    center, radius = np.array(chain.center), chain.radius
    toward = np.array([0.5, -1, 0.4]) / np.linalg.norm([0.5, -1, 0.4])
    renderer: dict[str, Any] = {"type": "surface", "step": radius / 100}
    if bounds is not None:
        renderer["bounds"] = {
            "center": (center + np.array([0, 0.1 * radius, 0])).tolist(),
            "radius": bounds * radius,
        }
    camera = {
        "position": [*(center + far * radius * toward)],
        "target": [*center],
        "fov": float(np.degrees(2 * np.arctan(0.8 / far))),
    }
    return scenes.scene_of(formula, camera, (160, 160), renderer=renderer, lights=[])


@pytest.mark.parametrize(
    "formula",
    [
        {"name": "mandelbulb", "iterations": 8},
        {"name": "hast", "iterations": 12},
        *combinations(
            [
                {"name": "quaternion_julia", "iterations": 10},
                {"name": "mandelbox", "iterations": 8},
                {"name": "menger_sponge", "iterations": 4},
                {"name": "burning_ship", "iterations": 9},
            ]
        ),
    ],
    ids=itemgetter("name"),
)
def test_nothing_is_lost(device: Device, formula: dict[str, Any]) -> None:
    """No ray goes through three footprints of the set unseen, and as many surfaces are nearer as are farther away."""
    for far in (2.5, 40.0):
        usual = seen_from(formula, far, None)
        home = see(usual, engine_of(device))
        solid = Solid(usual.chain, usual.formula.iterations, device)
        for bounds in (3.0, 10.0, 50.0):
            seen = see(seen_from(formula, far, bounds), engine_of(device))
            there = replace(seen, rays=home.rays)
            lost = measure_losses(there, solid, 600, np.random.default_rng(5)).lost
            assert len(lost) <= 1, (far, bounds, lost)
            met, both = np.isfinite(seen.t), np.isfinite(seen.t) & np.isfinite(home.t)
            assert abs(met.sum() - np.isfinite(home.t).sum()) < 0.01 * met.sum()
            off = (seen.t[both] - home.t[both]) / home.rays[both].width(home.t[both])
            assert np.median(np.abs(off)) < 0.3
            assert abs((off > 3).sum() - (off < -3).sum()) < 0.005 * both.sum()


def test_what_is_farther_out_than_the_ball_is_seen(device: Device) -> None:
    """A formula whose ball is too small has larger bounds: all of it is seen, also what the ball does not hold."""
    ball = {
        "variables": ["x", "y", "z"],
        "map": ["x", "y", "z"],
        "add": "none",
        "degree": 1,
        "shape": "sqrt(x*x + y*y + z*z) - 1",
        "bounds": {"center": [0, 0, 0], "radius": 0.4},
        "bailout": 10,
    }
    scene = scenes.scene_of(
        {"inline": ball, "iterations": 1},
        {"position": [0, -5, 0], "target": [0, 0, 0], "fov": 30},
        (96, 96),
        renderer={"type": "surface", "bounds": {"center": [0, 0, 0], "radius": 30}},
    )
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] == 1
    np.testing.assert_allclose(np.linalg.norm(points_of(framebuffer)[hit], axis=-1), 1, atol=0.01)
    shown = hit.mean() * (2 * 5 * np.tan(np.radians(15))) ** 2
    # The outline of a unit ball from 5 away.
    assert shown == pytest.approx(np.pi * 25 / 24, rel=0.03)


SIZE = (320, 240)
LIGHTS: list[dict[str, Any]] = [{"direction": [-1, 1, -1]}]
VIEWS: dict[str, dict[str, Any]] = {
    "perspective": {"position": [1.3, -2.6, 1.6], "target": [0, 0, 0], "fov": 45},
    "orthographic": {
        "projection": "orthographic",
        "position": [1.3, -2.6, 1.6],
        "target": [0, 0, 0],
        "height": 2.6,
    },
    "very wide": {"position": [0.2, -1.5, 0.3], "target": [0, 0, 0.3], "fov": 140},
    "from within the bounds": {"position": [0.4, -1.05, 0.1], "target": [0, 0, 0], "fov": 60},
}
# Of the steps without cones, at most.
MOST_STEPS = {
    ("mandelbulb", "perspective"): 0.97,
    ("mandelbulb", "orthographic"): 0.98,
    ("mandelbulb", "very wide"): 1.02,  # most of the picture is empty: rays end after a step or two
    ("mandelbulb", "from within the bounds"): 0.9,
    ("hast", "perspective"): 0.8,
    ("hast", "orthographic"): 0.83,
    ("hast", "very wide"): 0.5,
    ("hast", "from within the bounds"): 0.9,
}
CONE_FORMULAS: dict[str, dict[str, Any]] = {
    "mandelbulb": {"name": "mandelbulb", "iterations": 8},
    "hast": {"name": "hast", "iterations": 20},
}
# The unit sphere.
SPHERE = {"name": "quaternion_julia", "iterations": 8, "julia": [0, 0, 0, 0]}


def rendered(scene: Scene, device: Device) -> tuple[Framebuffer, int]:
    """The picture, and how many steps its rays have taken."""
    plan = plan_of(scene, device)
    framebuffer = Framebuffer(plan.channels, (scene.image.width, scene.image.height), plan.region)
    state = render_planned(scene, plan, device, framebuffer)
    return framebuffer, state.steps


def without_cones(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waves, "has_cones", lambda scene, plan: False)


@pytest.mark.parametrize(("formula", "camera"), MOST_STEPS)
def test_rays_behind_their_cone_find_the_same_with_fewer_steps(
    formula: str, camera: str, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of(CONE_FORMULAS[formula], VIEWS[camera], SIZE, lights=LIGHTS)
    cones, steps = rendered(scene, device)
    without_cones(monkeypatch)
    rays, steps_of_rays = rendered(scene, device)
    assert steps < MOST_STEPS[formula, camera] * steps_of_rays
    # Where a ray begins moves its steps, so what a rim shows of the set may differ, either way.
    hit, hit_by_rays = cones["A"] > 0, rays["A"] > 0
    assert (hit != hit_by_rays).mean() < 0.01
    assert abs(int(hit.sum()) - int(hit_by_rays.sum())) < 0.004 * hit.size
    both = hit & hit_by_rays
    width = 2.6 / SIZE[1] if camera == "orthographic" else 0.01 * cones["Z"][both]
    assert np.median(np.abs(cones["Z"][both] - rays["Z"][both]) / width) < (0.3 if formula == "hast" else 0.1)


@pytest.mark.parametrize(
    "renderer", [{}, {"samples": 4, "filter": "tent", "filter_width": 6}], ids=["one", "wide"]
)
def test_a_block_sees_what_is_smaller_than_a_pixel_anywhere_in_it(
    renderer: dict[str, Any], device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ball of two pixels, in the middle of pictures of all sizes: so it lies in all columns and rows of a block."""
    camera = {"position": [0, -40, 0], "target": [0, 0, 0], "up": [0, 0, 1], "fov": 60}
    for side in range(2 * BLOCK, 3 * BLOCK):
        scene = scene_of(SPHERE, camera, (side, side + 3), lights=LIGHTS, renderer=renderer)
        framebuffer, _ = rendered(scene, device)
        with monkeypatch.context() as patch:
            without_cones(patch)
            alone, _ = rendered(scene, device)
        np.testing.assert_allclose(framebuffer["A"], alone["A"], atol=1e-6)
        assert framebuffer["A"].sum() > 0.3, side


@pytest.mark.parametrize("formula", [BALL, QUICK_BALL], ids=["jacobian", "scalar rule"])
@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("renderer", [{}, {"normal": "least_squares"}], ids=["one", "points"])
def test_a_ray_whose_cone_ended_inside_begins_anew(
    formula: dict[str, Any],
    camera: dict[str, Any],
    renderer: dict[str, Any],
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A share of more than the whole distance stands for distances that are too large: cones go into the ball."""
    scene = scene_of(formula, camera, (160, 120), renderer=renderer, lights=LIGHTS)
    origin, direction, _ = rays(scene)
    _, nearest = to_sphere(origin, direction, (0, 0, 0), BALL_RADIUS)
    monkeypatch.setattr(march, "CONE_SHARE", 3.0)
    cones, _ = rendered(scene, device)
    hit = nearest < 0.8 * BALL_RADIUS
    assert hit.sum() > 2000
    assert (cones["A"][hit] > 0).all()
    # Light is computed a little above the ball.
    points = np.stack([cones["P.X"], cones["P.Y"], cones["P.Z"]], axis=-1)
    assert (np.abs(np.linalg.norm(points, axis=-1) - BALL_RADIUS)[hit] < 0.02).all()


def test_rays_without_a_common_cone_have_none() -> None:
    """Those through a lens, of a view that moves, or that are searched by steps."""
    scene = scene_of(CONE_FORMULAS["hast"], VIEWS["perspective"], SIZE)
    plan = make_plan(scene, precision="float32", lanes=1)
    assert waves.has_cones(scene, plan)
    assert not waves.has_cones(scene, replace(plan, moving=True))
    lens = {**VIEWS["perspective"], "f_number": 2.8, "focus_distance": 2.0}
    assert not waves.has_cones(scene_of(CONE_FORMULAS["hast"], lens, SIZE), plan)
    by_steps = scene_of(CONE_FORMULAS["hast"], VIEWS["perspective"], SIZE, renderer={"search": "steps"})
    assert not waves.has_cones(by_steps, plan)
