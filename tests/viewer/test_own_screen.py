"""The real screen's width follows a window that the user resizes, whatever is between, and a line tells it."""

from __future__ import annotations

import pytest

from clfractal.viewer.own_screen import OwnScreen
from clfractal.viewer.studio import Studio
from tests.viewer.panel_harness import make_ui

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 3}
camera: {position: [0, -4, 0]}
stereo: {mode: split, screen_width: 0.7, screen_distance: 2}
"""
FILM = """animation:
  duration: 2
  fps: 2
  tracks: {stereo.screen_width: {keys: [{frame: 0, value: 0.7}, {frame: 3, value: 1}]}}
"""


class Desk:
    """A window of a width, and a clock."""

    def __init__(self, text: str = SCENE) -> None:
        self.studio: Studio = make_ui(text)[0].studio
        self.screen = OwnScreen(self.studio)
        self.now = 0.0
        self.resize(1000)

    def resize(self, *widths: int, filling: bool = False) -> None:
        """The window has these widths in turn, 0.1 s each, and then rests for a second."""
        for width in widths:
            for _ in range(1 if width != widths[-1] else 10):
                self.now += 0.1
                self.screen.look(width, self.now, filling=filling, shown=True)

    @property
    def width(self) -> float:
        stereo = self.studio.scene.stereo
        assert stereo is not None
        return stereo.screen_width

    @property
    def told(self) -> list[str]:
        return [message.text for message in self.studio.messages]


def test_it_follows_once_and_says_so_once() -> None:
    desk = Desk()
    desk.resize(1013, 1207, 1333, 1500)
    assert desk.width == 1.05  # as if it had been done at once
    assert desk.told == ["the window is another screen: stereo.screen_width is 1.05 now"]
    assert not desk.studio.unsaved
    desk.resize(1000)
    assert desk.width == 0.7


def test_what_the_user_sets_is_where_the_next_begins() -> None:
    desk = Desk()
    desk.resize(2000)
    desk.studio.edit({"stereo.screen_width": 3.0})
    desk.resize(1000)
    assert desk.width == 1.5


@pytest.mark.parametrize("begins", ["in a window", "over screens", "before its picture"])
def test_what_is_no_wish_leaves_the_scenes_width(begins: str) -> None:
    desk = Desk()
    if begins != "in a window":
        desk.screen = OwnScreen(desk.studio)
    if begins == "before its picture":
        for width in (1280, 1920):
            desk.screen.look(width, 9.0, filling=False, shown=False)
        desk.resize(1920)
    else:
        desk.resize(3840, filling=True)
        desk.resize(1000)
    assert (desk.width, desk.told) == (0.7, [])


@pytest.mark.parametrize("text", [SCENE + FILM, SCENE.replace("0.7", "0.0003")])
def test_a_width_that_cannot_follow_is_told(text: str) -> None:
    """A film moves it, or it would be out of all proportion to the distance."""
    desk = Desk(text)
    before = desk.width
    desk.resize(300)
    assert desk.width == before
    assert "stays" in desk.told[-1]


def test_without_two_eyes_there_is_nothing_to_follow() -> None:
    desk = Desk(SCENE.replace("stereo:", "bookmarks: {}\n#"))
    desk.resize(1500)
    assert desk.told == []
