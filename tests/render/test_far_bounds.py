"""Bounds that are much larger than the formula's ball: the same surface is found, from near and from far away."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.truth.losses import measure_losses
from benchmarks.truth.picture import see
from benchmarks.truth.solid import Solid
from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests import scenes
from tests.render.shots import engine_of, points_of, shoot

FORMULAS = {
    "rule": {"name": "mandelbulb", "iterations": 8},
    "jacobian": {"name": "hast", "iterations": 12},
}
MORE = {
    "quaternion": {"name": "quaternion_julia", "iterations": 10},
    "folds": {"name": "mandelbox", "iterations": 8},
    "shape": {"name": "menger_sponge", "iterations": 4},
    "ship": {"name": "burning_ship", "iterations": 9},
}


def scene_of(formula: dict[str, Any], far: float, bounds: float | None) -> Scene:
    """A formula from so far away, and with bounds that are so large, in radii of its ball; the picture shows the ball."""
    chain = scenes.scene_of(formula).chain
    center, radius = np.array(chain.center), chain.radius
    toward = np.array([0.5, -1, 0.4]) / np.linalg.norm([0.5, -1, 0.4])
    renderer: dict[str, Any] = {"type": "surface", "step": radius / 100}
    if bounds is not None:
        renderer["bounds"] = {
            "center": (center + np.array([0, 0.1 * radius, 0])).tolist(),
            "radius": bounds * radius,
        }
    camera = {
        "position": [*(center + far * radius * toward)],
        "target": [*center],
        "fov": float(np.degrees(2 * np.arctan(0.8 / far))),
    }
    return scenes.scene_of(formula, camera, (160, 160), renderer=renderer, lights=[])


def check(device: Device, formula: dict[str, Any]) -> None:
    """No ray goes through three footprints of the set unseen, and as many surfaces are nearer as are farther away."""
    for far in (2.5, 40.0):
        usual = scene_of(formula, far, None)
        home = see(usual, engine_of(device))
        solid = Solid(usual.chain, usual.formula.iterations, device)
        for bounds in (3.0, 10.0, 50.0):
            seen = see(scene_of(formula, far, bounds), engine_of(device))
            there = replace(seen, rays=home.rays)
            lost = measure_losses(there, solid, 600, np.random.default_rng(5)).lost
            assert len(lost) <= 1, (far, bounds, lost)
            met, both = np.isfinite(seen.t), np.isfinite(seen.t) & np.isfinite(home.t)
            assert abs(met.sum() - np.isfinite(home.t).sum()) < 0.01 * met.sum()
            off = (seen.t[both] - home.t[both]) / home.rays[both].width(home.t[both])
            assert np.median(np.abs(off)) < 0.3
            assert abs((off > 3).sum() - (off < -3).sum()) < 0.005 * both.sum()


@pytest.mark.parametrize("name", FORMULAS)
def test_nothing_is_lost(device: Device, name: str) -> None:
    check(device, FORMULAS[name])


@pytest.mark.combination
@pytest.mark.parametrize("name", MORE)
def test_nothing_of_others_is_lost(device: Device, name: str) -> None:
    check(device, MORE[name])


def test_what_is_farther_out_than_the_ball_is_seen(device: Device) -> None:
    """A formula whose ball is too small has larger bounds: all of it is seen, also what the ball does not hold."""
    ball = {
        "variables": ["x", "y", "z"],
        "map": ["x", "y", "z"],
        "add": "none",
        "degree": 1,
        "shape": "sqrt(x*x + y*y + z*z) - 1",
        "bounds": {"center": [0, 0, 0], "radius": 0.4},
        "bailout": 10,
    }
    scene = scenes.scene_of(
        {"inline": ball, "iterations": 1},
        {"position": [0, -5, 0], "target": [0, 0, 0], "fov": 30},
        (96, 96),
        renderer={"type": "surface", "bounds": {"center": [0, 0, 0], "radius": 30}},
    )
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] == 1
    np.testing.assert_allclose(np.linalg.norm(points_of(framebuffer)[hit], axis=-1), 1, atol=0.01)
    shown = hit.mean() * (2 * 5 * np.tan(np.radians(15))) ** 2
    # The outline of a unit ball from 5 away.
    assert shown == pytest.approx(np.pi * 25 / 24, rel=0.03)
