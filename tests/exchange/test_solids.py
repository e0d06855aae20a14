"""Solids of settings files that repeat, are hollow, open, round or cut; and the places of joined formulas."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.peers import causes, theirs
from benchmarks.peers.one import record
from clfractal.errors import FileError
from clfractal.exchange.mandelbulber import import_text
from clfractal.scene.checks import inside_solid
from clfractal.scene.load import load_scene
from tests.exchange.files import program, settings
from tests.exchange.maps import mapped
from tests.variants import one_of

CAMERA = "camera 1.5 -4.4 2.1;\ntarget 0.1 0.2 0.1;\ncamera_top 0.1 0.2 1;\nfov 0.9;"
SPONGE = "formula_1 7;\nN 4;"
Places = np.ndarray
POINTS = np.random.default_rng(5).uniform(-2.5, 2.5, (4000, 3))


def solid(kind: str, **keys: str) -> str:
    """The lines of a solid with these keys."""
    given = {"enabled": "true", **keys}
    return "\n".join(f"primitive_{kind}_1_{key} {value};" for key, value in given.items())


def across(p: Places) -> Any:
    return np.hypot(p[:, 0], p[:, 1])


def cells(p: Places, *lengths: float) -> Places:
    found = p.copy()
    for axis, length in enumerate(lengths):
        if length:
            found[:, axis] -= length * np.round(p[:, axis] / length)
    return found


CASES: list[tuple[str, Callable[[Places], Any]]] = [
    (solid("sphere", radius="0.3", repeat="1 0 1.5"), lambda p: np.linalg.norm(cells(p, 1, 0, 1.5), axis=1) < 0.3),
    (solid("box", size="0.5 1 0.4", repeat="0 2 0"), lambda p: np.all(abs(cells(p, 0, 2)) < [0.25, 0.5, 0.2], axis=1)),
    (
        solid("box", size="1 2 1", rounding="0.4"),
        lambda p: np.linalg.norm(np.maximum(abs(p) - [0.5, 1, 0.5], 0), axis=1) < 0.4,
    ),
    (
        solid("cylinder", radius="0.2", height="9", repeat="1.2 1 0"),
        lambda p: across(cells(p, 1.2, 1)) < 0.2,
    ),
    (
        solid("cone", radius="0.6", height="2", repeat="2 2 0"),
        lambda p: (across(cells(p, 2, 2)) < 0.6 * (1 - p[:, 2] / 2)) & (p[:, 2] > 0),
    ),
    (
        solid("torus", radius="0.7", tube_radius="0.2", repeat="0 0 1"),
        lambda p: np.hypot(across(p) - 0.7, cells(p, 0, 0, 1)[:, 2]) < 0.2,
    ),
]  # fmt: skip


@pytest.mark.parametrize(("keys", "holds"), CASES, ids=[keys[10:20] for keys, _ in CASES])
def test_what_is_inside(keys: str, holds: Callable[[Places], Any]) -> None:
    found = import_text(settings(f"{CAMERA}\n{SPONGE}\n{keys}"), "x.fract")
    assert found.remarks == ()
    (name,) = found.scene["objects"]
    assert found.scene["objects"][name]["type"] == "formula"
    scene = load_scene({**found.scene, "formula": "none"})
    assert inside_solid(scene, POINTS.tolist()) == holds(POINTS).tolist()


@pytest.mark.parametrize(
    ("more", "kind"),
    [
        ("view_distance_max 9;", "cylinder"),
        ("view_distance_max 0.5;", "plane"),
        ("view_distance_max 9;\nlimits_enabled true;", "plane"),
        ("view_distance_max 9;\nprimitive_plane_1_rotation 180 0 0;", "plane"),
    ],
)
def test_a_plane_ends_where_rays_do_that_meet_it_from_above(more: str, kind: str) -> None:
    keys = solid("plane", position="0 0 -0.4")
    level = import_text(settings(f"{CAMERA}\n{SPONGE}\n{keys}\n{more}"), "x.fract").scene["objects"][
        "plane 1"
    ]
    assert level["type"] == kind
    if kind == "cylinder":
        assert level["radius"] == pytest.approx(np.sqrt(9**2 - 2.5**2))
        np.testing.assert_allclose(level["position"], [1.5, -4.4, -0.4 - level["height"] / 2])


def test_where_it_stands_and_what_it_is_made_of() -> None:
    keys = solid("box", size="1 2 3", position="1 2 3", rotation="20 -35 50", repeat="4 0 0", material_id="2")
    found = import_text(settings(f"{CAMERA}\n{SPONGE}\n{keys}\nmat2_surface_color ffff 0 0;"), "x.fract")
    plain = import_text(settings(f"{CAMERA}\n{SPONGE}\n{keys.replace('4 0 0', '0 0 0')}"), "x.fract")
    one, other = (each.scene["objects"]["box 1"] for each in (found, plain))
    assert other["type"] == "box"
    for key in ("position", "rotation", "material"):
        assert one[key] == other[key]


def test_shells_and_tubes_are_thin() -> None:
    limits = "limits_enabled true;\nlimit_min -2 -2 -2;\nlimit_max 2 2 0;"
    found = import_text(
        settings(f"{CAMERA}\n{SPONGE}\n{limits}\n{solid('sphere', radius='1.5', empty='true')}"), "x.fract"
    )
    scene = load_scene({**found.scene, "formula": "none"})
    way = np.array([0.6, 0.0, -0.8])
    places = [(radius * way).tolist() for radius in (0.5, 1.49, 1.5, 1.51)]
    assert inside_solid(scene, places) == [False, False, True, False]
    # In the middle, and beyond the limits.
    assert inside_solid(scene, [(0.0, 0.0, 0.0), (0.9, 0.0, 1.2)]) == [False, False]
    # From outside a whole shell looks as a solid does.
    whole = import_text(settings(f"{CAMERA}\n{solid('sphere', radius='1.5', empty='true')}"), "x.fract")
    assert whole.scene["objects"]["sphere 1"]["type"] == "sphere"
    tube = import_text(
        settings(f"{CAMERA}\n{solid('cylinder', radius='1', height='2', caps='false')}"), "x.fract"
    )
    scene = load_scene({**tube.scene, "formula": "none"})
    places = [[0, 0, 0.5], [0.6, 0.8, 0.5], [0.5, 0, 0.999], [0.6, 0.8, 1.1]]
    assert inside_solid(scene, places) == [False, True, False, False]
    narrow = import_text(
        settings(f"{CAMERA}\n{solid('cylinder', radius='1e-3', height='2', caps='false')}"), "x.fract"
    )
    scene = load_scene({**narrow.scene, "formula": "none"})
    assert inside_solid(scene, [(5e-4, 0.0, 0.5), (0.0, 1e-3, 0.5)]) == [False, True]


def test_at_most_eight_formulas() -> None:
    many = "\n".join(
        f"primitive_sphere_{number}_enabled true;\nprimitive_sphere_{number}_repeat 3 0 0;"
        for number in range(1, 10)
    )
    found = import_text(settings(f"{CAMERA}\n{SPONGE}\n{many}"), "x.fract")
    kinds = [each["type"] for each in found.scene["objects"].values()]
    assert (kinds.count("formula"), kinds.count("sphere")) == (8, 1)
    assert found.remarks == ("primitive_sphere_9_enabled: it is plain, as no more objects can be formulas",)
    load_scene(found.scene)


def test_more_than_a_scene_takes() -> None:
    nine = "\n".join(f"formula_{slot} 7;\nformula_position_{slot} {slot} 0 0;" for slot in range(1, 10))
    found = import_text(settings(f"{CAMERA}\nN 9;\nboolean_operators true;\n{nine}"), "x.fract")
    assert list(found.scene["objects"]) == [f"formula {slot}" for slot in range(1, 9)]
    assert found.remarks == ("formula_9: no more objects can be formulas",)
    load_scene(found.scene)
    many = "\n".join(f"primitive_sphere_{number}_enabled true;" for number in range(1, 81))
    found = import_text(settings(f"{CAMERA}\n{SPONGE}\n{many}\nlimits_enabled true;"), "x.fract")
    assert len(found.scene["objects"]) == 64
    assert "limits" in found.scene["objects"]
    load_scene(found.scene)


JOINED = "boolean_operators true;\nformula_1 7;\nN 3;\nboolean_operator_1 0;"


def test_a_place_of_the_first_joined_formula() -> None:
    keys = f"{JOINED}\nformula_2 8;\nformula_position_1 1 2 3;\nformula_rotation_1 10 20 30;\nformula_scale_1 0.5;"
    found = import_text(settings(f"{CAMERA}\n{keys}"), "x.fract")
    assert found.remarks == ()
    assert found.scene["formula"] == "none"
    first, second = (found.scene["objects"][f"formula {slot}"] for slot in (1, 2))
    assert (first["formula"]["name"], first["join"], second["join"]) == (
        "menger_sponge",
        "union",
        "intersection",
    )
    assert (first["position"], first["scale"]) == ([1, 2, 3], 0.5)
    scene = load_scene({**found.scene, "objects": {"formula 1": first}})
    own = load_scene({"version": 1, "formula": first["formula"], "camera": {}})
    turn = np.eye(3)
    for axis, angle in enumerate(np.radians((10, 20, 30))):
        c, s = np.cos(angle), np.sin(angle)
        one, other = (axis + 1) % 3, (axis + 2) % 3
        about = np.eye(3)
        about[[one, one, other, other], [one, other, one, other]] = c, -s, s, c
        turn = about @ turn
    places = POINTS * 0.5
    around = places @ turn * 0.5 + [1, 2, 3]
    assert inside_solid(scene, around.tolist()) == inside_solid(own, places.tolist())


def test_a_first_formula_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    keys = f"{JOINED}\nformula_position_1 1 2 3;".replace("formula_1 7", "formula_1 61")
    with pytest.raises(FileError, match="formula 61 has no counterpart"):
        import_text(settings(f"{CAMERA}\n{keys}"), "x.fract", formulas=program(tmp_path))


def test_joined_formulas_that_repeat() -> None:
    keys = f"{JOINED}\nformula_2 7;\nformula_position_2 1 2 3;\nformula_scale_2 0.5;\nformula_repeat_2 4 0 2;"
    found = import_text(settings(f"{CAMERA}\n{keys}"), "x.fract")
    assert found.remarks == ()
    second = found.scene["objects"]["formula 2"]
    assert (second["position"], second["scale"]) == ([1, 2, 3], 0.5)
    # It is enlarged, with the cells.
    first = second["formula"]["inline"]["chain"][0]["inline"]
    places = 4 * POINTS.T
    np.testing.assert_allclose(
        mapped(first, places, 0 * places).T, cells(places.T, 8, 0, 4), rtol=0, atol=1e-12
    )
    turned = import_text(settings(f"{CAMERA}\n{keys}\nformula_rotation_2 1 2 3;"), "x.fract")
    assert turned.remarks == ("formula_repeat_2: the formula is turned, and there once",)


def test_lamps_in_a_room_and_in_joined_formulas() -> None:
    lamps = (
        "aux_light_enabled_1 true;\naux_light_position_1 3 -0.5 1;\n"
        "aux_light_enabled_2 true;\naux_light_position_2 -2 -2 2;"
    )
    room = solid("sphere", radius="9", empty="true")
    found = import_text(settings(f"{CAMERA}\n{SPONGE}\n{lamps}\n{room}"), "x.fract")
    assert [light.get("type") for light in found.scene["lights"]] == [None, "point", "point"]
    load_scene(found.scene)
    keys = "boolean_operators true;\nformula_1 7;\nformula_2 2;\nN 6;\nformula_position_2 3 -0.5 1;"
    found = import_text(settings(f"{CAMERA}\n{lamps}\n{keys}", "", "[fractal_2]\npower 8;"), "x.fract")
    assert found.remarks == ("a lamp at 3, -0.5, 1 is within a solid; left out",)
    load_scene(found.scene)


@pytest.mark.skipif(not theirs.is_there(), reason="Mandelbulber 2 is not installed")
@pytest.mark.parametrize(
    "keys",
    one_of(
        f"{SPONGE}\n{solid('cylinder', radius='0.1', height='3', repeat='1.6 1.6 0', rotation='0 20 0')}",
        f"{SPONGE}\n{solid('sphere', radius='1.5', empty='true')}\n"
        "limits_enabled true;\nlimit_min -2 -2 -2;\nlimit_max 2 2 0.4;",
        f"{SPONGE}\n{solid('box', size='2 2 0.4', rounding='0.2', position='0 0 -1.4')}",
        "boolean_operators true;\nformula_1 7;\nformula_2 7;\nN 4;\nformula_position_1 0.4 -0.5 0.6;\n"
        "formula_rotation_1 -35 62 110;\nformula_scale_1 0.6;",
        "boolean_operators true;\nformula_1 7;\nformula_2 7;\nN 6;\nformula_position_2 0 0 1.4;\n"
        "formula_scale_2 0.2;\nformula_repeat_2 0.8 0.8 0;\nview_distance_max 20;",
    ),
    ids=["repeated", "shell", "rounded", "first", "repeated formula"],
)  # fmt: skip
def test_solids_in_both_programs(keys: str, tmp_path: Path) -> None:
    path = tmp_path / "solids.fract"
    path.write_text(settings(f"{CAMERA}\n{keys}"), encoding="utf-8")
    found = record(path, 48, 100)
    assert causes.verdict(found) == "alike", found
