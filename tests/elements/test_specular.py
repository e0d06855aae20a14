"""Highlights that are drawn out along a tangent: OpenPBR's widths, energy, reciprocity, sampling, and Mitsuba's values."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from clfractal.elements.materials.specular import Specular
from clfractal.errors import SceneError
from clfractal.files.resources import folder
from clfractal.shading import scattering
from tests.makers import maker
from tests.render.lobes import Floats, above, check_both_ways, check_samples, material, numbers, sampled
from tests.render.material_kernel import NORMAL, ask, turned
from tests.variants import one_of

pytestmark = pytest.mark.light

ALONG = [1.0, 0.0, 0.0]  # of the surface of these tests
GRID = [(r, a) for r in (0.35, 0.5, 0.75, 1.0) for a in (0.5, 0.9)]
ONE, TWO = turned(above(200, 7, 0.1)), turned(above(200, 8, 0.1))

BODIES: dict[str, dict[str, Any]] = {
    "metal": {"base": {"color": [1, 1, 1], "metalness": 1}},
    "gloss": {"base": {"color": [1, 1, 1]}},
    "glass": {"base": {"color": [1, 1, 1]}, "transmission": {"weight": 1}},
}


def drawn(body: str, roughness: float, anisotropy: float, tangent: Any = ALONG, **more: Any) -> Any:
    specular = {"roughness": roughness, "anisotropy": anisotropy, "tangent": list(tangent), **more}
    return material({**BODIES[body], "specular": specular})


def toward(cosine: float, angle: float) -> Floats:
    """A direction with this cosine to the normal and this angle to the tangent."""
    sine = math.sqrt(1 - cosine * cosine)
    return turned(np.array([[sine * math.cos(angle), sine * math.sin(angle), cosine]]))


LIMITS = {"metal": 0.015, "gloss": 0.01, "glass": 0.012}


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("body", BODIES)
def test_a_white_furnace_stays_white(body: str, precision: Any) -> None:
    for shape in GRID:
        for way in ((0.2, 0.0), (0.2, 1.57), (0.6, 0.7), (1.0, 0.0)):
            known = drawn(body, *shape)
            sums = sampled(known, toward(*way), numbers(1 << 13), precision=precision, lanes=8)
            assert np.abs(sums - 1).max() < LIMITS[body], (shape, way)


@pytest.mark.parametrize("body", ["metal", "gloss"])
def test_the_same_both_ways(body: str) -> None:
    check_both_ways(drawn(body, 0.6, 0.8))


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("angle", [0.0, 0.8, 1.57])
def test_densities_are_those_of_samples(body: str, angle: float) -> None:
    check_samples(drawn(body, 0.5, 0.8), toward(0.6, angle))


_THEIRS = """
import json, sys
import mitsuba as mi
mi.set_variant("scalar_rgb")
told = json.load(sys.stdin)
bsdf = mi.load_dict({"type": "roughconductor", "material": "none", "distribution": "ggx", **told["widths"]})
found = []
for viewer, light in zip(told["viewers"], told["lights"]):
    hit = mi.SurfaceInteraction3f()
    hit.wi = mi.Vector3f(*viewer)
    given = mi.BSDFContext(), hit, mi.Vector3f(*light)
    found.append([bsdf.eval(*given)[0], bsdf.pdf(*given)])
print(json.dumps(found))
"""


@pytest.mark.parametrize(("roughness", "anisotropy"), [(0.5, 0.0), (0.5, 0.6), (0.3, 0.9), (0.8, 0.5)])
def test_values_agree_with_mitsuba(roughness: float, anisotropy: float) -> None:
    """Of facets that mirror all: a dielectric's boundary over Fresnel's reflectance, by widths of OpenPBR 1.1."""
    rest = 1 - anisotropy
    along = roughness**2 * math.sqrt(2 / (1 + rest * rest))
    viewers, facets = above(300, 7, 0.1), above(300, 8, 0.1)
    facets = facets * [along, rest * along, 1.0] + [0.0, 0.0, 0.3]
    facets /= np.linalg.norm(facets, axis=1, keepdims=True)
    lights = 2 * (viewers * facets).sum(axis=1, keepdims=True) * facets - viewers
    over = lights[:, 2] > 0.02
    viewers, lights, facets = viewers[over], lights[over], facets[over]
    told = {
        "widths": {"alpha_u": along, "alpha_v": rest * along},
        "viewers": viewers.tolist(),
        "lights": lights.tolist(),
    }
    answer = subprocess.run(
        [sys.executable, "-c", _THEIRS], input=json.dumps(told), capture_output=True, text=True, check=True
    )
    theirs = np.array(json.loads(answer.stdout))
    # They take what hides the two directions as independent, and here it depends on the same heights of facets.
    one, two = (
        (np.sqrt(1 + ((each[:, :2] * [along, rest * along]) ** 2).sum(axis=1) / each[:, 2] ** 2) - 1) / 2
        for each in (viewers, lights)
    )
    theirs[:, 0] *= (1 + one) * (1 + two) / (1 + one + two)
    specular = {"roughness": roughness, "anisotropy": anisotropy, "tangent": ALONG, "ior": 1.5}
    known = material({"base": {"color": [0, 0, 0]}, "specular": specular})
    found = ask(known, turned(viewers), turned(lights), precision="float64")
    reflectance = maker("tables_layers").fresnel((viewers * facets).sum(axis=1), 1.5)
    assert found.value[:, 0] / reflectance == pytest.approx(theirs[:, 0], rel=2e-4)
    mirror = material({"base": {"color": [1, 1, 1], "metalness": 1}, "specular": specular})
    every = ask(mirror, turned(viewers), turned(lights), precision="float64")
    assert every.value[:, 0].min() > 0
    # A metal's density is that of its facets, but for the part of the hemisphere.
    share = roughness * 0.3 / (1 + roughness * 0.3)
    even = share * lights[:, 2] / math.pi
    assert every.density == pytest.approx((1 - share) * theirs[:, 1] + even, rel=2e-4)


def test_even_highlights_are_what_they_were() -> None:
    """No bit differs, whatever the tangent is."""
    for body in BODIES:
        without = ask(material({**BODIES[body], "specular": {"roughness": 0.4}}), ONE, TWO, lanes=8)
        given = ask(drawn(body, 0.4, 0.0, [0.3, 0.2, -2.0]), ONE, TWO, lanes=8)
        assert np.array_equal(without.value, given.value)
        assert np.array_equal(without.density, given.density)


def test_the_tangent_is_laid_onto_the_surface() -> None:
    """One along the normal is some other."""
    flat, steep, across, upright = (
        ask(drawn("metal", 0.4, 0.7, tangent), ONE, TWO, precision="float64").value
        for tangent in (ALONG, ALONG + 3 * NORMAL, np.cross(NORMAL, ALONG), NORMAL)
    )
    assert np.allclose(steep, flat, rtol=1e-6)
    assert not np.allclose(across, flat, rtol=0.1)
    assert np.isfinite(upright).all()
    assert upright.min() > 0
    with pytest.raises(SceneError, match="must not be zero"):
        Specular.checked({"tangent": [0, 0, 0]})


def test_tables_have_the_sizes_that_kernels_say() -> None:
    text = (folder("kernels") / "elements/materials/costly/specular.h").read_text("utf-8")
    told = dict(re.findall(r"#define (DRAWN_\w+) (\d+)\b", text, re.MULTILINE))
    assert told == {name: str(getattr(scattering, name)) for name in told}
    assert len(told) == 4
