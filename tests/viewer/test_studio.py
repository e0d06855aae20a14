"""The studio: every edit is checked, undone and shown; what only concerns showing needs no new rays."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.engine.canvas import CHANNELS
from clfractal.viewer.frame import Frame
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.studio import Studio
from tests.pictures import read_picture
from tests.scenes import STEREO
from tests.viewer.sessions import BALL, BULB, equal_pictures, framebuffers_of, scene_of, wait_for

VIEW = (96, 64)


@pytest.fixture
def studio(device: Device) -> Iterator[Studio]:
    made = Studio(scene_of(), device, Pacing(), lambda: None)
    made.resize(*VIEW)
    made.refresh()
    yield made
    made.close()


def rest(studio: Studio) -> None:
    wait_for(lambda: studio.session.idle)


def converged(studio: Studio) -> None:
    """Asserts that the picture at rest is the shell's."""
    rest(studio)
    assert studio.session.problem is None, studio.session.problem
    frame = studio.frame
    assert frame is not None
    assert frame.finished
    films, scene = framebuffers_of(frame), studio.shown_scene
    if scene.stereo is None:
        equal_pictures(films.picture(), clfractal.render(scene, channels=CHANNELS))
    else:
        pair = clfractal.render_pair(scene, channels=CHANNELS)
        for found, wanted in zip((films.eyes()["left"], films.eyes()["right"]), pair, strict=True):
            equal_pictures(found, wanted)


def test_edits_are_shown(studio: Studio) -> None:
    converged(studio)
    assert studio.edit({"formula.parameters.power": 6, "material.color": [1, 0, 0]})
    converged(studio)
    assert studio.unsaved
    assert studio.undo()
    converged(studio)
    assert not studio.unsaved
    assert studio.redo()
    converged(studio)
    assert not studio.redo()


def test_the_window_shows_the_scenes_own_picture_at_its_own_size(studio: Studio, tmp_path: Path) -> None:
    """What it shows is measured in pixels of the scene's size, at any size of the window, and in what it writes."""
    own = studio.scene.image
    for size in (VIEW, (60, 40), (200, 30)):
        studio.resize(*size)
        shown = studio.shown_scene.image
        assert (shown.width, shown.height, shown.reference) == (*size, own.height)
    frame = studio.frame
    still = studio.render_still((tmp_path / "a.png",), (48, 32))
    wait_for(lambda: still.finished)
    assert not still.problem
    assert clfractal.load_scene(tmp_path / "a.png").image == own.resized(48, 32)
    assert studio.scene.image == own
    assert studio.edit({"image.reference_height": 500})
    assert studio.shown_scene.image.reference == 500
    assert frame is None or frame.job.scene.image.reference == own.height


def test_a_wrong_edit_changes_nothing_and_is_told(studio: Studio) -> None:
    rest(studio)
    scene, number = studio.scene, studio.session.newest
    assert not studio.edit({"camera.fov": 500})
    assert studio.scene is scene
    assert studio.session.newest == number
    assert studio.problems["camera.fov"]
    assert studio.edit({"camera.fov": 50})
    assert not studio.problems


@pytest.mark.parametrize(
    "values",
    [{"output.exposure": 1.5}, {"output.tone": "agx"}, {"bookmarks": {"a": {}}}, {"output.png_bits": 16}],
)
def test_showing_needs_no_rays(values: dict[str, object], studio: Studio) -> None:
    rest(studio)
    frame, number = studio.frame, studio.session.newest
    assert studio.edit(values)
    time.sleep(0.05)
    rest(studio)
    assert studio.session.newest == number
    assert studio.frame is frame


def test_ways_of_stereo_keep_the_samples(studio: Studio) -> None:
    assert studio.edit({"stereo": {"mode": "anaglyph", "screen_width": 0.5, "screen_distance": 0.7}})
    rest(studio)
    frame, number = studio.frame, studio.session.newest
    for values in (
        {"stereo.swap": True},
        {"stereo.mode": "rows"},
        {"stereo.mode": "checkerboard"},
        {"stereo.glasses": "amber_blue"},
        {"stereo.mode": "left"},
    ):
        assert studio.edit(values)
        assert studio.look.stereo is not None
        assert studio.session.newest == number
    assert studio.frame is frame
    assert studio.edit({"stereo.mode": "split_half"})
    assert studio.session.newest > number
    converged(studio)


def test_a_resize_asks_once(studio: Studio) -> None:
    rest(studio)
    number = studio.session.newest
    studio.resize(*VIEW)
    assert studio.session.newest == number
    studio.resize(80, 50)
    studio.resize(80, 50)
    studio.resize(0, 50)
    assert studio.session.newest == number + 1
    converged(studio)
    assert studio.scene.image.width == 96


def test_what_is_under_way_is_not_asked_for_again(device: Device) -> None:
    """Also before the first frame: it would begin from the start each time."""
    studio = Studio(scene_of(BULB, "renderer.samples=9"), device, Pacing(), lambda: None)
    studio.resize(*VIEW)
    studio.refresh()
    number = studio.session.newest
    for _ in range(5):
        studio.refresh()
        studio.tick()
    assert studio.session.newest == number
    rest(studio)
    studio.close()


def test_a_dragged_parameter_needs_one_program(studio: Studio) -> None:
    rest(studio)
    for step in range(1, 30):
        assert studio.edit({"formula.parameters.power": 8 + 0.01 * step}, "power")
        time.sleep(0.01)
    wait_for(lambda: studio.frame is not None and studio.frame.request == studio.session.newest)
    studio.end_gesture()
    converged(studio)
    assert studio.history.depth("scene") == (1, 0)
    loaded = len(studio.session.device.loaded._programs)
    for step in range(1, 10):
        studio.edit({"formula.parameters.power": 7 + 0.013 * step}, "power")
        wait_for(lambda: studio.frame is not None and studio.frame.request == studio.session.newest)
    assert len(studio.session.device.loaded._programs) == loaded
    studio.end_gesture()
    converged(studio)


def test_undo_that_does_not_fit_is_told(studio: Studio) -> None:
    """Stereo needs a perspective camera; the camera's stack may have moved on."""
    assert studio.edit({"stereo": {"mode": "rows"}})
    assert studio.edit({"stereo": None})
    flat = scene_of(BULB, "camera={projection: orthographic, position: [0, -3, 0]}").camera
    studio.set_camera(flat)
    scene = studio.scene
    studio.undo("scene")
    assert studio.scene is scene
    assert studio.messages[-1].wrong
    assert studio.undo("camera")
    assert studio.undo("scene")
    assert studio.scene.stereo is not None


def test_a_region_is_refined_and_forgotten(studio: Studio) -> None:
    rest(studio)
    studio.set_region((5, 5, 20, 20))
    rest(studio)
    converged(studio)  # the rest was there
    studio.resize(90, 60)
    assert studio.region is None


def test_a_thumbnail_is_made_once(studio: Studio) -> None:
    loads: list[int] = []

    def load() -> clfractal.Scene:
        loads.append(1)
        return scene_of(BALL)

    first = studio.thumbnail("ball", load, (24, 16))
    assert studio.thumbnail("ball", load, (24, 16)) is first
    wait_for(lambda: first.finished)
    assert len(loads) == 1
    studio.forget_thumbnails(lambda key: key == "ball")
    assert studio.thumbnail("ball", load, (24, 16)) is not first


def test_another_device_takes_over_all_work(studio: Studio, device: Device, tmp_path: Path) -> None:
    still = studio.render_still((tmp_path / "still.exr",), (120, 80), 3)
    thumbs = [studio.thumbnail(number, lambda: scene_of(BALL), (16, 12)) for number in range(3)]
    studio.use_device(device.reopened())
    converged(studio)
    wait_for(lambda: still.finished and all(thumb.finished for thumb in thumbs))
    assert still.written
    assert all(thumb.pixels is not None for thumb in thumbs)


def test_a_still_is_the_shells_picture(studio: Studio, tmp_path: Path) -> None:
    from clfractal.files.exr import read_exr

    still = studio.render_still((tmp_path / "still.exr",), (70, 50), 3)
    wait_for(lambda: still.finished)
    assert still.problem == ""
    wanted = clfractal.render(scene_of(BULB, "renderer.samples=3"), size=(70, 50))
    wanted.save(tmp_path / "shell.exr")
    found, right = (read_exr(tmp_path / name)[0] for name in ("still.exr", "shell.exr"))
    for name in right:
        np.testing.assert_array_equal(found[name], right[name])


def test_stereo_that_is_fitted(studio: Studio) -> None:
    assert studio.edit({"stereo": scene_of(BULB, STEREO, "stereo.fit=auto").resolved()["stereo"]})
    converged(studio)
    studio.set_camera(studio.scene.camera.model_copy(update={"position": (0.4, -2.8, 0.5)}), "orbit")
    studio.end_gesture()
    converged(studio)


# Films

FILM = """
version: 1
formula: {name: mandelbulb, iterations: 6}
image: {width: 96, height: 64}
camera: {position: [0, -2.6, 0.5], fov: 40}
renderer: {samples: 4}
output: {exposure: auto}
animation:
  fps: 20
  frames: 21
  shutter: 0.8
  tracks:
    camera.position: {keys: [{frame: 0, value: [0, -2.6, 0.5]}, {frame: 20, value: [2, -1.8, 0.5]}]}
    MORE
"""
OTHERS = {
    "the camera moves": "camera.fov: {keys: [{frame: 0, value: 40}, {frame: 20, value: 50}]}",
    "light and form move": "formula.parameters.power: {expression: 8 + 2*u}\n"
    "    lights.0.intensity: {keys: [{frame: 0, value: 0.2}, {frame: 20, value: 3}]}",
}


@pytest.mark.parametrize("case", OTHERS)
def test_a_frame_at_rest_has_the_films_blur_and_exposure(case: str, device: Device, tmp_path: Path) -> None:
    scene = scene_of(FILM.replace("MORE", OTHERS[case]))
    rough = Pacing()
    rough.learn(VIEW[0] * VIEW[1], 2000.0, 2.0)  # so that coarse pictures come first
    studio = Studio(scene, device, rough, lambda: None)
    shown: list[Frame] = []
    studio.session.woken = lambda: shown.extend([studio.frame] if studio.frame is not None else [])
    try:
        studio.resize(*VIEW)
        assert studio.go_to_frame(12, moving=True)
        wait_for(lambda: studio.frame is not None)
        studio.end_gesture()
        rest(studio)
        assert studio.session.problem is None, studio.session.problem
        frame = studio.frame
        assert frame is not None
        ((_, film),) = clfractal.frames(scene, numbers=[12], channels=CHANNELS)
        equal_pictures(framebuffers_of(frame).picture(), film)
        assert studio.exposure == film.header["exposure"]
        assert frame.job.views[0].shutter is not None
        coarse = [each for each in shown if each.divider > 1]
        assert coarse
        assert all(view.shutter is None for each in coarse for view in each.views), "noise would hide them"
        # A still that is written beside it is the film's, too.
        still = studio.render_still((tmp_path / "still.png",), VIEW)
        wait_for(lambda: still.finished)
        film.save(tmp_path / "film.png")
        assert (read_picture(tmp_path / "still.png") == read_picture(tmp_path / "film.png")).all()
    finally:
        studio.close()
