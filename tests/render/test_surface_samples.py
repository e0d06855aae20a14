"""Background, coverage, and several samples a pixel."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from tests.render.sequence import unit_squares
from tests.render.shots import (
    BALL_RADIUS,
    CHANNELS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
)
from tests.scenes import scene_of

GRADIENT = {"top": [0.1, 0.4, 2.0], "bottom": [0.5, 0.0, 1.0]}
# Ambient light alone: every sample of the ball has this colour.
FLAT: dict[str, Any] = {
    "lights": [{"shadow": False}],
    "material": {"color": [0.25, 0.5, 1.0], "ambient": 1, "diffuse": 0, "specular": 0},
}
RGB = ("R", "G", "B")


def test_background(device: Device) -> None:
    """Linear between its colours from the picture's upper rim to its lower one."""
    scene = scene_of(QUICK_BALL, PERSPECTIVE, (40, 50), background=GRADIENT)
    framebuffer = shoot(scene, device)
    share = ((np.arange(50) + 0.5) / 50)[:, None, None]
    expected = (1 - share) * np.array(GRADIENT["top"]) + share * np.array(GRADIENT["bottom"])
    miss = framebuffer["A"] == 0
    assert miss.sum() > 500
    np.testing.assert_allclose(
        stacked(framebuffer, RGB)[miss], np.broadcast_to(expected, (50, 40, 3))[miss], rtol=1e-6
    )


@pytest.mark.parametrize("samples", [1, 16])
def test_transparent(device: Device, samples: int) -> None:
    """R, G, B are premultiplied: the colour times the coverage, 0 where nothing is hit."""
    scene = scene_of(QUICK_BALL, PERSPECTIVE, background="transparent", **FLAT)
    framebuffer = shoot(scene, device, samples=samples)
    coverage = framebuffer["A"]
    if samples == 1:
        assert set(np.unique(coverage)) == {0, 1}
    else:
        assert np.array_equal(coverage * 16, np.round(coverage * 16))
        assert len(np.unique(coverage)) > 5
    np.testing.assert_allclose(
        stacked(framebuffer, RGB), coverage[..., None] * np.array([0.25, 0.5, 1]), rtol=1e-6
    )


def test_averages_are_of_linear_light(device: Device) -> None:
    """A pixel half covered has the mean of the numbers in R, G, B, whatever the exposure of a PNG would be."""
    same = {"top": [0.1, 0.2, 3.0], "bottom": [0.1, 0.2, 3.0]}
    framebuffer = shoot(scene_of(QUICK_BALL, PERSPECTIVE, background=same, **FLAT), device, samples=8)
    a = framebuffer["A"][..., None]
    assert ((a > 0) & (a < 1)).any()
    np.testing.assert_allclose(
        stacked(framebuffer, RGB), a * np.array([0.25, 0.5, 1]) + (1 - a) * np.array(same["top"]), rtol=2e-6
    )


@pytest.mark.parametrize("samples", [2, 5, 16])
def test_data_channels_take_the_nearest_sample(device: Device, samples: int) -> None:
    """Depth, point and normal of one ray, that of the sample nearest to the pixel's centre: hit or not, no averages."""
    scene = scene_of(QUICK_BALL, ORTHOGRAPHIC, (48, 48), renderer={"detail": 0.01, "seed": 7})
    framebuffer = shoot(scene, device, samples=samples)
    across, below = unit_squares(48, 48, samples, 7)
    chosen = ((across - 0.5) ** 2 + (below - 0.5) ** 2).argmin(axis=-1)[..., None]
    u, v = (np.take_along_axis(place, chosen, axis=-1)[..., 0] for place in (across, below))
    origin, direction, _ = rays(scene, u, v)
    distance, nearest = to_sphere(origin, direction, (0, 0, 0), BALL_RADIUS)
    sure = np.abs(nearest - BALL_RADIUS) > 1e-2
    hit = np.isfinite(framebuffer["Z"])
    assert np.array_equal(hit[sure], np.isfinite(distance)[sure])
    points, facing = points_of(framebuffer), nearest < 0.9 * BALL_RADIUS
    expected = origin + np.where(np.isfinite(distance), distance, 0)[..., None] * direction
    np.testing.assert_allclose(points[facing], expected[facing], atol=5e-3)
    # On that ray, to rounding: a mean of two rays would lie beside it.
    offset = points - origin
    aside = offset - (offset * direction).sum(-1, keepdims=True) * direction
    assert np.abs(aside[hit]).max() < 2e-6
    np.testing.assert_allclose(np.linalg.norm(normals_of(framebuffer)[hit], axis=-1), 1, atol=1e-5)
    assert np.isfinite(stacked(framebuffer, [name for name in CHANNELS if name != "Z"])).all()


def test_seed_and_region_of_samples(device: Device) -> None:
    """Another seed, other places; the same seed, the same picture, in a region too."""
    scenes = [scene_of(QUICK_BALL, PERSPECTIVE, renderer={"seed": seed}) for seed in (0, 1)]
    first, second = (stacked(shoot(scene, device, samples=4)) for scene in scenes)
    assert not np.array_equal(first, second)
    assert np.abs(first[..., 3] - second[..., 3]).mean() < 0.02
    part = stacked(shoot(scenes[0], device, samples=4, region=(17, 5, 40, 33)))
    assert np.array_equal(part, first[5:38, 17:57])
