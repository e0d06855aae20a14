"""Rays that leave the surface: soft shadows, ambient occlusion, the environment's light and mirrors, on known surfaces.

Each is compared with its definition, evaluated in NumPy: the visible part of a lamp counted ray by ray, the part of
the hemisphere that a ball covers in closed form, and the environment's picture looked up in the mirrored direction.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal import resources
from clfractal.device.select import Device
from clfractal.files.environment import read_environment
from clfractal.files.exr import write_exr
from clfractal.pictures.film import Film
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from tests.render.shots import (
    BALL,
    BALL_RADIUS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    SOLIDS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    Floats,
    points_of,
    rays,
    scene_of,
    shoot,
    stacked,
    to_sphere,
)

BRIGHT = {"color": [1, 1, 1], "ambient": 0, "diffuse": 0, "specular": 0}


def colors(film: Film) -> Floats:
    return stacked(film, ("R", "G", "B")).astype(float)


def solids(light: dict[str, Any], material: dict[str, Any], **occlusion: Any) -> Scene:
    """The ball over the box, under a light with a size and with ambient occlusion: one program for all of them."""
    return scene_of(
        SOLIDS,
        {**ORTHOGRAPHIC, "position": [0.4, -2, 1.6]},
        lights=[light],
        material={**BRIGHT, **material},
        renderer={"samples": 16, "detail": 0.25, "ambient_occlusion": occlusion or {"rays": 1}},
    )


def ground(film: Film) -> npt.NDArray[np.bool_]:
    """Where the top of the box is seen, away from its edges."""
    points = points_of(film)
    inner = (np.abs(points[..., :2]) < 1.15).all(axis=-1)
    return np.asarray((film["A"] == 1) & (np.abs(points[..., 2]) < 0.011) & inner)


def disk(count: int) -> Floats:
    """Points spread evenly over the unit disk, by the golden angle (Vogel 1979)."""
    number = np.arange(count) + 0.5
    angle = number * np.pi * (3 - np.sqrt(5))
    places: Floats = np.sqrt(number / count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return places


@pytest.mark.parametrize("size", [2.0, 15.0, 60.0])
def test_soft_shadow_is_the_part_of_the_lamp_that_is_hidden(device: Device, size: float) -> None:
    way = np.array([0.5, 0.3, -1.0])
    light = {"direction": way.tolist(), "angular_size": size, "rays": 16}
    film = shoot(solids(light, {"diffuse": 1}), device)
    on_ground = ground(film)
    axis = -way / np.linalg.norm(way)
    side = np.cross(axis, [0, 0, 1]) / np.linalg.norm(np.cross(axis, [0, 0, 1]))
    places = disk(400)
    # Uniform over the cone's solid angle: heights along the axis are uniform.
    height = 1 - (places**2).sum(-1) * (1 - np.cos(np.radians(size / 2)))
    turn = places / np.linalg.norm(places, axis=-1, keepdims=True) * np.sqrt(1 - height**2)[:, None]
    toward = height[:, None] * axis + turn[:, :1] * side + turn[:, 1:] * np.cross(axis, side)
    points = points_of(film)[on_ground]
    free = to_sphere(points[:, None], toward[None], SPHERE_CENTER, SPHERE_RADIUS)[1] > SPHERE_RADIUS
    expected = (free * np.maximum(toward[:, 2], 0)).mean(axis=1)
    error = colors(film)[on_ground][:, 0] - expected
    assert on_ground.sum() > 800
    assert expected.min() < 0.1 * expected.max() or size > 40
    # Rays see the ball half a footprint too large, and a pixel at an edge averages what its middle does not show.
    assert abs(error.mean()) < 0.005
    assert np.abs(error).mean() < 0.01
    assert np.quantile(np.abs(error), 0.98) < (0.25 if size < 10 else 0.1)


def test_ambient_occlusion_is_the_part_of_the_hemisphere_that_is_covered(device: Device) -> None:
    """A ball above the horizon takes (R/d)^2 cos(angle) of the cosine-weighted hemisphere (Nusselt 1928)."""
    light = {"direction": [0, 0, -1], "angular_size": 1, "rays": 1, "shadow": False}
    film = shoot(solids(light, {"ambient": 1}, rays=32, distance=4), device)
    on_ground = ground(film)
    offset = SPHERE_CENTER - points_of(film)[on_ground]
    distance = np.linalg.norm(offset, axis=-1)
    expected = 1 - SPHERE_RADIUS**2 * offset[:, 2] / distance**3
    error = colors(film)[on_ground][:, 0] - expected
    assert expected.min() < 0.92
    assert abs(error.mean()) < 0.004
    assert np.quantile(np.abs(error), 0.99) < 0.03
    # What is farther away than `distance` hides nothing: here the ball, 0.6 above the box.
    film = shoot(solids(light, {"ambient": 1}, rays=32, distance=0.59), device)
    assert (colors(film)[ground(film)] > 1 - 1e-6).all()


def environment_scene(folder: Path, environment: dict[str, Any], reflection: float, **settings: Any) -> Scene:
    return load_scene(
        {
            "version": 1,
            "formula": {"inline": BALL, "iterations": 8},
            "camera": PERSPECTIVE,
            "image": {"width": 64, "height": 64},
            "lights": [],
            "environment": environment,
            "material": {**BRIGHT, "color": [0.8, 0.5, 0.2], "diffuse": 0.9, "reflection": reflection},
            "renderer": {"detail": 0.25, "firefly_limit": None, **settings},
        },
        folder=folder,
    )


@cache
def shipped(name: str) -> Floats:
    return np.asarray(read_environment(resources.folder("environments") / f"{name}.exr"), np.float64)


def look_up(pixels: Floats, direction: Floats, rotation: float) -> Floats:
    """The map, blended between its pixels: top row +z, middle column +y, to its right +x; `rotation` about z."""
    height, width, _ = pixels.shape
    azimuth = np.arctan2(direction[..., 0], direction[..., 1]) + np.radians(rotation)
    elevation = np.arcsin(np.clip(direction[..., 2], -1, 1))
    x = (0.5 + azimuth / (2 * np.pi)) * width - 0.5
    y = np.clip((0.5 - elevation / np.pi) * height - 0.5, 0, height - 1)
    left, top = np.floor(x).astype(int), np.minimum(np.floor(y).astype(int), height - 2)
    right, below = (x - left)[..., None], (y - top)[..., None]
    rows = [
        pixels[row, left % width] * (1 - right) + pixels[row, (left + 1) % width] * right
        for row in (top, top + 1)
    ]
    return np.asarray(rows[0] * (1 - below) + rows[1] * below)


@pytest.mark.parametrize("rotation", [0.0, 70.0])
def test_what_is_mirrored_and_seen_is_the_environment(
    device: Device, tmp_path: Path, rotation: float
) -> None:
    """The whole picture: past the ball the map itself, on the ball the map in the mirrored direction, right side up."""
    environment = {"name": "dusk", "rotation": rotation, "rays": 1}
    scene = environment_scene(tmp_path, environment, 1.0, bounces=1)
    film = shoot(scene, device)
    origin, direction, _ = rays(scene)
    t, _ = to_sphere(origin, direction, [0, 0, 0], BALL_RADIUS)
    hit = film["A"] == 1
    normal = (origin + np.where(hit, t, 0)[..., None] * direction) / BALL_RADIUS
    mirrored = direction - 2 * (direction * normal).sum(-1, keepdims=True) * normal
    toward = np.where(hit[..., None], mirrored, direction)
    expected = look_up(shipped("dusk"), toward, rotation)
    assert 0.2 < hit.mean() < 0.8
    assert (np.abs(colors(film) - expected) <= 0.005 + 0.02 * expected)[~hit].mean() > 0.999
    # A hit is up to half a footprint off, which a mirror shows near the sun and at the ball's rim.
    assert (np.abs(colors(film) - expected) <= 0.01 + 0.1 * expected)[hit].mean() > 0.88


@pytest.mark.parametrize("reflection", [0.0, 0.4])
def test_under_a_white_sky_a_ball_has_its_own_colour(
    device: Device, tmp_path: Path, reflection: float
) -> None:
    """A uniform map of brightness 1 gives `diffuse` times the colour, and a mirror shows 1."""
    white = np.ones((8, 16), np.float32)
    write_exr(
        tmp_path / "white.exr",
        [{"R": white, "G": white, "B": white}],
        display=(16, 8),
        region=(0, 0, 16, 8),
        channels="RGB",
        half="RGB",
    )
    scene = environment_scene(tmp_path, {"file": "white.exr", "rays": 32}, reflection, bounces=2, samples=4)
    film = shoot(scene, device)
    inside = film["A"] == 1
    expected = (1 - reflection) * 0.9 * np.array([0.8, 0.5, 0.2]) + reflection
    np.testing.assert_allclose(colors(film)[inside].mean(axis=0), expected, rtol=0.005)
    np.testing.assert_allclose(colors(film)[inside], np.broadcast_to(expected, (inside.sum(), 3)), rtol=0.12)
    np.testing.assert_allclose(colors(film)[film["A"] == 0], 1.0, atol=1e-5)
