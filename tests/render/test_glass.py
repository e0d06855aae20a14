"""Glass (`transmission.h`) keeps energy from both sides, is the same both ways and bends light by Snell's law."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clfractal.scene.materials import PbrMaterial
from tests.makers import maker
from tests.render.lobes import COSINES, WHITE, above, check_integrals, numbers, sampled, toward
from tests.render.material_kernel import NORMAL, ask, turned


def glass(roughness: float, ior: float = 1.5, **more: Any) -> PbrMaterial:
    """Clear glass, unless more is said."""
    values = {"specular": {"roughness": roughness, "ior": ior}, "transmission": {"weight": 1}, **more}
    found: PbrMaterial = PbrMaterial.model_validate(values)
    return found


LAYERS: dict[str, PbrMaterial] = {
    "half": glass(0.4, base=WHITE, transmission={"weight": 0.5}),
    "part metal": glass(0.5, base={**WHITE, "metalness": 0.4}),
    "coat": glass(0.2, coat={"weight": 0.8, "roughness": 0.3}),
    "fuzz": glass(0.6, fuzz={"weight": 0.7}),
}


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("ior", [1.0, 1.1, 1.33, 1.5, 2.4])
def test_a_white_furnace_stays_white(ior: float, inside: bool) -> None:
    for roughness in (0.0, 0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0):
        for cosine in COSINES:
            found = sampled(glass(roughness, ior), toward(cosine), numbers(1 << 14), inside=inside)
            assert np.abs(found - 1).max() < 0.01, (roughness, cosine, found)


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("name", LAYERS)
def test_layers_over_glass_keep_energy(name: str, inside: bool) -> None:
    for cosine in COSINES:
        found = sampled(LAYERS[name], toward(cosine), numbers(1 << 14), inside=inside, precision="float64")
        assert np.abs(found - 1).max() < 0.01, (cosine, found)


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("ior", [1.3, 2.0])
def test_integrals_over_the_sphere(ior: float, inside: bool) -> None:
    for cosine in COSINES[1:]:
        check_integrals(glass(0.6, ior), toward(cosine), inside=inside)


@pytest.mark.parametrize("roughness", [0.3, 0.8])
def test_the_same_both_ways(roughness: float) -> None:
    """f over the square of the index where the light comes from; the normal is always on the viewer's side."""
    ior, flip = 1.5, np.array([1, 1, -1])
    one, two = above(300, 3), above(300, 4)  # the second as seen from below
    known = glass(roughness, ior)
    there = ask(known, turned(one), turned(two * flip), precision="float64").value
    back = ask(known, turned(two), turned(one * flip), precision="float64", inside=True).value
    assert there.max() > 0.1
    assert np.allclose(there / two[:, 2:] / ior**2, back / one[:, 2:], rtol=1e-3, atol=1e-9)


@pytest.mark.parametrize("cosine", [0.5, 0.8, 0.95])
@pytest.mark.parametrize(("ior", "inside"), [(1.33, False), (1.5, True), (2.4, False)])
def test_smooth_glass_follows_snell_and_fresnel(ior: float, inside: bool, cosine: float) -> None:
    """Directions beyond the boundary, and how many go there, none beyond the critical angle; roughness 0 is the smoothest
    that there is."""
    across, viewer = 1 / ior if inside else ior, toward(cosine)
    found = ask(glass(0, ior), viewer, viewer, numbers(1 << 13), inside=inside)
    beyond = (found.chosen_density > 0) & (found.chosen @ NORMAL < 0)
    sine = math.sqrt(1 - cosine * cosine) / across
    reflected = maker("tables_glass").fresnel_across(np.array([cosine]), across)[0] if sine < 1 else 1.0
    assert abs(beyond.mean() - (1 - reflected)) < 2e-3
    if sine < 1:
        expected = -viewer[0] / across + (cosine / across - math.sqrt(1 - sine**2)) * NORMAL
        assert np.abs(found.chosen[beyond].mean(axis=0) - expected).max() < 1e-3
        assert np.abs(found.chosen[beyond] - expected).mean() < 5e-3


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
