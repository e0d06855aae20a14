"""Paths through sets of glass: nothing is lost on the way, media absorb by Beer and Lambert's law, and colours spread."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.integrators.plan import make_plan
from clfractal.integrators.surface import program_texts
from tests.render.glass_scenes import ball
from tests.render.path_scenes import path, scene_of, seen
from tests.variants import one_of

pytestmark = pytest.mark.light


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_media_absorb_along_the_chord(precision: str) -> None:
    """Glass that bends nothing: pixels have what Beer and Lambert's law leaves of white on a chord of the ball."""
    color, depth = np.array([0.9, 0.5, 0.1]), 0.8
    scene = ball(0, 1.0, transmission={"color": list(color), "depth": depth})
    found, normals, _ = seen(scene, 16, precision=precision)
    toward = normals - np.array([0, -4, 0])
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    chord = -2 * (normals * toward).sum(axis=1)
    expected = color ** (chord[:, None] / depth)
    inner = chord > 1
    assert inner.sum() > 100
    assert np.abs(found[inner] - expected[inner]).max() < 0.03
    assert abs((found[inner] / expected[inner]).mean() - 1) < 0.005


def test_without_a_depth_boundaries_are_tinted() -> None:
    """Twice on the way through a ball whose index is that of the air."""
    color = np.array([0.9, 0.5, 0.2])
    colors = seen(ball(0, 1.0, transmission={"color": list(color)}), 16)[0]
    assert np.abs(np.median(colors, axis=0) - color**2).max() < 0.005


def test_colours_spread_and_are_white_together() -> None:
    """Under a grey gradient red and blue come from other places only with dispersion; white stays white."""
    grey = {"top": [1, 1, 1], "bottom": [0, 0, 0]}
    plain = seen(ball(0, background=grey), 16)[0]
    assert np.abs(plain[:, 0] - plain[:, 2]).max() < 1e-4
    spread: dict[str, Any] = {"dispersion_scale": 1, "dispersion_abbe_number": 5}
    colors = seen(ball(0, background=grey, transmission=spread), 128)[0]
    apart = colors[:, 0] - colors[:, 2]
    half = len(apart) // 2
    # The picture is upside down: above, blue, which is bent more, comes from deeper.
    assert apart[:half].mean() > 0.01
    assert apart[half:].mean() < -0.01
    white = seen(ball(0, transmission=spread), 128)[0]
    assert np.abs(white.mean(axis=0) - 1).max() < 0.01


def test_a_sun_shines_through_rough_glass() -> None:
    """A light of one direction is asked for where paths leave the glass: behind a ball it is seen."""
    dark = {"top": [0, 0, 0], "bottom": [0, 0, 0]}
    scene = ball(0.6, background=dark, lights=[{"direction": [0, -1, 0]}])
    colors = seen(scene, 64)[0]
    assert colors.mean() > 0.05
    smooth = scene_of(background=dark, lights=[{"direction": [0, -1, 0]}], lighting=path(8))
    assert seen(smooth, 4)[0].mean() < 0.01


def test_scenes_without_glass_do_not_know_it() -> None:
    """No program more: a material whose transmission has no weight is like one without transmission."""
    scenes = [
        scene_of(lighting=path(2), materials={"m": {"transmission": values}}, material={"name": "m"})
        for values in ({}, {"color": [0.5, 0.6, 0.7], "depth": 2, "dispersion_scale": 1})
    ]
    texts = []
    for scene in scenes:
        plan = make_plan(scene, precision="float32", lanes=4, channels=("R", "G", "B"))
        found = program_texts(scene, plan)
        assert [text.name for text in found] == ["rays", "begin", "interactions", "scatter", "gather"]
        texts.append([text.flat.text for text in found])
    assert texts[0] == texts[1]
