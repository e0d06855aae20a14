"""Cut planes in a translucent volume: each place of a ray and each quad in its order, by NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from tests.render.quads import BACKGROUND, COLORS, LOOK, TINT, alpha_of, escape_tint, met, plane
from tests.render.shots import (
    BALL_RADIUS,
    CAMERAS,
    Floats,
    points_of,
    rays,
    shoot,
    stacked,
)
from tests.render.volumes import keep, middles, to_box, value_at, volume_scene

CORNER, VOXEL, SIDES = np.array([-1.0, -1.0, -1.0]), 0.0625, (32, 32, 32)
OPACITY = 0.06


def fog_scene(folder: Path, camera: dict[str, Any], planes: list[dict[str, Any]]) -> tuple[Scene, Any]:
    """Fog that grows denser along x, and its values."""
    values = (0.5 + 0.4 * middles(SIDES, CORNER, [VOXEL] * 3)[..., 0]).astype(np.float32)
    keep(folder / "fog.nrrd", values, CORNER, [VOXEL] * 3)
    transfer = {"opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": OPACITY}]}
    scene = volume_scene(
        camera,
        folder=folder,
        file="fog.nrrd",
        look=LOOK,
        transfer=transfer,
        opacity_limit=1,
        sections={"cut_planes": planes},
    )
    return scene, values


def expected(scene: Scene, values: Any) -> tuple[Floats, Floats, Any, Floats]:
    """Colour and coverage, where they are certain, and where along the ray half of the light is stopped."""
    origin, direction, _ = rays(scene)
    quads, sure = [], np.ones(origin.shape[:2], bool)
    start, behind = np.zeros(sure.shape), np.zeros(sure.shape, bool)
    face_tint = np.zeros(origin.shape)
    for index, each in enumerate(scene.cut_planes):
        seen, t, room = met(scene, index)
        tint, rim = escape_tint(scene, origin + t[..., None] * direction)
        sure &= (~seen | (rim > 1e-4)) & (room > 1e-4)
        if each.cut:
            # Seen from its front in these tests: the ray begins at it; inside the ball and the grid there is a face.
            there = origin + t[..., None] * direction
            start, face_tint = t, tint
            behind = (np.linalg.norm(there, axis=-1) < BALL_RADIUS) & (np.abs(there).max(-1) < 1)
            sure &= (rim > 1e-4) & (np.abs(np.abs(there).max(-1) - 1) > 1e-4)
        quads.append((np.where(seen, t, np.inf), alpha_of(each, tint), tint))
    near, far = to_box(origin, direction, CORNER, VOXEL * np.array(SIDES))
    near = np.maximum(near, start)
    step = 0.5 * VOXEL
    through, color, half = np.ones(sure.shape), np.zeros(origin.shape), np.full(sure.shape, np.inf)

    def add(alpha: Floats, tint: Floats, t: Floats) -> None:
        nonlocal through, color, half
        color = color + (through * alpha)[..., None] * tint
        through = through * (1 - alpha)
        half = np.where((half == np.inf) & (through <= 0.5) & (alpha > 0), t, half)

    def quads_between(low: Floats, high: Floats) -> None:
        for t, opacity, tint in sorted(
            quads, key=lambda quad: float(np.median(quad[0][np.isfinite(quad[0])]))
        ):
            add(np.where((t >= low) & (t < high), opacity, 0), tint, t)

    quads_between(np.zeros(sure.shape), np.minimum(near, np.where(behind, start, np.inf)))
    last = np.minimum(near, np.where(behind, start, np.inf))
    add(behind * 1.0, face_tint, start)
    for number in range(int(np.sqrt(3) * 32 / 0.5) + 2):
        t = near + number * step
        quads_between(last, t)
        last = t
        going = (t < far) & ~behind
        places = (origin + t[..., None] * direction - CORNER) / VOXEL
        opacity = OPACITY * value_at(values, np.where(going[..., None], places, 0))
        add(np.where(going, 1 - (1 - opacity) ** 0.5, 0), TINT + 0 * origin, t)
    quads_between(last, np.full(sure.shape, np.inf))
    return color + through[..., None] * BACKGROUND, 1 - through, sure, half


def check(device: Device, scene: Scene, values: Any) -> tuple[Framebuffer, Floats, Any, Floats]:
    """Gives the picture, its coverage, where that is certain, and where half of the light is stopped."""
    framebuffer = shoot(scene, device)
    color, coverage, sure, half = expected(scene, values)
    assert sure.mean() > 0.8
    np.testing.assert_allclose(framebuffer["A"][sure], coverage[sure], atol=3e-4)
    np.testing.assert_allclose(stacked(framebuffer, "RGB")[sure], color[sure], atol=1e-3)
    return framebuffer, coverage, sure, half


# Of planes at one distance.
PLACE = ([0.1, 0.1, 0.05], [0.1, -1, 0.2])


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("cut", [False, True])
def test_quads_in_fog(device: Device, tmp_path: Path, camera: str, cut: bool) -> None:
    """One near the front, one deep in the fog; the first may cut the ball open."""
    planes = [
        plane([0.1, -0.3, 0.1], [0.2, -1, 0.3], 0.25, cut=cut, width=1.2),
        plane([0, 0.6, -0.1], [0.1, -1, 0.2], 0.6),
    ]
    scene, values = fog_scene(tmp_path, CAMERAS[camera], planes)
    framebuffer, coverage, sure, half = check(device, scene, values)
    # Where half of the light is stopped, by fog, a quad or a face.
    origin, direction, _ = rays(scene)
    found = np.isfinite(framebuffer["Z"])
    t = ((points_of(framebuffer) - origin) * direction).sum(-1)
    off = np.abs(t - half)[sure & found & np.isfinite(half)]
    assert (found == np.isfinite(half))[sure].mean() > 0.98
    assert (off < 1e-4).mean() > 0.97
    assert off.max() < VOXEL
    if cut:
        face = sure & found & (np.abs(framebuffer["iterations"] - 8) < 1e-6)
        np.testing.assert_allclose(stacked(framebuffer, "RGB")[face & (coverage == 1)].max(), 0.9, atol=1e-4)
        assert (np.abs(stacked(framebuffer, "RGB") - np.array(COLORS["inside"])).max(-1) < 1e-4).sum() > 150


@pytest.mark.parametrize(
    ("camera", "planes"),
    [
        ("perspective", [plane(*PLACE, 0.5, inside_opacity=0.0), plane(*PLACE, 0.6)]),
        ("orthographic", [plane([0, 0.2, 0], [0, -1, 0], 1.0)] * 2),
    ],
    ids=["hole", "opaque"],
)
def test_quads_at_one_distance_in_fog(
    device: Device, tmp_path: Path, camera: str, planes: list[dict[str, Any]]
) -> None:
    """All of them are seen, the list's first in front, and the set on one is a hole in it; fog that stops less than half of
    the light is seen before an opaque one all the same."""
    check(device, *fog_scene(tmp_path, CAMERAS[camera], planes))
