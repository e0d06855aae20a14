"""Materials (`bsdf.h`) keep energy, are the same both ways, and are sampled as their density says."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clfractal.shading.scattering import COSINES as COSINES_OF_TABLES
from clfractal.shading.scattering import REFLECTANCES, ROUGHNESSES, WAVES, albedo_tables, glass_tables
from tests.makers import maker
from tests.render.lobes import COSINES, LOBES, NO_GLOSS, Floats, hemisphere, material, numbers, toward
from tests.render.material_kernel import ask, turned
from tests.variants import one_of

pytestmark = pytest.mark.light


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("lobe", LOBES)
def test_a_white_furnace_stays_white(lobe: str, precision: Any) -> None:
    """Sampled: the mean of value over density is what is reflected in all."""
    places = numbers(1 << 15)
    for cosine in COSINES:
        viewers = np.repeat(toward(cosine), len(places), axis=0)
        found = ask(material(LOBES[lobe]), viewers, viewers, places, precision=precision)
        weights = np.where(
            found.chosen_density[:, None] > 0,
            found.chosen_value / np.maximum(found.chosen_density, 1e-30)[:, None],
            0.0,
        )
        assert np.abs(weights.mean(axis=0) - 1).max() < 0.01, (cosine, weights.mean(axis=0))


@pytest.mark.parametrize("lobe", LOBES)
def test_integrals_over_the_hemisphere(lobe: str) -> None:
    """By quadrature, without sampling: what is reflected is 1, and so is the density, but for samples below the surface."""
    lights, each = hemisphere()
    for cosine in COSINES[1:]:
        found = ask(
            material(LOBES[lobe]), np.repeat(toward(cosine), len(lights), axis=0), lights, precision="float64"
        )
        assert np.abs(found.value.sum(axis=0) * each - 1).max() < 0.01
        places = numbers(1 << 14)
        tried = ask(material(LOBES[lobe]), np.repeat(toward(cosine), len(places), axis=0), lights[:1], places)
        usable = np.mean(tried.chosen_density > 0)
        assert abs(found.density.sum() * each - usable) < 0.01


@pytest.mark.parametrize("lobe", [name for name in LOBES if not {"coat", "fuzz"} & set(LOBES[name])])
def test_the_same_both_ways(lobe: str) -> None:
    random = np.random.default_rng(3)
    pairs = random.normal(size=(2, 200, 3))
    pairs[..., 2] = np.abs(pairs[..., 2]) + 0.05
    pairs /= np.linalg.norm(pairs, axis=-1, keepdims=True)
    one = ask(material(LOBES[lobe]), turned(pairs[0]), turned(pairs[1]), precision="float64").value
    two = ask(material(LOBES[lobe]), turned(pairs[1]), turned(pairs[0]), precision="float64").value
    assert np.allclose(one / pairs[1][:, 2:], two / pairs[0][:, 2:], rtol=1e-4)


def test_samples_follow_their_density() -> None:
    """Counts in cells of the hemisphere against the density's integral over them (chi-square)."""
    values = LOBES["all"]
    count, across, around = 1 << 16, 8, 12
    random = np.random.default_rng(11)
    viewers = np.repeat(toward(0.5), count, axis=0)
    found = ask(material(values), viewers, viewers, np.clip(random.random((count, 3)), 1e-6, 1 - 1e-6))
    frame = turned(np.eye(3))
    local = found.chosen @ frame.T
    kept = found.chosen_density > 0
    z, phi = local[kept, 2], np.arctan2(local[kept, 1], local[kept, 0]) % (2 * math.pi)
    counts = np.histogram2d(z, phi, bins=(across, around), range=((0, 1), (0, 2 * math.pi)))[0]
    lights, each = hemisphere(480, 480)
    density = ask(
        material(values), np.repeat(toward(0.5), len(lights), axis=0), lights, precision="float64"
    ).density
    expected = density.reshape(across, 480 // across, around, 480 // around).sum(axis=(1, 3)) * each * count
    usual = expected > 20
    from scipy.stats import chi2

    statistic = ((counts - expected) ** 2 / expected)[usual].sum()
    assert statistic < chi2.ppf(0.9999, int(usual.sum()))


@pytest.mark.parametrize("lanes", one_of(4, 1, 8, 16))
def test_lanes_do_not_matter(lanes: int) -> None:
    places = numbers(64)
    random = np.random.default_rng(2)
    viewers: Floats = random.normal(size=(64, 3))
    viewers[:, 2] = np.abs(viewers[:, 2])
    viewers = turned(viewers / np.linalg.norm(viewers, axis=1, keepdims=True))
    lights = viewers[::-1].copy()
    one = ask(material(LOBES["all"]), viewers, lights, places, lanes=1)
    packet = ask(material(LOBES["all"]), viewers, lights, places, lanes=lanes)
    for name in ("value", "density", "chosen", "chosen_density", "chosen_value"):
        assert np.allclose(getattr(one, name), getattr(packet, name), rtol=1e-3, atol=1e-5), name


def test_lambert_is_lambert() -> None:
    lights, _ = hemisphere(20, 20)
    values = {"base": {"color": [0.8, 0.5, 0.25], "weight": 0.5}, "specular": NO_GLOSS}
    found = ask(material(values), np.repeat(toward(0.4), len(lights), axis=0), lights, precision="float64")
    cosine = lights @ np.array([0.0, 0.6, 0.8])
    expected = np.array([0.4, 0.25, 0.125]) / math.pi * cosine[:, None]
    assert np.allclose(found.value, expected, rtol=1e-6)


def test_a_mirror_reflects_what_fresnel_says() -> None:
    """A smooth dielectric over black: all that comes back is the boundary's reflectance."""
    places = numbers(1 << 12)
    values = {"base": {"color": [0, 0, 0]}, "specular": {"roughness": 0.05, "ior": 1.5}}
    for cosine in (0.2, 0.5, 0.9):
        viewers = np.repeat(toward(cosine), len(places), axis=0)
        found = ask(material(values), viewers, viewers, places, precision="float64")
        kept = found.chosen_density > 0
        weights = found.chosen_value[kept, 0] / found.chosen_density[kept]
        expected = maker("tables_layers").fresnel(np.array([cosine]), 1.5)[0]
        assert abs(weights.sum() / len(places) - expected) < 0.01 * expected + 1e-4


def test_tables_are_albedos() -> None:
    table = albedo_tables()
    assert table.dtype == np.float32
    # Those of metals, the first four, are factors of lobes; behind those of fuzz and dielectrics there may be more factors.
    each = ROUGHNESSES * (COSINES_OF_TABLES + 1)
    assert table[: -3 * WAVES].min() >= 0
    assert table[4 * each : (5 + REFLECTANCES) * each].max() <= 1


def test_colours_of_wavenumbers_are_white_together() -> None:
    assert np.abs(albedo_tables()[-3 * WAVES :].reshape(WAVES, 3).sum(axis=0) - 1).max() < 1e-6


def test_tables_that_travel_with_the_program_are_what_is_found() -> None:
    """But for what libraries of mathematics differ in."""
    makers = maker("tables_layers").found_albedos, maker("tables_glass").found_glass
    for kept, find in zip((albedo_tables(), glass_tables()), makers, strict=True):
        found = find()
        assert kept.dtype == found.dtype
        assert kept.shape == found.shape
        assert np.abs(kept - found).max() < 1e-6
        assert not kept.flags.writeable
