"""Fractals' normals and smooth counts against maps written by hand, differentiated by differences in NumPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from tests.render.shots import Floats, normals_of, points_of, shoot
from tests.scenes import scene_of

Map = Callable[[Floats, Floats], Floats]


def mandelbulb(z: Floats, c: Floats) -> Floats:
    """White's rule of power 8 with its trigonometry: elevation from the axis, and azimuth."""
    r = np.linalg.norm(z, axis=-1)
    theta, phi = np.arccos(z[..., 2] / r), np.arctan2(z[..., 1], z[..., 0])
    direction = [np.sin(8 * theta) * np.cos(8 * phi), np.sin(8 * theta) * np.sin(8 * phi), np.cos(8 * theta)]
    result: Floats = (r**8)[..., None] * np.stack(direction, axis=-1) + c
    return result


def hast(z: Floats, c: Floats) -> Floats:
    """Englund 2010, Eq. 4."""
    a, b, d = np.moveaxis(z, -1, 0)
    r = np.sqrt(b * b + d * d)
    parts = [a * a - b * b - d * d, 2 * a * (b * np.abs(b) - d * d) / r, 4 * a * b * d / r]
    return np.stack(parts, axis=-1) + c


def julia(z: Floats, c: Floats) -> Floats:
    """The square of the quaternion (s, v): (s s - v.v, 2 s v), plus a constant."""
    s, v = z[..., :1], z[..., 1:]
    square = np.concatenate([s * s - (v * v).sum(-1, keepdims=True), 2 * s * v], axis=-1)
    result: Floats = square + np.array([-0.2, 0.6, 0.2, 0.2])
    return result


CASES: dict[str, tuple[dict[str, Any], Map, int]] = {
    "mandelbulb": ({"name": "mandelbulb", "iterations": 4}, mandelbulb, 8),
    "hast": ({"name": "hast", "iterations": 8}, hast, 2),
    "quaternion_julia": ({"name": "quaternion_julia", "iterations": 8}, julia, 2),
}
# Coloured as the scenes of the library that show them, whose programs have the same text.
COLORING = {"mandelbulb": "iterations", "hast": "solid", "quaternion_julia": "solid"}
CAMERA = {"position": [1.3, -2.6, 1.6], "target": [0, 0, 0], "fov": 45}


# How far before its hit light is computed at most, cones (`detail` times footprints), and places tried on that way.
FARTHEST, PLACES = 12.0, 193
# The cone, footprints: narrow, or the surface turns much between the places where normal and hit are.
DETAIL = 0.02


@pytest.mark.parametrize("name", CASES)
def test_normals_and_counts(device: Device, name: str) -> None:
    """The normal is the direction in which |z| of the last application grows fastest, at most of the scene's last one; the
    smooth count is n - log(log|z| / log R) / log d at the first n where |z| exceeds R, 1000 or less for high degrees d.
    Each is that of a place on the pixel's ray, at the hit or before it, where the cone came near the solid."""
    formula, step, degree = CASES[name]
    scene = scene_of(
        formula, CAMERA, (96, 72), lights=[], coloring={"by": COLORING[name]}, renderer={"detail": DETAIL}
    )
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] > 0
    assert hit.sum() > 800
    points, normals, counts = (
        each[hit][::3]
        for each in (points_of(framebuffer), normals_of(framebuffer), framebuffer["iterations"])
    )
    to_eye = np.asarray(CAMERA["position"]) - points
    distance = np.linalg.norm(to_eye, axis=-1, keepdims=True)
    to_eye /= distance
    cone = DETAIL * 2 * np.tan(np.radians(22.5)) / 72 * distance
    angle, difference = np.full(len(points), np.inf), np.full(len(points), np.inf)
    for way in np.linspace(0, FARTHEST, PLACES):
        limit = scene.chain.distance_bailout
        places = points + way * cone * to_eye
        expected, smooth = normal_and_count(step, places, name, limit, degree, formula["iterations"])
        # A hit on the far side of something thinner than a pixel shows the near side: mirrored towards the eye.
        away = -(expected * to_eye).sum(-1)
        expected += np.where(away > 0.1, 2 * away, 0)[:, None] * to_eye
        cosine = np.clip((normals * expected).sum(-1), -1, 1)
        angle = np.fmin(angle, np.degrees(np.arccos(cosine)))
        difference = np.fmin(difference, np.abs(counts - smooth))
    assert np.median(angle) < 0.05
    assert np.quantile(angle, 0.95) < 0.5
    assert np.median(difference) < 0.02
    assert np.quantile(difference, 0.95) < 0.2


def normal_and_count(
    step: Map, points: Floats, name: str, limit: float, degree: int, iterations: int
) -> tuple[Floats, Floats]:
    """Normals, of no z after the surface's, and smooth counts at points; not numbers where |z| stays below the limit."""
    with np.errstate(all="ignore"):
        count, radius = last(step, points, name, limit)
        of = np.minimum(count, iterations)
        h = 1e-6
        gradient = np.stack(
            [
                np.log(last(step, points + h * axis, name, limit, of)[1])
                - np.log(last(step, points - h * axis, name, limit, of)[1])
                for axis in np.eye(3)
            ],
            axis=-1,
        )
        normal = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
        smooth = count - np.clip(np.log(np.log(radius) / np.log(limit)) / np.log(degree), 0, 1)
    return normal, smooth


def test_smooth_counts_have_no_jumps(device: Device) -> None:
    """Along a line out of the Mandelbulb the smooth count falls steadily, through every whole number."""
    from clfractal.formulas.catalog import load_chain
    from clfractal.integrators.lanes import best_lanes
    from clfractal.integrators.points import distances

    line = np.linspace(2.0, 0.4, 8001)[:, None] * np.array([[0.48, 0.6, 0.64]])
    lanes = best_lanes(device, "float32")
    smooth = distances(load_chain("mandelbulb"), line, 60, device=device, lanes=lanes).smooth
    outer = smooth[: int((smooth > 5).argmax())]
    assert outer.max() - outer.min() > 3
    assert np.abs(np.diff(outer)).max() < 0.1


def last(
    step: Map, points: Floats, name: str, limit: float, count: Floats | None = None
) -> tuple[Floats, Floats]:
    """How many applications it takes until |z| > `limit`, and |z| then (0: never); or |z| after `count` of them."""
    if name == "quaternion_julia":
        z = np.concatenate([points, np.zeros((len(points), 1))], axis=-1)
        done = 0
    else:
        z, done = points.copy(), 1  # f(0) + C = C
    c = points
    result, at = np.zeros(len(points)), np.zeros(len(points))
    for n in range(done, 40):
        radius = np.linalg.norm(z, axis=-1)
        now = (at == 0) & (radius > limit) if count is None else count == n
        result[now], at[now] = radius[now], n
        z = step(np.where(at[:, None] > 0, 0.5, z), c)
    return at, result
