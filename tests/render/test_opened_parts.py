"""Planes that open one part of a joined set alone, against distances in NumPy; the light of their faces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from tests.render.joined_oracle import PLACED, SCALE, SIMPLE, Floats, agree, ball, placed, smooth, solids
from tests.render.shots import BALL, PERSPECTIVE, QUICK_BALL, SOLIDS, points_of, shoot
from tests.scenes import scene_of
from tests.variants import one_of

WAYS: dict[str, dict[str, Any]] = {"distance": {}, "steps": {"search": "steps", "step": 0.01}}
# Of a part that stands beside the ball.
MIDDLE, RADIUS = np.array([0.9, -1.2, 0.35]), 0.6
CENTER, NORMAL = [0.95, -1.25, 0.4], np.array([0.5, -0.7, 0.5])
PLANE = {"center": CENTER, "normal": NORMAL.tolist()}
PART = {
    "type": "sphere",
    "position": MIDDLE.tolist(),
    "radius": RADIUS,
    "join": "smooth_union",
    "smoothness": 0.2,
}
INSIDE = [0.6, 0.3, 0.1]


def height(points: Floats) -> Floats:
    """Over the plane."""
    return np.asarray((points - CENTER) @ (NORMAL / np.linalg.norm(NORMAL)))


def part(points: Floats) -> Floats:
    return np.asarray(np.maximum(np.linalg.norm(points - MIDDLE, axis=-1) - RADIUS, height(points)))


def opened(*names: str, **values: Any) -> list[dict[str, Any]]:
    return [{"plane": PLANE, "cut": True, "set": False, "objects": list(names), "opacity": 0, **values}]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("precision", "lanes"), one_of(("float32", None), ("float32", 4), ("float32", 1), ("float64", 4))
)
def test_a_part_is_opened_alone(device: Device, way: str, precision: Precision, lanes: int | None) -> None:
    """What flows into it flows to what is left; other parts stay whole."""
    scene = scene_of(
        QUICK_BALL,
        PERSPECTIVE,
        (96, 80),
        objects={"part": PART, "other": {**SIMPLE["box"][0], "join": "union"}},
        cut_planes=opened("part"),
        renderer={"type": "surface", **WAYS[way]},
    )

    def distance(points: Floats) -> Floats:
        return np.minimum(smooth(ball(points), part(points), 0.2), SIMPLE["box"][1](points))

    agree(device, scene, distance, precision=precision, lanes=lanes, degrees=4.0)


@pytest.mark.parametrize("formula", one_of(QUICK_BALL, BALL), ids=["rule", "jacobian"])
@pytest.mark.parametrize("join", ["union", "intersection"])
def test_a_formula_is_opened_alone(device: Device, formula: dict[str, Any], join: str) -> None:
    other = {"type": "formula", "formula": {"inline": SOLIDS, "iterations": 3}, "scale": SCALE, "join": join}
    plane = {"center": [0.5, -0.2, 0.3], "normal": [1, -0.4, 0.2]}
    scene = scene_of(
        formula,
        PERSPECTIVE,
        (112, 96),
        objects={"other": {**other, **PLACED}},
        cut_planes=[{**opened("other")[0], "plane": plane}],
    )
    normal = np.array(plane["normal"]) / np.linalg.norm(plane["normal"])

    def distance(points: Floats) -> Floats:
        more = np.maximum(placed(solids)(points), (points - plane["center"]) @ normal)
        both = np.minimum if join == "union" else np.maximum
        return np.asarray(both(ball(points), more))

    agree(device, scene, distance, degrees=4.0)


def test_of_a_stack_the_lowest_plane_counts(device: Device) -> None:
    objects = {"part": {**PART, "join": "union"}}
    stack = opened("part", count=3, spacing=-0.1)
    lowest = np.array(CENTER) - 0.2 * NORMAL / np.linalg.norm(NORMAL)
    single = opened("part")
    single[0]["plane"] = {**PLANE, "center": lowest.tolist()}
    pictures = [
        shoot(scene_of(QUICK_BALL, PERSPECTIVE, (64, 64), objects=objects, cut_planes=planes), device)
        for planes in (stack, single)
    ]
    assert np.isclose(pictures[0]["Z"], pictures[1]["Z"], rtol=1e-5).mean() > 0.999


@pytest.mark.parametrize("paths", [False, True], ids=["phong", "paths"])
def test_its_face_has_the_planes_colour_and_even_light(device: Device, paths: bool) -> None:
    """Along paths a sun lights it by the cosine, without spots of its own shadow."""
    lighting = {"mode": "path", "bounces": 1} if paths else {"mode": "direct"}
    towards = np.array([0.4, -0.8, 0.5])
    scene = scene_of(
        QUICK_BALL,
        PERSPECTIVE,
        (96, 96),
        objects={"part": {**PART, "join": "union"}},
        cut_planes=opened("part", colors={"inside": INSIDE}),
        lighting=lighting,
        lights=[{"direction": (-towards).tolist()}],
        background=[0, 0, 0],
        renderer={"type": "surface", "samples": 4},
    )
    picture = shoot(scene, device)
    points = points_of(picture)
    on = (np.abs(height(points)) < 2e-3) & (np.linalg.norm(points - MIDDLE, axis=-1) < RADIUS - 0.05)
    assert on.sum() > 60
    seen = np.stack([picture[name] for name in "RGB"], axis=-1)[on]
    cosine = towards @ NORMAL / np.linalg.norm(towards) / np.linalg.norm(NORMAL) if paths else 1.0
    assert np.allclose(seen, cosine * np.array(INSIDE), rtol=2e-3)


def test_its_face_has_a_material(device: Device) -> None:
    scene = scene_of(
        QUICK_BALL,
        PERSPECTIVE,
        (64, 64),
        objects={"part": {**PART, "join": "union"}},
        cut_planes=opened("part", material="glow"),
        materials={"glow": {"base": {"weight": 0}, "specular": {"weight": 0}, "emission": {"luminance": 2}}},
        lighting={"mode": "path", "bounces": 0},
        lights=[],
        background=[0, 0, 0],
    )
    picture = shoot(scene, device)
    points = points_of(picture)
    on = (np.abs(height(points)) < 2e-3) & (np.linalg.norm(points - MIDDLE, axis=-1) < RADIUS - 0.05)
    assert on.sum() > 25
    assert np.allclose(picture["R"][on], 2, rtol=1e-3)
    off = (picture["A"] == 1) & (np.abs(height(points)) > 0.05)
    assert picture["R"][off].max() == 0
