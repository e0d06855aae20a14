"""What takes long before a picture's first ray: once begun it is finished, and the old picture follows the camera.

Nothing counts seconds: what takes long does so until the test has seen what it waits for.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from clfractal.device import program
from clfractal.device.select import Device
from clfractal.errors import DeviceError
from clfractal.integrators.volume import VolumeKernel
from clfractal.scene.model import Scene
from clfractal.viewer.editing import edited
from clfractal.viewer.frame import Frame
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.preparing import differs_by_view, seen_from
from clfractal.viewer.session import Session
from clfractal.viewer.studio import Studio
from tests.scenes import STEREO
from tests.viewer.sessions import (
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
from tests.viewer.slow_compiler import Slow

SLOW = 1.2
"""Seconds that a program takes here at least, whatever the machine compiles it in: longer than between two edits."""
ENDLESS = 10_000.0


class Shown:
    """A studio whose frames are kept."""

    def __init__(self, scene: Scene, device: Device) -> None:
        self.frames: list[Frame] = []
        self.studio = Studio(scene, device, Pacing(), self._woken)
        self.studio.viewport = (96, 64)
        self.studio.refresh()
        self.rest()

    def _woken(self) -> None:
        frame = self.studio.session.frame
        if frame is not None and (not self.frames or self.frames[-1] is not frame):
            self.frames.append(frame)

    def rest(self) -> Frame:
        """The frame when nothing is under way any more."""
        wait_for(lambda: self.studio.session.idle)
        frame = self.studio.session.frame
        assert frame is not None
        return frame

    def wait(self, seconds: float) -> None:
        """As the window's loop does."""
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            self.studio.tick()
            time.sleep(0.01)


@pytest.fixture
def shown(device: Device, slow: Slow) -> Iterator[Shown]:
    found = Shown(scene_of(), device)
    yield found
    found.studio.close()


def power(frame: Frame) -> float:
    return float(frame.scene.formula.parameters.get("power", 8))


def test_a_slow_drag_of_a_parameter_shows_pictures(shown: Shown, slow: Slow) -> None:
    """Each value comes before the preparation of the one before is done, and pauses are longer than a move is expected."""
    slow.seconds = SLOW
    shown.frames.clear()
    value, counts = 5.5, set()

    def during() -> list[float]:
        return [power(frame) for frame in list(shown.frames) if power(frame) != 8]

    while len(set(during())) < 3:
        assert value < 7.5, "no picture while the slider was dragged"
        value = round(value + 0.01, 2)
        shown.studio.edit({"formula.parameters.power": value}, "power")
        shown.wait(0.6)
        if during():
            counts.add(slow.begun)
    assert during() == sorted(during())
    shown.studio.end_gesture()
    frame = shown.rest()
    # One program for all of them, and none was thrown away.
    assert counts == {slow.begun}
    assert slow.begun == slow.ended
    assert power(frame) == value
    slow.seconds = 0.0
    equal_pictures(framebuffers_of(frame).picture(), shell(shown.studio.shown_scene))


def of_own_text(value: float, *overrides: str) -> Scene:
    """A formula with a number in its text."""
    terms = f"map: ['x*x - y*y - z*z + {value}e-9', 2*x*y, 2*x*z], degree: 2, bounds: {{radius: 2}}"
    inline = f"variables: [x, y, z], parameters: {{power: 2}}, {terms}"
    return scene_of(BULB, f"formula={{inline: {{{inline}}}, parameters: {{power: {value}}}}}", *overrides)


def test_where_each_value_is_a_program_each_that_was_begun_is_shown(device: Device, slow: Slow) -> None:
    """Then the newest is taken; none is thrown away."""
    with session_on(device) as watch:
        watch.finished(scene_of())
        watch.frames.clear()
        slow.seconds, count = 0.5, slow.begun

        def shown_powers() -> list[float]:
            return [each for each in dict.fromkeys(power(each) for each in list(watch.frames)) if each != 8]

        step = 0
        while len(shown_powers()) < 3:
            step += 1
            assert step < 4000
            watch.session.request(of_own_text(round(5.25 + 0.0001 * step, 4)), moving=True)
            time.sleep(0.03)
        number = watch.session.request(of_own_text(5.9), follows=True)
        frame = watch.rest()
        powers = shown_powers()
        assert powers == sorted(powers)
        assert slow.begun - count == slow.ended - count == len(powers)
        assert (frame.request, frame.finished, power(frame)) == (number, True, 5.9)


def test_a_move_as_a_prepared_picture_arrives_does_not_end_it(
    device: Device, slow: Slow, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before its first frame is begun, a move would find nothing that is to be finished."""
    with session_on(device) as watch:
        watch.finished(scene_of())
        arrived, begun = Session._arrived, slow.begun

        def as_it_moves(self: Session, *arguments: Any) -> None:
            monkeypatch.setattr(Session, "_arrived", arrived)
            self.request(of_own_text(6.1), follows=True)
            arrived(self, *arguments)

        monkeypatch.setattr(Session, "_arrived", as_it_moves)
        watch.session.request(of_own_text(6.0), moving=True)
        watch.shows(lambda frame: power(frame) == 6.0)
        frame = watch.rest()
        assert (power(frame), frame.finished, slow.ended - begun) == (6.1, True, 2)


def test_the_old_picture_follows_the_camera(shown: Shown, slow: Slow) -> None:
    slow.seconds = ENDLESS
    shown.studio.set_scene(of_own_text(6.3))
    shown.frames.clear()
    step = 0
    while not any(power(frame) == 6.3 for frame in list(shown.frames)):
        step += 1
        shown.studio.set_camera(turned(shown.studio.scene, 0.001 * step).camera, "orbit")
        shown.wait(0.05)
        if len(shown.frames) >= 10:
            slow.seconds = 0.0
        assert step < 2000
    followed = [frame for frame in shown.frames if power(frame) == 8]
    places = [frame.scene.camera.position for frame in followed]
    assert len(set(places)) == len(places) >= 10
    # And the new one is seen at once from where the camera is by then.
    first = next(frame for frame in shown.frames if power(frame) == 6.3)
    assert first.scene.camera.position not in places[:-2]
    shown.studio.end_gesture()
    frame = shown.rest()
    assert (power(frame), frame.finished) == (6.3, True)
    equal_pictures(framebuffers_of(frame).picture(), shell(shown.studio.shown_scene))


def test_a_grid_is_filled_while_the_old_one_is_seen(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(BULB, *SCENES["volume"])
    fill, fills, seen = VolumeKernel._fill, [0], threading.Event()

    def slowly(self: VolumeKernel) -> Any:
        fills[0] += 1
        while not seen.wait(0.005):
            assert self.resources.token is not None
            self.resources.token.check()
        return fill(self)

    with session_on(device) as watch:
        watch.finished(scene)
        monkeypatch.setattr(VolumeKernel, "_fill", slowly)
        zoomed = edited(scene, {"renderer.zoom": [{"center": [0, 0, 0], "scale": 2.0}]})
        watch.session.request(zoomed)
        wait_for(lambda: fills[0])
        for step in range(1, 7):
            old = turned(scene, 0.05 * step)
            number = watch.session.request(turned(zoomed, 0.05 * step), moving=True)
            watch.shows(lambda frame, old=old: frame.scene == old)  # type: ignore[misc]
        seen.set()
        frame = watch.rest()
        assert (frame.request, frame.finished, fills[0]) == (number, True, 1)
        monkeypatch.setattr(VolumeKernel, "_fill", fill)
        equal_pictures(framebuffers_of(frame).picture(), shell(turned(zoomed, 0.3)))


def test_another_size_is_no_other_scene(device: Device, slow: Slow) -> None:
    """Of the window: what was begun goes on, and the old picture has the new size meanwhile."""
    with session_on(device) as watch:
        watch.finished(scene_of())
        slow.seconds, begun, stopped = ENDLESS, slow.begun, slow.stopped
        watch.session.request(of_own_text(5.3), moving=True)
        wait_for(lambda: slow.begun > begun)
        begun = slow.begun
        number = watch.session.request(of_own_text(5.3, "image.width=90"))
        watch.shows(lambda frame: frame.scene == scene_of(BULB, "image.width=90"))
        slow.seconds = 0.0
        frame = watch.rest()
        assert (frame.request, frame.finished) == (number, True)
        assert (slow.begun, slow.stopped) == (begun, stopped)


def test_another_scene_does_not_wait(device: Device, slow: Slow) -> None:
    with session_on(device) as watch:
        watch.finished(scene_of())
        slow.seconds, begun, stopped = ENDLESS, slow.begun, slow.stopped
        watch.session.request(of_own_text(5.35), moving=True)
        wait_for(lambda: slow.begun > begun)
        frame = watch.finished(turned(scene_of(), 0.5))
        wait_for(lambda: slow.stopped == stopped + 1)
        slow.seconds = 0.0
        equal_pictures(framebuffers_of(frame).picture(), shell(turned(scene_of(), 0.5)))


def test_it_closes_and_pauses_while_something_is_prepared(device: Device, slow: Slow) -> None:
    with session_on(device) as watch:
        watch.finished(scene_of())
        slow.seconds, begun = ENDLESS, slow.begun
        number = watch.session.request(of_own_text(5.4))
        wait_for(lambda: slow.begun > begun)
        assert not watch.session.idle
        watch.session.pause()
        wait_for(lambda: watch.session.idle)
        slow.seconds = 0.0
        watch.session.pause(False)
        frame = watch.rest()
        assert (frame.request, power(frame)) == (number, 5.4)
        slow.seconds, begun, stopped = ENDLESS, slow.begun, slow.stopped
        watch.session.request(of_own_text(5.6))
        wait_for(lambda: slow.begun > begun)
    assert slow.stopped == stopped + 1  # and the session has ended


def test_what_cannot_be_prepared_is_told(device: Device, slow: Slow, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object, **__: object) -> Any:
        raise DeviceError("no room for it")

    with session_on(device) as watch:
        before = watch.finished(scene_of())
        monkeypatch.setattr(program, "_compile", failing)
        watch.session.request(of_own_text(5.7))
        wait_for(lambda: watch.session.problem is not None)
        wait_for(lambda: watch.session.idle)
        assert "no room for it" in str(watch.session.problem)
        assert watch.session.frame is before


def test_the_same_from_elsewhere() -> None:
    scene = scene_of(BULB, STEREO)
    other = turned(scene_of(BULB, STEREO, "image.width=50", "stereo.mode=rows"), 0.4)
    assert differs_by_view(scene, other)
    assert seen_from(scene, other) == other
    assert not differs_by_view(scene, edited(other, {"material.diffuse": 0.2}))
    flat = scene_of(BULB, "camera={projection: orthographic, position: [0, -3, 0]}")
    assert seen_from(scene_of(), flat) == flat
