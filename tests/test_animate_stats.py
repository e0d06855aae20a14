"""`clfractal animate --stats`: the keys of a render, as sums over the frames, and the times of each frame."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from clfractal.device.select import choose
from tests.halves import halves_of
from tests.shell import InProcess, works

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 6}
image: {width: 80, height: 64}
renderer: {samples: 2}
camera: {position: [0, -3, 0]}
animation: {fps: 12, frames: 4, tracks: {camera.fov: {keys: [{frame: 0, value: 60}, {frame: 3, value: 30}]}}}
"""
TILES = 3 * 2  # of 32 x 32 pixels
SUMS = ("tiles", "tiles_resumed", "build_ms", "kernel_ms", "rays")


def told(path: str = "s.json") -> dict[str, Any]:
    found: dict[str, Any] = json.loads(Path(path).read_text())
    return found


def test_sums_and_frames(clf: InProcess) -> None:
    ended = works(
        clf("animate", "scene.yaml", "-o", "f#.png", "--frames", "1-3", "--stats", "s.json", "--verbose")
    )
    values = told()
    works(clf("render", "scene.yaml", "-o", "a.png", "--stats", "one.json"))
    assert list(values) == [*told("one.json"), "frames_kept", "frames"]
    assert [frame["frame"] for frame in values["frames"]] == [1, 2, 3]
    assert values["frames_kept"] == 0
    for key in SUMS:
        assert values[key] == pytest.approx(sum(frame[key] for frame in values["frames"]), abs=0.01), key
    assert values["tiles"] == 3 * TILES
    assert values["rays"] == 3 * 80 * 64 * 2
    assert (values["width"], values["height"], values["samples"]) == (80, 64, 2)
    assert 0 < values["hits"] < values["rays"]
    for frame in values["frames"]:
        assert frame["tiles"] == TILES
        assert 0 < frame["kernel_ms"] < frame["wall_ms"]
        assert 0 < frame["write_ms"] < frame["wall_ms"]
    assert values["wall_ms"] > sum(frame["wall_ms"] for frame in values["frames"])
    assert f"{values['steps_per_ray']:.1f} steps per ray" in ended.err


def test_kept_frames_are_counted_and_films_are_written_too(clf: InProcess) -> None:
    works(clf("animate", "scene.yaml", "-o", "f#.png", "--frames", "0-1"))
    order = ("animate", "scene.yaml", "-o", "f#.png", "--resume", "--stats", "s.json")
    works(clf(*order))
    assert (told()["frames_kept"], [frame["frame"] for frame in told()["frames"]]) == (2, [2, 3])
    works(clf(*order))
    assert (told()["frames_kept"], told()["frames"], told()["rays"]) == (4, [], 0)
    works(clf("animate", "scene.yaml", "-o", "film.mkv", "--stats", "film.json"))
    values = told("film.json")
    assert values["write_ms"] > sum(frame["write_ms"] for frame in values["frames"]) + 1


def test_number_types_and_no_view_of_two_eyes(clf: InProcess) -> None:
    """The camera comes so near that its last frames need more digits."""
    keys = "{frame: 0, value: [0, -3, 0]}, {frame: 3, value: [0.6550001, -0.7510001, 0.5190001]}"
    near = f"animation.tracks={{camera.position: {{keys: [{keys}]}}}}"
    target = "camera.target=[0.655, -0.751, 0.519]"
    stereo = "stereo={mode: split, separation: 0.1}"
    works(
        clf(
            "animate",
            "scene.yaml",
            "-o",
            "f#.png",
            "--stats",
            "s.json",
            "--set",
            near,
            "--set",
            target,
            "--set",
            stereo,
        )
    )
    assert told()["precision"] == "float32, float64"
    assert "stereo" not in told()
    assert told()["rays"] == 4 * 2 * 80 * 64 * 2


def test_each_device_has_its_share(clf: InProcess) -> None:
    halves = halves_of(choose())
    works(clf("animate", "scene.yaml", "-o", "f#.png", "--stats", "s.json", "--device", halves))
    shares = told()["devices"]
    assert sum(share["tiles"] for share in shares) == 4 * TILES
    assert sum(share["rays"] for share in shares) == told()["rays"]


def test_on_standard_output(clf: InProcess) -> None:
    ended = clf("animate", "scene.yaml", "-o", "f#.png", "--stats", "-", "--quiet")
    assert len(json.loads(ended.out)["frames"]) == 4


REFUSED = {
    ("--stats", "scene.yaml"): "scene.yaml: would be overwritten, but it is read for this",
    ("-o", "f#.png", "--stats", "f2.png"): "f2.png: would be written twice",
    ("-o", "film.mp4", "--stats", "film.mp4"): "film.mp4: would be written twice",
    ("--stats", "none/s.json"): "none/s.json: cannot be written: there is no folder",
    ("--missing", "--stats", "s.json"): "--stats: applies to frames that are rendered",
    ("--preview", "sheet.png", "--stats", "s.json"): "--stats: applies to frames that are rendered",
}


@pytest.mark.parametrize("options", REFUSED, ids=" ".join)
def test_mistakes_are_refused_before_a_frame(clf: InProcess, options: tuple[str, ...]) -> None:
    assert clf("animate", "scene.yaml", *options).is_one_line(2, REFUSED[options])
    assert [path.name for path in Path().iterdir()] == ["scene.yaml"]
