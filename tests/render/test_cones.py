"""Cones of blocks of pixels, which go before the rays: they hold every ray of the block, and hide nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators import march, waves
from clfractal.integrators.kernel import BLOCK
from clfractal.integrators.plan import make_plan
from clfractal.scene.model import Scene
from tests.render.shots import (
    BALL,
    BALL_RADIUS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    plan_of,
    rays,
    render_planned,
    to_sphere,
)
from tests.scenes import scene_of

SIZE = (320, 240)
LIGHTS: list[dict[str, Any]] = [{"direction": [-1, 1, -1]}]
CAMERAS: dict[str, dict[str, Any]] = {
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
FORMULAS: dict[str, dict[str, Any]] = {
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
    scene = scene_of(FORMULAS[formula], CAMERAS[camera], SIZE, lights=LIGHTS)
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
    scene = scene_of(FORMULAS["hast"], CAMERAS["perspective"], SIZE)
    plan = make_plan(scene, precision="float32", lanes=1)
    assert waves.has_cones(scene, plan)
    assert not waves.has_cones(scene, replace(plan, moving=True))
    lens = {**CAMERAS["perspective"], "f_number": 2.8, "focus_distance": 2.0}
    assert not waves.has_cones(scene_of(FORMULAS["hast"], lens, SIZE), plan)
    by_steps = scene_of(FORMULAS["hast"], CAMERAS["perspective"], SIZE, renderer={"search": "steps"})
    assert not waves.has_cones(by_steps, plan)
