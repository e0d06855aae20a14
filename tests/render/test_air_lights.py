"""What fog scatters of objects that shine, many lamps, balls on the set and a sky's sun, against sums along the rays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.shading.set_lights import set_lights_of
from tests.render.foggy import COLOR, EVEN, LAYER, MIST, agree, both, foggy, of_ball
from tests.render.media import phase
from tests.render.shots import QUICK_BALL, Floats, rays, shoot


def test_objects_that_shine(device: Device) -> None:
    """Two balls, one of them faint and near."""
    glow = {"base": {"color": [0, 0, 0]}, "specular": {"weight": 0}}
    materials = {
        "bright": {**glow, "emission": {"luminance": 60, "color": COLOR.tolist()}},
        "faint": {**glow, "emission": {"luminance": 8}},
    }
    objects = {
        "far": {"type": "sphere", "position": [-1.4, 1.5, 0.3], "radius": 0.08, "material": "bright"},
        "near": {"type": "sphere", "position": [0.9, 0.2, 0.6], "radius": 0.05, "material": "faint"},
    }
    scene = foggy(LAYER, materials=materials, objects=objects)
    shines = both(
        of_ball(scene, [-1.4, 1.5, 0.3], 0.08, 60 * COLOR), of_ball(scene, [0.9, 0.2, 0.6], 0.05, [8, 8, 8])
    )
    origin, way, _ = rays(scene)
    clear = np.ones(way.shape[:2], bool)
    for each in objects.values():
        place: Any = each["position"]
        offset = np.asarray(place) - origin
        along = (offset * way).sum(axis=-1)
        clear &= np.linalg.norm(offset - along[..., None] * way, axis=-1) > 0.3
    agree(scene, device, shines, clear)


@pytest.mark.parametrize("fog", [MIST, LAYER], ids=["mist", "layer"])
def test_many_lamps(device: Device, fog: dict[str, Any]) -> None:
    origin, way, _ = rays(foggy(fog))
    tried = np.random.default_rng(8).uniform(-3, 3, (400, 3)) - [0, 1, 0]
    offset = tried - np.broadcast_to(origin, way.shape)[0, 0]
    along = np.maximum(np.einsum("hwi,ni->hwn", way, offset), 0)[..., None]
    beside = np.linalg.norm(offset - along * way[:, :, None], axis=-1).min(axis=(0, 1))
    # Near rays even a part of a pixel matters.
    places = tried[beside > 0.4][:24]
    lights = [
        {
            "type": "point",
            "position": place.tolist(),
            "falloff": "inverse_square",
            "intensity": 0.05 * (1 + number % 3),
            "color": COLOR.tolist() if number % 2 else [1, 1, 1],
            "shadow": False,
        }
        for number, place in enumerate(places)
    ]
    scene = foggy(fog, lights=lights, renderer={"samples": 1024})
    small = 1e-3
    shines = both(
        *(
            of_ball(
                scene,
                place,
                small,
                0.05 * (1 + number % 3) / small**2 * (COLOR if number % 2 else np.ones(3)),
            )
            for number, place in enumerate(places)
        )
    )
    agree(scene, device, shines)


@pytest.mark.parametrize("mode", [{"mode": "path", "bounces": 0}, {"mode": "direct"}], ids=["path", "direct"])
def test_balls_on_the_set(device: Device, mode: dict[str, Any]) -> None:
    """Before the background, since the set hides what is behind it."""
    lights = [
        {
            "type": "set",
            "trap": {"shape": "plane", "center": [0, 0, 0]},
            "threshold": 0.4,
            "count": 40,
            "radius": 0.02,
            "intensity": 60,
            "color": COLOR.tolist(),
            "shadow": False,
            "visible": False,
        }
    ]
    scene = foggy(EVEN, lights=lights, formula=QUICK_BALL, lighting=mode)
    found = set_lights_of(scene)
    assert found is not None
    shines = both(*(of_ball(scene, ball[:3], ball[3], ball[4:7]) for ball in found.balls))
    beside = shoot(scene, device)["A"] == 0
    agree(scene, device, shines, beside)


@pytest.mark.parametrize("mode", [{"mode": "path", "bounces": 0}, {"mode": "direct"}], ids=["path", "direct"])
def test_the_sun_of_a_sky(device: Device, mode: dict[str, Any]) -> None:
    environment = {
        "sky": {"sun_elevation": 25, "sun_azimuth": 100},
        "background": False,
        "intensity": 0.7,
        "rotation": 30,
    }
    scene = foggy(MIST, environment=environment, lighting=mode)
    sun = scene.surroundings.sun  # type: ignore[union-attr]
    assert sun is not None
    angle = math.radians(30)
    x, y, z = sun.toward
    toward = np.array(
        [math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y, z]
    )

    def shines(points: Floats, way: Floats) -> Floats:
        bright = 0.7 * np.array(sun.irradiance) * phase(np.array([toward @ way]), 0.6)
        return np.broadcast_to(bright, points.shape)

    agree(scene, device, shines)
