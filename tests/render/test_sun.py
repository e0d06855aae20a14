"""The sun of a sky: `kernels/shading/sun.h` against its definition in NumPy, and in pictures."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.structs import Precision
from clfractal.scene.atmosphere import SUN_RADIUS
from clfractal.scene.lighting import Sky
from clfractal.scene.sky import bake, pixel_areas
from clfractal.scene.sun import SOLID_ANGLE, Sun, sun_of
from clfractal.shading.environment import pack_environment
from tests.devices import check_usable
from tests.render.environment_kernel import ask, every_variant, settings_of
from tests.render.shots import Floats

pytestmark = pytest.mark.light


LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
LOW = Sky(sun_elevation=2.0, sun_azimuth=30.0)
DARK = np.zeros((8, 16, 3), np.float32)


def the_sun(sky: Sky) -> Sun:
    found = sun_of(sky)
    assert found is not None
    return found


def near(sun: Sun, count: int, seed: int, reach: float = 3.0) -> Floats:
    """Directions about the sun, out to `reach` of its radii."""
    apart = np.random.default_rng(seed).normal(size=(count, 3))
    apart *= reach * SUN_RADIUS / np.linalg.norm(apart, axis=1, keepdims=True).max()
    found = np.array(sun.toward) + apart
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def turned(directions: Floats, degrees: float) -> Floats:
    """Counterclockwise about z, seen from above."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.asarray(directions @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))


@every_variant
def test_directions_show_the_disc(precision: Precision, lanes: int) -> None:
    check_usable(precision, lanes)
    sun = the_sun(LOW)
    directions = near(sun, 4000, 1)
    expected = 1.5 * sun.radiance(directions)
    inside = expected[:, 0] > 0
    found = ask(
        pack_environment(DARK, sun),
        turned(directions, 50.0),
        settings=settings_of(rotation=50.0, intensity=1.5),
        precision=precision,
        lanes=lanes,
        has_sun=True,
    )
    # At its very rim a direction's last digits decide.
    distance = np.linalg.norm(directions - np.array(sun.toward), axis=1) / SUN_RADIUS
    sure = np.abs(distance - 1) > 1e-3
    assert 0.2 < inside.mean() < 0.9
    np.testing.assert_allclose(found.color[sure], expected[sure], rtol=2e-3)
    # All light is the disc's, so nearly all directions are chosen in it, evenly.
    np.testing.assert_allclose(found.density[sure & inside], 1 / SOLID_ANGLE, rtol=1e-3)


@every_variant
def test_samples_find_the_sun_and_the_sky(precision: Precision, lanes: int) -> None:
    """The mean of light over density is the integral of both; each sample knows the density by both ways together."""
    check_usable(precision, lanes)
    sun = the_sun(LOW)
    pixels = np.full((8, 16, 3), 0.05, np.float32)
    packed, numbers = pack_environment(pixels, sun), np.random.default_rng(3).random((60_000, 2))
    options: dict[str, Any] = {"precision": precision, "lanes": lanes, "has_sun": True}
    chosen = ask(packed, None, numbers, **options)
    again = ask(packed, chosen.sample, **options)
    in_disc = np.linalg.norm(chosen.sample - np.array(sun.toward), axis=1) < SUN_RADIUS
    share = float(LUMINANCE @ sun.irradiance) / (float(LUMINANCE @ sun.irradiance) + 4 * np.pi * 0.05)
    assert in_disc.mean() == pytest.approx(share, abs=0.01)
    weights = again.color / chosen.sample_density[:, None]
    exact = np.array(sun.irradiance) + 4 * np.pi * 0.05
    error = weights.std(axis=0) / np.sqrt(len(numbers))
    assert (np.abs(weights.mean(axis=0) - exact) < 4.5 * error + 2e-4 * exact).all()
    assert (np.isclose(again.density, chosen.sample_density, rtol=1e-4)).mean() > 0.999


@cache
def picture(camera: str, mode: str = "direct") -> Floats:
    """Colours, shape (height, width, 3): a white ground under a sun at 8 degrees, by the camera `ground` or `disc`."""
    cameras = {
        "ground": {"position": [0, 0, 5], "target": [0.01, 0, 0], "fov": 30},
        "disc": {
            "position": [0, 0, 5],
            "target": [0, np.cos(np.radians(8)), 5 + np.sin(np.radians(8))],
            "fov": 3,
        },
    }
    film = clfractal.render(
        {
            "version": 1,
            "formula": {"name": "mandelbulb", "iterations": 2},
            "image": {"width": 120, "height": 120} if camera == "disc" else {"width": 32, "height": 32},
            "camera": cameras[camera],
            "renderer": {"bounds": {"center": [60, 0, -60], "radius": 1.5}, "samples": 16, "filter": "box"},
            "lighting": {"mode": mode},
            "lights": [],
            "material": {"color": [1, 1, 1], "ambient": 0, "diffuse": 1, "specular": 0},
            "environment": {"sky": {"sun_elevation": 8}, "rotation": 0},
            "objects": {"ground": {"type": "plane"}},
        }
    )
    return np.stack([film[name] for name in "RGB"], axis=-1).astype(float)


def test_the_disc_is_round() -> None:
    """At a field of view of 3 degrees: no rim is farther from a circle of 0.2665 degrees than a tenth of its radius."""
    light = picture("disc") @ LUMINANCE
    sun = light > np.median(light) + 0.01 * light.max()
    radius = np.tan(np.radians(0.2665)) / np.tan(np.radians(1.5)) * 60
    rows, columns = np.indices(light.shape) - 59.5
    distance = np.hypot(rows, columns)
    assert not sun[distance > 1.1 * radius].any()
    assert sun[distance < 0.9 * radius].all()
    area = (light - np.median(light)).clip(0).sum() * (2 * np.tan(np.radians(1.5)) / 120) ** 2
    assert area == pytest.approx(float(LUMINANCE @ the_sun(Sky(sun_elevation=8)).irradiance), rel=0.02)


@pytest.mark.parametrize("mode", ["direct", "path"])
def test_a_ground_has_the_light_of_sun_and_sky(mode: str) -> None:
    sky = Sky(sun_elevation=8)
    rows = np.pi / 2 - (np.arange(len(bake(sky))) + 0.5) * np.pi / len(bake(sky))
    above = np.einsum("rck,r->k", bake(sky).astype(float), pixel_areas() * np.maximum(np.sin(rows), 0))
    sun = the_sun(sky)
    expected = (above + sun.toward[2] * np.array(sun.irradiance)) / np.pi
    found = picture("ground", mode).reshape(-1, 3)
    error = found.std(axis=0) / np.sqrt(len(found))
    assert (np.abs(found.mean(axis=0) - expected) < 4 * error + 0.01 * expected).all()
    assert (error < 0.02 * expected).all()
