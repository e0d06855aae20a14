"""The session: what it shows in the end has the shell's bits, whatever came in between, and nothing stops it."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.engine.canvas import CHANNELS
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare as prepared
from clfractal.engine.run import run
from clfractal.errors import DeviceError, SceneError
from clfractal.scene.model import Scene
from clfractal.viewer import painting
from clfractal.viewer import session as sessions_module
from clfractal.viewer.background import Thumbnail
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.session import Session
from tests.viewer.sessions import (
    BALL,
    BULB,
    FOREVER,
    SCENES,
    Watch,
    equal_pictures,
    framebuffers_of,
    planes,
    scene_of,
    session_on,
    shell,
    turned,
    wait_for,
)

SOON = 60.0
"""Seconds within which what takes milliseconds on an idle machine is done on a loaded one; to finish would take minutes."""


@pytest.mark.parametrize("name", SCENES)
def test_the_picture_at_rest_has_the_bits_of_the_shell(name: str, device: Device) -> None:
    scene = scene_of(BULB, *SCENES[name])
    with session_on(device) as watch:
        frame = watch.finished(scene)
        framebuffers = framebuffers_of(frame)
    assert frame.samples == frame.job.samples
    if frame.job.stays_apart:
        for side, framebuffer in zip(
            ("left", "right"), clfractal.render_pair(scene, channels=CHANNELS), strict=True
        ):
            equal_pictures(framebuffers.eyes()[side], framebuffer)  # type: ignore[index]
    else:
        equal_pictures(framebuffers.picture(), shell(scene))


def test_frames_become_finer(device: Device) -> None:
    """Coarse ones first, then 1, 2, 4 samples; numbers rise."""
    scene = scene_of()
    pacing = Pacing(seconds_per_pixel=1e-3)
    with session_on(device, pacing) as watch:
        watch.finished(scene)
        frames = watch.frames
    assert frames[0].divider == pacing.coarsest
    dividers = [frame.divider for frame in frames]
    assert dividers == sorted(dividers, reverse=True)
    whole = [frame.samples for frame in frames if frame.divider == 1]
    assert whole == sorted(whole)
    assert whole[-1] == 4
    assert [frame.number for frame in frames] == sorted({frame.number for frame in frames})
    assert [frame.finished for frame in frames].index(True) == len(frames) - 1


def test_while_something_moves_frames_come_whatever_the_rate_of_requests(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Requests that come faster than frames can be made must not end each other's frame."""
    scene = scene_of(BULB, "image.width=960", "image.height=640")
    with session_on(device, Pacing(coarsest=1)) as watch:
        watch.finished(scene_of())  # the program is there
        watch.frames.clear()
        monkeypatch.setattr(sessions_module, "SETTLE_SECONDS", FOREVER)
        start, number = time.perf_counter(), 0
        # However slow the machine is: three requests are shown while later ones come in every millisecond.
        while len({each.request for each in list(watch.frames)}) < 3 and time.perf_counter() - start < 120:
            number += 1
            watch.session.request(turned(scene, 0.0001 * number), moving=True)
            time.sleep(0.001)
        moving = list(watch.frames)
        monkeypatch.undo()
        last = watch.session.request(turned(scene, 0.0001 * number), follows=True)
        frame = watch.rest()
        assert len({each.request for each in moving}) >= 3
        assert all(each.samples == 1 for each in moving)
        assert (frame.request, frame.finished) == (last, True)
        equal_pictures(framebuffers_of(frame).picture(), shell(turned(scene, 0.0001 * number)))


def test_a_request_ends_what_is_under_way(device: Device) -> None:
    """Also while samples are gathered that would take minutes."""
    slow = scene_of(BULB, "renderer.samples=65536", "image.width=400", "image.height=300")
    with session_on(device) as watch:
        watch.finished(scene_of())
        for moving in (False, True, False):
            first = watch.session.request(slow)
            wait_for(lambda: watch.frames[-1].request == first and watch.frames[-1].samples > 1)  # noqa: B023
            start = time.perf_counter()
            number = watch.session.request(scene_of(), moving=moving)
            wait_for(lambda: watch.frames[-1].request == number)  # noqa: B023
            assert time.perf_counter() - start < SOON
        frame = watch.rest()
        equal_pictures(framebuffers_of(frame).picture(), shell(scene_of()))


def test_requests_at_random_moments(device: Device) -> None:
    """Whatever was cancelled where: the last picture has its bits."""
    random = np.random.default_rng(7)
    scenes = [
        scene_of(BULB, *SCENES[name]) for name in ("mandelbulb", "volume", "layout", "anaglyph", "adaptive")
    ]
    with session_on(device) as watch:
        for scene in scenes:
            watch.finished(scene)
        for _ in range(40):
            scene = scenes[random.integers(len(scenes))]
            watch.session.request(scene, moving=bool(random.integers(2)))
            if random.random() < 0.2:
                watch.session.pause()
                time.sleep(random.random() * 0.01)
                watch.session.pause(False)
            if random.random() < 0.2:
                watch.session.add(Thumbnail(lambda: scene_of(BALL), (16, 12)))
            time.sleep(random.random() ** 2 * 0.1)
        for scene in scenes:
            frame = watch.finished(scene)
            equal_pictures(framebuffers_of(frame).picture(), shell(scene))


@pytest.mark.parametrize("name", ["mandelbulb", "adaptive", "float64", "volume", "cut plane", "layout"])
def test_pausing_keeps_the_bits(name: str, device: Device) -> None:
    scene = scene_of(BULB, *SCENES[name])
    random = np.random.default_rng(3)
    with session_on(device) as watch:
        watch.session.request(scene)
        for _ in range(12):
            time.sleep(random.random() * 0.02)
            watch.session.pause()
            wait_for(lambda: watch.session.idle)
            watch.session.pause(False)
        frame = watch.rest()
        assert frame.finished
        equal_pictures(framebuffers_of(frame).picture(), shell(scene))


def test_a_request_that_is_paused_before_its_first_frame_goes_on(device: Device) -> None:
    with session_on(device) as watch:
        number = watch.session.request(scene_of())
        watch.session.pause()
        wait_for(lambda: watch.session.idle)
        watch.session.pause(False)
        frame = watch.rest()
        assert (frame.request, frame.finished) == (number, True)
        # Also while it waits for a movement to go on.
        number = watch.session.request(turned(scene_of(), 0.1), moving=True)
        wait_for(lambda: watch.session.frame.request == number)  # type: ignore[union-attr]
        watch.session.pause()
        wait_for(lambda: watch.session.idle)
        watch.session.pause(False)
        assert watch.rest().finished


def test_a_region_is_refined_alone(device: Device) -> None:
    scene = scene_of(BULB, "renderer.samples=16")
    region = (30, 20, 33, 17)
    with session_on(device, Pacing(coarsest=1)) as watch:
        one = first_look(scene, device)
        watch.finished(turned(scene, 0.8))
        frame = watch.finished(scene, region=region)
        found = framebuffers_of(frame).picture()
    whole = shell(scene)
    x, y, width, height = region
    inside = np.zeros((64, 96), bool)
    inside[y : y + height, x : x + width] = True
    for name in CHANNELS:
        np.testing.assert_array_equal(found[name][inside], whole[name][inside])
    # Outside is one sample, not the picture that was shown before.
    for name in CHANNELS:
        np.testing.assert_array_equal(found[name][~inside], one[name][~inside])
    assert (found["R"][~inside] != whole["R"][~inside]).any()


def first_look(scene: Scene, device: Device) -> clfractal.Framebuffer:
    """A ray for each pixel, through its middle; its light is smoothed as that of the finished picture."""
    job = prepared(scene, device, channels=CHANNELS)
    framebuffers = JobFramebuffers(replace(job, views=tuple(view.coarse(1) for view in job.views)))
    run(framebuffers.job, framebuffers.framebuffers, LocalExecutor(device))
    return framebuffers.picture()


def test_a_region_of_a_picture_that_is_there_leaves_the_rest(device: Device) -> None:
    scene = scene_of()
    with session_on(device) as watch:
        before = framebuffers_of(watch.finished(scene)).picture()
        watch.frames.clear()
        frame = watch.finished(scene, region=(5, 6, 20, 20))
        assert all(each.divider == 1 for each in watch.frames)
        equal_pictures(framebuffers_of(frame).picture(), before)


@pytest.mark.parametrize("name", ["adaptive", "volume", "layout"])
def test_samples_that_were_lost_are_made_again(name: str, device: Device) -> None:
    """What passes keep goes with a drawing that is stopped while it takes a view: then they begin anew."""
    scene = scene_of(BULB, *SCENES[name], "renderer.samples=256")
    with session_on(device) as watch:
        watch.pauses = lambda frame: frame.divider == 1
        watch.session.request(scene)
        watch.shows(lambda frame: frame.divider == 1)
        frame = watch.rest()
        watch.session._executor._drawings.clear()
        assert not frame.finished
        watch.pauses = lambda frame: False
        watch.session.pause(False)
        equal_pictures(framebuffers_of(watch.rest()).picture(), shell(scene))


@pytest.mark.parametrize("name", ["layout", "squeezed", "anaglyph", "layout and stereo"])
def test_regions_of_several_views(name: str, device: Device) -> None:
    """The region is that of each eye's picture, also where it lies in one of a layout's views only."""
    scene = scene_of(BULB, *SCENES[name])
    with session_on(device) as watch:
        wholes = [{k: v.copy() for k, v in each.items()} for each in planes(watch.finished(scene))]
        watch.finished(scene_of(BALL))
        frame = watch.finished(scene, region=(3, 9, 20, 30))
        founds = planes(frame)
        for view, whole, found, place in zip(
            frame.views, wholes, founds, frame.arrangement.places, strict=True
        ):
            width, height = view.size
            left, right = (min(max(x - place.x, 0), width) for x in (3, 23))
            top, bottom = (min(max(y - place.y, 0), height) for y in (9, 39))
            for channel in CHANNELS:
                part = found[channel][top:bottom, left:right]
                np.testing.assert_array_equal(part, whole[channel][top:bottom, left:right])


@pytest.mark.parametrize("text", ["sin(", "undefined_function(x)"])
def test_a_scene_that_does_not_compile_leaves_the_picture(
    text: str, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    bad = scene_of(BULB, "renderer.samples=2")

    def failing(scene: Scene, *arguments: Any, **settings: Any) -> Any:
        if scene is bad:
            raise SceneError(f"wrong: {text}")
        return prepared(scene, *arguments, **settings)

    monkeypatch.setattr(sessions_module, "prepare", failing)
    with session_on(device) as watch:
        before = watch.finished(scene_of())
        watch.session.request(bad)
        wait_for(lambda: watch.session.problem is not None)
        wait_for(lambda: watch.session.idle)
        assert watch.session.frame is before
        assert text in str(watch.session.problem)
        after = watch.finished(scene_of(BULB, "renderer.samples=3"))
        equal_pictures(framebuffers_of(after).picture(), shell(scene_of(BULB, "renderer.samples=3")))


@pytest.mark.parametrize("error", [DeviceError("lost"), RuntimeError("a mistake")])
def test_a_device_that_fails_is_told(
    error: Exception, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    with session_on(device) as watch:
        before = watch.finished(scene_of())
        with monkeypatch.context() as patch:
            patch.setattr(painting, "run", raising(error))
            for moving in (False, True):
                watch.session.request(turned(scene_of(), 0.2), moving=moving)
                wait_for(lambda: watch.session.problem is not None)
                wait_for(lambda: watch.session.idle)
                assert str(error) in str(watch.session.problem)
                assert watch.session.frame is before
                watch.session.problem = None
        assert watch.finished(scene_of()).finished


def raising(error: Exception) -> Any:
    def failing(*_: object, **__: object) -> None:
        raise error

    return failing


def test_without_room_for_passes_all_samples_are_made_at_once(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    from clfractal.engine.drawing import Drawing

    keep, full = (
        Drawing.keep,
        DeviceError("out of device memory while allocating unfinished pixels", status=2),
    )

    def small(self: Drawing, tiles: int) -> None:
        if tiles > 1:
            raise full
        keep(self, tiles)

    monkeypatch.setattr(Drawing, "keep", small)
    with session_on(device) as watch:
        frame = watch.finished(scene_of())
        equal_pictures(framebuffers_of(frame).picture(), shell(scene_of()))
    assert any("one pass" in line for line in watch.progress)


def test_it_closes_quickly_at_any_moment(device: Device) -> None:
    slow = scene_of(BULB, "renderer.samples=65536", "image.width=400", "image.height=300")
    for wait in (0.0, 0.05, 0.3):
        session = Session(device, Pacing(), lambda: None)
        session.start()
        session.request(slow)
        time.sleep(wait)
        start = time.perf_counter()
        assert session.close()
        assert time.perf_counter() - start < SOON
    assert not any(thread.name == "clfractal-session" for thread in threading.enumerate())


def test_a_session_that_was_never_started_closes(device: Device) -> None:
    assert Session(device, Pacing(), lambda: None).close()


def test_canvases_are_used_again(device: Device) -> None:
    """However many pictures: no more canvases than are shown, drawn and held."""
    with session_on(device) as watch:
        for step in range(30):
            watch.session.request(turned(scene_of(), 0.1 * step), moving=True)
            time.sleep(0.01)
        watch.rest()
        assert len(watch.session.pool._canvases) <= 3


def test_a_frame_whose_canvas_is_drawn_on_anew_cannot_be_held(device: Device) -> None:
    with session_on(device) as watch:
        old = watch.finished(scene_of())
        assert watch.session.pool.hold(old)
        # While it is held it stays as it is.
        before = {name: plane.copy() for name, plane in planes(old)[0].items()}
        for step in (1, 2, 3):
            watch.finished(turned(scene_of(), 0.3 * step))
        for name, plane in planes(old)[0].items():
            np.testing.assert_array_equal(plane, before[name])
        watch.session.pool.release(old.canvas)
        for step in (1, 2, 3):
            newest = watch.finished(turned(scene_of(), 0.2 * step))
        assert not watch.session.pool.hold(old)
        assert watch.session.pool.hold(newest)
        watch.session.pool.release(newest.canvas)


def test_idle_is_not_told_too_early(device: Device) -> None:
    with session_on(device) as watch:
        for step in range(20):
            number = watch.session.request(turned(scene_of(BULB, "renderer.samples=2"), 0.1 * step))
            wait_for(lambda: watch.session.idle)
            frame = watch.session.frame
            assert frame is not None
            assert (frame.request, frame.finished) == (number, True)


def test_a_fit_is_carried_along_while_it_moves(device: Device) -> None:
    """The screen keeps its distance to the camera; at rest it is fitted anew, as the shell does."""
    scene = scene_of(BULB, *SCENES["fitted"])
    with session_on(device) as watch:
        watch.finished(scene)
        watch.frames.clear()
        moved = turned(scene, 0.4)
        watch.session.request(moved, moving=True)
        frame = watch.rest()
        # Before other frames reuse its canvas.
        equal_pictures(framebuffers_of(frame).picture(), shell(moved))
        first = watch.frames[0].job.scene.stereo
        at_rest = frame.job.scene.stereo
        assert first is not None
        assert at_rest is not None
        assert first.plane is not None
        assert at_rest.plane is not None
        assert first.plane != at_rest.plane
        camera = np.array(moved.camera.position)
        before = watch_distance(watch, scene)
        assert np.linalg.norm(camera - first.plane.center) == pytest.approx(before, rel=1e-5)


def watch_distance(watch: Watch, scene: Scene) -> float:
    """From the camera to the screen that was fitted for a scene."""
    stereo = watch.finished(scene).job.scene.stereo
    assert stereo is not None
    assert stereo.plane is not None
    return float(np.linalg.norm(np.array(scene.camera.position) - stereo.plane.center))
