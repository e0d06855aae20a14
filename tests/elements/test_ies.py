"""Luminaires of IES LM-63 files: what is read, and irradiance against the files' own tables, evaluated by NumPy."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.device.structs import Precision
from clfractal.elements.lights.ies import IesLight
from clfractal.errors import ClfractalError, FileError
from clfractal.scene.model import Scene
from clfractal.viewer.named import data_files, renamed
from tests.devices import device
from tests.render.known_lights import BRIGHT, PLACE, ground
from tests.render.shots import ORTHOGRAPHIC, SOLIDS, Floats, colors, points_of, shoot
from tests.scenes import scene_of
from tests.variants import combinations

VERTICAL = [0, 10, 25, 32.5, 40, 60, 90]
# The horizontal angles of each symmetry, and how it brings others to them.
SYMMETRIES: dict[str, Any] = {
    "round": ([0], lambda h: 0 * h),
    "quadrants": ([0, 20, 45, 90], lambda h: np.minimum(h % 180, 180 - h % 180)),
    "halves": ([0, 30, 100, 180], lambda h: np.minimum(h, 360 - h)),
    "halves of 90": (
        [90, 150, 200, 270],
        lambda h: np.where((h >= 90) & (h <= 270), h, (180 - h) % 360),
    ),
    "whole": ([0, 50, 110, 230, 300, 360], lambda h: h),
}


def values_of(horizontal: list[float]) -> Floats:
    found = np.random.default_rng(7).uniform(200, 3000, (len(horizontal), len(VERTICAL)))
    if horizontal[-1] == 360:
        found[-1] = found[0]
    return found.round(1)


def text_of(
    horizontal: list[float],
    values: Floats,
    *,
    vertical: list[float] = VERTICAL,
    tilt: str = "TILT=NONE",
    multiplier: float = 1,
    ballast: float = 1,
    kind: int = 1,
) -> str:
    def line(numbers: Any) -> str:
        return " ".join(f"{number:g}" for number in numbers)

    return "\n".join(
        [
            "IESNA:LM-63-2002",
            "[TEST] NONE",
            "[MANUFAC] clfractal",
            tilt,
            f"1 -1 {multiplier:g} {len(vertical)} {len(horizontal)} {kind} 2 0.1, 0.1, 0",
            f"{ballast:g} 1 60",
            line(vertical[:3]),
            line(vertical[3:]),
            line(horizontal),
            *(line(row) for row in values),
            "",
        ]
    )


def candela(
    points: Floats, horizontal: list[float], values: Floats, fold: Any, axis: Floats, up: Floats
) -> Floats:
    """Of the luminaire at PLACE towards points; horizontal angles are counterclockwise as seen from behind it."""
    way = points - PLACE
    way = way / np.linalg.norm(way, axis=-1, keepdims=True)
    back = -axis / np.linalg.norm(axis)
    zero = up - (up @ back) * back
    zero = zero / np.linalg.norm(zero)
    turn = np.degrees(np.arctan2(way @ np.cross(back, zero), way @ zero)) % 360
    down = np.degrees(np.arccos(-(way @ back)))
    at = fold(turn)
    rows = np.stack([np.interp(down, VERTICAL, row, left=0, right=0) for row in values])
    after = np.clip(np.searchsorted(horizontal, at), 1, max(len(horizontal) - 1, 1))
    if len(horizontal) == 1:
        return np.asarray(rows[0])
    low, high = np.array(horizontal)[after - 1], np.array(horizontal)[after]
    share = (at - low) / (high - low)
    lower = np.take_along_axis(rows, (after - 1)[None], 0)[0]
    return np.asarray(lower + share * (np.take_along_axis(rows, after[None], 0)[0] - lower))


def lit(folder: Path, text: str, mode: str = "direct", **light: Any) -> Scene:
    (folder / "lamp.ies").write_text(text)
    given = {"type": "ies", "position": PLACE.tolist(), "shadow": False, "file": "lamp.ies", **light}
    return scene_of(
        SOLIDS,
        {**ORTHOGRAPHIC, "position": [0.4, -2, 1.6]},
        folder=folder,
        lights=[given],
        material={**BRIGHT, "diffuse": 1},
        lighting={"mode": "path", "bounces": 0} if mode == "path" else {"mode": "direct"},
        # (Along paths rays begin a part of `detail` above the surface.)
        renderer={"samples": 1, "detail": 0.02},
        background=[0, 0, 0],
    )


# (In float64 with as many lanes as other tests of objects take: programs are the same.)
@pytest.mark.parametrize("symmetry", SYMMETRIES)
@pytest.mark.parametrize(
    ("mode", "precision", "lanes"),
    [
        ("direct", "float32", None),
        ("path", "float32", None),
        ("direct", "float64", 4),
        *combinations([("path", "float64", 4), ("direct", "float64", 1), ("path", "float64", 1)]),
    ],
)
def test_irradiance_is_that_of_the_table(
    symmetry: str, mode: str, precision: Precision, lanes: int | None, tmp_path: Path
) -> None:
    horizontal, fold = SYMMETRIES[symmetry]
    values = values_of(horizontal)
    ways = {"direction": [0.3, -0.2, -1], "up": [0.4, 1, 0.2]}
    scene = lit(tmp_path, text_of(horizontal, values), mode, **ways, intensity=2.5)
    framebuffer = shoot(scene, device(), precision, lanes=lanes)
    here = ground(framebuffer)
    points = points_of(framebuffer)[here]
    away = PLACE - points
    strong = candela(points, horizontal, values, fold, *(np.array(way, float) for way in ways.values()))
    expected = 2.5 * strong / 1000 * away[:, 2] / np.linalg.norm(away, axis=-1) ** 3
    assert here.sum() > 500
    assert expected.std() > 0.1 * expected.mean()
    assert np.abs(colors(framebuffer)[here][:, 0] - expected).max() < 2e-4 * expected.max()


@pytest.mark.parametrize(
    "sections",
    [
        {},
        {"fog": {"density": 0.4, "scattering": {}}},
        {"renderer": {"type": "volume", "resolution": 32}},
        {"renderer": {"type": "volume", "resolution": 32}, "lighting": {"mode": "path", "bounces": 1}},
    ],
    ids=["surface", "fog", "volume", "volume along paths"],
)
def test_a_thousand_candela_everywhere_are_a_point_light(sections: dict[str, Any], tmp_path: Path) -> None:
    even = text_of([0], np.full((1, 3), 500.0), vertical=[0, 90, 180], multiplier=2)
    files = lit(tmp_path, even)

    def seen(**light: Any) -> Floats:
        changed = {"lights": [{"position": PLACE.tolist(), **light}], "material": {}, **sections}
        return colors(shoot(files.model_copy(update=changed), device()))

    point = seen(type="point", falloff="inverse_square")
    assert point.std() > 0.01
    np.testing.assert_array_equal(seen(type="ies"), point)
    np.testing.assert_allclose(seen(type="ies", file="lamp.ies"), point, rtol=1e-5, atol=1e-6)


def test_where_nothing_was_measured_it_is_dark(tmp_path: Path) -> None:
    text = text_of([0], np.full((1, 3), 1000.0), vertical=[90, 120, 180])
    framebuffer = shoot(lit(tmp_path, text), device())
    assert colors(framebuffer)[ground(framebuffer)].max() == 0
    framebuffer = shoot(lit(tmp_path, text, direction=[0, 0, 1]), device())
    assert colors(framebuffer)[ground(framebuffer)].min() > 0.01


def test_all_factors_count(tmp_path: Path) -> None:
    path = tmp_path / "lamp.ies"
    values = np.array([[100.0, 50, 25]])
    tilt = "TILT=INCLUDE\n1\n3\n0 45 90\n0.5 0.4 0.3"
    path.write_text(text_of([0], values, vertical=[0, 45, 90], tilt=tilt, multiplier=3, ballast=0.8))
    rows = (values[0] * 3 * 0.8 * 0.5 / 1000).tolist()
    table = IesLight.table_of(path)
    assert table == pytest.approx([3, 2, 0, 45, 90, 0, 360, *rows, *rows])
    assert IesLight.most_of(table) == pytest.approx(rows[0])


def test_half_symmetric_files_without_a_row_at_180_are_closed(tmp_path: Path) -> None:
    path = tmp_path / "lamp.ies"
    path.write_text(
        text_of([90, 150, 270], np.array([[1000.0] * 3, [2000.0] * 3, [4000.0] * 3]), vertical=[0, 45, 90])
    )
    table = IesLight.table_of(path)
    angles, first = table[5 : 5 + int(table[1])], table[5 + int(table[1]) :: 3]
    # 30 is 150's mirror; between 30 and 330, 270 and 90 are there: at 0 the mean by angle of 270 and 30.
    assert angles == [0, 30, 90, 150, 270, 360]
    assert first == pytest.approx([2.5, 2, 1, 2, 4, 2.5])


ROUND = text_of([0], np.array([[100.0, 50, 25]]), vertical=[0, 45, 90])


@pytest.mark.parametrize(
    ("before", "after", "line", "message"),
    [
        ("TILT=NONE\n", "", 4, "must be a [KEYWORD] or TILT=, got '1 -1 1 3 1 1 2 0.1, 0.1, 0'"),
        (ROUND, "not at all", None, "has no line TILT=, as files of IES LM-63 have"),
        ("TILT=NONE", "TILT=lamp.tlt", 4, "TILT must be NONE or INCLUDE, got 'lamp.tlt'"),
        ("TILT=NONE", "TILT=INCLUDE\n4", 5, "the lamp's geometry must be a whole number, 1 to 3, got 4"),
        ("1 -1 1 3 1 1 2", "1 -1 1 3 1 2 2", 5, "photometry is of type B; only type C (1) is read"),
        ("1 -1 1 3 1 1 2", "1 -1 1 3 1 3 2", 5, "photometry is of type A; only type C (1) is read"),
        ("1 -1 1 3", "1 -1 -1 3", 5, "the candela multiplier must be at least 0, got -1"),
        ("1 -1 1 3", "1 -1 1 1", 5, "the number of vertical angles must be a whole number, 2 to 3601, got 1"),
        (
            "1 -1 1 3",
            "1 -1 1 3.5",
            5,
            "the number of vertical angles must be a whole number, 2 to 3601, got 3.5",
        ),
        ("0 45 90", "0 45 45", 7, "vertical angles must rise, got 45 after 45"),
        ("0 45 90", "0 45 80", 7, "vertical angles must go from 0 or 90 to 90 or 180, got 0 to 80"),
        (
            "\n0\n",
            "\n10\n",
            9,
            "horizontal angles must be 0, or go from 0 to 90, 180 or 360, or from 90 to 270, got 10 to 10",
        ),
        ("100 50 25", "100 fifty 25", 10, "a candela value must be a number, got 'fifty'"),
        ("100 50 25", "100 inf 25", 10, "a candela value must be a number, got 'inf'"),
        ("100 50 25", "100 -50 25", 10, "a candela value must be at least 0, got -50"),
        ("100 50 25", "100\n50", 11, "ends before a candela value"),
        ("100 50 25", "100 50 25\n12", 11, "must end behind the candela values, got '12'"),
    ],
)
def test_what_is_wrong_in_a_file_is_said_with_its_line(
    before: str, after: str, line: int | None, message: str, tmp_path: Path
) -> None:
    assert before in ROUND
    with pytest.raises(FileError) as found:
        lit(tmp_path, ROUND.replace(before, after))
    place = f"{tmp_path / 'lamp.ies'}" + (f":{line}: " if line is not None else " ")
    assert found.value.message == place + message
    assert found.value.where.path == "lights.0.file"


@pytest.mark.parametrize(
    ("light", "message"),
    [
        (
            {"file": "../lamp.ies"},
            "lights.0.file: must be a path inside the scene's folder, got '../lamp.ies'",
        ),
        ({"file": "none.ies"}, "No such file"),
        ({"up": [0, 0, 3]}, "lights.0.up: must not be along direction"),
        ({"direction": [0, 0, 0]}, "lights.0.direction: must not be zero"),
    ],
    ids=["out of the folder", "missing", "up", "zero"],
)
def test_mistakes_in_its_keys(light: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(ClfractalError) as found:
        lit(tmp_path, ROUND, **light)
    assert message in str(found.value)


def test_its_file_goes_with_the_scene(tmp_path: Path) -> None:
    scene = lit(tmp_path, ROUND)
    assert tmp_path / "lamp.ies" in scene.files
    assert data_files(scene) == ["lamp.ies"]
    (tmp_path / "lamp.ies").unlink()
    # What was read is sent along, and kept where other values of lights change.
    sent = pickle.loads(pickle.dumps(scene))
    brighter = sent.model_copy(update={"lights": [{**sent.lights[0].model_dump(), "intensity": 3}]})
    key = ("ies", "lamp.ies")
    assert brighter.light_tables.keys() == {key}
    np.testing.assert_array_equal(brighter.light_tables[key].numbers, scene.light_tables[key].numbers)
    (tmp_path / "other.ies").write_text(ROUND)
    assert renamed(scene, {"lamp.ies": "other.ies"}).lights[0].reads == "other.ies"
