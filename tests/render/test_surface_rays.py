"""Rays that leave the surface: soft shadows, ambient occlusion, the environment's light and mirrors, on known surfaces.

Each is compared with its definition, evaluated in NumPy: the visible part of a lamp counted ray by ray, the part of
the hemisphere that a ball covers in closed form, and the environment's picture looked up in the mirrored direction.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.files import resources
from clfractal.files.environment_map import read_environment
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.march import march_record
from clfractal.integrators.records import HemisphereRays, hemisphere_rays
from clfractal.scene.model import Scene
from tests.environment_maps import blended, irradiance, place, write_map
from tests.render.known_lights import BRIGHT, ground
from tests.render.shots import (
    BALL,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    SOLIDS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    Floats,
    colors,
    normals_of,
    plan_of,
    points_of,
    rays,
    render_planned,
    shoot,
    to_sphere,
)
from tests.scenes import scene_of


def solids(light: dict[str, Any] | list[dict[str, Any]], material: dict[str, Any], **occlusion: Any) -> Scene:
    """The ball over the box, under lights with a size and with ambient occlusion: one program for all of them."""
    return scene_of(
        SOLIDS,
        {**ORTHOGRAPHIC, "position": [0.4, -2, 1.6]},
        lights=light if isinstance(light, list) else [light],
        material={**BRIGHT, **material},
        renderer={"samples": 16, "detail": 0.25, "ambient_occlusion": occlusion or {"rays": 1}},
    )


def disk(count: int) -> Floats:
    """Points spread evenly over the unit disk, by the golden angle (Vogel 1979)."""
    number = np.arange(count) + 0.5
    angle = number * np.pi * (3 - np.sqrt(5))
    return np.asarray(np.sqrt(number / count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


@pytest.mark.parametrize("size", [2.0, 15.0, 60.0])
def test_soft_shadow_is_the_part_of_the_lamp_that_is_hidden(device: Device, size: float) -> None:
    way = np.array([0.5, 0.3, -1.0])
    light = {"direction": way.tolist(), "angular_size": size, "rays": 16}
    framebuffer = shoot(solids(light, {"diffuse": 1}), device)
    on_ground = ground(framebuffer)
    axis = -way / np.linalg.norm(way)
    side = np.cross(axis, [0, 0, 1]) / np.linalg.norm(np.cross(axis, [0, 0, 1]))
    places = disk(400)
    # Uniform over the cone's solid angle: heights along the axis are uniform.
    height = 1 - (places**2).sum(-1) * (1 - np.cos(np.radians(size / 2)))
    turn = places / np.linalg.norm(places, axis=-1, keepdims=True) * np.sqrt(1 - height**2)[:, None]
    toward = height[:, None] * axis + turn[:, :1] * side + turn[:, 1:] * np.cross(axis, side)
    points = points_of(framebuffer)[on_ground]
    free = to_sphere(points[:, None], toward[None], SPHERE_CENTER, SPHERE_RADIUS)[1] > SPHERE_RADIUS
    expected = (free * np.maximum(toward[:, 2], 0)).mean(axis=1)
    error = colors(framebuffer)[on_ground][:, 0] - expected
    assert on_ground.sum() > 800
    assert expected.min() < 0.1 * expected.max() or size > 40
    # Rays see the ball half a footprint too large, and a pixel at an edge averages what its middle does not show.
    assert abs(error.mean()) < 0.005
    assert np.abs(error).mean() < 0.01
    assert np.quantile(np.abs(error), 0.98) < (0.25 if size < 10 else 0.1)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=["soft first", "hard first"])
def test_hard_and_soft_lights_together(device: Device, order: tuple[int, int]) -> None:
    """Each light has its own number of rays, and brings as much light as it does alone."""
    soft = {"direction": [0.5, 0.3, -1.0], "angular_size": 4, "rays": 8, "color": [1, 0, 0]}
    hard = {"direction": [-0.4, 0.1, -1.0], "intensity": 0.5, "color": [0, 1, 0]}
    framebuffer = shoot(solids([(soft, hard)[number] for number in order], {"diffuse": 1}), device)
    on_ground = ground(framebuffer)
    softly, hardly = (
        colors(shoot(solids(light, {"diffuse": 1}), device))[on_ground] for light in (soft, hard)
    )
    together = colors(framebuffer)[on_ground]
    np.testing.assert_allclose(together[:, 1], hardly[:, 1], atol=1e-6)
    # Another place among the lights, other places on the lamp: only their mean is the same.
    np.testing.assert_allclose(together[:, 0], softly[:, 0], atol=0.15)
    assert together[:, 0].mean() == pytest.approx(softly[:, 0].mean(), rel=3e-3)
    assert (hardly[:, 1] == 0).mean() > 0.02


def test_rays_that_go_together_lose_no_number(device: Device) -> None:
    """With ambient occlusion rays wait in a batch, and what they found comes back from there: all of it."""
    for formula, scale in ((BALL, 1.0), (QUICK_BALL, 2.0)):  # 2.0: steps that end inside are counted, too
        found = []
        for occlusion in (None, {"rays": 1}):
            settings = {"step_scale": scale, "over_relaxation": 1, "ambient_occlusion": occlusion}
            scene = scene_of(formula, PERSPECTIVE, lights=[], renderer=settings)
            plan = plan_of(scene, device)
            framebuffer = Framebuffer(plan.channels, (64, 64), plan.region)
            found.append((framebuffer, render_planned(scene, plan, device, framebuffer).bad_distances))
        (alone, bad), (together, bad_together) = found
        for name in ("A", "Z", "N.X", "N.Y", "N.Z", "iterations", "steps"):
            np.testing.assert_allclose(together[name], alone[name], rtol=1e-5, atol=1e-6, err_msg=name)
        assert alone["iterations"][alone["A"] == 1].min() > 0
        assert bad == bad_together
    assert bad > 50


def test_ambient_occlusion_is_the_part_of_the_hemisphere_that_is_covered(device: Device) -> None:
    """A ball above the horizon takes (R/d)^2 cos(angle) of the cosine-weighted hemisphere (Nusselt 1928)."""
    light = {"direction": [0, 0, -1], "angular_size": 1, "rays": 1, "shadow": False}
    framebuffer = shoot(solids(light, {"ambient": 1}, rays=32, distance=4), device)
    on_ground = ground(framebuffer)
    offset = SPHERE_CENTER - points_of(framebuffer)[on_ground]
    distance = np.linalg.norm(offset, axis=-1)
    expected = 1 - SPHERE_RADIUS**2 * offset[:, 2] / distance**3
    error = colors(framebuffer)[on_ground][:, 0] - expected
    assert expected.min() < 0.92
    assert abs(error.mean()) < 0.004
    assert np.quantile(np.abs(error), 0.99) < 0.03
    # What is farther away than `distance` hides nothing: here the ball, 0.6 above the box.
    framebuffer = shoot(solids(light, {"ambient": 1}, rays=32, distance=0.59), device)
    assert (colors(framebuffer)[ground(framebuffer)] > 1 - 1e-6).all()


def environment_scene(folder: Path, environment: dict[str, Any], reflection: float, **settings: Any) -> Scene:
    return scene_of(
        BALL,
        PERSPECTIVE,
        folder=folder,
        lights=[],
        environment=environment,
        material={**BRIGHT, "color": [0.8, 0.5, 0.2], "diffuse": 0.9, "reflection": reflection},
        renderer={"detail": 0.25, "firefly_limit": None, **settings},
    )


@cache
def shipped(name: str) -> Floats:
    return np.asarray(read_environment(resources.folder("environments") / f"{name}.exr"), np.float64)


@pytest.mark.parametrize("rotation", [0.0, 70.0])
@pytest.mark.parametrize("count", [0, 1])
def test_what_is_mirrored_and_seen_is_the_environment(
    device: Device, tmp_path: Path, rotation: float, count: int
) -> None:
    """The whole picture: past the ball the map itself, on the ball the map in the mirrored direction, right side up."""
    environment = {"name": "dusk", "rotation": rotation, "rays": count}
    scene = environment_scene(tmp_path, environment, 1.0, bounces=1, detail=0.05)
    framebuffer = shoot(scene, device)
    direction = rays(scene)[1]
    hit = framebuffer["A"] == 1
    # Where the ball was hit, up to half a footprint off, matters to a mirror: so the normal that was found there.
    normal = normals_of(framebuffer)
    mirrored = direction - 2 * (direction * normal).sum(-1, keepdims=True) * normal
    toward = np.where(hit[..., None], mirrored, direction)
    expected = blended(shipped("dusk"), *place(toward, rotation))
    assert 0.2 < hit.mean() < 0.8
    assert (np.abs(colors(framebuffer) - expected) <= 0.005 + 0.02 * expected).mean() > 0.999
    assert (np.abs(colors(framebuffer) - expected) <= 0.01 + 0.1 * expected).all()
    points = points_of(framebuffer)[hit]
    np.testing.assert_allclose(normal[hit], points / np.linalg.norm(points, axis=-1)[:, None], atol=1e-4)


def test_rays_of_the_hemisphere(tmp_path: Path) -> None:
    """Half of the environment's rays follow its brightness, of an odd number the smaller half; without an environment rays
    end where nothing counts any more."""
    for light_rays, occlusion, cosine, by_map in (
        (1, None, 1, 0),
        (5, None, 3, 2),
        (8, {"rays": 2}, 4, 4),
        (2, {"rays": 7}, 7, 1),
        (None, {"rays": 3, "distance": 0.5}, 3, 0),
    ):
        environment = None if light_rays is None else {"name": "dusk", "rays": light_rays}
        scene = scene_of(
            BALL, PERSPECTIVE, environment=environment, renderer={"ambient_occlusion": occlusion}
        )
        assert hemisphere_rays(scene) == HemisphereRays(cosine, by_map, light_rays is not None)
        march = march_record(scene, "float32")
        assert march["ambient_far"] > 1e30 if light_rays is not None else march["ambient_far"] == 0.5
        assert march["occlusion_share"] == pytest.approx(0 if occlusion is None else 1 / cosine)


@pytest.mark.parametrize("reflection", [0.0, 0.4])
def test_under_a_white_sky_a_ball_has_its_own_colour(
    device: Device, tmp_path: Path, reflection: float
) -> None:
    """A uniform map of brightness 1 gives `diffuse` times the colour, and a mirror shows 1."""
    write_map(tmp_path / "white.exr", 1.0)
    scene = environment_scene(tmp_path, {"file": "white.exr", "rays": 32}, reflection, bounces=2, samples=4)
    framebuffer = shoot(scene, device)
    inside = framebuffer["A"] == 1
    expected = (1 - reflection) * 0.9 * np.array([0.8, 0.5, 0.2]) + reflection
    np.testing.assert_allclose(colors(framebuffer)[inside].mean(axis=0), expected, rtol=0.005)
    np.testing.assert_allclose(
        colors(framebuffer)[inside], np.broadcast_to(expected, (inside.sum(), 3)), rtol=0.12
    )
    np.testing.assert_allclose(colors(framebuffer)[framebuffer["A"] == 0], 1.0, atol=1e-5)


@pytest.mark.parametrize(
    ("light_rays", "occlusion"), [(1, None), (3, None), (4, None), (4, 5), (6, 1)], ids=str
)
def test_a_ball_under_a_sky_that_is_brighter_on_one_side(
    device: Device, tmp_path: Path, light_rays: int, occlusion: int | None
) -> None:
    """Whatever the numbers of rays of both kinds are: odd, or more for the occlusion, each weighs as much as it should."""
    open_part = None if occlusion is None else {"rays": occlusion}
    environment = {"name": "dusk", "rays": light_rays}
    scene = environment_scene(tmp_path, environment, 0.0, samples=16, ambient_occlusion=open_part)
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] == 1
    # Halved: the sum over 16 times fewer pixels is the same to a thousandth.
    sky = shipped("dusk")
    sky = sky.reshape(sky.shape[0] // 4, 4, sky.shape[1] // 4, 4, 3).mean(axis=(1, 3))
    expected = 0.9 * np.array([0.8, 0.5, 0.2]) * irradiance(sky, normals_of(framebuffer)[hit])
    found = colors(framebuffer)[hit]
    assert expected.max() > 3 * expected.min()
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.01)
    bright = expected[:, 0] > np.median(expected[:, 0])
    for half in (bright, ~bright):
        np.testing.assert_allclose(found[half].mean(axis=0), expected[half].mean(axis=0), rtol=0.02)
    assert np.sqrt(((found / expected - 1) ** 2).mean()) < 0.2
