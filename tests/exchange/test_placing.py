"""Sets that a settings file turns, moves and blends, and what stands around them."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from benchmarks.peers import causes, theirs
from benchmarks.peers.one import record
from clfractal.camera.views import scene_view
from clfractal.elements.shapes.box import BoxObject
from clfractal.elements.shapes.cylinder import CylinderObject
from clfractal.exchange.mandelbulber import import_text
from clfractal.exchange.parameters import rotation
from clfractal.exchange.placing import placing_of
from clfractal.exchange.settings import parse_settings
from clfractal.scene.load import load_scene
from tests.exchange.files import program, settings
from tests.exchange.maps import POINTS, formula_of, mapped
from tests.variants import one_of

CAMERA = "camera 1.5 -2.4 1.1;\ntarget 0.1 0.2 0.1;\ncamera_top 0.1 0.2 1;\nfov 0.9;"
TURNED = "fractal_rotation -35 62 110;\nfractal_position 0.2 0.1 0.3;"
BOX = (
    "primitive_box_1_enabled true;\nprimitive_box_1_position 0.9 -0.7 -0.4;\n"
    "primitive_box_1_rotation 20 -35 50;\nprimitive_box_1_size 0.3 0.6 0.9;"
)
LEVEL = "primitive_plane_1_enabled true;\nprimitive_plane_1_position 0 0 -1;"
SPONGE = "formula_1 7;\nN 4;"
BULB = "alpha_enabled 1;\nN 9;"


def turn_of(angles: tuple[float, float, float]) -> np.ndarray:
    """Rz Ry Rx: a place in the set's space, of one around it."""
    found = np.eye(3)
    for axis, angle in enumerate(np.radians(angles)):
        c, s = np.cos(angle), np.sin(angle)
        one, other = (axis + 1) % 3, (axis + 2) % 3
        about = np.eye(3)
        about[[one, one, other, other], [one, other, one, other]] = c, -s, s, c
        found = about @ found
    return found


@pytest.mark.parametrize("more", ["", f"{TURNED}\n"])
def test_a_target_close_to_the_camera(more: str) -> None:
    # Deep zooms have targets nearer than 1e-13, where the plane that rays go through would be rounded to parts of pixels.
    camera, target = [Fraction(each) for each in ("2.375", "-1.25", "2.625")], []
    for each, away in zip(camera, (-3, 5, 2), strict=True):
        target.append(each + Fraction(away, 2**46))
    keys = "".join(
        f"{key} {' '.join(str(Decimal(each.numerator) / each.denominator) for each in place)};\n"
        for key, place in (("camera", camera), ("target", target))
    )
    found = import_text(
        settings(f"{keys}camera_top 0.1 0.2 1;\nfov 0.9;\nambient_occlusion_enabled true;\n{more}{SPONGE}"),
        "x.fract",
    )
    view = scene_view(load_scene(found.scene))
    turn = turn_of((-35, 62, 110)) if more else np.eye(3)
    forward = turn @ (np.array([-3, 5, 2]) / np.sqrt(38))
    assert view.eye is not None
    steps = np.linspace(0, view.width, 100)
    places = view.center + steps[:, None] * view.side - view.eye
    across = places / (places @ forward)[:, None] - forward
    np.testing.assert_allclose(across @ forward, 0, atol=1e-8)
    np.testing.assert_allclose(across, np.linspace(0, 1.2, 100)[:, None] * view.side, atol=1e-8)
    # Occlusion is sought as far as the picture is high at the set, not at the target: 0.3 of it.
    place = np.subtract(found.scene["camera"]["position"], found.scene["camera"]["target"])
    far = np.linalg.norm(np.maximum(np.abs(found.scene["camera"]["position"]) - 1, 0))
    assert 0.2 * far < np.linalg.norm(place) < 1.01 * far
    assert found.scene["renderer"]["ambient_occlusion"]["distance"] == pytest.approx(
        0.27 * np.linalg.norm(place), rel=1e-3
    )


def test_what_is_around_a_turned_set() -> None:
    lamp = "aux_light_enabled_1 true;\naux_light_position_1 3 0.5 1;"
    found = import_text(settings(f"{CAMERA}\n{SPONGE}\n{TURNED}\n{BOX}\n{LEVEL}\n{lamp}"), "x.fract")
    turn, place = turn_of((-35, 62, 110)), np.array([0.2, 0.1, 0.3])
    np.testing.assert_allclose(found.scene["camera"]["position"], turn @ ([1.5, -2.4, 1.1] - place))
    np.testing.assert_allclose(found.scene["camera"]["target"], turn @ ([0.1, 0.2, 0.1] - place))
    np.testing.assert_allclose(found.scene["camera"]["up"], turn @ [0.1, 0.2, 1])
    disc = load_scene(found.scene).objects["plane 1"]
    assert isinstance(disc, CylinderObject)
    for point in np.random.default_rng(2).uniform(-60, 60, (300, 2)):
        within = np.linalg.norm(point - [1.5, -2.4]) < np.sqrt(50**2 - 2.1**2)
        assert [disc.holds(tuple(turn @ ([*point, -1 + up] - place))) for up in (-1e-4, 1e-4)] == [
            within,
            False,
        ]
    (shines,) = (light for light in found.scene["lights"] if light.get("type") == "point")
    np.testing.assert_allclose(shines["position"], turn @ ([3, 0.5, 1] - place))
    box = load_scene(found.scene).objects["box 1"]
    assert isinstance(box, BoxObject)
    own = np.array(rotation((20.0, -35.0, 50.0, 0.0)))
    for point in np.random.default_rng(1).normal(size=(300, 3)) * 0.5 + [0.9, -0.7, -0.4]:
        inside = bool(np.all(np.abs(own @ (point - [0.9, -0.7, -0.4])) <= [0.15, 0.3, 0.45]))
        assert box.holds(tuple(turn @ (point - place))) == inside
    assert not any("fractal_" in remark for remark in found.remarks)


@pytest.mark.parametrize("legacy", ["", "legacy_coordinate_system true;"])
def test_the_sky_turns_with_what_is_around_the_set(legacy: str) -> None:
    found = import_text(settings(f"{CAMERA}\n{SPONGE}\n{TURNED}\n{legacy}"), "x.fract", look="ours")
    up = turn_of((-35, 62, 110)) @ [0, 0, 1]
    np.testing.assert_allclose(found.scene["environment"]["up"], up * (1, 1, -1 if legacy else 1), atol=1e-6)
    assert not found.remarks


def test_a_set_that_stays_has_no_place_of_its_own() -> None:
    assert placing_of(parse_settings(settings(f"{CAMERA}\nfractal_rotation 0 0 0;"), "x.fract")) is None


def test_a_joined_formula_has_place_rotation_and_size() -> None:
    keys = (
        "boolean_operators true;\nformula_1 7;\nformula_2 8;\nformula_position_2 1 2 3;\nformula_scale_2 0.2;"
    )
    found = import_text(
        settings(f"{CAMERA}\n{keys}\nformula_rotation_2 10 20 30;\nformula_weight_2 0.5;"), "x.fract"
    )
    placed = found.scene["objects"]["formula 2"]
    assert (placed["position"], placed["scale"]) == ([1, 2, 3], 0.2)
    x, y, z = placed["rotation"]
    # Ours turn the object, about x, then y, then z: the other way round.
    ours = turn_of((x, y, z))
    np.testing.assert_allclose(ours.T, turn_of((10, 20, 30)), atol=1e-7)
    assert found.remarks == ()


def test_formulas_of_no_weight_leave_z_where_it_is(tmp_path: Path) -> None:
    text = "REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux) { return z * %s; }"
    folder = program(tmp_path, menger_mod1=text % "2.0f", xenodreambuie=text % "3.0f")
    hybrid = "hybrid_fractal_enable true;\nformula_1 61;\nformula_2 11;\nformula_weight_2 %s;"
    for weight, factor in (("0", 1.0), ("1", 3.0)):
        section = formula_of(folder, "", hybrid % weight)
        members = [each["inline"] for each in section["inline"]["chain"]]
        first, second = (
            next(each for each in members if each["title"].startswith(f"Formula {number} "))
            for number in (61, 11)
        )
        np.testing.assert_allclose(mapped(first, POINTS, 0 * POINTS), 2 * POINTS)
        np.testing.assert_allclose(mapped(second, POINTS, 0 * POINTS), factor * POINTS)
        assert second["add"] == ("point" if factor > 1 else "none")


def test_a_julia_set_whose_formula_asks_for_the_point(tmp_path: Path) -> None:
    text = """REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	z.x = z.x * z.x + aux->const_c.y;
	return z;
}
"""
    section = formula_of(
        program(tmp_path, xenodreambuie=text), "", "formula_1 11;\njulia_mode true;\njulia_c 0.1 0.2 0.3;"
    )
    formula = section["inline"]["chain"][-1]["inline"]
    x, y, z = POINTS
    point = POINTS[::-1]
    expected = np.array([x * x + point[1] + 0.1, y + 0.2, z + 0.3])
    np.testing.assert_allclose(mapped(formula, POINTS, point), expected, rtol=1e-9, atol=1e-12)


def test_space_that_repeats(tmp_path: Path) -> None:
    """The orbit begins in the middle cell, and what is added is the point there."""
    text = (
        "REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux) { return z * 2.0f; }"
    )
    section = formula_of(program(tmp_path, xenodreambuie=text), "", "formula_1 11;\nrepeat 0 3 0.5;")
    first, second = (each["inline"] for each in section["inline"]["chain"])
    x, y, z = POINTS
    cell = np.array([x, y - 3 * np.round(y / 3), z - 0.5 * np.round(z / 0.5)])
    np.testing.assert_allclose(mapped(first, POINTS, 0 * POINTS), cell, atol=1e-12)
    np.testing.assert_allclose(mapped(second, POINTS[::-1], POINTS), 2 * POINTS[::-1] + cell, atol=1e-12)
    assert section["iterations"] == 10


def test_a_loop_that_ends_by_z(tmp_path: Path) -> None:
    text = """REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	while (z.x > 0.5f) z.x -= 1.0f;
	for (int k = 0; k < 3 && z.y < 1.0f; k++) z.y = z.y * 2.0f + k;
	return z;
}
"""
    formula = formula_of(program(tmp_path, menger_mod1=text), "", "formula_1 61;")["inline"]
    x, y, z = POINTS
    for k in range(3):
        y = np.where(y < 1, 2 * y + k, y)
    expected = np.array([np.where(x > 0.5, x - np.ceil(x - 0.5), x), y, z])
    np.testing.assert_allclose(mapped(formula, POINTS, 0 * POINTS), expected, atol=1e-12)


@pytest.mark.skipif(not theirs.is_there(), reason="Mandelbulber 2 is not installed")
@pytest.mark.parametrize(
    "keys",
    [
        f"{SPONGE}\n{TURNED}\n{BOX}",
        f"{BULB}\n{TURNED}\njulia_mode true;\njulia_c -0.9 0.3 0.2;",
        f"{SPONGE}\nrepeat 1.5 0 0;\nlimits_enabled true;\nlimit_min -1 -1 -1;\nlimit_max 1 1 1;",
        "boolean_operators true;\nformula_1 7;\nformula_2 7;\nN 4;\nformula_position_2 0.4 -0.5 0.6;\n"
        "formula_rotation_2 -35 62 110;\nformula_scale_2 0.6;",
    ],
    ids=["sponge", "julia", "repeated", "joined"],
)
def test_turned_sets_in_both_programs(keys: str, tmp_path: Path) -> None:
    path = tmp_path / "turned.fract"
    path.write_text(settings(f"{CAMERA}\n{keys}"), encoding="utf-8")
    found = record(path, 48, 100)
    assert causes.verdict(found) == "alike", found


NEAR = "camera 3 -6 3;\ntarget 0 0 0;\ncamera_top -0.2 0.4 0.9;"
FAR = "camera 8 -16 9;\ntarget 0 0 0;\ncamera_top -0.2 0.4 0.9;"
KALEIDOSCOPE = (
    "IFS_abs_x true;\nIFS_abs_y true;\nIFS_abs_z true;\nIFS_direction_5 0.71 -0.71 0;\nIFS_enabled_5 true;\n"
    "IFS_direction_6 0.71 0 -0.71;\nIFS_enabled_6 true;\nIFS_offset 1 1 1;\nIFS_edge 0.5 0.7 0.4;\n"
    "IFS_rotations_6 20 12 8;\nIFS_rotation 3 12 8;\nIFS_rotation_enabled true;"
)


@pytest.mark.skipif(not theirs.is_there(), reason="Mandelbulber 2 is not installed")
@pytest.mark.parametrize(
    ("main", "fractal", "version"),
    one_of(
        (f"{NEAR}\nformula_1 10;", KALEIDOSCOPE, "2.20"),
        (f"{NEAR}\nformula_1 10;", KALEIDOSCOPE.replace("IFS_rotation_enabled true;", ""), "2.06"),
        (
            f"{FAR}\nformula_1 8;",
            "mandelbox_main_rotation_enabled true;\nmandelbox_rotation_main 13 22 -9;\nmandelbox_rotations_enabled true;\n"
            "mandelbox_rotation_neg_1 13 22 -9;\nmandelbox_rotation_pos_2 3 12 -19;",
            "2.20",
        ),
        (
            f"{NEAR}\nhybrid_fractal_enable true;\nformula_1 1002;\nformula_2 7;",
            "transf_rotation 12 20 9;",
            "2.20",
        ),
        (
            f"{NEAR}\nformula_1 7;\nprimitive_cone_1_enabled true;\nprimitive_cone_1_position 0 -1.5 0.6;\n"
            "primitive_cone_1_rotation 33 52 -39;",
            "",
            "2.20",
        ),
    ),
    ids=["kaleidoscope", "old kaleidoscope", "box", "sponge", "cone"],
)
def test_angles_of_formulas_in_both_programs(main: str, fractal: str, version: str, tmp_path: Path) -> None:
    path = tmp_path / "turned.fract"
    path.write_text(settings(main, fractal).replace("version 2.20", f"version {version}"), encoding="utf-8")
    found = record(path, 48, 100)
    assert causes.verdict(found) == "alike", found
    assert found["ninth"] < 0.01
