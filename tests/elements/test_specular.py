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
from tests.render.lobes import Floats, hemisphere, material, numbers
from tests.render.material_kernel import NORMAL, ask, turned
from tests.variants import one_of

pytestmark = pytest.mark.light

ALONG = [1.0, 0.0, 0.0]  # of the surface of these tests
GRID = [(r, a) for r in (0.35, 0.5, 0.75, 1.0) for a in (0.5, 0.9)]
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


def directions(count: int) -> Floats:
    """By chance, over the surface, in its frame."""
    found = np.random.default_rng(7).normal(size=(count, 3))
    found[:, 2] = np.abs(found[:, 2]) + 0.1
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


LIMITS = {"metal": 0.015, "gloss": 0.01, "glass": 0.012}


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("body", BODIES)
def test_a_white_furnace_stays_white(body: str, precision: Any) -> None:
    """Sampled: the mean of value over density is what is reflected in all."""
    places = numbers(1 << 13)
    for roughness, anisotropy in GRID:
        for cosine, angle in ((0.2, 0.0), (0.2, 1.57), (0.6, 0.7), (1.0, 0.0)):
            viewers = np.repeat(toward(cosine, angle), len(places), axis=0)
            found = ask(
                drawn(body, roughness, anisotropy), viewers, viewers, places, precision=precision, lanes=8
            )
            density = found.chosen_density[:, None]
            weights = np.where(density > 0, found.chosen_value / np.maximum(density, 1e-30), 0.0)
            assert np.abs(weights.mean(axis=0) - 1).max() < LIMITS[body], (
                roughness,
                anisotropy,
                cosine,
                angle,
            )


@pytest.mark.parametrize("body", ["metal", "gloss"])
def test_the_same_both_ways(body: str) -> None:
    one, two = directions(400)[:200], directions(400)[200:]
    there = ask(drawn(body, 0.6, 0.8), turned(one), turned(two), precision="float64").value
    back = ask(drawn(body, 0.6, 0.8), turned(two), turned(one), precision="float64").value
    assert np.allclose(there / two[:, 2:], back / one[:, 2:], rtol=1e-4)


@pytest.mark.parametrize("body", ["metal", "gloss"])
@pytest.mark.parametrize("angle", [0.0, 0.8, 1.57])
def test_densities_are_those_of_samples(body: str, angle: float) -> None:
    """In all, and in each of 16 parts of the hemisphere."""
    lights, each = hemisphere()
    places = numbers(1 << 15)
    known, viewer = drawn(body, 0.5, 0.8), toward(0.6, angle)
    density = ask(known, np.repeat(viewer, len(lights), axis=0), lights, precision="float64").density * each
    tried = ask(known, np.repeat(viewer, len(places), axis=0), lights[:1], places)
    usable = tried.chosen_density > 0
    assert density.sum() == pytest.approx(usable.mean(), abs=0.003)

    def part(of: Floats) -> Any:
        side, up = of[:, 0], of @ np.cross(NORMAL, ALONG)
        turn = np.floor((np.arctan2(up, side) / (2 * math.pi) % 1) * 8).astype(int)
        return turn * 2 + (of @ NORMAL > 0.7)

    expected = np.bincount(part(lights), density, 16)
    found = np.bincount(part(tried.chosen[usable]), minlength=16) / len(places)
    assert np.abs(found - expected).max() < 0.004


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
    viewers, facets = directions(600)[:300], directions(600)[300:]
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
    one, two = turned(directions(400)[:200]), turned(directions(400)[200:])
    for body in BODIES:
        without = ask(material({**BODIES[body], "specular": {"roughness": 0.4}}), one, two, lanes=8)
        given = ask(drawn(body, 0.4, 0.0, [0.3, 0.2, -2.0]), one, two, lanes=8)
        assert np.array_equal(without.value, given.value)
        assert np.array_equal(without.density, given.density)


def test_the_tangent_is_laid_onto_the_surface() -> None:
    one, two = turned(directions(400)[:200]), turned(directions(400)[200:])
    flat = ask(drawn("metal", 0.4, 0.7, ALONG), one, two, precision="float64").value
    steep = ask(drawn("metal", 0.4, 0.7, ALONG + 3 * NORMAL), one, two, precision="float64").value
    across = ask(drawn("metal", 0.4, 0.7, np.cross(NORMAL, ALONG)), one, two, precision="float64").value
    assert np.allclose(steep, flat, rtol=1e-6)
    assert not np.allclose(across, flat, rtol=0.1)


def test_a_tangent_along_the_normal_is_some_other() -> None:
    one, two = turned(directions(400)[:200]), turned(directions(400)[200:])
    found = ask(drawn("metal", 0.4, 0.7, NORMAL), one, two, precision="float64").value
    assert np.isfinite(found).all()
    assert found.min() > 0
    with pytest.raises(SceneError, match="must not be zero"):
        Specular.checked({"tangent": [0, 0, 0]})


def test_tables_have_the_sizes_that_kernels_say() -> None:
    text = (folder("kernels") / "elements/materials/costly/specular.h").read_text("utf-8")
    told = dict(re.findall(r"#define (DRAWN_\w+) (\d+)\b", text, re.MULTILINE))
    assert told == {name: str(getattr(scattering, name)) for name in told}
    assert len(told) == 4
