"""Materials whose normal is not the surface's (`bsdf_bumped.h`): no light is lost, none goes below the surface."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.scene.materials import PbrMaterial
from tests.render.lobes import LOBES, NO_GLOSS, hemisphere, material, toward
from tests.render.material_kernel import NORMAL, ask, turned
from tests.variants import one_of

pytestmark = pytest.mark.light

Floats = npt.NDArray[np.floating[Any]]

GLASS = {"base": {"color": [1, 1, 1]}, "specular": {"roughness": 0.4}, "transmission": {"weight": 1}}
COSINES = (0.25, 0.6, 1.0)


def leaning(slope: float, angle: float = 0.7) -> Floats:
    """The normal of a relief of that slope on the tests' surface."""
    local = np.array([[slope * math.cos(angle), slope * math.sin(angle), 1.0]])
    return np.asarray(turned(local / np.linalg.norm(local))[0])


def numbers(count: int) -> Floats:
    from scipy.stats import qmc

    return np.asarray(np.clip(qmc.Sobol(4, seed=5).random(count), 1e-6, 1 - 1e-6))


def reflected(values: PbrMaterial, cosine: float, leans: Floats, **options: Any) -> Floats:
    """What is reflected (and let through) in all, by sampling."""
    places = numbers(1 << 14)
    viewers = np.repeat(toward(cosine), len(places), axis=0)
    found = ask(values, viewers, viewers, places, leans=leans, **options)
    kept = found.chosen_density > 0
    weights = found.chosen_value[kept] / found.chosen_density[kept, None]
    return np.asarray(weights.sum(axis=0) / len(places))


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("lobe", ["lambert", "gloss", "rough metal", "all"])
def test_a_white_furnace_stays_white(lobe: str, precision: Any) -> None:
    """However steep the relief is, as long as it faces the viewer."""
    for slope in (0.3, 1.5):
        for cosine in COSINES:
            leans = leaning(slope)
            if float(toward(cosine)[0] @ leans) < 0.05:
                continue
            sums = reflected(material(LOBES[lobe]), cosine, leans, precision=precision)
            assert np.abs(sums - 1).max() < 0.01, (slope, cosine, sums)


@pytest.mark.parametrize("inside", [False, True])
def test_white_glass_stays_white(inside: bool) -> None:
    for slope in (0.3, 1.0):
        for cosine in COSINES[1:]:
            sums = reflected(material(GLASS), cosine, leaning(slope), inside=inside)
            assert np.abs(sums - 1).max() < 0.015, (slope, cosine, sums)


@pytest.mark.parametrize("lobe", ["lambert", "gloss", "all"])
def test_integrals_over_the_hemisphere(lobe: str) -> None:
    """By quadrature over the surface's own hemisphere, without sampling: nothing is below it, and all is above."""
    lights, each = hemisphere()
    for slope in (0.5, 1.5):
        viewers = np.repeat(toward(0.6), len(lights), axis=0)
        leans = leaning(slope)
        found = ask(material(LOBES[lobe]), viewers, lights, precision="float64", leans=leans)
        assert np.abs(found.value.sum(axis=0) * each - 1).max() < 0.01
        assert found.density.sum() * each < 1.005
        mirrored = lights - 2 * (lights @ NORMAL)[:, None] * NORMAL
        below = ask(material(LOBES[lobe]), viewers, mirrored, precision="float64", leans=leans)
        assert not below.value.any()
        assert not below.density.any()


def test_samples_follow_their_density() -> None:
    """Counts in cells of the hemisphere against the density's integral over them (chi-square)."""
    from scipy.stats import chi2

    count, across, around = 1 << 16, 8, 12
    random = np.random.default_rng(11)
    leans = leaning(1.2)
    viewers = np.repeat(toward(0.6), count, axis=0)
    places = np.clip(random.random((count, 4)), 1e-6, 1 - 1e-6)
    found = ask(material(LOBES["all"]), viewers, viewers, places, leans=leans)
    local = found.chosen @ turned(np.eye(3)).T
    kept = found.chosen_density > 0
    assert local[kept, 2].min() > 0
    z, phi = local[kept, 2], np.arctan2(local[kept, 1], local[kept, 0]) % (2 * math.pi)
    counts = np.histogram2d(z, phi, bins=(across, around), range=((0, 1), (0, 2 * math.pi)))[0]
    lights, each = hemisphere(480, 480)
    density = ask(
        material(LOBES["all"]),
        np.repeat(viewers[:1], len(lights), axis=0),
        lights,
        precision="float64",
        leans=leans,
    ).density
    expected = density.reshape(across, 480 // across, around, 480 // around).sum(axis=(1, 3)) * each * count
    usual = expected > 20
    assert ((counts - expected) ** 2 / expected)[usual].sum() < chi2.ppf(0.9999, int(usual.sum()))


def test_lambert_far_from_the_horizon_is_lambert_of_the_relief() -> None:
    lights, _ = hemisphere(60, 60)
    values = material({"base": {"color": [0.8, 0.5, 0.25]}, "specular": NO_GLOSS})
    leans = leaning(0.4)
    viewers = np.repeat(toward(0.9), len(lights), axis=0)
    found = ask(values, viewers, lights, precision="float64", leans=leans).value
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
    found = ask(values, np.repeat(NORMAL[None], 5, axis=0), lights, precision="float64", leans=leans).value[
        :, 0
    ]
    share = np.minimum(1, np.sin(elevation) / ((lights @ leans) * (leans @ NORMAL)))
    share = share + share**2 - share**3
    images = lights - 2 * (lights @ NORMAL)[:, None] * NORMAL
    expected = share * (np.maximum(lights @ leans, 0) + np.maximum(images @ leans, 0)) / math.pi
    assert np.allclose(found, expected, rtol=1e-5)
    assert found[0] < 1e-3


@pytest.mark.parametrize("lanes", one_of(4, 8, 16))
def test_lanes_do_not_matter(lanes: int) -> None:
    places = numbers(64)
    random = np.random.default_rng(2)
    viewers: Floats = random.normal(size=(64, 3))
    viewers[:, 2] = np.abs(viewers[:, 2])
    viewers = turned(viewers / np.linalg.norm(viewers, axis=1, keepdims=True))
    lights, leans = viewers[::-1].copy(), leaning(0.9)
    one = ask(material(LOBES["all"]), viewers, lights, places, lanes=1, leans=leans)
    packet = ask(material(LOBES["all"]), viewers, lights, places, lanes=lanes, leans=leans)
    for name in ("value", "density", "chosen", "chosen_density", "chosen_value"):
        assert np.allclose(getattr(one, name), getattr(packet, name), rtol=1e-3, atol=1e-5), name
