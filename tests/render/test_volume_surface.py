"""The surface of a grid: balls that are filled, and grids of others, against the sphere; light, shadows, samples, zooms."""

from __future__ import annotations

from pathlib import Path
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
    Floats,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
    view_of,
)
from tests.render.volumes import LIT, check_ball, keep, middles, volume_scene

BOX = {"center": [0, 0, 0], "size": 2.5}
# Not a cube, sides of voxels 0.05, 0.0625 and 0.04.
LONG = {"center": [0.1, -0.05, 0.02], "size": [2.5, 3.0, 2.4]}


def lit(points: Floats, normals: Floats, to_viewer: Floats, tint: Any) -> Floats:
    """The thesis's Eq. 5 with the lights of `LIT`, without shadows."""
    total = np.zeros_like(points)
    for light in LIT["lights"]:
        if light.get("type") == "point":
            toward = np.array(light["position"]) - points
        else:
            toward = -np.array(light["direction"], float) + 0 * points
        toward = toward / np.linalg.norm(toward, axis=-1, keepdims=True)
        facing = (normals * toward).sum(-1, keepdims=True)
        mirrored = 2 * facing * normals - toward
        highlight = np.maximum((mirrored * to_viewer).sum(-1, keepdims=True), 0) ** 32
        body = tint * (0.1 + 0.7 * np.maximum(facing, 0)) + 0.2 * highlight * (facing > 0)
        total += np.array(light.get("color", [1, 1, 1])) * body
    return total


@pytest.mark.parametrize("level", [None, 0.6, -0.2])
@pytest.mark.parametrize("dtype", [np.float32, np.int16, np.uint8])
def test_the_radius_follows_the_level(
    device: Device, tmp_path: Path, dtype: Any, level: float | None
) -> None:
    """Values are distances from the middle, negated: each level is a sphere. As of a scan, they may be whole numbers."""
    corner, voxel = np.full(3, -1.5), 0.0625
    depth = -np.linalg.norm(middles((48, 48, 48), corner, [voxel] * 3), axis=-1)
    scale, zero = {np.float32: (1, 0), np.int16: (1000, 1500), np.uint8: (90, 255)}[dtype]
    values = (scale * depth + zero).round(6 if dtype == np.float32 else 0).astype(dtype)
    keep(tmp_path / "depth.nrrd", values, corner, [voxel] * 3)
    wanted = None if level is None else float(scale * (level - 1) + zero)
    scene = volume_scene(PERSPECTIVE, folder=tmp_path, file="depth.nrrd", level=wanted)
    framebuffer = shoot(scene, device)
    low, high = float(values.min()), float(values.max())
    radius = 1 - level if level is not None else (zero - (low + high) / 2) / scale
    found = np.linalg.norm(points_of(framebuffer), axis=-1)[framebuffer["A"] == 1]
    assert len(found) > 100
    # Between voxels, along a straight line, a distance is met to voxel^2 / (8 radius); rounding moves it by half a value.
    assert np.abs(found - radius).max() < 0.0035 / radius + 0.5 / scale * (dtype != np.float32)


@pytest.mark.parametrize("store", ["byte", "float"])
def test_a_level_of_counts(device: Device, store: str) -> None:
    """Of z^2 the smooth count at radius r is log2(log R / log r): a level is a sphere."""
    level = 3.25
    scene = volume_scene(
        ORTHOGRAPHIC,
        box={"size": 5},
        resolution=96,
        value="iterations",
        store=store,
        level=level,
        formula={**BALL, "distance_bailout": 100},
    )
    radius = 100 ** (2.0**-level)
    framebuffer = shoot(scene, device)
    found = np.linalg.norm(points_of(framebuffer), axis=-1)[framebuffer["A"] == 1]
    assert len(found) > 500
    assert np.abs(found - radius).max() < (0.01 if store == "float" else 0.03)


PHONG = {"ambient": 0.1, "diffuse": 0.7, "specular": 0.2, "shininess": 32}
LOOK = {**LIT, "material": {**LIT["material"], **PHONG}}


@pytest.mark.parametrize(
    ("box", "resolution", "keys", "degrees"),
    [
        (BOX, 64, {"value": "inside"}, 12),
        (BOX, 64, {"value": "coverage"}, 4),
        (LONG, [50, 48, 60], {"value": "coverage"}, 5),
        (LONG, [50, 48, 60], {"value": "inside", "normals": "exact"}, 5),
    ],
    ids=["inside", "coverage", "long box", "exact"],
)
@pytest.mark.parametrize("camera", CAMERAS)
def test_a_filled_ball(
    device: Device, camera: str, box: dict[str, Any], resolution: Any, keys: dict[str, Any], degrees: float
) -> None:
    """Rays hit within a voxel of the ball; depth, point, normal, light and coverage are those of the hit."""
    scene = volume_scene(CAMERAS[camera], box=box, resolution=resolution, look=LOOK, **keys)
    framebuffer = shoot(scene, device)
    origin, direction, _ = rays(scene)
    distance, nearest = to_sphere(origin, direction, (0, 0, 0), BALL_RADIUS)
    hit = framebuffer["A"] == 1
    voxel = 0.0625
    assert hit[nearest < BALL_RADIUS - voxel].all()
    assert not hit[nearest > BALL_RADIUS + voxel].any()
    np.testing.assert_array_equal(framebuffer["A"], hit)
    points = points_of(framebuffer)
    assert np.abs(np.linalg.norm(points, axis=-1) - BALL_RADIUS)[hit].max() < voxel
    # On the pixel's own ray, at its depth.
    t = ((points - origin) * direction).sum(-1)
    assert np.linalg.norm(origin + t[..., None] * direction - points, axis=-1)[hit].max() < 1e-5
    eye = np.array(scene.camera.position)
    depth = (points - eye) @ view_of(scene).axis
    np.testing.assert_allclose(framebuffer["Z"][hit], depth[hit], atol=1e-5)
    clear = hit & (nearest < 0.8 * BALL_RADIUS)
    assert np.abs(t - distance)[clear].max() < voxel / 0.6
    # Normals.
    normals = normals_of(framebuffer)
    np.testing.assert_allclose(np.linalg.norm(normals[hit], axis=-1), 1, atol=1e-5)
    cosine = (normals * points).sum(-1)[hit] / np.linalg.norm(points, axis=-1)[hit]
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert np.percentile(angle, 95) < degrees
    assert angle.max() < 2.5 * degrees
    # Light, from the very normals.
    wanted = lit(points, normals, -direction, np.array([0.8, 0.6, 0.4]))
    np.testing.assert_allclose(stacked(framebuffer, "RGB")[hit], wanted[hit], atol=2e-4)
    # Nothing where nothing is, but the background.
    np.testing.assert_array_equal(stacked(framebuffer, "RGB")[~hit], 0.5)
    assert np.isposinf(framebuffer["Z"][~hit]).all()
    assert not stacked(framebuffer, [n for n in CHANNELS if n[0] in "NPi"])[~hit].any()
    assert np.isfinite(stacked(framebuffer, [n for n in CHANNELS if n != "Z"])).all()


def test_color_by_normal(device: Device) -> None:
    flat = {**LIT, "material": {"ambient": 0.5, "diffuse": 0, "specular": 0}, "coloring": {"by": "normal"}}
    scene = volume_scene(PERSPECTIVE, box=BOX, resolution=64, value="coverage", look=flat)
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] == 1
    # Two lights: 0.5 white and 0.5 of a bluish one.
    wanted = 0.5 * (0.5 * normals_of(framebuffer) + 0.5) * (1 + np.array([0.2, 0.4, 0.9]))
    np.testing.assert_allclose(stacked(framebuffer, "RGB")[hit], wanted[hit], atol=1e-5)
    assert hit.sum() > 500


@pytest.mark.parametrize("offset", [0.0, -500.0, 300.0])
@pytest.mark.parametrize(
    "colors", [None, [{"at": -1000, "color": [1, 1, 1]}, {"at": 9000, "color": [1, 1, 1]}]]
)
def test_the_surface_of_a_given_grid(
    device: Device, tmp_path: Path, offset: float, colors: list[dict[str, Any]] | None
) -> None:
    """It lies halfway between the least and the largest value, wherever those lie and however they are coloured."""
    corner, spacing, sides = np.array([-1.3, -1.1, -1.2]), np.array([0.0625, 0.05, 0.08]), (42, 44, 31)
    distance = np.linalg.norm(middles(sides, corner, spacing), axis=-1) - 0.9
    values = (offset - 100 * np.clip(distance, -0.5, 0.5)).astype(np.float32)
    keep(tmp_path / "a.nrrd", values, corner, spacing)
    scene = volume_scene(
        PERSPECTIVE, folder=tmp_path, file="a.nrrd", transfer={"color": colors}, normal_radius=0
    )
    framebuffer = shoot(scene, device)
    check_ball(framebuffer, scene, np.zeros(3), 0.9, 0.08, degrees=1.5)
    hit = framebuffer["A"] == 1
    # A step of half a voxel, halved five times, and the curve between voxels.
    assert np.abs(np.linalg.norm(points_of(framebuffer), axis=-1) - 0.9)[hit].max() < 0.004
    # Close to the level, on its inner side.
    np.testing.assert_allclose(framebuffer["iterations"][hit], offset, atol=0.4)


def test_a_grid_of_one_layer(device: Device, tmp_path: Path) -> None:
    """A picture as a volume: one voxel deep along each axis in turn."""
    square = np.zeros((20, 30), np.uint8)
    square[5:15, 10:25] = 200
    camera = {"projection": "orthographic", "height": 2.0}
    places: list[tuple[Any, list[float], list[float]]] = [
        (square[None], [0.05, 0.05, 0.4], [0, 0, 3]),
        (square[:, None], [0.05, 0.4, 0.05], [0, -3, 0]),
        (square[:, :, None], [0.4, 0.05, 0.05], [3, 0, 0]),
    ]
    for number, (values, spacing, position) in enumerate(places):
        size = np.array(values.shape[::-1]) * spacing
        keep(tmp_path / f"{number}.nrrd", values, -size / 2, spacing)
        up = [0, 1, 0] if number == 0 else [0, 0, 1]
        scene = volume_scene(
            {**camera, "position": position, "up": up},
            folder=tmp_path,
            file=f"{number}.nrrd",
            size=(40, 40),
            interpolation="nearest",
        )
        framebuffer = shoot(scene, device)
        wanted = np.zeros((40, 40))
        wanted[10 + 5 : 10 + 15, 5 + 10 : 5 + 25] = 1
        # Rows of the picture run downward, those of the array upward.
        np.testing.assert_array_equal(framebuffer["A"], wanted[::-1])
