"""Orbits that come back are found early, and no picture shows it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from tests.render.planes import picture_of, plane_scene
from tests.render.shots import CHANNELS, shoot, stacked

# Whatever the way that the inside is found, but for what it took.
SHOWN = tuple(name for name in CHANNELS if name != "steps")
CASES: dict[str, tuple[dict[str, Any] | str, dict[str, Any], str]] = {
    "hast": ("hast", {"center": [-0.5, 0, 0], "width": 3, "height": 3}, "stepped"),
    "hast, smooth, oblique": (
        "hast",
        {"center": [-0.4, 0, 0.1], "normal": [0.2, 0.5, 1], "width": 3},
        "smooth",
    ),
    # Four coordinates, and a constant: the orbit begins at the point.
    "quaternions": (
        {"name": "quaternion_julia", "julia": [-0.2, 0.6, 0.2, 0]},
        {"width": 3, "height": 3},
        "smooth",
    ),
    # A chain, whose formulas take turns: an orbit must come back in the same turn.
    "bulbox": ("bulbox", {"width": 6, "height": 6, "normal": [1, 0, 0]}, "stepped"),
    # Degree 1: orbits go beyond the bailout and come back.
    "mandelbox": ("mandelbox", {"width": 12, "height": 12, "center": [0, 0, 0.7]}, "smooth"),
}


@pytest.mark.parametrize("case", CASES)
def test_the_picture_is_the_same_bit_for_bit(device: Device, case: str) -> None:
    formula, plane, mode = CASES[case]
    keys: dict[str, Any] = {"iterations": 600, "plane": plane, "colors": {"mode": mode}, "samples": 2}
    found = shoot(plane_scene(formula, (96, 96), **keys), device)
    plain = shoot(plane_scene(formula, (96, 96), periodicity=False, **keys), device)
    assert stacked(found, SHOWN).tobytes() == stacked(plain, SHOWN).tobytes()
    inside = plain["iterations"] == 600
    assert (plain["steps"][inside] >= 600).all()
    assert 0.01 < inside.mean() < 0.9
    assert (found["steps"] <= plain["steps"]).all()


def test_it_finds_most_of_them_soon(device: Device) -> None:
    plane = {"center": [-0.5, 0, 0], "width": 3, "height": 3}
    framebuffer = shoot(
        plane_scene(size=(96, 96), iterations=10_000, plane=plane, colors={"mode": "stepped"}), device
    )
    inside = framebuffer["iterations"] == 10_000
    assert 0.15 < inside.mean() < 0.18  # of the area 9, that of the set is 1.5066
    assert np.median(framebuffer["steps"][inside]) < 200
    assert framebuffer["steps"][inside].mean() < 1000


def test_an_orbit_that_leaves_and_comes_back_is_inside_by_its_last_application(device: Device) -> None:
    """z goes round r, 4 r, 16 r, r, ... and is beyond the bailout of 2 in one or two turns of three, never beyond the
    distance bailout: that it comes back must not hide where it is in the end."""
    formula = {
        "variables": ["x", "y", "z"],
        "let": {"r": "sqrt(x*x + y*y + z*z)", "f": "where(r < 2.5, 4, 0.0625)"},
        "map": ["f*x", "f*y", "f*z"],
        "add": "none",
        "degree": 1,
        "bailout": 2,
        "bounds": {"radius": 2},
    }
    plane = {"width": 2, "height": 2}
    for iterations in range(30, 33):
        scene = plane_scene(formula, (64, 64), iterations=iterations, plane=plane, colors={"mode": "smooth"})
        framebuffer = shoot(scene, device)
        x, y = framebuffer["P.X"].astype(float), framebuffer["P.Y"].astype(float)
        radius = np.hypot(x, y)
        # Powers of two change nothing but the exponent: the orbits are exact.
        for _ in range(iterations):
            radius = radius * np.where(radius < 2.5, 4, 0.0625)
        sure = np.abs(radius - 2) > 1e-5
        inside = (picture_of(framebuffer) == 0).all(axis=-1)
        np.testing.assert_array_equal(inside[sure], (radius <= 2)[sure])
        assert 0.01 < inside.mean() < 0.99
