"""What a window minds beside its picture: room for panels, monitors that go and come, depth that strains the eyes."""

from __future__ import annotations

from typing import Any, cast

import pytest

from clfractal.device.select import Device
from clfractal.engine.comfort import comfort_of_framebuffers
from clfractal.engine.show import Look
from clfractal.viewer.cables import Cables
from clfractal.viewer.depth_range import DepthRange
from clfractal.viewer.panels import overlay
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.room import Room
from clfractal.viewer.window import Monitor
from tests.viewer.panel_harness import make_ui
from tests.viewer.sessions import BULB, framebuffers_of, scene_of, session_on, shown_frame

# Room for panels


@pytest.fixture
def ui() -> Ui:
    return make_ui(scene_of(BULB, "stereo={mode: split}"))[0]


def fit(ui: Ui, room: Room, width: float, *, alone: bool = False) -> bool:
    """Whether panels are shown in an area of a width."""
    ui.size = (width, 360.0)
    room.fit(ui, alone=alone)
    return "panels" in ui.show


def test_panels_leave_half_of_a_small_window(ui: Ui) -> None:
    """Each eye's half of 640 x 360 is 320 points wide: the dock takes 316 of them."""
    room = Room()
    assert fit(ui, room, 640)
    assert not fit(ui, room, 320)
    assert "F2 shows them" in ui.studio.messages[-1].text
    assert not fit(ui, room, 330)
    assert len(ui.studio.messages) == 1
    assert fit(ui, room, 640)


def test_who_asks_for_panels_gets_them(ui: Ui) -> None:
    room = Room()
    assert not fit(ui, room, 320)
    ui.show.add("panels")
    assert fit(ui, room, 320)
    ui.show.discard("panels")
    assert not fit(ui, room, 640)  # the user has put them away
    ui.show.add("panels")
    assert not fit(ui, room, 320)
    assert not fit(ui, room, 1920, alone=True)  # on a projector they do not come back by themselves
    assert fit(ui, room, 640)


def test_figures_are_few_where_the_picture_is_small(ui: Ui) -> None:
    def labels(width: float) -> set[str]:
        ui.size = (width, 360.0)
        return {label for row in overlay.lines(ui) for label, _ in row}

    assert {"stereo", "depth"} <= labels(320) < labels(1280)


# Monitors


class Desk:
    """Two projectors with the same name, and a clock."""

    def __init__(self, second: str = "EPSON") -> None:
        self.left = Monitor(1, "EPSON", 0, 0, 1920, 1080, 0.0)
        self.right = Monitor(2, second, 1920, 0, 1920, 1080, 0.0)
        self.there = [self.left, self.right]
        self.cables = Cables(lambda: list(self.there))
        self.now = 0.0
        self.windows: list[Any] = [object(), object()]
        for where, monitor in zip(self.windows, self.there, strict=True):
            self.cables.filled(cast(Any, where), [monitor])

    def look(self, *there: Monitor) -> tuple[list[str], list[Any]]:
        """What is told, and which windows fill which monitors, when these monitors are there."""
        self.there = list(there)
        self.now += 1.0
        told, again = self.cables.look(self.now)
        return [line.text for line in told], [(self.windows.index(where), found) for where, found in again]


@pytest.mark.parametrize("second", ["EPSON", "BENQ"])
def test_a_monitor_goes_and_comes_back_elsewhere(second: str) -> None:
    desk = Desk(second)
    assert desk.look(desk.left, desk.right) == ([], [])
    told, again = desk.look(desk.left)
    assert told == [f"monitor 2 ({second}) is gone; its picture waits for it"]
    assert again == []
    assert desk.cables.has(desk.windows[0])
    assert not desk.cables.has(desk.windows[1])
    assert not desk.cables.complete
    assert desk.look(desk.left) == ([], [])
    other = Monitor(2, second, 1920, 96, 1280, 720, 0.0)
    assert desk.look(desk.left, other) == ([f"monitor 2 ({second}) is back"], [(1, [other])])
    assert desk.cables.has(desk.windows[1])
    assert desk.cables.complete


def test_a_window_over_both_waits_for_both() -> None:
    desk = Desk("BENQ")
    desk.cables.clear()
    assert desk.look(desk.left) == ([], [])
    desk.there = [desk.left, desk.right]
    desk.cables.filled(desk.windows[0], desk.there)
    assert desk.look(desk.left)[1] == []
    assert desk.look(desk.left, desk.right)[1] == [(0, [desk.left, desk.right])]
    moved = Monitor(2, "BENQ", 1920, 0, 1280, 720, 0.0)
    assert desk.look(desk.left, moved) == ([], [(0, [desk.left, moved])])  # another mode


# Depth


@pytest.mark.parametrize("convergence", ["off_axis", "toe_in"])
def test_the_depth_of_the_picture_is_that_of_a_file(device: Device, convergence: str) -> None:
    """The same range as `render --stats` has; told once, until it was better."""
    stereo = f"stereo={{mode: split, screen_width: 0.5, screen_distance: 0.7, convergence: {convergence}}}"
    deep, flat = scene_of(BULB, stereo), scene_of(BULB, stereo, "stereo.separation=0.1")
    minded = DepthRange()
    with session_on(device) as watch:
        for scene, wanted in ((deep, 1), (deep, 0), (flat, 0), (deep, 1)):
            frame = watch.finished(scene)
            shown, _ = shown_frame(device, watch, frame, Look(0.0, scene.stereo))
            warning = minded.look(shown)
            assert bool(warning) == bool(wanted)
            assert minded.comfort == comfort_of_framebuffers(frame.job, framebuffers_of(frame).framebuffers)
