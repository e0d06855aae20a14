"""Fractals' smooth counts against |z| in NumPy. (Their normals: `test_level_normals.py`.)"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.formulas.catalog import load_chain
from clfractal.integrators.lanes import best_lanes
from clfractal.integrators.points import distances
from tests.render.levels import sizes
from tests.render.shots import points_of, shoot
from tests.scenes import scene_of

# Coloured as the scenes of the library that show them, whose programs have the same text; and their degrees.
CASES: dict[str, tuple[dict[str, Any], str, int]] = {
    "mandelbulb": ({"name": "mandelbulb", "iterations": 4}, "iterations", 8),
    "hast": ({"name": "hast", "iterations": 8}, "solid", 2),
    "quaternion_julia": ({"name": "quaternion_julia", "iterations": 8}, "solid", 2),
}
CAMERA = {"position": [1.3, -2.6, 1.6], "target": [0, 0, 0], "fov": 45}
# How far before its hit light is computed at most, cones (`detail` times footprints), and places tried on that way.
FARTHEST, PLACES = 12.0, 193
# The cone, footprints: narrow, or counts change much between the places where they are computed and the hits.
DETAIL = 0.02


@pytest.mark.parametrize("name", CASES)
def test_counts(device: Device, name: str) -> None:
    """n - log(log|z| / log R) / log d at the first n where |z| exceeds R, 1000 or less for high degrees d: that of a place
    on the pixel's ray, at the hit or before it, where the cone came near the solid."""
    formula, by, degree = CASES[name]
    scene = scene_of(formula, CAMERA, (96, 72), lights=[], coloring={"by": by}, renderer={"detail": DETAIL})
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] > 0
    assert hit.sum() > 800
    points, counts = (each[hit][::3] for each in (points_of(framebuffer), framebuffer["iterations"]))
    to_eye = np.asarray(CAMERA["position"]) - points
    distance = np.linalg.norm(to_eye, axis=-1, keepdims=True)
    cone = DETAIL * 2 * np.tan(np.radians(22.5)) / 72 * distance
    limit, difference = scene.chain.distance_bailout, np.full(len(points), np.inf)
    for way in np.linspace(0, FARTHEST, PLACES):
        size = sizes(scene.chain, points + way * cone * to_eye / distance, 40)
        first = (size > limit).argmax(axis=0)
        with np.errstate(all="ignore"):
            left = np.log(np.log(size[first, np.arange(len(points))]) / np.log(limit)) / np.log(degree)
        difference = np.fmin(difference, np.abs(counts - (first + 1 - np.clip(left, 0, 1))))
    assert np.median(difference) < 0.02
    assert np.quantile(difference, 0.95) < 0.2


def test_smooth_counts_have_no_jumps(device: Device) -> None:
    """Along a line out of the Mandelbulb the smooth count falls steadily, through every whole number."""
    line = np.linspace(2.0, 0.4, 8001)[:, None] * np.array([[0.48, 0.6, 0.64]])
    lanes = best_lanes(device, "float32")
    smooth = distances(load_chain("mandelbulb"), line, 60, device=device, lanes=lanes).smooth
    outer = smooth[: int((smooth > 5).argmax())]
    assert outer.max() - outer.min() > 3
    assert np.abs(np.diff(outer)).max() < 0.1
