"""What docs/stereo.md tells in tables and numbers is computed anew; its drawings and scenes are there."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path
from typing import cast, get_args

import numpy as np
import pytest
from PIL import Image

import clfractal
from clfractal.images.anaglyph import IDEAL, Filter, Floats, Glasses, Method, matrices, mix
from clfractal.images.modes import eye_size, picture_size
from clfractal.images.outputs import output_files
from clfractal.scene.stereo import Mode, Stereo
from clfractal.stereo.eyes import degrees
from tests.document import DOCS, code, table, text
from tests.ghosting import REAL_RED_CYAN, ghosting, leaking
from tests.makers import maker, pictured

WIDTH, HEIGHT = 640, 360


def stereo_of(**keys: object) -> Stereo:
    """A section with these keys, and the defaults."""
    return Stereo.model_validate(keys)


def size(cell: str) -> tuple[int, int]:
    """The pixels that `2W x H` or `W/2 x H` stand for."""
    parts = re.fullmatch(r"(\d*)W(/\d+)? x (\d*)H(/\d+)?", cell)
    assert parts, cell
    wide, narrow, high, low = parts.groups()
    across = Fraction(WIDTH * int(wide or 1), int((narrow or "/1")[1:]))
    down = Fraction(HEIGHT * int(high or 1), int((low or "/1")[1:]))
    return int(across), int(down)


def test_modes_and_their_sizes() -> None:
    rows = table("stereo.md", "Ways to show")
    assert {code(row[0]) for row in rows} == set(get_args(Mode))
    for row in rows:
        stereo = stereo_of(mode=code(row[0]))
        assert size(row[1]) == eye_size(stereo, (WIDTH, HEIGHT)), row[0]
        assert size(row[2]) == picture_size(stereo, (WIDTH, HEIGHT)), row[0]


def test_files_of_a_mode() -> None:
    *apart, others = table("stereo.md", "Files")
    assert others[0] == "others"
    told = {code(row[0]): row for row in apart}
    for mode in get_args(Mode):
        for column, suffix in ((1, "exr"), (2, "png")):
            files = re.findall(r"`([\w.]+)`", told.get(mode, others)[column])
            assert [str(path) for path in output_files(stereo_of(mode=mode), f"out.{suffix}")] == files


def test_measures_of_a_screen() -> None:
    for width, distance, nearest, farthest, infinity in table("stereo.md", "Comfort"):
        screen, place = float(width.partition(",")[0]), float(distance)
        stereo = stereo_of(screen_width=screen, screen_distance=place)
        apart = stereo.interpupillary_distance
        # A point at depth z before the eyes: e (1 - d / z).
        assert degrees(stereo, apart * (1 - place / float(nearest))) == pytest.approx(-1, abs=0.07)
        if farthest == "no limit":
            assert degrees(stereo, apart) < 1
        else:
            assert degrees(stereo, apart * (1 - place / float(farthest))) == pytest.approx(1, abs=0.07)
        assert infinity == f"{float(degrees(stereo, apart)):+.2f} degrees"


def chart() -> tuple[Floats, Floats]:
    """Squares of all four combinations of black and white; shape (1, 4, 3) for each eye."""
    left, right = (
        np.array([[[value] * 3 for value in row]], np.float32) for row in ([0, 0, 1, 1], [0, 1, 0, 1])
    )
    return left, right


def percent(method: Method, glasses: Glasses, filters: tuple[Filter, Filter]) -> str:
    by = matrices(method, glasses)
    found = ghosting(lambda left, right: mix(left, right, by), *chart(), glasses, filters)
    return ", ".join(f"{100 * share:.1f}" for share in found).replace("0.0, 0.0", "0, 0")


def test_ghosting() -> None:
    rows = table("stereo.md", "Ghosting")
    assert len(rows) == 2 * len(IDEAL)
    for row in rows:
        names = re.findall(r"`(\w+)`", row[0])
        glasses, method = cast("Glasses", names[0]), cast("Method", names[1])
        as_this: tuple[Method, ...] = ("color", "half_color", "gray") if method == "color" else (method,)
        for same in as_this:
            assert percent(same, glasses, IDEAL[glasses]) == row[1]
            assert percent(same, glasses, leaking(glasses, 0.05)) == row[2]
            assert row[3] == (percent(same, glasses, REAL_RED_CYAN) if glasses == "red_cyan" else "")


def test_glasses() -> None:
    primaries = ("red", "green", "blue")
    for row in table("stereo.md", "Anaglyphs"):
        told = [tuple(float(name in cell) for name in primaries) for cell in row[1:]]
        assert told == list(IDEAL[cast("Glasses", code(row[0]))])


def test_the_angle_that_keeps_the_camera() -> None:
    told = re.search(r"screen's angle:\n?\s*([\d.]+) degrees for the defaults and 16 : 9", text("stereo.md"))
    assert told
    stereo = stereo_of()
    high = stereo.screen_width * 9 / 16
    assert float(told[1]) == round(2 * np.degrees(np.arctan(high / 2 / stereo.screen_distance)), 1)


@pictured
def test_drawings_are_there_and_as_they_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawings = maker("make_drawings")
    monkeypatch.setattr(drawings, "PICTURES", tmp_path)
    drawings.main([])
    for name in drawings.DRAWINGS:
        kept = DOCS / "pictures" / f"{name}.png"
        assert kept.stat().st_size <= drawings.LARGEST_FILE
        assert f"](pictures/{name}.png)" in text("stereo.md") + text("architecture.md")
        with Image.open(kept) as there, Image.open(tmp_path / f"{name}.png") as made:
            assert there.size == made.size
            # Fonts are drawn a little differently by other versions of their library.
            difference = np.asarray(there.convert("RGB"), float) - np.asarray(made.convert("RGB"), float)
            assert np.abs(difference).mean() < 2


def stereo_scenes() -> list[clfractal.Scene]:
    return [clfractal.load_scene(path) for path in sorted((DOCS.parent / "scenes").glob("stereo_*.yaml"))]


def test_there_are_stereo_scenes_of_three_formulas_and_a_volume() -> None:
    scenes = stereo_scenes()
    assert all(scene.stereo is not None for scene in scenes)
    assert len({scene.formula.name for scene in scenes}) >= 3
    assert {"surface", "volume"} <= {scene.renderer.type for scene in scenes}
    assert any(scene.cut_planes for scene in scenes)
    assert any(scene.stereo and scene.stereo.mode == "split" and scene.stereo.swap for scene in scenes)
