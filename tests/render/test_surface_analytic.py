"""The surface renderer against closed forms: a ball, a box, a sphere over a box."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
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
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
    view_of,
)
from tests.scenes import scene_of

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
