"""Sizes and screens: resized, full screen and back, minimised, over several windows of a desktop with a manager."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.window.display import SIZE as SCREEN
from tests.window.display import Display
from tests.window.driver import Window, wait_for
from tests.window.film import film
from tests.window.scenes import SURFACE


@pytest.fixture
def window(desktop: Display, folder: Path) -> Iterator[Window]:
    """A window among others, with a frame around it."""
    (folder / "s.yaml").write_text(SURFACE)
    with Window(desktop, folder, "s.yaml", "--size", "360x240", "--no-panels") as found:
        yield found


def shows_its_film(window: Window) -> None:
    """The picture has the window's size, whatever that is, and every pixel of it."""
    _, _, width, height = window.place
    window.shows(film(window.folder, "s.yaml", (width, height)))


def _has_size(window: Window, size: tuple[int, int]) -> bool:
    return window.place[2:] == size


def test_resized_again_and_again(window: Window) -> None:
    shows_its_film(window)
    for size in ((500, 300), (333, 401), (640, 200), (321, 233)):
        window.resize(*size)
        wait_for(partial(_has_size, window, size), f"the size {size}")
        shows_its_film(window)


def test_resized_while_it_moves(window: Window) -> None:
    for step in range(40):
        window.display.xdotool("windowsize", window.id, 360 + 3 * step, 240 + 2 * step)
    wait_for(partial(_has_size, window, (360 + 3 * 39, 240 + 2 * 39)), "the last size")
    shows_its_film(window)


def test_full_screen_and_back(window: Window) -> None:
    before = window.place
    window.display.xdotool("windowfocus", "--sync", window.id)
    window.keys("F11")
    wait_for(lambda: window.place == (0, 0, *SCREEN), "the full screen")
    shows_its_film(window)
    assert np.array_equal(window.display.pixels(), window.pixels())  # no frame, no bar
    window.keys("F11")
    wait_for(lambda: window.place[2:] == before[2:], "the window")
    shows_its_film(window)
    assert np.abs(np.subtract(window.place, before)).max() <= 40  # a frame may be put around it


@pytest.mark.parametrize("options", [["--fullscreen"], ["--monitors", "1"]])
def test_it_begins_in_full_screen(desktop: Display, folder: Path, options: list[str]) -> None:
    (folder / "s.yaml").write_text(SURFACE)
    with Window(desktop, folder, "s.yaml", *options) as found:
        wait_for(lambda: found.place == (0, 0, *SCREEN), "the full screen")
        shows_its_film(found)


def test_minimised_and_back(window: Window) -> None:
    plain = window.still()
    window.display.xdotool("windowminimize", "--sync", window.id)
    window.display.xdotool("sleep", 0.5)
    assert window.process.poll() is None
    window.display.xdotool("windowmap", "--sync", window.id)
    wait_for(lambda: np.array_equal(window.pixels(), plain), "the picture")
    window.display.xdotool("windowfocus", "--sync", window.id)
    window.move(180, 120)
    window.keys("minus")
    assert (window.still() != plain).any()


def test_a_window_for_each_eye(window: Window) -> None:
    window.display.xdotool("windowfocus", "--sync", window.id)
    window.keys("ctrl+F11")

    def both() -> list[str]:
        found = window.display.xdotool("search", "--onlyvisible", "--name", "^clfractal").split()
        return found if len(found) == 2 else []

    ids = wait_for(both, "two windows")
    titles = sorted(window.display.xdotool("getwindowname", each).strip() for each in ids)
    assert any("right eye" in title for title in titles)
    window.display.xdotool("windowfocus", "--sync", window.id)
    window.keys("ctrl+F11")
    wait_for(lambda: not both(), "one window")
    assert window.process.poll() is None


def test_closed_by_the_window_manager(window: Window) -> None:
    window.display.xdotool("windowfocus", "--sync", window.id)
    window.keys("alt+F4")
    ended = window.ended()
    assert (ended.status, ended.out, ended.err) == (0, "", "")


def test_unsaved_changes_are_asked_about_before_it_closes(window: Window) -> None:
    window.display.xdotool("windowfocus", "--sync", window.id)
    window.move(180, 120)
    window.keys("minus")
    window.still()
    window.keys("alt+F4")
    window.still()
    assert window.process.poll() is None
    window.keys("Escape", "alt+F4")  # no; and asked again
    window.still()
    assert window.process.poll() is None
    window.keys("alt+F4")  # yes
    assert window.ended().status == 0
