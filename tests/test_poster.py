"""The film of the README: how its shots are put together, and that it is there, small, and as the table says."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from PIL import Image

from clfractal.files import srgb
from clfractal.files.png import write_png
from tests.makers import DOCS, maker, pictured


@pytest.fixture(scope="module")
def poster() -> Any:
    """docs/make_poster.py"""
    return maker("make_poster")


@pytest.fixture(scope="module")
def table(poster: Any) -> Any:
    return poster.table()


@pytest.fixture
def two(poster: Any, table: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Two shots of 5 and 7 frames with a fade of 2, of one colour each."""
    monkeypatch.setattr(poster, "FRAMES", tmp_path)
    scene = table.shots[0].scene
    shots = (poster.Shot("one", scene, 5), poster.Shot("other", scene, 7))
    for shot, level in zip(shots, (0.1, 0.7), strict=True):
        for number in range(shot.frames):
            shot.file(number).parent.mkdir(exist_ok=True)
            write_png(
                shot.file(number), [np.full((16, 32, 3), level, np.float32)], width=32, height=16, bits=16
            )
    return replace(table, size=(32, 16), fade=2, shots=shots)


def test_the_table_is_a_film_of_some_twenty_seconds(table: Any) -> None:
    parts = table.parts()
    assert len(parts) == sum(shot.frames for shot in table.shots) - table.fade * (len(table.shots) - 1)
    assert len(parts) / table.fps == pytest.approx(20, abs=2)
    for shot in table.shots:
        assert (shot.scene.image.width, shot.scene.image.height) == table.size
        assert shot.scene.animation.count == shot.frames
        assert shot.scene.animation.noise == "fixed"


def test_every_frame_is_shown_once_and_in_its_turn(table: Any) -> None:
    shown = [file for parts in table.parts() for file, _ in parts]
    assert sorted(shown) == sorted(shot.file(number) for shot in table.shots for number in range(shot.frames))
    for shot in table.shots:
        of_shot = [file for file in shown if file.parent.name == shot.name]
        assert of_shot == [shot.file(number) for number in range(shot.frames)]
    for parts in table.parts():
        assert sum(weight for _, weight in parts) == pytest.approx(1)


def test_fades_go_evenly_in_linear_light(poster: Any, two: Any) -> None:
    levels = [float(poster.mixed(parts).mean()) for parts in two.parts()]
    assert levels == pytest.approx([0.1, 0.1, 0.1, 0.3, 0.5, 0.7, 0.7, 0.7, 0.7, 0.7], abs=1e-4)


def test_files_hold_what_is_mixed(poster: Any, two: Any) -> None:
    files = list(poster.files(two))
    assert len(files) == 10
    for file, parts in zip(files, two.parts(), strict=True):
        assert poster.light_of(file) == pytest.approx(poster.mixed(parts), abs=1e-4)


def test_only_missing_frames_are_rendered(poster: Any, two: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    shot = two.shots[1]
    assert shot.missing == []
    shot.file(3).unlink()
    asked: list[Any] = []

    def rendered(scene: Any, numbers: Any, channels: Any) -> list[Any]:
        asked.append(list(numbers))
        return []

    monkeypatch.setattr(poster, "frames", rendered)
    poster.render_shot(shot)
    poster.render_shot(two.shots[0])  # of which all are there
    assert asked == [[3]]
    with pytest.raises(ValueError, match="frame 3 is missing"):
        poster.make_film(two)


@pytest.mark.parametrize("arguments", [["no such shot"], ["pagoda", "--film"], ["--fillm"]])
def test_what_is_no_shot(poster: Any, arguments: list[str]) -> None:
    with pytest.raises(SystemExit, match="is none of the shots: mist, lanterns"):
        poster.main(arguments)


def test_shots_that_are_shorter_than_their_fades(
    poster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (DOCS / "poster.yaml").read_text("utf-8")
    monkeypatch.setattr(poster, "TABLE", tmp_path / "poster.yaml")
    poster.TABLE.write_text(text.replace("fade: 12", "fade: 46"), "utf-8")
    with pytest.raises(ValueError, match="is shorter than two fades"):
        poster.table()
    poster.TABLE.write_text(text.replace("    set:", "    sets:", 1), "utf-8")
    with pytest.raises(ValueError, match=r"unknown keys \['sets'\]"):
        poster.table()


@pictured
def test_the_film_is_there_and_as_the_table_says(poster: Any, table: Any) -> None:
    assert poster.FILM.stat().st_size <= poster.LARGEST_FILM == 6_000_000
    with av.open(str(poster.FILM)) as file:
        stream = file.streams.video[0]
        assert (stream.width, stream.height) == table.size
        assert stream.average_rate == Fraction(table.fps)
        assert stream.frames == len(table.parts())
        first = next(file.decode(video=0)).to_ndarray(format="rgb24")
    light = srgb.decode(first / 255)
    assert light.std() > 0.01  # a picture, and no empty one


@pictured
def test_the_small_film_is_there_and_shown(poster: Any, table: Any) -> None:
    assert poster.SMALL.stat().st_size <= poster.LARGEST_SMALL == 1_000_000
    with Image.open(poster.SMALL) as shown:
        assert shown.width == poster.SMALL_WIDTH
        assert getattr(shown, "n_frames", 1) == len(table.parts()[:: poster.STEP])
    readme = (DOCS.parent / "README.md").read_text("utf-8")
    assert "](docs/pictures/poster.webp)](docs/pictures/poster.mp4)" in readme
