"""The comparison with the installed program: depths that it writes, measures of likeness, its table and records."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.peers import __main__ as peers
from benchmarks.peers import causes, ours, theirs
from benchmarks.peers.compare import likeness, outlines
from benchmarks.peers.one import record
from clfractal.exchange.mandelbulber import Imported, import_text
from clfractal.scene.objects import WaterObject
from tests.exchange.files import settings

# Squaring, of which the Julia set of 0 is the ball of radius 1.
BALL = settings(
    "camera 1 -3 0.5;\ntarget 0.1 0 0;\ncamera_top 0 0 1;\nfov 0.9;\nformula_1 2;\nN 20;\njulia_mode true;\njulia_c 0 0 0;",
    "power 2;",
)


def _rays(side: int) -> tuple[np.ndarray, np.ndarray]:
    y, x = np.mgrid[:side, :side] / side - 0.5
    # Not along the axes: there places that are whole numbers apart lie on one ray.
    turn = np.linalg.qr(np.array([[0.9, 0.2, 0.31], [0.3, -0.7, 0.53], [0.17, 0.61, 0.8]]))[0]
    rays = np.stack([x, np.ones_like(x), -y], -1) @ turn
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return rays, np.array([0.3, -7.7, 2.1])


@pytest.mark.parametrize("scale", [4e-4, 0.01, 1.0, 9.0])
def test_depths_from_levels_and_places(scale: float) -> None:
    rays, eye = _rays(24)
    generator = np.random.default_rng(3)
    t = scale * (1 + generator.random((24, 24)))
    t[0] = np.inf
    near, far = t.min(), t[1:].max()
    with np.errstate(invalid="ignore"):
        levels = np.where(np.isfinite(t), np.floor(60000 * np.log(t / near) / math.log(far / near)), 65535)
        places = np.trunc((eye + t[..., None] * rays) * 65535) % 65536
    places[0] = 0
    found = theirs.decoded(levels, places, rays, eye, 50)
    assert np.array_equal(found.t == np.inf, t == np.inf)
    np.testing.assert_allclose(found.t[1:], t[1:], rtol=4e-5 + 1e-6 / scale)
    assert found.spread < 1e-5 + 2e-5 / scale


def test_nothing_and_nothing_that_can_be_told() -> None:
    rays, eye = _rays(8)
    empty = theirs.decoded(np.full((8, 8), 65535.0), np.zeros((8, 8, 3)), rays, eye, 50)
    assert np.all(empty.t == np.inf)
    unknown = theirs.decoded(
        np.zeros((8, 8)), np.random.default_rng(1).integers(65536, size=(8, 8, 3)).astype(float), rays, eye, 2
    )
    assert np.all(np.isnan(unknown.t))


def test_outlines_are_left_out() -> None:
    shape = np.zeros((9, 9), bool)
    shape[3:6, 3:6] = True
    near = outlines(shape)
    assert not near[4, 4]
    assert near[2:7, 2:7].sum() == near.sum() == 24
    # A silhouette that is larger by a pixel all around is the same.
    grown = np.where(near | shape, 2.0, np.inf)
    assert likeness(np.where(shape, 2.0, np.inf), grown).union == 1


def test_likeness() -> None:
    one, other = np.full((20, 20), np.inf), np.full((20, 20), np.inf)
    one[:, :10], other[:, :15] = 2.0, 2.1
    found = likeness(one, other)
    assert found.covered == 0.5
    # Columns 9, 10, 14 and 15 are near an outline: 0 to 8 are in both, 11 to 13 in ours alone.
    assert found.union == pytest.approx(9 / 12)
    assert found.middle == found.ninth == pytest.approx(0.05)
    assert math.isnan(likeness(one, np.full((20, 20), np.inf)).middle)


def test_verdicts_and_summary() -> None:
    good: dict[str, object] = {
        "stage": "done",
        "dropped": [],
        "covered": 0.5,
        "union": 0.99,
        "middle": 0.001,
        "ninth": 0.01,
    }
    records: list[dict[str, object]] = [
        good,
        good | {"union": 0.9},
        good | {"union": 0.9, "covered": 0.95, "ninth": 0.1},
        good | {"middle": None, "spread": 0.0},
        good | {"middle": None, "spread": None},
        good | {"dropped": ["perspective_type"]},
        {"stage": "open", "error": "x", "dropped": []},
        {"stage": "theirs", "error": "x", "dropped": []},
    ]
    assert [causes.verdict(each) for each in records] == [
        "alike",
        "silhouette",
        "depth",
        "no depth",
        "alike",
        "dropped",
        "not opened",
        "theirs",
    ]
    lines = causes.summary(records)
    assert lines[0] == "8 files, 6 open (75.0 %)"
    assert "3 of 4 that cover 5 to 90 % are alike (75.0 %)" in lines[1]


def test_what_is_dropped() -> None:
    remarks = (
        "perspective_type: fish eye is not there yet; the picture is in perspective",
        "line 4: repeat = 3 3 3 is not taken over",
        "line 5: primitive_box_1_material_id = 2 is not taken over",
        "gamma: 2 is not taken over",
        "formula_weight_1: its map is not blended with z by 0.7",
    )
    assert causes.dropped(Imported({}, remarks)) == ["perspective_type", "repeat", "formula_weight_1"]


def test_without_the_program(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(theirs, "PROGRAM", "no-such-program")
    assert peers.main([]) == 2
    assert capsys.readouterr().out.count("\n") == 1


def test_what_is_known_is_not_measured_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = [tmp_path / f"{name}.fract" for name in ("a", "b")]
    done: list[str] = []

    def measured(path: Path, _: object) -> dict[str, object]:
        done.append(path.stem)
        bad: dict[str, object] = {"stage": "open", "error": "no counterpart", "dropped": []}
        good: dict[str, object] = {
            "stage": "done",
            "dropped": [],
            "covered": 0.5,
            "union": 1,
            "middle": 0,
            "ninth": 0,
        }
        return bad if path.stem == "a" else good

    monkeypatch.setattr(theirs, "is_there", lambda: True)
    monkeypatch.setattr(peers, "_measured", measured)
    kept = tmp_path / "kept.json"
    for more in ([], [], ["--again", "not opened"]):
        assert peers.main([*map(str, paths), "-o", str(kept), *more]) == 0
    assert done == ["a", "b", "a"]
    assert len(json.loads(kept.read_text("utf-8"))) == 2
    assert "2 files, 1 open (50.0 %)" in capsys.readouterr().out


def test_our_rays_are_theirs(tmp_path: Path) -> None:
    path = tmp_path / "ball.fract"
    path.write_text(BALL, encoding="utf-8")
    scene = ours.bare(ours.read(path)[0], 24)
    rays, eye = ours.rays(scene, 24, mirrored=False)
    # Their pixel 12, 12 of 24 looks at the target, and 24 pixels are `fov` high at distance 1.
    forward = np.array([0.1, 0, 0]) - eye
    np.testing.assert_allclose(rays[12, 12], forward / np.linalg.norm(forward), atol=1e-12)
    top = rays[0, 12] / (rays[0, 12] @ rays[12, 12]) - rays[12, 12]
    assert np.linalg.norm(top) == pytest.approx(0.45)


def _over_water(height: float) -> str:
    water = f"primitive_water_1_enabled true;\nprimitive_water_1_length 4;\nprimitive_water_1_position 0 0 {height};"
    return BALL.replace("formula_1", f"{water}\nformula_1")


def test_water_is_compared_flat_where_the_eye_is_above_it() -> None:
    above, below = (import_text(_over_water(height)) for height in (-0.4, 0.7))
    assert ours.calm_waters(above) == ["water 1"]
    assert ours.calm_waters(below) == []
    for found, height in ((above, 0), (below, 2.16)):
        water = ours.bare(found, 24).objects["water 1"]
        assert isinstance(water, WaterObject)
        assert water.waves.height == pytest.approx(height)


def test_files_with_flat_water_have_a_mark() -> None:
    good = {"stage": "done", "dropped": [], "covered": 0.5, "union": 1, "middle": 0, "ninth": 0, "calm": True}
    assert peers.line("a", good).endswith(" ~alike")
    assert peers.line("a", good | {"calm": False}).endswith("  alike")
    assert sum(line.startswith("~ 1 ") for line in causes.summary([good])) == 1


@pytest.mark.skipif(not theirs.is_there(), reason="Mandelbulber 2 is not installed")
def test_flat_water_in_both_programs(tmp_path: Path) -> None:
    path = tmp_path / "water.fract"
    path.write_text(_over_water(-0.4), encoding="utf-8")
    found = record(path, 48, 100, tmp_path)
    assert found["calm"]
    assert causes.verdict(found) == "alike"
    kept = np.load(tmp_path / "water.npz")
    rays, eye = ours.rays(ours.bare(ours.read(path)[0], 48), 48, mirrored=False)
    deep = rays[40:, :, 2]  # the rows where nothing else is
    np.testing.assert_allclose(kept["theirs"][40:], -(eye[2] + 0.4) / deep, rtol=3e-4)


@pytest.mark.skipif(not theirs.is_there(), reason="Mandelbulber 2 is not installed")
@pytest.mark.parametrize("more", ["", "iteration_threshold_mode true;\n"])
def test_a_ball_in_both_programs(more: str, tmp_path: Path) -> None:
    path = tmp_path / "ball.fract"
    path.write_text(BALL.replace("formula_1", f"{more}formula_1"), encoding="utf-8")
    found = record(path, 48, 100, tmp_path)
    assert causes.verdict(found) == "alike"
    assert found["spread"] < 1e-4
    kept = np.load(tmp_path / "ball.npz")
    rays, eye = ours.rays(ours.bare(ours.read(path)[0], 48), 48, mirrored=False)
    along = rays @ eye
    square = along**2 - eye @ eye + 1
    t = np.where(square > 0, -along - np.sqrt(np.maximum(square, 0)), np.inf)
    inside = square > 0.2
    for name, within in (("theirs", 0.01), ("ours", 0.002)):
        assert np.array_equal(
            np.isfinite(kept[name]) & ~outlines(square > 0), (square > 0) & ~outlines(square > 0)
        )
        np.testing.assert_allclose(kept[name][inside], t[inside], rtol=within)
