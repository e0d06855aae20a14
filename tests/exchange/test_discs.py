"""Formulas whose orbits end at a disc, as the Pseudo Kleinian's, or between two planes: distances are those to them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clfractal.exchange.mandelbulber import import_text
from clfractal.formulas.catalog import resolve
from clfractal.formulas.reference import own_distance
from tests.exchange.files import program, settings

# A fold of the tests' own under the name of one whose orbits end at a disc, with a scale that its derivative grows by.
DISC = """REAL4 OwnDiscIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	z = fabs(z) * 2.0f - (REAL4){1.0f, 0.0f, 0.0f, 0.0f};
	aux->DE = aux->DE * 2.0f;
	aux->pseudoKleinianDE = fractal->analyticDE.scale1;
	return z;
}
"""


def test_distances_to_discs(tmp_path: Path) -> None:
    folder = program(tmp_path, pseudo_kleinian_mod1=DISC)
    found = import_text(
        settings("formula_1 104;\nN 2;", "analyticDE_scale_1 0.5;"), "x.fract", formulas=folder
    )
    scene = found.scene["formula"]
    points = np.array([[0.2, 0.3, 0.4], [0.75, 0.0, 0.05]])
    measured = own_distance(resolve(scene), points, 2)
    for point, distance in zip(points, measured, strict=True):
        z = point
        for _ in range(2):
            z = 2 * np.abs(z) - [1, 0, 0]
        across = np.hypot(z[0], z[1])
        expected = max(across - 0.5, across * abs(z[2]) / np.linalg.norm(z)) / 4
        assert distance == pytest.approx(expected, rel=1e-6)
    # Another function for distances than that of discs is none of these, but in old files, which do not choose.
    text = settings("formula_1 104;\nN 2;\ndelta_DE_function 2;\niteration_threshold_mode true;")
    for version, has_discs in (("2.20", False), ("2.19", True)):
        other = import_text(text.replace("version 2.20", f"version {version}"), "x.fract", formulas=folder)
        assert ("distance" in str(other.scene["formula"])) == has_discs


@pytest.mark.parametrize("spheres", [True, False])
def test_distances_to_planes(spheres: bool, tmp_path: Path) -> None:
    text = DISC.replace("\taux->pseudoKleinianDE = fractal->analyticDE.scale1;\n", "")
    folder = program(tmp_path, jos_kleinian=text)
    keys = f"transf_folding_value 1.4;\nanalyticDE_tweak_005 0.3;\ntransf_spheres_enabled {str(spheres).lower()};"
    found = import_text(settings("formula_1 122;\nN 2;", keys), "x.fract", formulas=folder)
    points = np.array([[0.2, 0.3, 0.4], [0.75, 0.04, 0.05]])
    measured = own_distance(resolve(found.scene["formula"]), points, 2)
    for point, distance in zip(points, measured, strict=True):
        height = 4 * point[1]
        expected = min(height, 1.4 - height, 0.3) / 4 if spheres else min(height, 0.3) / 4
        assert distance == pytest.approx(expected, rel=1e-6)


def test_an_eye_among_what_does_not_escape(tmp_path: Path) -> None:
    """Three applications are too few for anything to escape: distances are how long z is by how fast it grew."""
    text = """REAL4 OwnSlowIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	z = fabs(z) * 1.1f - (REAL4){1.0f, 0.0f, 0.0f, 0.0f};
	aux->DE = aux->DE * 1.1f;
	return z;
}
"""
    folder = program(tmp_path, menger_mod1=text)
    keys = "formula_1 61;\nN 3;\ncamera 0.3 0.2 0.1;\ntarget 1 1 1;"
    found = import_text(settings(keys), "x.fract", formulas=folder)
    points = np.array([[0.2, 0.3, 0.4], [0.75, 0.0, 0.05]])
    measured = own_distance(resolve(found.scene["formula"]), points, 3)
    for point, distance in zip(points, measured, strict=True):
        z = point
        for _ in range(3):
            z = 1.1 * np.abs(z) - [1, 0, 0]
        assert distance == pytest.approx(np.linalg.norm(z) / 1.1**3, rel=1e-6)
    assert len(found.origins) == 1
    # From where it escapes the set is a solid as ever.
    far = import_text(
        settings(keys.replace("N 3", "N 90").replace("0.3 0.2", "9 9")), "x.fract", formulas=folder
    )
    assert "distance" not in str(far.scene["formula"])
