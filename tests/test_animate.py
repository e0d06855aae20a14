"""`clfractal animate` and `clfractal.frames`: each frame is the picture of its own scene, whole or not there."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.select import choose
from clfractal.engine import run as work
from clfractal.files.exr import read_exr
from clfractal.files.frame_names import frame_file
from tests.halves import halves_of
from tests.interrupts import interrupted_at
from tests.long_renders import holding
from tests.shell import InProcess, Running, has_tiles, works

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 6}
image: {width: 40, height: 24}
camera: {position: [0, -3, 0]}
animation:
  fps: 10
  frames: 5
  tracks:
    camera.position: {keys: [{frame: 0, value: [0, -3, 0]}, {frame: 4, value: [1.6, -2, 0.8]}]}
    formula.parameters.power: {expression: "8 - 2*u"}
"""


def names() -> list[str]:
    return sorted(path.name for path in Path().iterdir() if path.name != "scene.yaml")


def test_each_frame_is_the_picture_of_its_scene(clf: InProcess) -> None:
    ended = works(clf("animate", "scene.yaml", "-o", "f_##.exr", "-o", "p#.png"))
    assert ended.err.splitlines()[-1].startswith("f_00.exr to f_04.exr: 5 frames, ")
    assert names() == [*(f"f_0{i}.exr" for i in range(5)), *(f"p{i}.png" for i in range(5))]
    films = dict(clfractal.frames("scene.yaml"))
    assert list(films) == [0, 1, 2, 3, 4]
    for number, film in films.items():
        pixels, _ = read_exr(f"f_0{number}.exr")
        np.testing.assert_array_equal(pixels["Z"], film["Z"])
        still = clfractal.load_scene(f"f_0{number}.exr")
        assert still.animation is None
        assert still.formula.parameters == {"power": 8 - 2 * number / 4}
        np.testing.assert_array_equal(clfractal.render(still)["Z"], film["Z"])
    assert not np.array_equal(films[0]["Z"], films[1]["Z"])


def test_a_part_of_the_film_and_the_default_name(clf: InProcess) -> None:
    assert clf("animate", "scene.yaml", "--frames", "1-4:2", "--quiet").err == ""
    assert names() == ["scene_0001.png", "scene_0003.png"]
    some = [number for number, _ in clfractal.frames("scene.yaml", numbers=[3, 0])]
    assert some == [3, 0]


def test_render_shows_the_scene_as_it_stands(clf: InProcess) -> None:
    works(clf("render", "scene.yaml", "-o", "a.exr"))
    still = clfractal.load_scene(SCENE).model_copy(update={"animation": None})
    np.testing.assert_array_equal(read_exr("a.exr")[0]["Z"], clfractal.render(still)["Z"])
    assert clfractal.load_scene("a.exr").animation == clfractal.load_scene(SCENE).animation


def test_programs_are_compiled_once_for_all_frames(clf: InProcess) -> None:
    with clfractal.Engine() as engine:
        engine.render(clfractal.at_frame(SCENE, 0))
        before = engine.device.loaded.building.milliseconds
        for frame in (1, 2.5, 4):
            engine.render(clfractal.at_frame(SCENE, frame))
        assert engine.device.loaded.building.milliseconds == before


def test_exposure_is_measured_once_for_all_frames(clf: InProcess) -> None:
    scene = clfractal.load_scene(SCENE, overrides=["output.exposure=auto", "material.color=[0.1, 0.1, 0.1]"])
    stops = {film.header["exposure"] for _, film in clfractal.frames(scene, numbers=[4, 2, 0])}
    assert len(stops) == 1
    assert stops != {0.0}


def test_interrupted_the_finished_frames_stay(clf: InProcess) -> None:
    with interrupted_at(3):
        clf("animate", "scene.yaml", "-o", "f#.png")
    assert names() == ["f0.png", "f1.png"]
    kept = [Path(name).stat().st_mtime_ns for name in names()]
    ended = clf("animate", "scene.yaml", "-o", "f#.png", "--resume")
    assert "f0.png to f4.png: 3 frames, 2 were there already, " in ended.err
    assert [Path(name).stat().st_mtime_ns for name in names()[:2]] == kept
    assert clf("animate", "scene.yaml", "-o", "f#.png", "--resume").err == (
        "f0.png to f4.png: all 5 frames were there already\n"
    )


def test_frames_of_another_scene_are_refused(clf: InProcess) -> None:
    works(clf("animate", "scene.yaml", "-o", "f#.png"))
    before = Path("f0.png").read_bytes()
    ended = clf("animate", "scene.yaml", "-o", "f#.png", "--resume", "--set", "material.ambient=0.3")
    assert ended.is_one_line(2, "f0.png: is a frame of another scene, or of other settings; remove it")
    whole = Path("f2.png").read_bytes()
    Path("f2.png").write_text("my notes")
    assert clf("animate", "scene.yaml", "-o", "f#.png", "--resume").is_one_line(2, "f2.png: ")
    assert Path("f2.png").read_text() == "my notes"
    Path("f2.png").write_bytes(whole[:100])
    works(clf("animate", "scene.yaml", "-o", "f#.png", "--resume"))
    assert len(Path("f2.png").read_bytes()) > 0.9 * len(whole)
    assert Path("f0.png").read_bytes() == before


def test_a_frame_in_work_keeps_its_tiles(clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    render, size = work.run, ["--size", "160x96", "--frames", "1"]

    def interrupted(job: Any, stores: Any, *arguments: Any, **settings: Any) -> Any:
        def stop(state: Any) -> None:
            if state.tiles_done:
                raise KeyboardInterrupt

        return render(job, stores, *arguments, **{**settings, "progress": stop})

    with monkeypatch.context() as patch:
        patch.setattr("clfractal.cli.numbered.run", interrupted)
        with pytest.raises(KeyboardInterrupt):
            clf("animate", "scene.yaml", "-o", "f#.exr", *size, "--samples", "64")
    assert names() == ["f1.exr.partial"]
    works(clf("animate", "scene.yaml", "-o", "f#.exr", *size, "--samples", "64", "--resume"))
    assert names() == ["f1.exr"]


@pytest.mark.skipif(os.name == "nt", reason="needs SIGKILL")
def test_killed_twice_in_a_frame_it_goes_on(clf: InProcess) -> None:
    """Frames of 36 tiles, which are kept while a frame is in work; the film is the same as without kills."""
    size = ["--size", "384x384", "--set", "formula.iterations=12", "--samples", "2", "--frames", "0-1"]
    for number in range(2):
        words = holding(9, "animate", "scene.yaml", "-o", "k#.exr", "--resume", "--quiet", *size)
        running = Running(Path(), words=words)
        running.wait_until(has_tiles(Path("k0.exr.partial"), 9 * (number + 1)))
        assert running.ended_by(signal.SIGKILL)[0] == -signal.SIGKILL
        for file in Path().glob("k?.exr"):
            read_exr(file)
    works(clf("animate", "scene.yaml", "-o", "k#.exr", "--resume", *size))
    works(clf("animate", "scene.yaml", "-o", "w#.exr", *size))
    for number in range(2):
        one, other = (read_exr(f"{word}{number}.exr")[0] for word in "kw")
        for channel in one:
            np.testing.assert_array_equal(one[channel], other[channel])


REFUSED = {
    ("-o", "f.png"): "f.png: must have # where the frame's number goes, such as f_####.png",
    ("-o", "f#.gif"): "f0.gif: unknown extension '.gif'",
    ("--codec", "h264"): "--codec: applies to films, such as -o film.mp4",
    ("--crf", "3"): "--crf: applies to films, such as -o film.mp4",
    ("-o", "a.mp4", "--set", "background=transparent"): "scene.yaml: background: must be a colour",
    ("-o", "-"): "frames are several files",
    ("-o", "#############.png"): "must have at most 12 # in a row",
    ("-o", "none/f#.png"): "none/f0.png: cannot be written: there is no folder",
    ("--frames", "0-5"): "--frames: must be frames 0 to 4 of the film, got 5",
    ("--frames", "4-1"): "--frames: must go upwards, got '4-1'",
    ("--frames", "0-4:0"): "--frames: must go upwards, got '0-4:0'",
    ("--frames", "all"): "--frames: must be A-B, A-B:STEP or a number, such as 0-119:2; got 'all'",
    ("--set", "animation=null"): "scene.yaml: animation: is missing: a film needs fps, frames and tracks",
    ("--set", "animation.frames=0"): "--set animation.frames: must be at least 1, got 0",
}


@pytest.mark.parametrize("options", REFUSED)
def test_mistakes_are_refused_before_a_frame(clf: InProcess, options: tuple[str, ...]) -> None:
    before = names()
    assert clf("animate", "scene.yaml", *options).is_one_line(2, REFUSED[options])
    assert names() == before


PARTS_THAT_MOVE = """version: 1
formula: {name: mandelbulb, iterations: 6}
image: {width: 40, height: 24}
camera: {position: [0, -3, 0], focus_distance: 2}
stereo: {mode: split, separation: 0.2}
lights: [{direction: [0, 1, -1]}, {type: point, position: [1, -2, 1]}]
layout: {views: [{}, {camera: {position: [0, 3, 0]}}]}
fog: {density: 0.1}
renderer: {type: surface, bounds: {center: [0, 0, 0], radius: 2}}
animation:
  frames: 3
  tracks:
    TRACK: {expression: "VALUE"}
"""
REMOVED = {
    ("stereo.separation", "0.2 + 0.1*u"): (
        "stereo=null",
        "cannot move: stereo is null; give it a value, or leave",
    ),
    ("fog.density", "0.1*u"): (
        "fog=null",
        "cannot move: fog is null; give it a value, or leave this track out",
    ),
    ("lights.1.intensity", "u"): (
        "lights=[{direction: [0, 1, -1]}]",
        "cannot move: lights has entries 0 to 0",
    ),
    ("lights.1.position.0", "u"): ("lights.1={direction: [0, 1, -1]}", "unknown key of lights.1 'position'"),
    ("layout.views.1.camera.fov", "40 + u"): ("layout=null", "cannot move: layout is null; give it a value"),
    ("renderer.bounds.radius", "2 + u"): ("renderer={type: volume}", "unknown key of renderer 'bounds'"),
    ("camera.focus_distance", "2 + u"): (
        "camera={projection: orthographic, position: [0, -3, 0], height: 3}",
        "unknown key of camera",
    ),
    ("formula.parameters.power", "8 - u"): (
        "formula={chain: [{name: menger_sponge}, {name: mandelbulb}]}",
        "cannot move: formula is a chain; name a value of formula.chain.0, formula.chain.1",
    ),
}


@pytest.mark.parametrize("track", REMOVED, ids=lambda track: track[0])
def test_a_track_of_what_an_override_removes_is_refused_at_its_line(
    clf: InProcess, track: tuple[str, str]
) -> None:
    """Whatever is moved is there without the override, and the message names the track, not the override."""
    name, value = track
    text = PARTS_THAT_MOVE.replace("TRACK", name).replace("VALUE", value)
    others = tuple({"stereo", "layout"} - {name.partition(".")[0]})  # neither goes with all that is moved
    text = "".join(line for line in text.splitlines(keepends=True) if not line.startswith(others))
    Path("scene.yaml").write_text(text)
    clfractal.load_scene("scene.yaml")
    override, message = REMOVED[track]
    line = text[: text.index("{expression")].count("\n") + 1
    for shell in (["animate", "scene.yaml", "-o", "f#.png"], ["check", "scene.yaml"]):
        ended = clf(*shell, "--set", override)
        assert ended.is_one_line(2, f"scene.yaml:{line}:"), ended
        assert f": animation.tracks.{name}: {message}" in ended.err
    assert names() == []


def test_arguments_of_python_are_checked() -> None:
    with pytest.raises(clfractal.SceneError, match="numbers: must be from 0 to 4, got 5"):
        clfractal.frames(SCENE, numbers=[5])
    with pytest.raises(clfractal.SceneError, match="numbers: must be a list of numbers of frames"):
        clfractal.frames(SCENE, numbers=3)  # type: ignore[arg-type]
    with pytest.raises(clfractal.SceneError, match="frame: must be at most 4, got 6"):
        clfractal.at_frame(SCENE, 6)
    with pytest.raises(clfractal.SceneError, match="animation: is missing"):
        clfractal.frames({"version": 1, "formula": {"name": "hast"}, "camera": {}})


def test_names_of_frames() -> None:
    assert frame_file(Path("a/f_###.png"), 7) == Path("a/f_007.png")
    assert frame_file(Path("a#b##.exr"), 1234) == Path("a#b1234.exr")


# --- --stats ---


TIMED = """version: 1
formula: {name: mandelbulb, iterations: 6}
image: {width: 80, height: 64}
renderer: {samples: 2}
camera: {position: [0, -3, 0]}
animation: {fps: 12, frames: 4, tracks: {camera.fov: {keys: [{frame: 0, value: 60}, {frame: 3, value: 30}]}}}
"""


@pytest.fixture
def timed(clf: InProcess) -> InProcess:
    Path("scene.yaml").write_text(TIMED)
    return clf


TILES = 3 * 2  # of 32 x 32 pixels
SUMS = ("tiles", "tiles_resumed", "build_ms", "kernel_ms", "rays")


def told(path: str = "s.json") -> dict[str, Any]:
    found: dict[str, Any] = json.loads(Path(path).read_text())
    return found


def test_sums_and_frames(timed: InProcess) -> None:
    ended = works(
        timed("animate", "scene.yaml", "-o", "f#.png", "--frames", "1-3", "--stats", "s.json", "--verbose")
    )
    values = told()
    works(timed("render", "scene.yaml", "-o", "a.png", "--stats", "one.json"))
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


def test_kept_frames_are_counted_and_films_are_written_too(timed: InProcess) -> None:
    works(timed("animate", "scene.yaml", "-o", "f#.png", "--frames", "0-1"))
    order = ("animate", "scene.yaml", "-o", "f#.png", "--resume", "--stats", "s.json")
    works(timed(*order))
    assert (told()["frames_kept"], [frame["frame"] for frame in told()["frames"]]) == (2, [2, 3])
    works(timed(*order))
    assert (told()["frames_kept"], told()["frames"], told()["rays"]) == (4, [], 0)
    works(timed("animate", "scene.yaml", "-o", "film.mkv", "--stats", "film.json"))
    values = told("film.json")
    assert values["write_ms"] > sum(frame["write_ms"] for frame in values["frames"]) + 1


def test_number_types_and_no_view_of_two_eyes(timed: InProcess) -> None:
    """The camera comes so near that its last frames need more digits."""
    keys = "{frame: 0, value: [0, -3, 0]}, {frame: 3, value: [0.6550001, -0.7510001, 0.5190001]}"
    near = f"animation.tracks={{camera.position: {{keys: [{keys}]}}}}"
    target = "camera.target=[0.655, -0.751, 0.519]"
    stereo = "stereo={mode: split, separation: 0.1}"
    works(
        timed(
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


def test_each_device_has_its_share(timed: InProcess) -> None:
    halves = halves_of(choose())
    works(timed("animate", "scene.yaml", "-o", "f#.png", "--stats", "s.json", "--device", halves))
    shares = told()["devices"]
    assert sum(share["tiles"] for share in shares) == 4 * TILES
    assert sum(share["rays"] for share in shares) == told()["rays"]


def test_on_standard_output(timed: InProcess) -> None:
    ended = timed("animate", "scene.yaml", "-o", "f#.png", "--stats", "-", "--quiet")
    assert len(json.loads(ended.out)["frames"]) == 4


REFUSED_STATS = {
    ("--stats", "scene.yaml"): "scene.yaml: would be overwritten, but it is read for this",
    ("-o", "f#.png", "--stats", "f2.png"): "f2.png: would be written twice",
    ("-o", "film.mp4", "--stats", "film.mp4"): "film.mp4: would be written twice",
    ("--stats", "none/s.json"): "none/s.json: cannot be written: there is no folder",
    ("--missing", "--stats", "s.json"): "--stats: applies to frames that are rendered",
    ("--preview", "sheet.png", "--stats", "s.json"): "--stats: applies to frames that are rendered",
}


@pytest.mark.parametrize("options", REFUSED_STATS, ids=" ".join)
def test_mistakes_of_stats(timed: InProcess, options: tuple[str, ...]) -> None:
    assert timed("animate", "scene.yaml", *options).is_one_line(2, REFUSED_STATS[options])
    assert [path.name for path in Path().iterdir()] == ["scene.yaml"]
