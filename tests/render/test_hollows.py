"""Formulas that are cut out: hollows in which no distance is known, against distances and inside tests in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.scene.model import Scene
from tests.render.joined_oracle import (
    Floats,
    a_sphere,
    agree,
    beside_a_rim,
    marched,
    normal_at,
)
from tests.render.shots import BALL, BALL_RADIUS, QUICK_BALL, normals_of, points_of, rays, shoot
from tests.scenes import scene_of
from tests.voxels.joined import belongs

# The scene's own formula is a large ball; balls are cut out of it, and one floats in the hollow.
SIZE = 0.7
HOLE, OTHER_HOLE, PEARL = [0.1, -0.75, 0.45], [-0.75, -0.3, 0.6], [0.45, -0.6, 0.3]
CAMERA = {"position": [0.6, -3.6, 2.4], "target": [0, -0.2, 0.2], "up": [0.1, 0, 1], "fov": 36}
WITHIN = {"position": HOLE, "target": [-0.1, 0.5, 0.1], "fov": 80}


def ball_object(formula: dict[str, Any], place: list[float], scale: float, **values: Any) -> dict[str, Any]:
    """A ball that is a formula's set: how deep places are in it nobody knows."""
    return {
        "type": "formula",
        "formula": {"inline": formula, "iterations": 8},
        "position": place,
        "scale": scale,
        **values,
    }


def hollow_scene(
    formula: dict[str, Any], camera: dict[str, Any], size: tuple[int, int], **sections: Any
) -> Scene:
    objects = {
        "hole": ball_object(formula, HOLE, SIZE, join="cut", rotation=[10, 20, 30]),
        "other": ball_object(formula, OTHER_HOLE, 0.4, join="cut"),
        "pearl": ball_object(formula, PEARL, 0.15),
    }
    return scene_of(formula, camera, size, objects=objects, **sections)


def hollowed(points: Floats) -> Floats:
    """The distance to what is left, or less."""
    holes = [
        a_sphere(place, scale * BALL_RADIUS)(points) for place, scale in ((HOLE, SIZE), (OTHER_HOLE, 0.4))
    ]
    left = np.maximum(a_sphere([0, 0, 0], BALL_RADIUS)(points), -np.minimum(*holes))
    return np.asarray(np.minimum(left, a_sphere(PEARL, 0.15 * BALL_RADIUS)(points)))


WAYS: dict[str, dict[str, Any]] = {"distance": {"step": 0.02}, "steps": {"search": "steps", "step": 0.01}}


@pytest.mark.parametrize("camera", [CAMERA, WITHIN], ids=["outside", "within"])
@pytest.mark.parametrize("formula", [BALL, QUICK_BALL], ids=["jacobian", "rule"])
def test_balls_that_are_formulas(device: Device, formula: dict[str, Any], camera: dict[str, Any]) -> None:
    renderer = {"type": "surface", **WAYS["distance"]}
    agree(device, hollow_scene(formula, camera, (112, 96), renderer=renderer), hollowed)


@pytest.mark.combination
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("points", [1, 9])
@pytest.mark.parametrize(
    ("precision", "lanes"), [("float32", 1), ("float32", 4), ("float32", 16), ("float64", 1), ("float64", 4)]
)
def test_each_search_and_number_type(
    device: Device, way: str, points: int, precision: Precision, lanes: int
) -> None:
    renderer = {"type": "surface", "points": {"count": points, "pattern": "grid"}, **WAYS[way]}
    scene = hollow_scene(BALL, CAMERA, (96, 80), renderer=renderer)
    degrees = 6.0 if points > 1 or way == "steps" else 1.0
    agree(device, scene, hollowed, precision=precision, lanes=lanes, degrees=degrees)


@pytest.mark.parametrize("lamp", [[0.35, -1.0, 0.75], [3.0, -1.2, 2.2]], ids=["within", "outside"])
def test_shadows_in_a_hollow(device: Device, lamp: list[float]) -> None:
    """What a lamp lights is what it sees."""
    scene = hollow_scene(
        BALL,
        CAMERA,
        (112, 96),
        renderer={"type": "surface", **WAYS["distance"]},
        lights=[{"type": "point", "position": lamp}],
        material={"color": [1, 1, 1], "ambient": 0, "diffuse": 1, "specular": 0},
    )
    framebuffer = shoot(scene, device)
    origin, direction, footprint = rays(scene)
    t = marched(hollowed, origin, direction)
    met = np.isfinite(t)
    points = origin + np.where(met, t, 0)[..., None] * direction
    normal = normal_at(hollowed, points)
    # Shadow rays begin three footprints above the surface.
    over = points + (3 * footprint * np.where(met, t, 0))[..., None] * normal
    way = np.array(lamp) - over
    far = np.linalg.norm(way, axis=-1)
    toward = way / far[..., None]
    facing = (normal * (np.array(lamp) - points)).sum(-1) / np.linalg.norm(np.array(lamp) - points, axis=-1)
    free = marched(hollowed, over, toward, far=20.0) > far
    lit = met & free & (facing > 0)
    plain = met & ~beside_a_rim(met) & ~beside_a_rim(lit) & (np.abs(facing) > 0.15)
    assert (plain & lit).sum() > 500
    assert (plain & ~lit).sum() > 100
    assert ((framebuffer["R"] > 0)[plain] == lit[plain]).mean() > 0.99
    np.testing.assert_allclose(np.median(framebuffer["R"][plain & lit] / facing[plain & lit]), 1, atol=0.01)


def mould(**sections: Any) -> Scene:
    """A block of which a Mandelbulb was cut."""
    block = {
        "variables": ["x", "y", "z"],
        "map": ["x", "y", "z"],
        "add": "none",
        "degree": 1,
        "shape": "max(abs(x) - 1.2, abs(y) - 1.2, abs(z) - 1)",
        "bounds": {"center": [0, 0, 0], "radius": 2.1},
        "bailout": 10,
    }
    bulb = {"type": "formula", "formula": {"name": "mandelbulb", "iterations": 7}, "position": [0, -1, 0.5]}
    camera = {"position": [0.9, -4.6, 2.2], "target": [0, -0.6, 0.3], "fov": 30}
    usual: dict[str, Any] = {"iterations": 1, "objects": {"bulb": {**bulb, "join": "cut"}}}
    return scene_of(block, camera, (160, 128), **{**usual, **sections})


def ways(scene: Scene, t: Floats, direction: Floats, origin: Floats) -> npt.NDArray[np.bool_]:
    """Which places of rays belong to the set, at distances of shape (rays, places)."""
    return np.asarray(belongs(scene, origin[:, None] + t[..., None] * direction[:, None]))


def test_a_mould_of_a_fractal(device: Device) -> None:
    """Every hit has the set within a footprint, and no ray goes through three footprints of it before."""
    scene = mould(renderer={"type": "surface", "step": 0.01})
    framebuffer = shoot(scene, device)
    origin, direction, footprint = rays(scene)
    hit = (framebuffer["A"] == 1) & ~beside_a_rim(framebuffer["A"] == 1)
    chosen = np.flatnonzero(hit)[:: max(1, int(hit.sum() // 1500))]
    o, d = origin.reshape(-1, 3)[chosen], direction.reshape(-1, 3)[chosen]
    t = np.linalg.norm(points_of(framebuffer).reshape(-1, 3)[chosen] - o, axis=-1)
    width = footprint.reshape(-1)[chosen] * t
    around = t[:, None] + width[:, None] * np.linspace(-0.1, 1, 45)
    assert ways(scene, around, d, o).any(axis=1).mean() > 0.99
    # Of the way before the hit, places a third of a footprint apart.
    before = t[:, None] - width[:, None] * np.arange(1.5, 90, 1 / 3)
    within = ways(scene, before, d, o)
    thick = np.logical_and.reduce([within[:, i : within.shape[1] - 9 + i] for i in range(9)])
    assert thick.any(axis=1).sum() == 0
    walls = np.linalg.norm(points_of(framebuffer).reshape(-1, 3)[chosen] - [0, -1, 0.5], axis=-1) < 1.15
    assert walls.sum() > 300
    facing = (normals_of(framebuffer).reshape(-1, 3)[chosen] * d).sum(-1)
    assert (facing[walls] < 0.11).all()
