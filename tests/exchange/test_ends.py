"""Orbits of the Pseudo Kleinian end where they stand still, with what they carry."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.peers import causes, theirs
from benchmarks.peers.one import record
from clfractal.exchange.ends import ending
from clfractal.exchange.mandelbulber import import_settings, import_text
from clfractal.formulas.catalog import resolve
from clfractal.formulas.reference import own_distance
from tests.exchange.files import program, settings

FOLDED: dict[str, Any] = {
    "title": "Folds and an inversion",
    "variables": ["x", "y", "z"],
    "let": {
        **{f"f{name}": f"2*clamp({name}, -0.7, 0.7) - {name}" for name in "xyz"},
        "k": "max(0.5/(fx*fx + fy*fy + fz*fz), 1)",
    },
    "map": ["fx*k", "fy*k", "fz*k"],
    "add": "none",
    "degree": 1,
    "bounds": {"radius": 100},
    "bailout": 1e9,
    "state": {"grown": {"start": 1, "next": "grown*(k + 0.05)"}},
    "distance": "sqrt(x*x + y*y)*abs(z)/grown",
    "distance_bailout": 1e9,
}


def test_what_stands_still_grows_no_more() -> None:
    points = np.random.default_rng(1).uniform(-6, 6, (400, 3))
    expected = []
    for place in points:
        z, grown = place, 1.0
        for _ in range(200):
            folded = 2 * np.clip(z, -0.7, 0.7) - z
            k = max(0.5 / (folded @ folded), 1.0)
            before, z = z, folded * k
            grown *= k + 0.05
            if (z - before) @ (z - before) < 1e-6 * (z @ z):
                break
        expected.append(np.hypot(z[0], z[1]) * abs(z[2]) / grown)
    chain = resolve({"inline": ending(FOLDED, 100, checks=True)})
    found = own_distance(chain, points, 200)
    # (Where orbits are about to end a rounding decides.)
    near = np.isclose(found, expected, rtol=1e-6)
    assert near.mean() > 0.99
    assert not np.isclose(own_distance(resolve({"inline": FOLDED}), points, 200), expected, rtol=0.5).any()


def test_what_has_ended_is_left_alone_by_what_does_not_check() -> None:
    doubles = {
        **FOLDED,
        "let": {},
        "map": ["2*x", "2*y", "2*z"],
        "state": {"grown": {"start": 1, "next": "2*grown"}},
    }
    found = ending(doubles, 100, checks=False)
    assert found["map"] == ["next_x", "next_y", "next_z"]
    assert found["let"]["next_x"] == "where(ended > 0, x, 2*x)"
    assert found["state"]["ended"] == {"start": 0, "next": "ended"}
    points = np.array([[0.5, 0.2, -0.3]])
    np.testing.assert_allclose(
        own_distance(resolve({"inline": found}), points, 5), np.hypot(16, 6.4) * 9.6 / 32
    )


@pytest.mark.skipif(not theirs.is_there(), reason="Mandelbulber 2 is not installed")
def test_halls_in_both_programs(tmp_path: Path) -> None:
    path = tmp_path / "halls.fract"
    path.write_text(
        settings("formula_1 103;\ncamera 2.66 -4.32 1.41;\ntarget 2.67 -4.28 1.41;\ncamera_top 0 0 1;"),
        encoding="utf-8",
    )
    found = record(path, 48, 100)
    assert causes.verdict(found) == "alike", found
    assert found["ninth"] < 0.01


POWER = """REAL4 OwnIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	aux->DE = aux->DE * 2.0f * aux->r;
	return (REAL4){z.x * z.x - z.y * z.y - z.z * z.z, 2.0f * z.x * z.y, 2.0f * z.x * z.z, z.w};
}
"""


@pytest.mark.parametrize(("count", "known"), [(5, True), (8, True), (9, False)])
def test_after_few_applications_of_a_power_their_distance_is_the_surface(
    count: int, known: bool, tmp_path: Path
) -> None:
    """Squares of a point: what is nearer than 1 has a distance of 0; after 5 the ball of what has not left is larger."""
    folder = program(tmp_path, benesi_pine_tree=POWER)
    keys = f"formula_1 66;\nN {count};\njulia_mode true;\ncamera 4 -7 3;\ntarget 0 0 0;\ncamera_top 0 0 1;"
    section = import_text(settings(keys), "x.fract", formulas=folder).scene["formula"]
    chain = resolve(section)
    assert (chain.rule_index is not None) is known
    if known:
        found = own_distance(chain, np.array([[0.97, 0, 0], [1.05, 0, 0]]), section["iterations"])
        assert found[0] == 0
        assert found[1] == pytest.approx(0.5 * 1.05 * np.log(1.05))


TENT = """REAL4 OwnIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	aux->DE = aux->DE * GROWN;
	return (REAL4){3.0f - 3.0f * fabs(z.x), 0.5f * z.y, 0.5f * z.z, z.w};
}
"""


@pytest.mark.parametrize(("grown", "eye", "known"), [(1.5, 1e-9, True), (3, 1e-9, False), (1.5, 0.2, False)])
def test_an_eye_in_dust_that_their_distance_does_not_see(
    grown: float, eye: float, known: bool, tmp_path: Path
) -> None:
    """Of x -> 3 - 3 |x| the place 0.75 stays, among dust; the text tells how fast distances grow, or half of it."""
    folder = program(tmp_path, benesi_pine_tree=TENT.replace("GROWN", f"{float(grown)}f"))
    keys = (
        f"formula_1 66;\njulia_mode true;\ncamera {0.75 + eye!r} 0.4 0.1;\ntarget 0 0 0;\ncamera_top 0 0 1;"
    )
    section = import_text(settings(keys), "x.fract", formulas=folder).scene["formula"]
    assert (resolve(section).rule_index is not None) is known


@pytest.mark.skipif(not theirs.is_there(), reason="Mandelbulber 2 is not installed")
def test_a_file_chooses_the_distance_of_its_solids(tmp_path: Path) -> None:
    """Tubes by folds that also put spheres into space: what counts are the tubes, as in their picture."""
    path = tmp_path / "tubes.fract"
    text = "formula_1 604;\nN 12;\ndelta_DE_function {};\ncamera 4 -7 3;\ntarget 0 0 0;\ncamera_top 0 0 1;"
    kept = []
    for wanted in (3, 5):
        path.write_text(settings(text.format(wanted)), encoding="utf-8")
        found = record(path, 48, 100)
        assert found["union"] > 0.97, (wanted, found)
        kept.append(found["covered"])
    assert abs(kept[0] - kept[1]) > 0.02


@pytest.mark.skipif(not theirs.is_there(), reason="Mandelbulber 2 is not installed")
@pytest.mark.parametrize(("number", "solid"), [(3, False), (10, True)])
def test_solids_beside_powers_do_not_count(tmp_path: Path, number: int, *, solid: bool) -> None:
    path = tmp_path / "beside.fract"
    path.write_text(
        settings(f"formula_1 {number};\nformula_2 1603;\nhybrid_fractal_enable true;"), encoding="utf-8"
    )
    members = import_settings(path).scene["formula"]["inline"]["chain"]
    assert ("distance" in members[-1]["inline"]) is solid
