"""Folds by the faces of solids: the solids, texts that choose a face by z, and maps of many parts."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.peers import causes, theirs
from benchmarks.peers.one import record
from clfractal.exchange.polyhedra import faces
from clfractal.formulas.build_orbit import MAX_LETS
from tests.exchange.files import ENUMS, program, settings
from tests.exchange.maps import POINTS, formula_of, mapped
from tests.variants import one_of

NAMES = ("tet", "cube", "oct", "dodeca", "oct_cube", "icosa", "box6", "box5")
# Of solids whose faces are all alike: how many neighbours a face has, and the cosine between both normals.
REGULAR = {
    "tet": (4, 3, -1 / 3),
    "cube": (6, 4, 0.0),
    "oct": (8, 3, 1 / 3),
    "dodeca": (12, 5, 1 / math.sqrt(5)),
    "icosa": (20, 3, math.sqrt(5) / 3),
}
KINDS = "typedef enum\n{\n\tgeneralizedFoldBoxTypeCl_foldTet = 0,\n\tgeneralizedFoldBoxTypeCl_foldIcosa = 5\n} enumKinds;\n"
# Mirrors z, as often as it says, at the face of an icosahedron that it is farthest beyond.
MIRROR = """REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	__constant REAL3 *Nv;
	int sides;
	switch (fractal->genFoldBox.type)
	{
		default:
		case generalizedFoldBoxTypeCl_foldTet:
			Nv = fractal->genFoldBox.Nv_tet;
			sides = fractal->genFoldBox.sides_tet;
			break;
		case generalizedFoldBoxTypeCl_foldIcosa:
			Nv = fractal->genFoldBox.Nv_icosa;
			sides = fractal->genFoldBox.sides_icosa;
			break;
	}
	for (int k = 0; k < TIMES; k++)
	{
		REAL3 zXYZ = z.xyz;
		REAL most = fractal->mandelbox.solid;
		int side = -1;
		for (int i = 0; i < sides; i++)
		{
			REAL beyond = dot(zXYZ, Nv[i]);
			if (beyond > most)
			{
				most = beyond;
				side = i;
			}
		}
		if (side != -1)
		{
			zXYZ += Nv[side] * (2.0f * (fractal->mandelbox.solid - most));
			aux->color += fractal->mandelbox.color.factor.x;
		}
		z = (REAL4){zXYZ.x, zXYZ.y, zXYZ.z, z.w};
	}
	return z * 2.0f;
}
"""


@pytest.mark.parametrize("name", REGULAR)
def test_regular_solids(name: str) -> None:
    normals = np.array(faces(name))
    count, neighbours, cosine = REGULAR[name]
    assert normals.shape == (count, 3)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    between = normals @ normals.T - 3 * np.eye(count)
    np.testing.assert_allclose(between.max(axis=1), cosine, atol=1e-12)
    assert np.all(np.isclose(between, cosine).sum(axis=1) == neighbours)


def test_other_solids() -> None:
    both = {tuple(np.round(each, 9) + 0.0) for name in ("oct", "cube") for each in faces(name) or ()}
    assert {tuple(np.round(each, 9) + 0.0) for each in faces("oct_cube") or ()} == both
    for name, sides in (("box6", 6), ("box5", 5)):
        normals = np.array(faces(name))
        assert len(normals) == sides + 2
        np.testing.assert_allclose(normals.sum(axis=0), 0, atol=1e-12)
        around = normals[normals[:, 2] == 0]
        turned = np.sort(np.arctan2(around[:, 1], around[:, 0]))
        np.testing.assert_allclose(np.diff(turned), 2 * math.pi / sides)
    assert faces("ball") is None


@pytest.mark.parametrize("times", [1, 3])
@pytest.mark.parametrize(("kind", "name"), [("5", "icosa"), ("fold_icosa", "icosa"), ("", "tet")])
def test_a_face_that_z_chooses(tmp_path: Path, times: int, kind: str, name: str) -> None:
    folder = program(tmp_path, generalized_fold_box=MIRROR.replace("TIMES", str(times)))
    (folder / "opencl" / "fractal_cl.h").write_text(ENUMS + KINDS, encoding="utf-8")
    chosen = f"mandelbox_generalized_fold_type {kind};" if kind else ""
    main = "formula_1 37;\ndont_add_c_constant_1 true;"
    formula = formula_of(folder, f"{chosen}\nmandelbox_solid 0.6;", main)["inline"]
    normals, expected = np.array(faces(name)), POINTS.copy()
    for _ in range(times):
        side = np.argmax(normals @ expected, axis=0)
        beyond = np.maximum((normals[side].T * expected).sum(axis=0) - 0.6, 0)
        expected = expected - 2 * beyond * normals[side].T
    np.testing.assert_allclose(mapped(formula, POINTS, 0 * POINTS), 2 * expected, rtol=1e-9, atol=1e-12)
    # What is more than `let` has room for are statements.
    assert ("do" in formula) == (name == "icosa" and times == 3)
    assert ("do" in formula) or len(formula["let"]) <= MAX_LETS


def test_what_is_carried_beside_many_parts(tmp_path: Path) -> None:
    text = MIRROR.replace("TIMES", "3").replace(
        "return z", "aux->dist = min(aux->dist, length(z));\n\treturn z"
    )
    folder = program(tmp_path, generalized_fold_box=text)
    (folder / "opencl" / "fractal_cl.h").write_text(ENUMS + KINDS, encoding="utf-8")
    fractal = "mandelbox_generalized_fold_type 5;"
    formula = formula_of(folder, fractal, "formula_1 37;\ndont_add_c_constant_1 true;")["inline"]
    assert formula["distance"] == "kept_dist"
    assert formula["state"]["kept_dist"] == {"start": 1000}
    assert set(formula["do"][-1]) == {"x", "y", "z", "kept_dist", "kept_de"}


NEAR = "camera 5 -9 4;\ntarget 0 0 0;\ncamera_top -0.2 0.4 0.9;\nformula_1 37;\nN 12;"


@pytest.mark.skipif(not theirs.is_there(), reason="Mandelbulber 2 is not installed")
@pytest.mark.parametrize("kind", one_of(*range(8)))
def test_folds_in_both_programs(kind: int, tmp_path: Path) -> None:
    path = tmp_path / "folded.fract"
    fractal = (
        f"mandelbox_generalized_fold_type {kind};\nmandelbox_scale -1.6;\n"
        "mandelbox_main_rotation_enabled true;\nmandelbox_rotation_main 9 5 3;"
    )
    path.write_text(settings(NEAR, fractal), encoding="utf-8")
    found = record(path, 48, 100)
    assert causes.verdict(found) == "alike", found
