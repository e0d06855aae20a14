"""Light that fog scatters once, and glow around the set, against sums along the rays."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.bits import alike_by_lanes
from tests.render.media import phase
from tests.render.shots import (
    BALL_RADIUS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    SOLID_RADIUS,
    SOLID_SPHERE,
    Floats,
    rays,
    shoot,
    stacked,
    to_sphere,
)
from tests.scenes import scene_of
from tests.variants import every, one_of

SIDE = 32
ALBEDO = np.array([1.0, 0.5, 0.25])


def scene_with(light: dict[str, Any], samples: int, *, paths: bool = False, **fog: Any) -> Scene:
    """A black ball in black fog: all light that is seen was scattered by the fog."""
    sections: dict[str, Any] = {"lighting": {"mode": "path", "bounces": 1}} if paths else {}
    scattering = {"color": ALBEDO.tolist(), "anisotropy": fog.pop("anisotropy", 0.0)}
    return scene_of(
        QUICK_BALL,
        PERSPECTIVE,
        (SIDE, SIDE),
        lights=[light],
        material={"color": [0, 0, 0], "ambient": 0, "diffuse": 0, "specular": 0},
        background={"top": [0, 0, 0], "bottom": [0, 0, 0]},
        fog={"color": [0, 0, 0], "background": False, "scattering": scattering, **fog},
        renderer={"samples": samples},
        **sections,
    )


def expected(scene: Scene, far: Floats, parts: int = 20_000) -> Floats:
    """Of each pixel's middle ray by the middles of many parts; rays to the light are free."""
    fog: Any = scene.fog
    light: Any = scene.lights[0]
    origin, way, _ = rays(scene)
    origin = np.broadcast_to(origin, way.shape)
    found = np.zeros(way.shape[:2])
    for place in np.ndindex(found.shape):
        # Parts that grow with the distance: the near ones count most.
        edge = np.concatenate([[0.0], np.geomspace(1e-4, far[place], parts)])
        t, step = (edge[1:] + edge[:-1]) / 2, np.diff(edge)
        points = origin[place] + t[:, None] * way[place]
        density = np.full(len(t), fog.density)
        if fog.height is not None:
            density = fog.density * np.exp(np.minimum(-(points[:, 2] - fog.base) / fog.height, 80))
        passes = np.exp(-(np.cumsum(density * step) - density * step / 2))
        if light.type == "point":
            toward = np.array(light.position) - points
            square = (toward**2).sum(axis=1)
            toward /= np.sqrt(square)[:, None]
            strength = light.intensity / (square if light.falloff == "inverse_square" else 1.0)
        else:
            toward = np.broadcast_to(
                -np.array(light.direction) / np.linalg.norm(light.direction), points.shape
            )
            strength = np.full(len(t), light.intensity)
        part = phase(toward @ way[place], fog.scattering.anisotropy)
        found[place] = (density * passes * math.pi * strength * part * step).sum()
    return np.asarray(found[..., None] * ALBEDO)


LIGHTS: list[dict[str, Any]] = [
    {"direction": [-1, 1, -1], "shadow": False, "intensity": 2.0},
    {"type": "point", "position": [2.5, -1.0, 1.5], "shadow": False, "falloff": "inverse_square"},
    {"type": "point", "position": [-2.0, 1.0, 0.5], "shadow": False},
]
FOGS: list[dict[str, Any]] = [
    {"density": 0.3},
    {"density": 1.0, "anisotropy": 0.6},
    {"density": 0.5, "height": 0.5, "anisotropy": -0.3},
]


# Every fourth: each light, each fog and both modes.
@pytest.mark.parametrize(("paths", "light", "fog"), every(4, product((False, True), LIGHTS, FOGS)))
def test_scattered_light_is_the_integral(
    device: Device, light: dict[str, Any], fog: dict[str, Any], paths: bool
) -> None:
    scene = scene_with(light, 256, paths=paths, **fog)
    framebuffer = shoot(scene, device)
    seen = stacked(framebuffer, ("R", "G", "B")).astype(float)
    origin, way, _ = rays(scene)
    distance, nearest = to_sphere(np.broadcast_to(origin, way.shape), way, [0, 0, 0], BALL_RADIUS)
    sure = (nearest < 0.9 * BALL_RADIUS) | (nearest > 1.1 * BALL_RADIUS)
    far = np.where(nearest < BALL_RADIUS, distance, 300.0)
    wanted = expected(scene, far)
    assert wanted[sure].max() > 0.01
    assert abs(seen[sure].mean() / wanted[sure].mean() - 1) < 0.01
    np.testing.assert_allclose(seen[sure], wanted[sure], rtol=0.1, atol=0.03 * wanted[sure].max())


def test_fog_behind_a_ball_is_dark(device: Device) -> None:
    """Light along x: the ball's shadow is the cylinder behind it, and only rays through that are darker."""
    light = {"direction": [1, 0, 0]}
    lit, shaded = (
        scene_with({**light, "shadow": False}, 64, density=0.05),
        scene_with(light, 64, density=0.05),
    )
    ratio = shoot(shaded, device)["R"] / shoot(lit, device)["R"]
    origin, way, _ = rays(lit)
    t = np.linspace(0, 40, 4000)
    points = np.broadcast_to(origin, way.shape)[..., None, :] + way[..., None, :] * t[:, None]
    beside = np.hypot(points[..., 1], points[..., 2]) / BALL_RADIUS
    behind = points[..., 0] > -BALL_RADIUS
    in_shadow = ((beside < 0.9) & behind).sum(axis=-1) * (t[1] - t[0])
    free = ~((beside < 1.2) & behind).any(axis=-1)
    _, nearest = to_sphere(np.broadcast_to(origin, way.shape), way, [0, 0, 0], BALL_RADIUS)
    past = nearest > 1.1 * BALL_RADIUS
    assert (past & free).sum() > 50
    assert (past & (in_shadow > BALL_RADIUS)).sum() > 20
    assert ratio[past & free].min() > 0.999
    assert ratio[past & (in_shadow > BALL_RADIUS)].max() < 0.99


def test_noise_fades(device: Device) -> None:
    light = {"type": "point", "position": [2.5, -1.0, 1.5], "falloff": "inverse_square"}
    few, more, most = (
        shoot(scene_with(light, n, density=0.3), device)["R"].astype(float) for n in (4, 64, 1024)
    )
    assert np.abs(more - most).mean() < 0.4 * np.abs(few - most).mean()


def test_a_lamp_where_half_of_the_light_is_scattered_has_no_noise_of_its_own(device: Device) -> None:
    """Not more of it than one that is nearer to the eye, whose fog is chosen by the angle at the lamp too."""
    origin, way, _ = rays(scene_with({"direction": [1, 0, 0]}, 1, density=0.2))
    corner = np.broadcast_to(origin, way.shape)[4, 4], way[4, 4]

    def noise(distance: float) -> float:
        place = (corner[0] + distance * corner[1]).tolist()
        light = {"type": "point", "position": place, "falloff": "inverse_square", "shadow": False}
        scene = scene_with(light, 16, density=0.2)
        seeds = [scene.surface.model_copy(update={"seed": seed}) for seed in range(6)]
        seen = np.array(
            [shoot(scene.model_copy(update={"renderer": each}), device)["R"][:10, :10] for each in seeds],
            float,
        )
        # (Around it; the nearest pixels' own width matters more.)
        around = np.ones((10, 10), bool)
        around[3:6, 3:6] = False
        return float((seen.std(axis=0, ddof=1) / seen.mean(axis=0))[around].mean())

    half = math.log(2) / 0.2
    assert noise(half) < 2.5 * noise(0.7 * half)


def test_a_soft_light_has_soft_shafts(device: Device) -> None:
    """Scattered alike to all sides, its size does not change how bright fog without shadows is."""
    light = {"direction": [-1, 1, -1], "shadow": False}
    hard, soft = (
        shoot(scene_with({**light, "angular_size": size}, 16, density=0.3), device)["R"] for size in (0, 30)
    )
    np.testing.assert_allclose(hard, soft, rtol=1e-4)


COLOR = np.array([1.0, 0.5, 0.25])
BLACK = {"color": [0, 0, 0], "ambient": 0, "diffuse": 0, "specular": 0}


def glowing(samples: int, camera: dict[str, Any] = PERSPECTIVE, **sections: Any) -> Scene:
    """A black ball before black, so that only the glow is seen."""
    glow = {"color": COLOR.tolist(), "intensity": 0.7, "width": 0.15, **sections.pop("glow", {})}
    return scene_of(
        SOLID_SPHERE,
        camera,
        (SIDE, SIDE),
        lights=[],
        background={"top": [0, 0, 0], "bottom": [0, 0, 0]},
        glow=glow,
        renderer={"samples": samples},
        **{"material": BLACK, **sections},
    )


def places(scene: Scene, parts: int = 4000) -> tuple[Floats, Floats, Any]:
    """Of each pixel's middle ray the middles of many parts, a part's length, and where it is free."""
    origin, way, _ = rays(scene)
    origin = np.broadcast_to(origin, way.shape)
    t = (np.arange(parts) + 0.5) * (8 / parts)
    points = origin[..., None, :] + t[:, None] * way[..., None, :]
    distance, nearest = to_sphere(origin, way, [0, 0, 0], SOLID_RADIUS)
    far = np.where(nearest < SOLID_RADIUS, distance, 8.0)
    return points, np.full(t.shape, 8 / parts), t < far[..., None]


def glow_of(scene: Scene) -> Floats:
    glow: Any = scene.glow
    points, step, free = places(scene)
    distance = np.maximum(np.linalg.norm(points, axis=-1) - SOLID_RADIUS, 0)
    bright = np.exp(-distance / glow.width) * free
    if glow.by == "trap":
        # The orbit stays where it began.
        bright *= np.exp(-np.abs(points[..., 2] - glow.trap.center[2]) / glow.reach)
    if scene.fog is not None:
        bright *= np.exp(-scene.fog.density * np.cumsum(step))
    total = (bright * step).sum(axis=-1) / glow.width
    return np.asarray(total[..., None] * glow.intensity * COLOR)


def sure(scene: Scene) -> Any:
    """Pixels without the ball's rim."""
    origin, way, _ = rays(scene)
    _, nearest = to_sphere(np.broadcast_to(origin, way.shape), way, [0, 0, 0], SOLID_RADIUS)
    return (nearest < 0.9 * SOLID_RADIUS) | (nearest > 1.1 * SOLID_RADIUS)


PLANE_TRAP = {"by": "trap", "reach": 0.3, "trap": {"shape": "plane", "center": [0, 0, 0.5]}}
CASES: dict[str, dict[str, Any]] = {
    "close": {},
    "wide": {"glow": {"width": 0.6}},
    "narrow": {
        "glow": {"width": 0.02},
        "camera": {**ORTHOGRAPHIC, "height": 0.5, "target": [1, 0.1, 0], "position": [2, -2, 1.5]},
    },
    "trap": {"glow": PLANE_TRAP},
    "fog": {"fog": {"density": 0.4, "color": [0, 0, 0], "background": False}},
    "paths": {"lighting": {"mode": "path", "bounces": 1}},
    "parallel": {"camera": ORTHOGRAPHIC},
}


@pytest.mark.parametrize("case", one_of("paths", *(case for case in CASES if case != "paths")))
def test_glow_is_the_integral(device: Device, case: str) -> None:
    scene = glowing(256, **CASES[case])
    seen = stacked(shoot(scene, device), ("R", "G", "B")).astype(float)
    wanted, inner = glow_of(scene), sure(scene)
    assert wanted[inner].max() > 0.1
    assert abs(seen[inner].mean() / wanted[inner].mean() - 1) < 0.01
    np.testing.assert_allclose(seen[inner], wanted[inner], rtol=0.06, atol=0.02 * wanted[inner].max())


@pytest.mark.combination
def test_steps_do_not_show(device: Device) -> None:
    alike_by_lanes(glowing(64), device, share=1, rtol=1e-4, atol=1e-5)


def test_a_mirror_shows_glow(device: Device) -> None:
    """Rays that leave a ball gather as much as those that arrive. (Close up, where they begin near the surface.)"""
    close = {"position": [1.5, -2.5, 1.2], "target": [0, 0, 0], "fov": 0.5}
    wide = {"width": 0.6}
    plain = shoot(glowing(64, close, glow=wide), device)["R"].astype(float)
    mirror = shoot(glowing(64, close, glow=wide, material={**BLACK, "reflection": 0.5}), device)["R"].astype(
        float
    )
    assert mirror.mean() / plain.mean() == pytest.approx(1.5, rel=0.01)
