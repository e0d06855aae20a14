"""Materials (`bsdf.h`, `bsdf_bumped.h`) keep energy, are the same both ways, and are sampled as their density says."""

from __future__ import annotations

import math
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from clfractal.shading.scattering import COSINES as COSINES_OF_TABLES
from clfractal.shading.scattering import REFLECTANCES, ROUGHNESSES, WAVES, albedo_tables, glass_tables
from tests.makers import maker
from tests.render.facet_walks import Walks, walked
from tests.render.lobes import (
    COSINES,
    LOBES,
    NO_GLOSS,
    WHITE,
    Floats,
    check_both_ways,
    check_integrals,
    check_lanes,
    check_samples,
    leaning,
    material,
    numbers,
    sampled,
    sphere,
    toward,
)
from tests.render.material_kernel import NORMAL, ask, turned
from tests.variants import one_of

pytestmark = pytest.mark.light

GLASS: dict[str, Any] = {
    "base": WHITE,
    "specular": {"roughness": 0.7},
    "transmission": {"weight": 0.7},
    "coat": {"weight": 0.4, "roughness": 0.5},
}
# Materials, and how they are looked at: from inside glass, or with a relief.
KINDS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "all": (LOBES["all"], {}),
    "glass": (GLASS, {}),
    "glass from inside": (GLASS, {"inside": True}),
    "relief": (LOBES["all"], {"leans": leaning(1.2)}),
}


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("lobe", LOBES)
def test_a_white_furnace_stays_white(lobe: str, precision: Any) -> None:
    for cosine in COSINES:
        sums = sampled(material(LOBES[lobe]), toward(cosine), numbers(1 << 15), precision=precision)
        assert np.abs(sums - 1).max() < 0.01, (cosine, sums)


@pytest.mark.parametrize("lobe", LOBES)
def test_integrals_over_the_hemisphere(lobe: str) -> None:
    for cosine in COSINES[1:]:
        check_integrals(material(LOBES[lobe]), toward(cosine))


@pytest.mark.parametrize("lobe", [name for name in LOBES if not {"coat", "fuzz"} & set(LOBES[name])])
def test_the_same_both_ways(lobe: str) -> None:
    check_both_ways(material(LOBES[lobe]))


@pytest.mark.parametrize("kind", KINDS)
def test_samples_follow_their_density(kind: str) -> None:
    values, options = KINDS[kind]
    check_samples(material(values), toward(0.6), **options)


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("lanes", one_of(4, 8, 16))
@pytest.mark.parametrize("kind", KINDS)
def test_lanes_do_not_matter(kind: str, lanes: int, precision: Any) -> None:
    values, options = KINDS[kind]
    check_lanes(material(values), lanes, precision=precision, **options)


def test_lambert_is_lambert() -> None:
    lights = sphere((np.arange(20) + 0.5) / 20, 20)
    values = {"base": {"color": [0.8, 0.5, 0.25], "weight": 0.5}, "specular": NO_GLOSS}
    found = ask(material(values), toward(0.4), lights, precision="float64")
    expected = np.array([0.4, 0.25, 0.125]) / math.pi * (lights @ NORMAL)[:, None]
    assert np.allclose(found.value, expected, rtol=1e-6)


@pytest.mark.parametrize("cosine", [0.2, 0.5, 0.9])
def test_a_mirror_reflects_what_fresnel_says(cosine: float) -> None:
    """A smooth dielectric over black: all that comes back is the boundary's reflectance."""
    known = material({"base": {"color": [0, 0, 0]}, "specular": {"roughness": 0.05, "ior": 1.5}})
    found = sampled(known, toward(cosine), numbers(1 << 12), precision="float64")[0]
    assert found == pytest.approx(
        maker("tables_layers").fresnel(np.array([cosine]), 1.5)[0], rel=0.01, abs=1e-4
    )


def test_tables_are_albedos() -> None:
    table = albedo_tables()
    # Those of metals, the first four, are factors of lobes; behind those of fuzz and dielectrics there may be more factors.
    each = ROUGHNESSES * (COSINES_OF_TABLES + 1)
    assert table[: -3 * WAVES].min() >= 0
    assert table[4 * each : (5 + REFLECTANCES) * each].max() <= 1
    # Colours of wavenumbers are white together.
    assert np.abs(table[-3 * WAVES :].reshape(WAVES, 3).sum(axis=0) - 1).max() < 1e-6


def test_tables_that_travel_with_the_program_are_what_is_found() -> None:
    """But for what libraries of mathematics differ in."""
    for kept, found in (
        (albedo_tables(), maker("tables_layers").found_albedos()),
        (glass_tables(), maker("tables_glass").found_glass()),
    ):
        assert kept.dtype == found.dtype == np.float32
        assert kept.shape == found.shape
        assert np.abs(kept - found).max() < 1e-6
        assert not kept.flags.writeable


ROUGH_GLASS = {"base": {"color": [1, 1, 1]}, "specular": {"roughness": 0.4}, "transmission": {"weight": 1}}
SLANTS = (0.25, 0.6, 1.0)


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("lobe", ["lambert", "gloss", "rough metal", "all"])
def test_reliefs_in_a_white_furnace(lobe: str, precision: Any) -> None:
    """However steep the relief is, as long as it faces the viewer."""
    for slope, cosine in product((0.3, 1.5), SLANTS):
        viewer, leans = toward(cosine), leaning(slope)
        if float(viewer[0] @ leans) >= 0.05:
            sums = sampled(
                material(LOBES[lobe]), viewer, numbers(1 << 14, 4), leans=leans, precision=precision
            )
            assert np.abs(sums - 1).max() < 0.01, (slope, cosine, sums)


@pytest.mark.parametrize("inside", [False, True])
def test_white_glass_stays_white(inside: bool) -> None:
    for slope, cosine in product((0.3, 1.0), SLANTS[1:]):
        sums = sampled(
            material(ROUGH_GLASS), toward(cosine), numbers(1 << 14, 4), leans=leaning(slope), inside=inside
        )
        assert np.abs(sums - 1).max() < 0.015, (slope, cosine, sums)


@pytest.mark.parametrize("slope", [0.5, 1.5])
@pytest.mark.parametrize("lobe", ["lambert", "gloss", "all"])
def test_integrals_of_reliefs(lobe: str, slope: float) -> None:
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


METAL_ROUGHNESSES = (0.35, 0.5, 0.65, 0.8, 1.0)
METAL_COSINES = (0.95, 0.5, 0.15)
# Colours, and specular colours.
GOLD = ((0.944, 0.776, 0.373), (0.998, 0.981, 0.751))
GREY = ((1.0, 0.7, 0.5), (1.0, 1.0, 1.0))
IRON = ((0.53, 0.51, 0.49), (0.8, 0.7, 0.6))
METALS = {"grey": GREY, "gold": GOLD, "iron": IRON}
PARTS = 4  # cells of the hemisphere, of as much projected solid angle: that many in height, and as many in azimuth
WALKS = 400_000


@cache
def walks(metal: str, roughness: float, cosine: float) -> Walks:
    colors, tints = METALS[metal]
    return walked(cosine, roughness**2, list(zip(colors, tints, strict=True)), count=WALKS, seed=7)


def cells(directions: Floats, light: Floats) -> Floats:
    """Sums of light of directions over cells, shape (colours, heights, azimuths from where the light comes)."""
    azimuth = np.abs(np.arctan2(directions[:, 1], directions[:, 0]))
    edges = ((0, 1), (0, math.pi))
    return np.stack(
        [
            np.histogram2d(directions[:, 2] ** 2, azimuth, bins=PARTS, range=edges, weights=each)[0]
            for each in light.T
        ]
    )


@cache
def reflected(metal: str, roughness: float, cosine: float) -> Floats:
    """The same of the kernels, by midpoints: 160 x 320 directions of equal projected solid angle."""
    colors, tints = METALS[metal]
    values = {
        "base": {"color": list(colors), "metalness": 1},
        "specular": {"roughness": roughness, "color": list(tints)},
    }
    z = np.sqrt((np.arange(160) + 0.5) / 160)[:, None]
    angle = 2 * math.pi * (np.arange(320)[None, :] + 0.5) / 320
    level = np.sqrt(1 - z * z)
    lights = np.stack(np.broadcast_arrays(level * np.cos(angle), level * np.sin(angle), z), axis=-1)
    lights = lights.reshape(-1, 3)
    viewer = np.array([[math.sqrt(1 - cosine * cosine), 0.0, cosine]])
    found = ask(material(values), turned(viewer), turned(lights), precision="float64")
    return cells(lights, found.value * math.pi / len(lights) / lights[:, 2:])


@pytest.mark.parametrize("roughness", METAL_ROUGHNESSES)
@pytest.mark.parametrize("metal", METALS)
def test_light_goes_where_facets_send_it(metal: str, roughness: float) -> None:
    """Of each colour within 1 % of what leaves the facets; in each of 16 cells of equal projected solid angle within 0.7 %
    of all light that comes."""
    for cosine in METAL_COSINES:
        taken, found = walks(metal, roughness, cosine), reflected(metal, roughness, cosine)
        assert np.abs(found.sum(axis=(1, 2)) / taken.light.mean(axis=0) - 1).max() < 0.01, cosine
        assert np.abs(found - cells(taken.leaves, taken.light) / WALKS).max() < 0.007, cosine


@pytest.mark.parametrize("roughness", [0.05, 0.1, 0.17, 0.23, 0.3, 0.43, 0.63, 0.9])
def test_nothing_is_lost_or_made_near_the_horizon(roughness: float) -> None:
    """A white metal's light is 1, also between the places that tables are made for."""
    white = material({"base": {"color": [1, 1, 1], "metalness": 1}, "specular": {"roughness": roughness}})
    for cosine in (0.03, 0.07, 0.12, 0.2, 0.4, 0.8):
        found = sampled(white, toward(cosine), numbers(1 << 14))[0]
        assert abs(found - 1) < 0.01, (cosine, found)


def test_walks_lose_nothing_and_meet_what_ggx_says() -> None:
    """The oracle itself: all light of a white metal leaves; after one facet as much of it as GGX's formula has (0.3275 and
    0.6945 for the cosines 0.9 and 0.15 at the roughness 1, by quadrature)."""
    for cosine, once in ((0.9, 0.3275), (0.15, 0.6945)):
        taken = walked(cosine, 1.0, [(1.0, 1.0)], count=WALKS, seed=3)
        assert (taken.light == 1).all()
        assert (taken.leaves[:, 2] > 0).all()
        assert abs((taken.facets == 1).mean() - once) < 0.003
