"""Tasks of a session: small pictures and stills come between the picture's samples, and leave it alone."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.engine.local_executor import LocalExecutor
from clfractal.errors import ClfractalError, DeviceError
from clfractal.integrators import volume
from clfractal.scene.model import Scene
from clfractal.viewer.background import Still, Task, Tell, Thumbnail
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.session import Session
from tests.calls import counted
from tests.viewer.sessions import (
    BALL,
    BULB,
    SCENES,
    equal_pictures,
    framebuffers_of,
    scene_of,
    session_on,
    shell,
    turned,
    wait_for,
)


def test_thumbnails_and_stills_come_in_between(device: Device, tmp_path: Path) -> None:
    """And leave the picture's bits alone, also those of a volume, whose grid they must not push out."""
    scene = scene_of(BULB, *SCENES["volume"], "renderer.samples=64")
    still_scene = scene_of(BULB, "image.width=60", "image.height=40")
    with session_on(device) as watch:
        watch.session.request(scene)
        wait_for(lambda: any(each.samples >= 1 and each.divider == 1 for each in watch.frames))
        thumbs = [
            Thumbnail(partial(scene_of, BALL, f"camera.fov={30 + number}"), (24, 16)) for number in range(6)
        ]
        stills = [Still(still_scene, (tmp_path / name,)) for name in ("a.png", "b.exr")]
        tasks: list[Task] = [*thumbs, *stills]
        for task in tasks:
            watch.session.add(task)
        frame = watch.rest()
        wait_for(lambda: all(each.finished for each in tasks))
        assert frame.finished
        equal_pictures(framebuffers_of(frame).picture(), shell(scene))
    for thumb in thumbs:
        assert thumb.problem == ""
        assert thumb.pixels is not None
        assert thumb.pixels.shape == (16, 24, 4)
        assert thumb.pixels[..., :3].std() > 5
    for still in stills:
        assert (still.problem, still.written, still.share) == ("", still.paths, 1.0)
    wanted = clfractal.render(still_scene)
    wanted.save(tmp_path / "c.png")
    from PIL import Image

    found, right = (np.asarray(Image.open(tmp_path / name)) for name in ("a.png", "c.png"))
    np.testing.assert_array_equal(found, right)


def test_tasks_do_not_hold_up_a_picture_without_samples(device: Device) -> None:
    """Nor do they lose a request that is under way."""
    with session_on(device) as watch:
        watch.finished(scene_of())
        for step in range(10):
            number = watch.session.request(turned(scene_of(), 0.1 * step), moving=step % 2 == 0)
            time.sleep(0.004 * step)
            watch.session.add(Thumbnail(lambda: scene_of(BALL), (16, 12)))
            frame = watch.rest()
            assert (frame.request, frame.finished) == (number, True)


def test_a_still_is_cancelled_soon_and_writes_nothing(device: Device, tmp_path: Path) -> None:
    big = scene_of(BULB, "image.width=800", "image.height=600", "renderer.samples=4096")
    still = Still(big, (tmp_path / "big.png",))
    with session_on(device) as watch:
        watch.finished(scene_of())
        watch.session.add(still)
        wait_for(lambda: not watch.session.idle)
        time.sleep(0.5)
        # A picture that is asked for meanwhile is made first.
        frame_number = watch.session.request(turned(scene_of(), 0.3))
        watch.shows(lambda frame: frame.request == frame_number and frame.samples >= 1)
        assert not still.finished
        time.sleep(0.3)
        start = time.perf_counter()
        still.cancel()
        watch.rest()
        assert time.perf_counter() - start < 60  # to finish it would take minutes
        assert (still.finished, still.cancelled, still.problem) == (True, True, "")
    assert not list(tmp_path.iterdir())


def test_a_cancelled_thumbnail_is_not_rendered(device: Device) -> None:
    loaded: list[int] = []

    def load() -> Scene:
        loaded.append(1)
        return scene_of(BALL)

    with session_on(device) as watch:
        thumb = Thumbnail(load, (16, 12))
        thumb.cancel()
        watch.session.add(thumb)
        wait_for(lambda: watch.session.idle)
    assert not loaded


class Broken:
    """A task that always fails."""

    def __init__(self, error: Exception) -> None:
        self.error, self.calls, self.told = error, 0, ""

    @property
    def finished(self) -> bool:
        return False

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Tell) -> None:
        self.calls += 1
        raise self.error

    def failed(self, error: ClfractalError) -> None:
        self.told = error.message


@pytest.mark.parametrize("error", [DeviceError("no"), ValueError("mistake")])
def test_a_task_that_fails_is_given_up_and_the_picture_goes_on(error: Exception, device: Device) -> None:
    task = Broken(error)
    with session_on(device) as watch:
        watch.session.request(scene_of(BULB, "renderer.samples=32"))
        watch.session.add(task)
        frame = watch.rest()
        assert frame.finished
        assert watch.session.problem is None
    assert task.calls == 1
    assert str(error) in task.told


class Patient(Broken):
    """A task that takes its time."""

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Tell) -> None:
        self.calls += 1
        end = time.perf_counter() + 0.3
        while time.perf_counter() < end:
            token.check()
            time.sleep(0.005)


def test_a_task_is_not_ended_by_the_next_one(device: Device) -> None:
    """It may be compiling: if each new one ended it, it would never be done."""
    with session_on(device) as watch:
        watch.finished(scene_of())
        first, second = Patient(ValueError()), Patient(ValueError())
        watch.session.add(first)
        wait_for(lambda: first.calls)
        watch.session.add(second)
        watch.rest()
        assert (first.calls, second.calls) == (1, 1)


def test_a_thumbnail_of_a_wrong_scene_tells_why(device: Device) -> None:
    thumb = Thumbnail(lambda: clfractal.load_scene("{version: 1}"), (16, 12))
    with session_on(device) as watch:
        watch.session.add(thumb)
        wait_for(lambda: thumb.finished)
    assert thumb.pixels is None
    assert thumb.problem


def test_small_pictures_do_not_push_out_the_grid(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """A grid takes seconds to fill; the picture that needs it goes on after them."""
    fills = counted(monkeypatch, volume, "fill_grid")
    scene = scene_of(BULB, *SCENES["volume"], "renderer.samples=256")
    with session_on(device) as watch:
        watch.session.request(scene)
        wait_for(lambda: watch.frames and watch.frames[-1].divider == 1)
        for number in range(8):
            watch.session.add(Thumbnail(partial(scene_of, BALL, f"camera.fov={30 + number}"), (24, 16)))
        watch.session.add(Thumbnail(lambda: scene, (24, 16)))
        assert watch.rest().finished
        watch.finished(turned(scene, 0.1))
    assert len(fills) == 1


def test_tasks_go_on_in_another_session(device: Device) -> None:
    """As when the device is changed."""
    session = Session(device, Pacing(), lambda: None)
    thumb = Thumbnail(lambda: scene_of(BALL), (16, 12))
    session.add(thumb)
    session.close()
    (task,) = session.take_tasks()
    with session_on(device.reopened()) as watch:
        watch.session.add(task)
        wait_for(lambda: thumb.finished)
    assert thumb.pixels is not None
