"""Many things that shine, which stand in a tree as lamps do: beside each weighed by itself, and a closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from clfractal.shading import light_tree
from clfractal.shading.emitter_tree import shining_of
from tests.render.glowing import FLOOR, MATERIALS, blocks, colors, lit
from tests.render.shots import Floats, points_of, shoot

pytestmark = pytest.mark.light

KINDS: list[dict[str, Any]] = [
    {"type": "sphere", "radius": 0.15},
    {"type": "box", "size": [0.3, 0.2, 0.1], "rotation": [20, 30, 50]},
    {"type": "cylinder", "radius": 0.05, "height": 0.5, "rotation": [80, 10, 0]},
    {"type": "torus", "radius": 0.15, "tube": 0.05, "rotation": [50, 0, 0]},
]


def dark(luminance: Any, color: list[float]) -> dict[str, Any]:
    emission = {"luminance": luminance, "color": color}
    return {"base": {"color": [0, 0, 0]}, "specular": {"weight": 0}, "emission": emission}


def balls() -> tuple[Floats, dict[str, Any]]:
    places = np.random.default_rng(8).uniform([-1.5, -1.5, 0.6], [1.5, 1.5, 1.2], (50, 3))
    objects = {
        f"ball{number}": {"radius": 0.01, "position": place.tolist(), "material": f"glow{number % 3}"}
        for number, place in enumerate(places)
    }
    return places, objects


def test_small_balls_light_a_floor(device: Device) -> None:
    """Each its light by the square of the distance and the cosine."""
    places, objects = balls()
    materials = {**MATERIALS, **{f"glow{n}": dark(1000 * (n + 1), [1, 1, 1]) for n in range(3)}}
    scene = lit(objects, 256, materials=materials)
    assert len(shining_of(scene).nodes) == 99
    film = shoot(scene, device)
    points = points_of(film).reshape(-1, 3)
    right = np.zeros(len(points))
    for number, place in enumerate(places):
        way = place - points
        square = (way**2).sum(axis=1)
        right += 1000 * (number % 3 + 1) * 1e-4 * np.maximum(way[:, 2], 0) / square**1.5
    found = film["R"].astype(float)
    assert found.mean() == pytest.approx(right.mean(), rel=0.005)
    share = blocks(found[..., None]) / blocks(right.reshape(24, 24, 1))
    assert np.abs(share - 1).max() < 0.03


def crowd(samples: int) -> Scene:
    """Things of all shapes, some of which are sought, over a gloss."""
    random = np.random.default_rng(9)
    objects: dict[str, Any] = {}
    for number in range(28):
        place = [*random.uniform(-1.2, 1.2, 2), random.uniform(0.3, 1.0)]
        name = ("red", "map")[number // 4 % 2]
        objects[f"it{number}"] = {
            **KINDS[number % 4],
            "position": [float(x) for x in place],
            "material": name,
        }
    steel = {"base": {"color": [0.8, 0.8, 0.8], "metalness": 1}, "specular": {"roughness": 0.35}}
    rises = {"by": "height", "range": [0, 1.2], "curve": [[0, 1], [1, 6]]}
    return lit(
        {**objects, "floor": FLOOR},
        samples,
        2,
        camera={"position": [0.5, -3.2, 2.2], "target": [0, 0, 0.2], "fov": 40},
        materials={
            **MATERIALS,
            "white": steel,
            "red": dark(4, [1, 0.3, 0.2]),
            "map": dark(rises, [0.3, 0.6, 1]),
        },
    )


def test_the_tree_changes_nothing_but_noise(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for most in (light_tree.MOST_WEIGHED, 99):
        monkeypatch.setattr(light_tree, "MOST_WEIGHED", most)
        scene = crowd(192)
        assert bool(len(shining_of(scene).nodes)) == (most < 99)
        found.append(colors(scene, device))
    one, other = (blocks(each).mean(axis=-1) for each in found)
    assert found[0].mean() == pytest.approx(found[1].mean(), rel=0.005)
    np.testing.assert_allclose(one, other, rtol=0.04, atol=0.01 * other.mean())
