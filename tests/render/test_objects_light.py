"""Light on objects and between them: shadows, mirrors, fog, energy along paths, and closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from tests.render.objects_oracle import NOWHERE, light_of, met
from tests.render.shots import BALL, PERSPECTIVE, colors, normals_of, points_of, rays, shoot
from tests.scenes import scene_of
from tests.variants import combinations, one_of

WHITE = {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}
FLOOR = {"type": "plane", "position": [0, 0, -0.5], "material": "white"}
BALL_OBJECT = {"type": "sphere", "position": [0.2, -0.1, 0.3], "radius": 0.4, "material": "white"}
DULL = {"ambient": 0, "diffuse": 1, "specular": 0, "color": [1, 1, 1]}
FROM_ABOVE = {**PERSPECTIVE, "position": [1.0, -1.8, 2.0]}


@pytest.mark.parametrize(
    ("mode", "lanes"), [("direct", None), ("path", None), ("direct", 1), *combinations([("path", 1)])]
)
def test_shadow_of_a_ball_on_a_plane(device: Device, mode: str, lanes: int | None) -> None:
    way = np.array([0.5, 0.3, -1.0])
    scene = scene_of(
        NOWHERE,
        FROM_ABOVE,
        (48, 48),
        objects={"floor": FLOOR, "ball": BALL_OBJECT},
        materials={"white": WHITE},
        material=DULL,
        lights=[{"direction": way.tolist()}],
        background=[0, 0, 0],
        **light_of(mode),
    )
    shots: dict[str, Any] = {"lanes": lanes} if lanes else {}
    framebuffer = shoot(scene, device, **shots)
    toward = -way / np.linalg.norm(way)
    origin, direction, _ = rays(scene)
    t, normal, number = met(scene, origin, direction)
    on_floor = number == 1
    points = origin + np.where(on_floor, t, 1)[..., None] * direction
    shadowed = np.isfinite(met(scene, points + 1e-6 * normal, np.broadcast_to(toward, points.shape))[0])
    expected = np.where(shadowed, 0, toward[2])[on_floor]
    assert (expected == 0).sum() > 100
    assert (expected > 0).sum() > 500
    assert (np.abs(colors(framebuffer)[on_floor][:, 0] - expected) > 1e-4).sum() <= 2
    # The ball's own light: the cosine, and dark behind its terminator.
    on_ball = number == 2
    cosine = np.maximum((normal @ toward)[on_ball], 0)
    np.testing.assert_allclose(colors(framebuffer)[on_ball][:, 0], cosine, atol=2e-4)
    assert (cosine == 0).sum() > 10


@pytest.mark.parametrize("mode", ["direct", "path"])
def test_set_and_objects_shadow_each_other(device: Device, mode: str) -> None:
    """A ball of the formula over a plane shadows as a ball among the objects does, and the other way round."""
    common: dict[str, Any] = {
        "materials": {"white": WHITE},
        "material": DULL,
        "lights": [{"direction": [0.4, 0.2, -1]}],
        **light_of(mode),
        "background": [0, 0, 0],
        "coloring": {"by": "solid"},
        "renderer": {"detail": 0.05},
    }
    camera = {"position": [3, -5, 5], "target": [0, 0, 0], "fov": 40}
    floor = {**FLOOR, "position": [0, 0, -1.2]}
    above = {"type": "sphere", "position": [-0.7, -0.4, 2.0], "radius": 0.5, "material": "white"}
    radius = 4.0 ** (2.0**-8)
    as_object = {"type": "sphere", "radius": radius, "material": "white"}
    one = shoot(scene_of(BALL, camera, (64, 64), objects={"floor": floor, "above": above}, **common), device)
    objects = {"floor": floor, "above": above, "ball": as_object}
    other = shoot(scene_of(NOWHERE, camera, (64, 64), objects=objects, **common), device)
    a, b = colors(one)[..., 0], colors(other)[..., 0]
    assert (b < 0.01).sum() > 200
    # At rims, and at the rims of shadows, a ray may go to either side.
    assert (np.abs(a - b) > 0.02).mean() < 0.01
    assert np.median(np.abs(a - b)) < 1e-4


@pytest.mark.parametrize("search", ["distance", "steps"])
def test_the_set_shadows_what_points_of_pixels_see_beside_it(device: Device, search: str) -> None:
    """The cone of such a pixel's shared march ends nowhere; its light's rays have a width all the same, and arrive."""
    way = np.array([0.4, 0.2, -1.0])
    scene = scene_of(
        BALL,
        {"position": [3, -5, 5], "target": [0, 0, -1.6], "fov": 50},
        (64, 64),
        objects={"floor": {**FLOOR, "position": [0, 0, -1.6]}},
        materials={"white": WHITE},
        material=DULL,
        lights=[{"direction": way.tolist()}],
        renderer={"search": search, "points": {"pattern": "grid", "count": 4}, "detail": 0.05},
        background=[0, 0, 0],
    )
    framebuffer = shoot(scene, device)
    points = points_of(framebuffer)
    on_floor = (framebuffer["A"] == 1) & (np.abs(points[..., 2] + 1.6) < 1e-4)
    toward = -way / np.linalg.norm(way)
    along = points @ toward
    # How far a shadow ray passes the middle of the ball.
    passes = np.sqrt((points**2).sum(-1) - along**2)
    expected = np.where(passes < 4.0 ** (2.0**-8), 0, toward[2])
    # At the ball's rim points of a pixel lie on both.
    all_on_floor = np.lib.stride_tricks.sliding_window_view(np.pad(on_floor, 1, mode="edge"), (3, 3)).all(
        (2, 3)
    )
    sure = all_on_floor & (np.abs(passes - 1) > 0.08)
    assert (expected[sure] == 0).sum() > 90
    assert (expected[sure] > 0).sum() > 800
    np.testing.assert_allclose(colors(framebuffer)[sure][:, 0], expected[sure], atol=1e-4)


def test_a_mirror_shows_what_the_mirrored_ray_meets(device: Device) -> None:
    mirror = {"base": {"color": [1, 1, 1], "metalness": 1}, "specular": {"roughness": 0}}
    lamp = {
        "base": {"color": [0, 0, 0]},
        "specular": {"weight": 0},
        "emission": {"luminance": 3, "color": [1, 0.5, 0]},
    }
    objects = {
        "floor": {**FLOOR, "material": "mirror"},
        "ball": {**BALL_OBJECT, "material": "lamp"},
    }
    for mode in ("direct", "path"):
        scene = scene_of(
            NOWHERE,
            FROM_ABOVE,
            (48, 48),
            objects=objects,
            materials={"mirror": mirror, "lamp": lamp},
            lights=[],
            lighting={"mode": mode},
            renderer={"firefly_limit": None, "samples": 1},
            background=[0, 0, 0],
        )
        framebuffer = shoot(scene, device)
        origin, direction, _ = rays(scene)
        t, normal, number = met(scene, origin, direction)
        on_floor = number == 1
        points = origin + np.where(on_floor, t, 1)[..., None] * direction
        mirrored = direction * np.array([1, 1, -1])
        seen = np.isfinite(met(scene, points + 1e-6 * normal, mirrored)[0])
        assert (seen & on_floor).sum() > 60
        expected = np.where(seen[..., None], [3, 1.5, 0], 0)[on_floor]
        # (Along paths a mirror is a very narrow lobe, which rays at the rim may miss. What is beside it is asked for.)
        near = 0.01 if mode == "direct" else 0.1
        wrong = (np.abs(colors(framebuffer)[on_floor] - expected) > near).any(axis=-1)
        assert wrong.sum() <= (3 if mode == "direct" else 12)
        np.testing.assert_allclose(
            colors(framebuffer)[number == 2], [[3, 1.5, 0]] * (number == 2).sum(), rtol=1e-5
        )


def test_fog_before_an_object(device: Device) -> None:
    lamp = {"base": {"color": [0, 0, 0]}, "specular": {"weight": 0}, "emission": {"luminance": 2}}
    scene = scene_of(
        NOWHERE,
        FROM_ABOVE,
        (32, 32),
        objects={"floor": {**FLOOR, "material": "lamp"}},
        materials={"lamp": lamp},
        lights=[],
        fog={"density": 0.3, "color": [0.5, 0.6, 0.7]},
    )
    framebuffer = shoot(scene, device)
    origin, direction, _ = rays(scene)
    t, _, _ = met(scene, origin, direction)
    passes = np.exp(-0.3 * t)[..., None]
    np.testing.assert_allclose(
        colors(framebuffer), 2 * passes + (1 - passes) * np.array([0.5, 0.6, 0.7]), rtol=1e-4
    )


@pytest.mark.parametrize("kind", ["box", "sphere", "cylinder"])
def test_a_closed_room_keeps_its_energy(device: Device, kind: str) -> None:
    """Walls that shine E and scatter the part r of light: after n bounces E (1 - r^(n + 1)) / (1 - r) everywhere."""
    sizes: dict[str, dict[str, Any]] = {
        "box": {"size": [3, 2, 2]},
        "sphere": {"radius": 1.5},
        "cylinder": {"radius": 1.4, "height": 2},
    }
    wall = {
        "base": {"color": [0.5, 0.5, 0.5]},
        "specular": {"weight": 0},
        "emission": {"luminance": 1},
    }
    scene = scene_of(
        NOWHERE,
        {"position": [0.1, -0.2, 0.1], "target": [1, 1, 0.3], "fov": 90},
        (32, 32),
        objects={"room": {"type": kind, "material": "wall", **sizes[kind]}},
        materials={"wall": wall},
        lights=[],
        lighting={"mode": "path", "bounces": 7, "roulette": 64},
        renderer={"samples": 4},
        background=[9, 9, 9],
    )
    framebuffer = shoot(scene, device)
    np.testing.assert_allclose(colors(framebuffer), (1 - 0.5**8) / 0.5, rtol=2e-3)


def test_ambient_occlusion_is_not_used_along_paths(device: Device) -> None:
    found = []
    for occlusion in (None, {"rays": 4}):
        scene = scene_of(
            NOWHERE,
            FROM_ABOVE,
            (16, 16),
            objects={"ball": {"type": "sphere", "radius": 0.8}},
            lighting={"mode": "path", "bounces": 1},
            renderer={"ambient_occlusion": occlusion},
        )
        found.append(colors(shoot(scene, device)))
    np.testing.assert_array_equal(found[0], found[1])


HEIGHT, RADIUS, RADIANCE = 0.02, 0.015, 30.0


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
    ("near", "path", "float32", None),
    ("near", "path", "float32", 4),
    ("far out", "path", "float32", 4),
    ("from afar", "direct", "float32", 4),
    ("far out", "direct", "float64", 4),
    ("near", "direct", "float32", 1),
)


@pytest.mark.parametrize("kind", OBJECTS)
@pytest.mark.parametrize(("place", "mode", "precision", "lanes"), WAYS)
def test_no_object_is_in_its_own_shadow(
    device: Device, kind: str, place: str, mode: str, precision: Precision, lanes: int | None
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
