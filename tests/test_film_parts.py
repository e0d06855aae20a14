"""Frames of a film that are there, are not, or are not whole; and the sheet that shows a film before it is rendered."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from clfractal.cli.film_parts import frames_of, ranges, shown_ranges
from clfractal.cli.film_sheet import MOST_FRAMES, spread
from tests.shell import InProcess, works

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 4}
image: {width: 40, height: 24}
camera: {position: [0, -3, 0]}
animation:
  fps: 10
  frames: 6
  tracks:
    camera.position: {keys: [{frame: 0, value: [0, -3, 0]}, {frame: 5, value: [1.6, -2, 0.8]}]}
    lights.0.intensity: {expression: "1 + frame"}
"""


@given(st.sets(st.integers(0, 60)))
def test_ranges_name_the_numbers(numbers: set[int]) -> None:
    found = list(ranges(sorted(numbers)))
    again = [number for text in found for number in frames_of(text, 61)]
    assert again == sorted(numbers)
    gaps = sum(number + 1 not in numbers for number in numbers)
    assert len(found) == gaps


def test_only_the_first_ranges_of_many_are_shown() -> None:
    assert shown_ranges([1, 2, 3, 7]) == "1-3, 7"
    assert shown_ranges(range(0, 30, 2)) == "0, 2, 4, 6, 8, 10, 12, 14 and 7 more"


@given(st.integers(1, 5000), st.integers(1, 7))
def test_a_sheet_shows_the_whole_film_evenly(count: int, step: int) -> None:
    numbers = range(0, count, step)
    found = spread(numbers)
    assert (found[0], found[-1]) == (numbers[0], numbers[-1])
    assert len(found) == min(len(numbers), MOST_FRAMES)
    assert sorted(set(found)) == found
    if len(found) > 1:
        gaps = np.diff(found) / step
        assert gaps.max() - gaps.min() <= 1


def test_missing_frames_are_listed_and_rendered(clf: InProcess) -> None:
    listed = ("animate", "scene.yaml", "-o", "f_##.exr", "-o", "p#.png", "--missing")
    assert clf(*listed).out.split() == ["0-5"] == clf("animate", "scene.yaml", "--missing").out.split()
    ended = clf("animate", "scene.yaml", "-o", "f_##.exr", "-o", "p#.png", "--frames", "1-3")
    assert ended.err.splitlines()[-1] == "3 frames of the film are missing: 0, 4-5"
    Path("p3.png").write_bytes(Path("p3.png").read_bytes()[:-5])
    Path("f_02.exr").write_bytes(Path("f_02.exr").read_bytes()[:-5])
    assert clf(*listed).out.split() == ["0", "2-5"]
    assert clf(*listed, "--frames", "1-2").out.split() == ["2"]
    before = os.stat("f_01.exr").st_mtime_ns
    ended = works(clf("animate", "scene.yaml", "-o", "f_##.exr", "-o", "p#.png", "--resume"))
    assert "5 frames, 1 were there already" in ended.err
    assert os.stat("f_01.exr").st_mtime_ns == before
    listed_at_last = clf(*listed)
    assert (listed_at_last.out, listed_at_last.err, listed_at_last.status) == ("", "", 0)


@pytest.mark.parametrize("name", ["f_1.exr", "f_1.png", "f_1.jpg", "f_1.webp"])
def test_a_frame_of_random_bytes_is_missing_and_told(clf: InProcess, name: str) -> None:
    """As a failing disk or a copy that went wrong leaves it. It may be somebody's file: so it is not written over."""
    order = ("animate", "scene.yaml", "-o", f"f_#{Path(name).suffix}", "--frames", "0-2")
    works(clf(*order))
    noise = np.random.default_rng(1).bytes(5000)
    Path(name).write_bytes(noise)
    assert clf(*order, "--missing").out.split() == ["1"]
    told = f"{name}: is no picture, as its name says; remove it, or render without --resume"
    assert clf(*order, "--resume").is_one_line(2, told)
    assert Path(name).read_bytes() == noise
    Path(name).write_bytes(bytes(5000))  # as a power failure leaves it
    assert clf(*order, "--missing").out.split() == ["1"]
    works(clf(*order, "--resume"))
    assert clf(*order, "--missing").out == ""


def test_what_is_no_frame_is_told_before_any_is_rendered(clf: InProcess) -> None:
    Path("f_5.png").write_text("notes")
    assert clf("animate", "scene.yaml", "-o", "f_#.png", "--resume").is_one_line(2, "f_5.png: is no picture")
    assert not Path("f_0.png").exists()


def test_a_damaged_frame_is_told_with_advice(clf: InProcess) -> None:
    works(clf("animate", "scene.yaml", "-o", "p_#.png", "--frames", "0"))
    data = bytearray(Path("p_0.png").read_bytes())
    at = data.index(b"clfractal")
    data[at + 3] ^= 8
    Path("p_0.png").write_bytes(data)
    ended = clf("animate", "scene.yaml", "-o", "p_#.png", "--frames", "0", "--resume")
    assert ended.status == 2
    assert ended.err.startswith("p_0.png: ")
    assert ended.err.endswith("; remove it, or render without --resume\n")


def test_a_sheet_of_small_frames(clf: InProcess) -> None:
    ended = works(clf("animate", "scene.yaml", "--preview", "sheet.png", "--frames", "0-5:2"))
    assert ended.err.splitlines()[-1].startswith("sheet.png: 3 of 6 frames, ")
    with Image.open("sheet.png") as sheet:
        pixels = np.asarray(sheet, float)
    # Three pictures of 40 x 24 in a row, with gaps of 8 between; the light grows from frame to frame.
    assert pixels.shape[:2] == (40, 3 * 48 + 8)
    means = [pixels[8:32, 8 + 48 * place : 48 + 48 * place].mean() for place in range(3)]
    assert means[0] < means[1] < means[2]
    assert [path.name for path in Path().iterdir() if path.suffix == ".exr"] == []


REFUSED = {
    ("-o", "film.mp4", "--missing"): "--missing: applies to numbered pictures",
    ("-o", "a.png", "--missing"): "must have # where the frame's number goes",
    ("--preview", "s.png", "-o", "f_##.png"): "--preview: writes a sheet alone",
    ("--preview", "s.gif"): "s.gif",
    ("--preview", "scene.yaml"): "scene.yaml",
    ("--preview", "s.png", "--frames", "9"): "--frames: must be frames 0 to 5",
}


@pytest.mark.parametrize("options", REFUSED, ids=" ".join)
def test_what_is_refused(clf: InProcess, options: tuple[str, ...]) -> None:
    assert clf("animate", "scene.yaml", *options).is_one_line(2, REFUSED[options])
    assert Path("scene.yaml").read_text() == SCENE
