"""Light on objects that have an equation: computed where they are, however wide pixels are, and not in their shadow."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import colors, normals_of, shoot
from tests.scenes import scene_of
from tests.variants import one_of

WHITE = {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}
DULL = {"ambient": 0, "diffuse": 1, "specular": 0, "color": [1, 1, 1]}
HEIGHT, RADIUS, RADIANCE = 0.02, 0.015, 30.0


def light_of(mode: str) -> dict[str, Any]:
    return {"lighting": {"mode": mode, **({"bounces": 0} if mode == "path" else {})}}


@pytest.mark.parametrize(
    ("mode", "detail", "lanes"), one_of(("path", 1, 4), ("direct", 1, 4), ("path", 0.1, 1))
)
def test_a_lamp_just_above_a_plane(device: Device, mode: str, detail: float, lanes: int) -> None:
    """A ball of radiance L lights a plane by pi L (r / d)^2 cos(angle), also where it is nearer than half a pixel."""
    side, size = 0.8, 16
    floor: dict[str, Any] = {"type": "plane", "position": [0, 0, -0.5], "material": "white"}
    lamp = {
        "type": "sphere",
        "position": [0.013, -0.021, -0.5 + HEIGHT],
        "radius": RADIUS,
        "intensity": RADIANCE,
        "visible": False,
    }
    scene = scene_of(
        NOWHERE,
        {
            "projection": "orthographic",
            "position": [0, 0, 2],
            "target": [0, 0, 0],
            "up": [0, 1, 0],
            "height": side,
        },
        (size, size),
        objects={"floor": floor},
        materials={"white": WHITE},
        material=DULL,
        lights=[lamp],
        renderer={"samples": 256, "detail": detail, "firefly_limit": None},
        background=[0, 0, 0],
        **light_of(mode),
    )
    framebuffer = shoot(scene, device, lanes=lanes)
    steps = 128 * size
    place = (np.arange(steps) + 0.5) / steps * side - side / 2
    x, y = np.meshgrid(place - 0.013, -place + 0.021)
    distance = np.sqrt(x**2 + y**2 + HEIGHT**2)
    light = RADIANCE * (RADIUS / distance) ** 2 * HEIGHT / distance
    expected = light.reshape(size, 128, size, 128).mean((1, 3))
    # Beside the lamp, where as much light is missing as places are too high.
    beside = np.hypot(*np.meshgrid(np.arange(size) - 7.5, np.arange(size) - 7.5)) > 3
    found = colors(framebuffer)[..., 0]
    assert found[beside].sum() == pytest.approx(expected[beside].sum(), rel=0.01)
    assert np.median(found[beside] / expected[beside]) == pytest.approx(1, abs=0.01)


OBJECTS: dict[str, dict[str, Any]] = {
    "sphere": {"type": "sphere", "radius": 0.8},
    "box": {"type": "box", "scale": [1.1, 0.8, 1.4], "rotation": [30, 20, 50]},
    "cylinder": {"type": "cylinder", "scale": [1.8, 1.8, 1.4], "rotation": [40, 10, 0]},
    "ellipsoid": {"type": "sphere", "radius": 1, "scale": [0.9, 0.2, 0.5], "rotation": [30, 20, 50]},
    "plane": {"type": "plane", "normal": [0.3, -0.2, 1]},
    "water": {"type": "water"},
}
# Where objects are, from how far off they are seen, and whether rays are parallel.
PLACES = {
    "near": ((0.0, 0.0, 0.0), 4.0, False),
    "far out": ((150.0, -90.0, 40.0), 4.0, False),
    "from afar": ((0.0, 0.0, 0.0), 3000.0, True),
}
WAYS = one_of(
    ("near", "path", "float32", 4),
    ("far out", "path", "float32", 4),
    ("from afar", "direct", "float32", 4),
    ("far out", "direct", "float64", 4),
    ("near", "direct", "float32", 1),
)


@pytest.mark.parametrize("kind", OBJECTS)
@pytest.mark.parametrize(("place", "mode", "precision", "lanes"), WAYS)
def test_no_object_is_in_its_own_shadow(
    device: Device, kind: str, place: str, mode: str, precision: Precision, lanes: int
) -> None:
    """What faces a sun has the cosine's light, at every angle and from every distance."""
    middle, far, parallel = PLACES[place]
    toward_eye = np.array([0.35, -0.75, 0.55]) / np.linalg.norm([0.35, -0.75, 0.55])
    camera: dict[str, Any] = {"position": (middle + far * toward_eye).tolist(), "target": list(middle)}
    camera |= {"projection": "orthographic", "height": 2.4} if parallel else {"fov": 34}
    # Of waves only a high sun makes no shadows.
    for way in ((0.2, 0.1, -1.0), (0.9, 0.3, -0.1), (-0.7, 0.7, -0.15)):
        if kind == "water" and way[2] > -0.5:
            continue
        scene = scene_of(
            NOWHERE,
            camera,
            (48, 48),
            objects={"body": {**OBJECTS[kind], "position": list(middle), "material": "white"}},
            materials={"white": WHITE},
            material=DULL,
            lights=[{"direction": list(way)}],
            background=[0, 0, 0],
            **light_of(mode),
        )
        framebuffer = shoot(scene, device, precision, lanes=lanes)
        toward = -np.array(way) / math.sqrt(sum(each * each for each in way))
        cosine = np.maximum(normals_of(framebuffer) @ toward, 0)
        on_body = framebuffer["A"] == 1
        assert on_body.sum() > 300
        np.testing.assert_allclose(colors(framebuffer)[on_body][:, 0], cosine[on_body], atol=2e-3)
