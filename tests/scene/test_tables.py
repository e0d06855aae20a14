"""Tables that move values of a film: their rows, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.errors import ClfractalError
from clfractal.scene.load import load_scene
from tests.scene.movements import HEAD, moving, values


def test_a_table_moves_a_value(tmp_path: Path) -> None:
    rows = "\n".join(f"{frame}, {0.1 * frame}" for frame in range(21))
    (tmp_path / "sound.csv").write_text(f"frame, bass\n{rows}\n")
    track = "{file: sound.csv, column: bass, factor: 2, offset: 1}"
    text = f"{HEAD}animation: {{frames: 21, tracks: {{lights.0.intensity: {track}}}}}\n"
    (tmp_path / "scene.yaml").write_text(text)
    scene = load_scene(tmp_path / "scene.yaml")
    assert tmp_path / "sound.csv" in scene.files
    np.testing.assert_allclose(values(scene, "lights.0.intensity"), 1 + 0.2 * np.arange(21))
    assert clfractal.at_frame(scene, 2.5).lights[0].intensity == pytest.approx(1.5)


TABLES = {
    "bass\n" + "1\n" * 20: "sound.csv has 20 rows, but the film 21 frames",
    "treble\n" + "1\n" * 21: "sound.csv:1: unknown column 'bass'; known: treble",
    "bass\n1\nx\n": "sound.csv:3: column 'bass' must hold finite numbers, got 'x'",
    "a,bass\n1\n": "sound.csv:2: column 'bass' must hold finite numbers, got ''",
    "bass\n1\n\n2\n": "sound.csv:3: must have a row for each frame, without blank ones",
    'bass\n"1': "sound.csv:2: is no CSV table: unexpected end of data",
    "frame,bass\n0,1\n3,1\n1,1\n": "sound.csv:3: column 'frame' leaves out frame 2, before frame 3",
    "frame,bass\n1,1\n2,1\n": "sound.csv:2: column 'frame' leaves out frame 0, before frame 1",
    "frame,bass\n1,1\n0,1\n1,1\n": "sound.csv:4: column 'frame' has frame 1 twice, in line 2 too",
    "frame,bass\n0,1\n0.5,1\n": "sound.csv:3: column 'frame' must tell a frame counted from 0, got '0.5'",
    "frame,bass\n-1,1\n": "sound.csv:2: column 'frame' must tell a frame counted from 0, got '-1'",
    "frame,bass\nnan,1\n": "sound.csv:2: column 'frame' must hold finite numbers, got 'nan'",
    "time,bass\n0,1\n1e308,1\n": "sound.csv:3: column 'time' must tell a frame of 30 a second, got '1e308'",
    "time,bass\n0,1\n0.2,1\n": "sound.csv:3: column 'time' leaves out frame 1, before frame 6",
    "time,bass\n0,1\n0.05,1\n": "sound.csv:3: column 'time' must tell a frame of 30 a second, got '0.05'",
}


@pytest.mark.parametrize("table", TABLES)
def test_wrong_tables(table: str, tmp_path: Path) -> None:
    (tmp_path / "sound.csv").write_text(table)
    tracks = "{lights.0.intensity: {file: sound.csv, column: bass}}"
    (tmp_path / "scene.yaml").write_text(f"{HEAD}animation: {{frames: 21, tracks: {tracks}}}\n")
    with pytest.raises(ClfractalError) as caught:
        load_scene(tmp_path / "scene.yaml")
    assert caught.value.message == TABLES[table]
    assert caught.value.where.path == "animation.tracks.lights.0.intensity.file"
    assert caught.value.where.line == 4


@pytest.mark.parametrize(
    ("title", "factor"), [("frame", 1), ("time", 0.04)], ids=["by the frame", "by the time"]
)
def test_rows_of_a_table_come_in_the_order_of_their_frames(title: str, factor: float, tmp_path: Path) -> None:
    order = [3, 0, 4, 1, 2]
    rows = "".join(f"{100 + 10 * frame},{factor * frame:.6g}\n" for frame in order)
    (tmp_path / "t.csv").write_text(f"k,{title}\n{rows}")
    tracks = f"{{coloring.offset: {{file: t.csv, column: k}}, coloring.scale: {{file: t.csv, column: {title}, offset: 1}}}}"
    (tmp_path / "scene.yaml").write_text(f"{HEAD}animation: {{fps: 25, frames: 5, tracks: {tracks}}}\n")
    scene = load_scene(tmp_path / "scene.yaml")
    assert values(scene, "coloring.offset") == [100, 110, 120, 130, 140]
    assert values(scene, "coloring.scale") == pytest.approx([1 + factor * frame for frame in range(5)])


def test_a_table_stays_in_the_scenes_folder(tmp_path: Path) -> None:
    tracks = {"lights.0.intensity": {"file": "../sound.csv", "column": "bass"}}
    with pytest.raises(ClfractalError, match="must be a path inside the scene's folder"):
        moving(tracks)
