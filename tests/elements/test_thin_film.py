"""A thin film against Airy's sum in complex numbers, over every nanometre of the CIE's colours; its energy, its limits."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from tests.render.lobes import COSINES, material, numbers, sampled, toward
from tests.render.material_kernel import ask, turned
from tests.variants import one_of

mitsuba = pytest.importorskip("mitsuba")
pytestmark = pytest.mark.light

Doubles = npt.NDArray[np.float64]
NANOMETRES = np.arange(360.0, 831.0)
ANGLES = (1.0, 0.7, 0.4, 0.2)
# Indices of metals at the sodium lines, about: gold's of red, green and blue light, aluminium, iron, titanium.
METALS = [0.18 + 3.4j, 0.42 + 2.35j, 1.37 + 1.77j, 1.2 + 7.2j, 2.9 + 3j, 2.7 + 3.8j]
WHITE = {"color": [1, 1, 1]}
FURNACES: dict[str, dict[str, Any]] = {
    "gloss": {"base": WHITE, "specular": {"roughness": 0}},
    "rough gloss": {"base": WHITE, "specular": {"roughness": 0.5}},
    "wide gloss": {"base": {**WHITE, "diffuse_roughness": 0.5}, "specular": {"roughness": 1, "ior": 2}},
    "no boundary": {"base": WHITE, "specular": {"roughness": 0.3, "ior": 1}},
    "metal": {"base": {**WHITE, "metalness": 1}, "specular": {"roughness": 0.2}},
    "rough metal": {"base": {**WHITE, "metalness": 1}, "specular": {"roughness": 0.8}},
    "half metal": {"base": {**WHITE, "metalness": 0.5}, "specular": {"roughness": 0.4}},
    "coated": {"base": WHITE, "specular": {"roughness": 0.4}, "coat": {"weight": 0.7, "darkening": 0}},
    "glass": {"specular": {"roughness": 0}, "transmission": {"weight": 1}},
    "rough glass": {"specular": {"roughness": 0.4}, "transmission": {"weight": 1}},
    "bubble": {"specular": {"roughness": 0, "ior": 1}, "transmission": {"weight": 1}},
}


@cache
def weights() -> Doubles:
    """Of linear Rec. 709 at each nanometre, so that light of all wavelengths alike is white."""
    mitsuba.set_variant("scalar_rgb")
    matched = np.array([np.ravel(mitsuba.cie1931_xyz(float(each))) for each in NANOMETRES])
    to_rgb = np.linalg.inv(
        [[0.412391, 0.357584, 0.180481], [0.212639, 0.715169, 0.072192], [0.019331, 0.119195, 0.950532]]
    )
    found = matched @ to_rgb.T
    return np.asarray(found / found.sum(axis=0))


def fresnel(index: complex, cosine: float) -> float:
    along = np.sqrt(index * index - 1 + cosine * cosine + 0j)
    across = (cosine - along) / (cosine + along)
    level = (index * index * cosine - along) / (index * index * cosine + along)
    return float(abs(across) ** 2 + abs(level) ** 2) / 2


def airy(cosine: float, thickness: float, film: float, base: complex) -> Doubles:
    """What a film in air reflects, of both polarisations, in linear Rec. 709."""
    along = [cosine + 0j, *(np.sqrt(each * each - 1 + cosine * cosine + 0j) for each in (film, base))]
    phase = np.exp(4j * np.pi * along[1] * thickness * 1000 / NANOMETRES)
    found = np.zeros(len(NANOMETRES))
    for power in (0, 2):
        air, within, below = (z / n**power for z, n in zip(along, (1.0, film, base), strict=True))
        outer, inner = (air - within) / (air + within), (within - below) / (within + below)
        found += np.abs((outer + inner * phase) / (1 + outer * inner * phase)) ** 2 / 2
    return found @ weights()


def mirrored(parts: dict[str, Any], cosine: float, **options: Any) -> Doubles:
    """What a smooth material reflects of one direction, over what a mirror does."""
    sine = np.sqrt(1 - cosine * cosine)
    viewer, light = turned(np.array([[sine, 0, cosine]])), turned(np.array([[-sine, 0, cosine]]))
    smooth = {**parts, "specular": {**parts.get("specular", {}), "roughness": 0}}
    mirror = {"base": {**WHITE, "metalness": 1}, "specular": {"roughness": 0}}
    one, all_of_it = (ask(material(each), viewer, light, **options).value[0] for each in (smooth, mirror))
    return np.asarray(one / all_of_it)


def black(index: float, thickness: float, film: float) -> dict[str, Any]:
    """A black body."""
    return {
        "base": {"color": [0, 0, 0]},
        "specular": {"ior": index},
        "thin_film": {"weight": 1, "thickness": thickness, "ior": film},
    }


def metal(index: complex, thickness: float, film: float) -> dict[str, Any]:
    """A metal of a complex index, by its reflectances straight on and at 82 degrees."""
    straight = fresnel(index, 1)
    schlick = straight + (1 - straight) * (6 / 7) ** 5
    return {
        "base": {"color": [straight] * 3, "metalness": 1},
        "specular": {"color": [min(fresnel(index, 1 / 7) / schlick, 1)] * 3},
        "thin_film": {"weight": 1, "thickness": thickness, "ior": film},
    }


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize(
    ("index", "film"), [(1.5, 1.33), (1.5, 1.8), (1.5, 2.4), (3, 1.4), (3, 2), (1, 1.33)]
)
def test_on_dielectrics(index: float, film: float, precision: Any) -> None:
    far = []
    for thickness in (0.03, 0.1, 0.25, 0.5, 0.8):
        for cosine in ANGLES:
            truth = np.clip(airy(cosine, thickness, film, index), 0, 1)
            found = mirrored(black(index, thickness, film), cosine, precision=precision)
            far.append(np.abs(found - truth).max())
    assert max(far) < 0.006


@pytest.mark.parametrize("index", METALS)
def test_on_metals(index: complex) -> None:
    """Their indices are known by two reflectances alone."""
    far = []
    for film in (1.4, 2.2):
        for thickness in (0.05, 0.1, 0.25, 0.5):
            for cosine in ANGLES:
                truth = np.clip(airy(cosine, thickness, film, index), 0, 1)
                far.append(np.abs(mirrored(metal(index, thickness, film), cosine) - truth).max())
    assert max(far) < 0.04
    assert np.mean(far) < 0.025


@pytest.mark.parametrize("thickness", [0.1, 0.35, 0.9])
@pytest.mark.parametrize("name", FURNACES)
def test_nothing_is_lost_or_made(name: str, thickness: float) -> None:
    """A film alone on a rough body changes with the angle more than its mean at three cosines tells at grazing ones."""
    parts = {**FURNACES[name], "thin_film": {"weight": 1, "thickness": thickness, "ior": 1.7}}
    for inside in (False, True) if "transmission" in parts else (False,):
        for cosine in COSINES:
            found = sampled(material(parts), toward(cosine), numbers(1 << 14), inside=inside)
            most = 0.07 if name == "no boundary" and cosine < 0.2 else 0.01
            assert np.abs(found - 1).max() < most, (inside, cosine, found)


def test_no_film_is_none() -> None:
    """No weight, and no thickness, leave every bit."""
    for parts in FURNACES.values():
        plain, *others = (
            ask(material({**parts, **film}), toward(0.6), toward(0.6), numbers(1 << 10))
            for film in ({}, {"thin_film": {"weight": 0}}, {"thin_film": {"weight": 1, "thickness": 0}})
        )
        for found in others:
            for name in ("chosen_value", "chosen_density", "value"):
                assert (getattr(found, name) == getattr(plain, name)).all()


def test_a_film_thinner_than_light_does_nothing_and_a_thick_one_has_no_colour() -> None:
    bare = {"base": {"color": [0, 0, 0]}, "specular": {"ior": 1.6}}
    assert np.abs(mirrored(black(1.6, 1e-4, 1.33), 0.7) - mirrored(bare, 0.7)).max() < 1e-4
    found = mirrored(black(1.6, 20, 1.33), 0.7)
    assert np.ptp(found) < 1e-5
    assert np.abs(found - airy(0.7, 20, 1.33, 1.6)).max() < 0.003


def test_half_a_film_is_half_of_it() -> None:
    parts = metal(0.42 + 2.35j, 0.2, 1.5)
    half, whole, none = (
        mirrored({**parts, "thin_film": {**parts["thin_film"], "weight": weight}}, 0.6)
        for weight in (0.5, 1, 0)
    )
    assert np.abs(half - (whole + none) / 2).max() < 1e-6
    assert np.abs(whole - none).max() > 0.03
