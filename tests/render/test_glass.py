"""Glass (`transmission.h`) keeps energy from both sides, is the same both ways and bends light by Snell's law."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chi2

from clfractal.scene.materials import PbrMaterial
from tests.makers import maker
from tests.render.lobes import COSINES, numbers, toward
from tests.render.material_kernel import NORMAL, ask, turned
from tests.variants import one_of

Floats = npt.NDArray[np.floating[Any]]


def glass(roughness: float, ior: float = 1.5, **more: Any) -> PbrMaterial:
    """Clear glass, unless more is said."""
    values = {"specular": {"roughness": roughness, "ior": ior}, "transmission": {"weight": 1}, **more}
    found: PbrMaterial = PbrMaterial.model_validate(values)
    return found


WHITE: dict[str, Any] = {"color": [1, 1, 1]}
LAYERS: dict[str, PbrMaterial] = {
    "half": glass(0.4, base=WHITE, transmission={"weight": 0.5}),
    "part metal": glass(0.5, base={**WHITE, "metalness": 0.4}),
    "coat": glass(0.2, coat={"weight": 0.8, "roughness": 0.3}),
    "fuzz": glass(0.6, fuzz={"weight": 0.7}),
}


def sphere(heights: Floats, angles: int) -> Floats:
    """Directions all around at the given cosines to the normal, for each of them all angles."""
    z, phi = heights, 2 * math.pi * (np.arange(angles) + 0.5) / angles
    level = np.sqrt(1 - z * z)
    local = np.stack(
        np.broadcast_arrays(level[:, None] * np.cos(phi), level[:, None] * np.sin(phi), z[:, None])
    )
    return turned(local.reshape(3, -1).T)


def scattered(material: PbrMaterial, cosine: float, *, inside: bool, precision: Any = "float32") -> float:
    """The mean of value over density of samples: all that is reflected and refracted."""
    places = numbers(1 << 14)
    viewers = np.repeat(toward(cosine), len(places), axis=0)
    found = ask(material, viewers, viewers, places, inside=inside, precision=precision)
    usable = found.chosen_density > 0
    return float((found.chosen_value[usable, 0] / found.chosen_density[usable]).sum() / len(places))


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("ior", [1.0, 1.1, 1.33, 1.5, 2.4])
def test_a_white_furnace_stays_white(ior: float, inside: bool) -> None:
    for roughness in (0.0, 0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0):
        for cosine in COSINES:
            all_light = scattered(glass(roughness, ior), cosine, inside=inside)
            assert abs(all_light - 1) < 0.01, (roughness, cosine, all_light)


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("name", LAYERS)
def test_layers_over_glass_keep_energy(name: str, inside: bool) -> None:
    for cosine in COSINES:
        all_light = scattered(LAYERS[name], cosine, inside=inside, precision="float64")
        assert abs(all_light - 1) < 0.01, (cosine, all_light)


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("ior", [1.3, 2.0])
def test_integrals_over_the_sphere(ior: float, inside: bool) -> None:
    """By quadrature, without sampling: all light, and all probability but that of facets that others hide."""
    count = 420
    theta = math.pi * (np.arange(count) + 0.5) / count
    lights = sphere(np.cos(theta), count)
    areas = np.repeat(np.sin(theta) * math.pi / count * 2 * math.pi / count, count)
    material, places = glass(0.6, ior), numbers(1 << 14)
    for cosine in COSINES[1:]:
        viewers = np.repeat(toward(cosine), len(lights), axis=0)
        found = ask(material, viewers, lights, precision="float64", inside=inside)
        assert abs(found.value[:, 0] @ areas - 1) < 0.01
        tried = ask(material, viewers[: len(places)], lights[:1], places, inside=inside)
        assert abs(found.density @ areas - np.mean(tried.chosen_density > 0)) < 0.01


def test_the_same_both_ways() -> None:
    """f over the square of the index where the light comes from; the normal is always on the viewer's side."""
    random = np.random.default_rng(3)
    above, below = random.normal(size=(2, 300, 3))
    above[:, 2], below[:, 2] = np.abs(above[:, 2]) + 0.05, -np.abs(below[:, 2]) - 0.05
    above /= np.linalg.norm(above, axis=1, keepdims=True)
    below /= np.linalg.norm(below, axis=1, keepdims=True)
    ior, flip = 1.5, np.array([1, 1, -1])
    for roughness in (0.3, 0.8):
        one = ask(glass(roughness, ior), turned(above), turned(below), precision="float64").value
        two = ask(
            glass(roughness, ior),
            turned(below * flip),
            turned(above * flip),
            precision="float64",
            inside=True,
        ).value
        assert one.max() > 0.1
        assert np.allclose(one / -below[:, 2:] / ior**2, two / above[:, 2:], rtol=1e-3, atol=1e-9)


@pytest.mark.parametrize("inside", [False, True])
def test_samples_follow_their_density(inside: bool) -> None:
    """Counts in cells of the sphere against the density's integral over them (chi-square)."""
    count, across, around = 1 << 16, 12, 12
    material = glass(
        0.7, 1.5, base=WHITE, transmission={"weight": 0.7}, coat={"weight": 0.4, "roughness": 0.5}
    )
    random = np.random.default_rng(11)
    viewers = np.repeat(toward(0.6), count, axis=0)
    places = np.clip(random.random((count, 3)), 1e-6, 1 - 1e-6)
    found = ask(material, viewers, viewers, places, inside=inside)
    local = (found.chosen @ turned(np.eye(3)).T)[found.chosen_density > 0]
    phi = np.arctan2(local[:, 1], local[:, 0]) % (2 * math.pi)
    bounds = ((-1, 1), (0, 2 * math.pi))
    counts = np.histogram2d(-local[:, 2], phi, bins=(across, around), range=bounds)[0]
    lights, each = sphere(1 - 2 * (np.arange(960) + 0.5) / 960, 480), 4 * math.pi / (960 * 480)
    density = ask(
        material, np.repeat(toward(0.6), len(lights), axis=0), lights, precision="float64", inside=inside
    ).density
    expected = density.reshape(across, 960 // across, around, 480 // around).sum(axis=(1, 3)) * each * count
    usual = expected > 20
    assert usual[:6].any()
    assert usual[6:].any()
    statistic = ((counts - expected) ** 2 / expected)[usual].sum()
    assert statistic < chi2.ppf(0.9999, int(usual.sum()))


@pytest.mark.parametrize(("ior", "inside"), [(1.33, False), (1.5, True), (2.4, False)])
def test_smooth_glass_follows_snell_and_fresnel(ior: float, inside: bool) -> None:
    """Directions beyond the boundary, and how many go there; roughness 0 is the smoothest that there is."""
    across = 1 / ior if inside else ior
    places = numbers(1 << 13)
    for cosine in (0.8, 0.95):
        viewer = toward(cosine)
        found = ask(glass(0, ior), np.repeat(viewer, len(places), axis=0), viewer, places, inside=inside)
        beyond = (found.chosen_density > 0) & (found.chosen @ NORMAL < 0)
        other = math.sqrt(1 - (1 - cosine * cosine) / across**2)
        expected = -viewer[0] / across + (cosine / across - other) * NORMAL
        assert np.abs(found.chosen[beyond].mean(axis=0) - expected).max() < 1e-3
        assert np.abs(found.chosen[beyond] - expected).mean() < 5e-3
        reflected = maker("tables_glass").fresnel_across(np.array([cosine]), across)[0]
        assert abs(beyond.mean() - (1 - reflected)) < 2e-3


def test_all_is_reflected_beyond_the_critical_angle() -> None:
    places = numbers(1 << 10)
    viewers = np.repeat(toward(0.5), len(places), axis=0)
    found = ask(glass(0, 1.5), viewers, viewers, places, inside=True)
    assert (found.chosen @ NORMAL > 0).all()


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("lanes", one_of(4, 16))
def test_lanes_do_not_matter(lanes: int, precision: Any) -> None:
    places = numbers(64)
    random = np.random.default_rng(2)
    viewers, lights = random.normal(size=(2, 64, 3))
    viewers[:, 2] = np.abs(viewers[:, 2])
    viewers = turned(viewers / np.linalg.norm(viewers, axis=1, keepdims=True))
    lights = turned(lights / np.linalg.norm(lights, axis=1, keepdims=True))
    material = glass(0.5, 1.4, base=WHITE, transmission={"weight": 0.8})
    for inside in (False, True):
        one = ask(material, viewers, lights, places, inside=inside, precision=precision)
        packet = ask(material, viewers, lights, places, lanes=lanes, inside=inside, precision=precision)
        for name in ("value", "density", "chosen", "chosen_density", "chosen_value"):
            assert np.allclose(getattr(one, name), getattr(packet, name), rtol=1e-3, atol=1e-5), name


def test_wavelengths_are_white_together() -> None:
    table = maker("tables_glass").wavelengths()
    assert np.allclose(np.trapezoid(table[:, 1:], dx=1 / (len(table) - 1), axis=0), 1)
    assert (table[:, 1:] >= 0).all()
    # The index falls from blue to red; it is told from line d, in parts of the difference of lines F and C.
    assert (np.diff(table[:, 0]) < 0).all()
    bend, colors = table[:, 0], maker("tables_spectrum").seen_colors(np.array([450.0, 540.0, 620.0]))
    assert (colors.argmax(axis=1) == [2, 1, 0]).all()
    blue, green, red = (np.average(bend, weights=table[:, n]) for n in (3, 2, 1))
    assert red < 0.3
    assert 0.1 < green < 0.6 < blue
