"""Several formulas in one text: each is a leaf with a name of its own, whose number stands before its constants."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import choose
from clfractal.formulas import catalog
from clfractal.formulas.opencl import write_formula
from clfractal.formulas.together import write_together
from clfractal.geometry.solids import Body
from clfractal.integrators.points import distances, nearest
from clfractal.scene.load import load_scene

# Of three and four numbers, with scalar rules and without, a chain, and a shape: (the formula, applications).
KINDS = {
    "mandelbulb": 6,
    "quaternion_julia": 8,
    "quaternion_mandelbrot": 8,
    "hast": 9,
    "mandelbox": 7,
    "mengerbulb": 5,
    "sierpinski_tetrahedron": 6,
}
APART = 40.0


def names_of(text: str) -> list[str]:
    """The names of all functions and types."""
    return re.findall(r"^INLINE \w+ (\w+)\(|^\} (\w+);", text, re.MULTILINE)


def test_each_leaf_has_names_of_its_own() -> None:
    chains = tuple(map(catalog.load_chain, KINDS))
    found = names_of(write_together(chains).text)
    assert len(set(found)) == len(found)


def test_equal_functions_are_there_once_with_constants_for_each() -> None:
    near, far = (
        catalog.load_chain({"name": "mandelbulb", "live": ["power"], "parameters": {"power": power}})
        for power in (7.5, 8.5)
    )
    together = write_together((near, catalog.load_chain("hast"), far))
    assert [together.constants[first - 1] for first in together.firsts] == [0, 1, 0]
    assert together.formulas[0].text is together.formulas[2].text
    for chain, first, written in zip((near, far), together.firsts[::2], together.formulas[::2], strict=True):
        own = write_formula(chain).constants
        assert len(written.constants) <= len(own)
        assert together.constants[first : first + len(written.constants)] == written.constants
    assert together.formulas[0].constants != together.formulas[2].constants


@pytest.mark.parametrize("other", KINDS)
@pytest.mark.parametrize("own", ["hast", "quaternion_julia"])
def test_each_formula_is_that_by_itself(own: str, other: str) -> None:
    """Two sets far apart: near each one the distances, normals and counts are its own."""
    place = [APART, 0.0, 0.0]
    objects: dict[str, Any] = {
        "other": {
            "type": "formula",
            "formula": {"name": other, "iterations": KINDS[other]},
            "position": place,
        }
    }
    formula = {"name": own, "iterations": KINDS[own]}
    camera = {"position": [0, -9, 0], "target": [0, 0, 0]}
    scene = load_scene({"version": 1, "formula": formula, "camera": camera, "objects": objects})
    body = Body.of(scene)
    device = choose()
    for number, (chain, at) in enumerate(
        [(scene.chain, [0.0, 0.0, 0.0]), (scene.joined_chains["other"], place)]
    ):
        rng = np.random.default_rng(number)
        arm = rng.normal(size=(400, 3))
        radii = rng.uniform(0.0, 1.0, 400) ** (1 / 3)
        points = (
            np.array(chain.center)
            + chain.radius * radii[:, None] * arm / np.linalg.norm(arm, axis=1)[:, None]
        )
        alone = distances(
            chain, points, KINDS[(own, other)[number]], device=device, lanes=1, precision="float64"
        )
        found, objects_of = nearest(body, points + at, device=device, lanes=1, precision="float64")
        outside = ~alone.inside
        assert (found.inside == alone.inside).mean() > 0.995
        assert (objects_of == number).all()
        same = outside & ~found.inside
        np.testing.assert_allclose(found.full[same], alone.full[same], rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(found.smooth[same], alone.smooth[same], rtol=1e-5, atol=1e-6)
        assert np.median((found.normal * alone.normal).sum(axis=1)[same]) > 1 - 1e-9
