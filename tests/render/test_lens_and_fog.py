"""The thin lens and fog, on a ball that is seen from afar or from near by."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.programs import compile_all
from tests.render.sequence import unit_squares
from tests.render.shots import (
    BALL_RADIUS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    Floats,
    rays,
    shoot,
    stacked,
    to_sphere,
)
from tests.scenes import scene_of
from tests.variants import one_of

SIDE, SAMPLES = 64, 256
FOV = 50.0
FAR = 40.0
# Looked at past the middle, so that the distance along the axis is another one than along the ray.
TARGETS = {"middle": [0, 0, 0], "aside": [9, 0, -6]}


def lens_scene(
    depth_share: float | None, target: str = "middle", blur: float = 0.2, sensor: float = 0.5
) -> Scene:
    """The ball, a few pixels wide, through a lens focused at a part of its depth, whose circle of confusion by the formula
    of stills.md has a diameter of `blur` picture heights; a pinhole if there is no part."""
    position, aim = np.array([0, -FAR, 0]), np.array(TARGETS[target])
    camera: dict[str, Any] = {"position": position.tolist(), "target": aim.tolist(), "fov": FOV}
    if depth_share is not None:
        axis = (aim - position) / np.linalg.norm(aim - position)
        depth = float(-position @ axis)
        focus = depth_share * depth
        half = np.tan(np.radians(FOV) / 2)
        diameter = blur * 2 * half / abs(1 / focus - 1 / depth) if depth_share != 1 else 1.0
        f_number = sensor / (2 * half) / diameter
        camera |= {"f_number": f_number, "focus_distance": focus, "sensor_height": sensor}
    return scene_of(
        QUICK_BALL,
        camera,
        (SIDE, SIDE),
        lights=[],
        background="transparent",
        renderer={"samples": SAMPLES, "detail": 0.01},
    )


def spread(coverage: Floats) -> tuple[float, Floats, float]:
    """Area, pixels; its middle, pixels; and its variance about it, the mean of both directions."""
    y, x = np.indices(coverage.shape) + 0.5
    area = coverage.sum()
    middle = np.array([(coverage * x).sum(), (coverage * y).sum()]) / area
    variance = (coverage * ((x - middle[0]) ** 2 + (y - middle[1]) ** 2)).sum() / area / 2
    return float(area), middle, float(variance)


def pinhole(scene: Scene, fine: int = 16) -> Floats:
    """The ball's exact coverage, but for a fine grid's error."""
    places = (np.arange(fine) + 0.5) / fine
    hits = [
        to_sphere(*rays(scene, x, y)[:2], [0, 0, 0], BALL_RADIUS)[1] < BALL_RADIUS
        for x in places
        for y in places
    ]
    return np.asarray(np.mean(hits, axis=0))


@pytest.fixture(scope="module", autouse=True)
def _compiled(device: Device) -> None:
    fog = fog_scene({"density": 1.0})
    compile_all([lens_scene(None), lens_scene(1.0), fog], device)


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("depth_share", [0.25, 0.6, 3.0])
@pytest.mark.parametrize(("blur", "sensor"), one_of((0.3, 3.0), (0.1, 0.5), (0.2, 0.2)))
def test_circle_of_confusion(
    device: Device, target: str, depth_share: float, blur: float, sensor: float
) -> None:
    """The blurred ball is the sharp one spread over a disk: variances add, that of a disk is its diameter's square over 16.
    Its light stays, and stays in its place."""
    scene = lens_scene(depth_share, target, blur, sensor)
    coverage = shoot(scene, device, channels=("A",))["A"].astype(float)
    area, middle, variance = spread(coverage)
    sharp_area, sharp_middle, sharp_variance = spread(pinhole(scene))
    diameter = 4 * np.sqrt(variance - sharp_variance)
    assert diameter == pytest.approx(blur * SIDE, rel=0.02)
    # From the rim of a wide lens a ball is seen from nearer by.
    assert area == pytest.approx(sharp_area, rel=0.05)
    assert np.hypot(*(middle - sharp_middle)) < 0.01 * blur * SIDE + 0.05
    y, x = np.indices(coverage.shape) + 0.5
    reach = np.hypot(x - middle[0], y - middle[1])
    edge = (diameter + np.sqrt(sharp_area * 4 / np.pi)) / 2
    assert not coverage[reach > edge + 1].any()
    assert (coverage[reach < edge - 1] > 0).all()


@pytest.mark.combination
def test_focus_is_as_sharp_as_a_pinhole(device: Device) -> None:
    """The ball's outline lies in the plane of focus, its diameter a twentieth of the distance; a tiny lens is sharp at any;
    without a focus distance the target is sharp."""
    exact = pinhole(lens_scene(None), 32)
    scenes = [lens_scene(None), lens_scene(1.0), lens_scene(3.0, blur=1e-4), lens_scene(3.0, blur=0.1)]
    pictures = [shoot(scene, device, channels=("A",))["A"] for scene in scenes]
    for coverage in pictures[:3]:
        assert np.abs(coverage - exact).max() < 0.06
        assert coverage.sum() == pytest.approx(exact.sum(), rel=0.03)
    assert np.abs(pictures[3] - exact).max() > 0.3
    usual = scenes[1].camera.model_dump() | {"focus_distance": None}
    same = scenes[1].model_copy(update={"camera": type(scenes[1].camera)(**usual)})
    np.testing.assert_array_equal(shoot(same, device, channels=("A",))["A"], pictures[1])


RED, MIST, GREEN = np.array([0.9, 0.2, 0.1]), np.array([0.1, 0.3, 0.8]), np.array([0.1, 0.6, 0.1])


def fog_scene(
    fog: dict[str, Any],
    camera: dict[str, Any] = PERSPECTIVE,
    background: Any = None,
    precision: str = "float32",
    samples: int = 1,
) -> Scene:
    return scene_of(
        QUICK_BALL,
        camera,
        (SIDE, SIDE),
        lights=[{"shadow": False}],
        material={"color": RED.tolist(), "ambient": 1, "diffuse": 0, "specular": 0},
        background=background or {"top": GREEN.tolist(), "bottom": GREEN.tolist()},
        fog={"color": MIST.tolist(), **fog},
        renderer={"detail": 0.01, "precision": precision, "samples": samples},
    )


SKY = {"top": [0.5, 0.5, 0.0], "bottom": [0.0, 0.5, 0.5]}


@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("density", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("covered", [True, False])
@pytest.mark.parametrize("transparent", [True, False])
def test_fog(
    device: Device, camera: dict[str, Any], density: float, covered: bool, transparent: bool
) -> None:
    """exp(-density d) of the surface's colour comes through, d along the ray; behind the ball mist alone, or the sky, or
    nothing. No density is no fog."""
    fog = {"density": density, "background": covered}
    scene = fog_scene(fog, camera, "transparent" if transparent else SKY)
    framebuffer = shoot(scene, device)
    seen = stacked(framebuffer, ("R", "G", "B")).astype(float)
    origin, way, _ = rays(scene)
    distance, nearest = to_sphere(origin, way, [0, 0, 0], BALL_RADIUS)
    hit, miss = framebuffer["A"] == 1, framebuffer["A"] == 0
    inner = hit & (nearest < 0.98 * BALL_RADIUS)
    assert inner.sum() > 800
    through = np.exp(-density * np.where(inner, distance, 0))[..., None]
    fogged = RED * through + MIST * (1 - through)
    np.testing.assert_allclose(seen[inner], fogged[inner], atol=0.002 * density + 1e-6)
    share = ((np.arange(SIDE) + 0.5) / SIDE)[:, None, None]
    sky = np.broadcast_to(np.array(SKY["top"]) * (1 - share) + np.array(SKY["bottom"]) * share, seen.shape)
    misty = covered and density > 0
    behind = np.zeros_like(seen) if transparent else np.broadcast_to(MIST, seen.shape) if misty else sky
    np.testing.assert_allclose(seen[miss], behind[miss], atol=1e-6)


@pytest.mark.parametrize("covered", [True, False])
def test_fog_at_edges(device: Device, covered: bool) -> None:
    """Every sample is fogged by itself; what is transparent stays so."""
    density, samples = 0.5, 16
    fog = {"density": density, "background": covered}
    scene = fog_scene(fog, ORTHOGRAPHIC, "transparent", samples=samples)
    framebuffer = shoot(scene, device)
    expected, coverage = np.zeros((SIDE, SIDE, 3)), np.zeros((SIDE, SIDE))
    across, below = unit_squares(SIDE, SIDE, samples, 0)
    for n in range(samples):
        origin, way, _ = rays(scene, across[..., n], below[..., n])
        distance, nearest = to_sphere(origin, way, [0, 0, 0], BALL_RADIUS)
        hit = nearest < BALL_RADIUS
        through = np.exp(-density * np.where(hit, distance, 0))[..., None]
        expected += np.where(hit[..., None], RED * through + MIST * (1 - through), 0) / samples
        coverage += hit / samples
    # But for rays that pass the ball within the hit distance.
    sure = framebuffer["A"] == coverage
    assert (sure & (coverage > 0) & (coverage < 1)).sum() > 80
    assert sure.mean() > 0.98
    np.testing.assert_allclose(stacked(framebuffer, ("R", "G", "B"))[sure], expected[sure], atol=0.004)


def depth(origin: Floats, way: Floats, distance: Floats, fog: Any, parts: int = 4000) -> Floats:
    """The optical depth by the middles of many parts of the way."""
    up = np.array(fog.up) / np.linalg.norm(fog.up)
    start, rise = origin @ up, way @ up
    middles = (np.arange(parts) + 0.5) / parts
    level = start[..., None] + (rise * distance)[..., None] * middles
    density = fog.density * np.exp(np.minimum(-(level - fog.base) / fog.height, 80))
    return np.asarray(density.mean(axis=-1) * distance)


CASES: list[dict[str, Any]] = [
    {"density": 0.5, "height": 0.7},
    {"density": 0.2, "height": 5000.0},
    {"density": 2.0, "height": 0.1, "base": -0.6},
    {"density": 0.05, "height": 0.4, "base": 0.8, "up": [1, 2, -0.5]},
]


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("values", CASES)
def test_what_comes_through_is_the_integral(device: Device, values: dict[str, Any], precision: str) -> None:
    scene = fog_scene(values, precision=precision)
    framebuffer = shoot(scene, device)
    seen = stacked(framebuffer, ("R", "G", "B")).astype(float)
    origin, way, _ = rays(scene)
    origin = np.broadcast_to(origin, way.shape)
    distance, nearest = to_sphere(origin, way, [0, 0, 0], BALL_RADIUS)
    inner = (framebuffer["A"] == 1) & (nearest < 0.98 * BALL_RADIUS)
    assert inner.sum() > 300
    through = np.exp(-depth(origin[inner], way[inner], distance[inner], scene.fog))[:, None]
    np.testing.assert_allclose(seen[inner], RED * through + MIST * (1 - through), atol=0.002)


@pytest.mark.parametrize("values", CASES)
def test_the_sky_comes_through_above(device: Device, values: dict[str, Any]) -> None:
    """As far as one sees up; down there is no end of it."""
    scene = fog_scene(values)
    framebuffer = shoot(scene, device)
    seen = stacked(framebuffer, ("R", "G", "B")).astype(float)
    origin, way, _ = rays(scene)
    origin = np.broadcast_to(origin, way.shape)
    fog: Any = scene.fog
    rise = way @ (np.array(fog.up) / np.linalg.norm(fog.up))
    up, down = (framebuffer["A"] == 0) & (rise > 0.02), (framebuffer["A"] == 0) & (rise <= 0)
    np.testing.assert_allclose(seen[down], np.broadcast_to(MIST, seen[down].shape), atol=1e-5)
    # Far enough that nothing of the fog is left.
    far = 40 * fog.height / rise[up]
    through = np.exp(-depth(origin[up], way[up], far, fog, parts=40_000))[:, None]
    np.testing.assert_allclose(seen[up], GREEN * through + MIST * (1 - through), atol=0.003)


def test_without_a_height_nothing_has_changed(device: Device) -> None:
    """The greatest height is hardly one."""
    flat, high = (
        shoot(fog_scene({"density": 0.4}), device),
        shoot(fog_scene({"density": 0.4, "height": 1e6}), device),
    )
    np.testing.assert_allclose(flat["R"][flat["A"] == 1], high["R"][flat["A"] == 1], atol=1e-5)
