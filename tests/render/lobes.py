"""Materials of one lobe or several, and directions to look at them from."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2, qmc

from clfractal.scene.materials import PbrMaterial
from tests.render.material_kernel import NORMAL, Answers, ask, turned

Floats = npt.NDArray[np.floating[Any]]

WHITE: dict[str, Any] = {"color": [1, 1, 1]}

NO_GLOSS = {"weight": 0}

LOBES: dict[str, dict[str, Any]] = {
    "lambert": {"base": WHITE, "specular": NO_GLOSS},
    "rough body": {"base": {**WHITE, "diffuse_roughness": 1}, "specular": NO_GLOSS},
    "gloss": {"base": WHITE, "specular": {"roughness": 0.3}},
    "rough gloss": {"base": {**WHITE, "diffuse_roughness": 0.4}, "specular": {"roughness": 0.9, "ior": 2.2}},
    "weak gloss": {"base": WHITE, "specular": {"roughness": 0.5, "weight": 0.3}},
    "metal": {"base": {**WHITE, "metalness": 1}, "specular": {"roughness": 0.4}},
    "rough metal": {"base": {**WHITE, "metalness": 1}, "specular": {"roughness": 1}},
    "half metal": {"base": {**WHITE, "metalness": 0.5}, "specular": {"roughness": 0.6}},
    "coat": {"base": WHITE, "specular": NO_GLOSS, "coat": {"weight": 1, "roughness": 0.3}},
    "coated metal": {
        "base": {**WHITE, "metalness": 1},
        "specular": {"roughness": 0.5},
        "coat": {"weight": 0.7, "roughness": 0.2},
    },
    "fuzz": {"base": WHITE, "specular": NO_GLOSS, "fuzz": {"weight": 1}},
    "all": {
        "base": {**WHITE, "metalness": 0.3, "diffuse_roughness": 0.5},
        "specular": {"roughness": 0.4},
        "coat": {"weight": 0.6, "roughness": 0.5},
        "fuzz": {"weight": 0.5, "roughness": 0.3},
    },
}

COSINES = (0.1, 0.35, 0.7, 1.0)


def material(values: dict[str, Any]) -> PbrMaterial:
    found: PbrMaterial = PbrMaterial.model_validate(values)
    return found


def toward(cosine: float) -> Floats:
    """A direction with this cosine to the normal, not along an axis."""
    sine = math.sqrt(1 - cosine * cosine)
    return turned(np.array([[0.6 * sine, 0.8 * sine, cosine]]))


def above(count: int, seed: int, least: float = 0.05) -> Floats:
    """Directions by chance over the surface, in its frame."""
    found = np.random.default_rng(seed).normal(size=(count, 3))
    found[:, 2] = np.abs(found[:, 2]) + least
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def leaning(slope: float, angle: float = 0.7) -> Floats:
    """The normal of a relief of that slope on the tests' surface."""
    local = np.array([[slope * math.cos(angle), slope * math.sin(angle), 1.0]])
    return np.asarray(turned(local / np.linalg.norm(local))[0])


def sphere(heights: Floats, angles: int) -> Floats:
    """Directions all around at the given cosines to the normal, for each of them all angles."""
    z, phi = heights[:, None], 2 * math.pi * (np.arange(angles) + 0.5) / angles
    level = np.sqrt(1 - z * z)
    local = np.stack(np.broadcast_arrays(level * np.cos(phi), level * np.sin(phi), z))
    return turned(local.reshape(3, -1).T)


def numbers(count: int, dimensions: int = 3) -> Floats:
    return np.asarray(np.clip(qmc.Sobol(dimensions, seed=5).random(count), 1e-6, 1 - 1e-6))


def sampled(known: PbrMaterial, viewer: Floats, places: Floats, **options: Any) -> Floats:
    """What is reflected and let through in all, of each colour: the mean of value over density of samples."""
    found = ask(known, viewer, viewer, places, **options)
    density = found.chosen_density[:, None]
    return np.asarray(
        np.where(density > 0, found.chosen_value / np.maximum(density, 1e-30), 0.0).mean(axis=0)
    )


def check_integrals(known: PbrMaterial, viewer: Floats, *, count: int = 420, **options: Any) -> None:
    """By quadrature over the sphere, without sampling: all light, and all probability but that of facets that others hide
    and of samples below the surface."""
    theta = math.pi * (np.arange(count) + 0.5) / count
    lights = sphere(np.cos(theta), count)
    areas = np.repeat(np.sin(theta) * math.pi / count * 2 * math.pi / count, count)
    found = ask(known, viewer, lights, precision="float64", **options)
    assert np.abs(areas @ found.value - 1).max() < 0.01
    tried = ask(known, viewer, lights[:1], numbers(1 << 14, 4), **options)
    assert abs(found.density @ areas - np.mean(tried.chosen_density > 0)) < 0.01
    if not known.transmission.weight:
        assert not found.value[lights @ NORMAL < 0].any()
        assert not found.density[lights @ NORMAL < 0].any()


def check_samples(known: PbrMaterial, viewer: Floats, **options: Any) -> None:
    """Counts of samples in cells of the sphere against the density's integral over them (chi-square)."""
    count, across, around = 1 << 16, 16, 12
    places = np.clip(np.random.default_rng(11).random((count, 4)), 1e-6, 1 - 1e-6)
    found = ask(known, viewer, viewer, places, **options)
    local = (found.chosen @ turned(np.eye(3)).T)[found.chosen_density > 0]
    phi = np.arctan2(local[:, 1], local[:, 0]) % (2 * math.pi)
    bounds = ((-1, 1), (0, 2 * math.pi))
    counts = np.histogram2d(-local[:, 2], phi, bins=(across, around), range=bounds)[0]
    lights, each = sphere(1 - 2 * (np.arange(960) + 0.5) / 960, 480), 4 * math.pi / (960 * 480)
    density = ask(known, viewer, lights, precision="float64", **options).density
    expected = density.reshape(across, 960 // across, around, 480 // around).sum(axis=(1, 3)) * each * count
    usual = expected > 20
    assert usual[: across // 2].any()
    assert usual[across // 2 :].any() == bool(known.transmission.weight)
    statistic = ((counts - expected)[usual] ** 2 / expected[usual]).sum()
    assert statistic < chi2.ppf(0.9999, int(usual.sum()))


def check_both_ways(known: PbrMaterial) -> None:
    """f is the same with the directions exchanged."""
    one, two = above(200, 3), above(200, 4)
    there, back = (
        ask(known, turned(a), turned(b), precision="float64").value for a, b in ((one, two), (two, one))
    )
    assert np.allclose(there / two[:, 2:], back / one[:, 2:], rtol=1e-4)


def check_lanes(known: PbrMaterial, lanes: int, **options: Any) -> None:
    """A packet has the answers of single lanes."""
    viewers = turned(above(64, 2, 0))
    one, packet = (
        ask(known, viewers, viewers[::-1], numbers(64, 4), lanes=each, **options) for each in (1, lanes)
    )
    for name in Answers.__slots__:
        assert np.allclose(getattr(one, name), getattr(packet, name), rtol=1e-3, atol=1e-5), name
