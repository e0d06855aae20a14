"""Materials (`bsdf.h`) keep energy, are the same both ways, and are sampled as their density says."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from clfractal.shading.scattering import COSINES as COSINES_OF_TABLES
from clfractal.shading.scattering import REFLECTANCES, ROUGHNESSES, WAVES, albedo_tables, glass_tables
from tests.makers import maker
from tests.render.lobes import (
    COSINES,
    LOBES,
    NO_GLOSS,
    WHITE,
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
from tests.render.material_kernel import NORMAL, ask
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
