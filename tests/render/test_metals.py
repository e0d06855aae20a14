"""Rough metals against facets between which light is followed by chance, facet after facet."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from tests.render.facet_walks import Walks, walked
from tests.render.lobes import Floats, material, numbers, sampled, toward
from tests.render.material_kernel import ask, turned

pytestmark = pytest.mark.light

ROUGHNESSES = (0.35, 0.5, 0.65, 0.8, 1.0)
COSINES = (0.95, 0.5, 0.15)
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


@pytest.mark.parametrize("roughness", ROUGHNESSES)
@pytest.mark.parametrize("metal", METALS)
def test_light_goes_where_facets_send_it(metal: str, roughness: float) -> None:
    """Of each colour within 1 % of what leaves the facets; in each of 16 cells of equal projected solid angle within 0.7 %
    of all light that comes."""
    for cosine in COSINES:
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
