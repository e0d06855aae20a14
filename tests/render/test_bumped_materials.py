"""Materials whose normal is not the surface's (`bsdf_bumped.h`): no light is lost, none goes below the surface."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

from tests.render.lobes import (
    LOBES,
    NO_GLOSS,
    check_integrals,
    leaning,
    material,
    numbers,
    sampled,
    sphere,
    toward,
)
from tests.render.material_kernel import NORMAL, ask
from tests.variants import one_of

pytestmark = pytest.mark.light

GLASS = {"base": {"color": [1, 1, 1]}, "specular": {"roughness": 0.4}, "transmission": {"weight": 1}}
COSINES = (0.25, 0.6, 1.0)


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("lobe", ["lambert", "gloss", "rough metal", "all"])
def test_a_white_furnace_stays_white(lobe: str, precision: Any) -> None:
    """However steep the relief is, as long as it faces the viewer."""
    for slope, cosine in product((0.3, 1.5), COSINES):
        viewer, leans = toward(cosine), leaning(slope)
        if float(viewer[0] @ leans) >= 0.05:
            sums = sampled(
                material(LOBES[lobe]), viewer, numbers(1 << 14, 4), leans=leans, precision=precision
            )
            assert np.abs(sums - 1).max() < 0.01, (slope, cosine, sums)


@pytest.mark.parametrize("inside", [False, True])
def test_white_glass_stays_white(inside: bool) -> None:
    for slope, cosine in product((0.3, 1.0), COSINES[1:]):
        sums = sampled(
            material(GLASS), toward(cosine), numbers(1 << 14, 4), leans=leaning(slope), inside=inside
        )
        assert np.abs(sums - 1).max() < 0.015, (slope, cosine, sums)


@pytest.mark.parametrize("slope", [0.5, 1.5])
@pytest.mark.parametrize("lobe", ["lambert", "gloss", "all"])
def test_integrals_over_the_hemisphere(lobe: str, slope: float) -> None:
    """Over the surface's own hemisphere: nothing is below it, and all is above."""
    check_integrals(material(LOBES[lobe]), toward(0.6), leans=leaning(slope))


def test_lambert_far_from_the_horizon_is_lambert_of_the_relief() -> None:
    lights = sphere((np.arange(60) + 0.5) / 60, 60)
    values = material({"base": {"color": [0.8, 0.5, 0.25]}, "specular": NO_GLOSS})
    leans = leaning(0.4)
    found = ask(values, toward(0.9), lights, precision="float64", leans=leans).value
    cosine, over, level = lights @ leans, lights @ NORMAL, float(leans @ NORMAL)
    away = leans - level * NORMAL
    # Where neither the light nor its image at the wall is darkened by the horizon.
    image = lights - 2 * (lights @ away)[:, None] * away / (away @ away)
    free = (over > level * cosine) & (over > level * (image @ leans)) & (cosine > 0)
    assert free.mean() > 0.2
    assert np.allclose(found[free], cosine[free, None] * [0.8, 0.5, 0.25] / math.pi, rtol=1e-6)


def test_light_fades_towards_the_horizon() -> None:
    """Where the relief faces the horizon, too: by the equation of Chiang and others."""
    leans = leaning(0.8)
    away = leans - (leans @ NORMAL) * NORMAL
    away /= np.linalg.norm(away)
    elevation = np.radians(np.array([0.01, 5, 15, 40, 80]))
    lights = np.cos(elevation)[:, None] * away + np.sin(elevation)[:, None] * NORMAL
    values = material({"base": {"color": [1, 1, 1]}, "specular": NO_GLOSS})
    found = ask(values, NORMAL[None], lights, precision="float64", leans=leans).value[:, 0]
    share = np.minimum(1, np.sin(elevation) / ((lights @ leans) * (leans @ NORMAL)))
    share = share + share**2 - share**3
    images = lights - 2 * (lights @ NORMAL)[:, None] * NORMAL
    expected = share * (np.maximum(lights @ leans, 0) + np.maximum(images @ leans, 0)) / math.pi
    assert np.allclose(found, expected, rtol=1e-5)
    assert found[0] < 1e-3
