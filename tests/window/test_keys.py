"""Keys in a real window: flight by position on any layout, help, panels, Escape; all else is asked without a window."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.window.display import Display, needed
from tests.window.driver import Window, wait_for
from tests.window.scenes import SPHERE

pytestmark = pytest.mark.quiet

# Where W and Q are on a keyboard of any layout, as X numbers places.
PLACE_W, PLACE_A, PLACE_6 = "25", "38", "15"


@pytest.fixture(scope="module")
def opened(display: Display, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Window]:
    """One window for all tests of this module."""
    folder = tmp_path_factory.mktemp("keys")
    (folder / "sphere.yaml").write_text(SPHERE)
    with Window(display, folder, "sphere.yaml", "--size", "480x360", "--no-panels") as window:
        window.move(240, 180)
        yield window
        assert window.process.poll() is None, window.told


@pytest.fixture
def window(opened: Window) -> Iterator[Window]:
    """The window; what a test changes is taken back."""
    before = opened.scene()
    yield opened
    opened.keys(*["alt+z"] * 12, *["ctrl+z"] * 12)
    opened.still()
    assert opened.scene() == before


@pytest.fixture
def french(display: Display) -> Iterator[None]:
    """A keyboard on which A and Q, Z and W have changed their places."""
    needed("setxkbmap")
    subprocess.run(["setxkbmap", "fr"], env=display.environment(), check=True)
    yield
    subprocess.run(["setxkbmap", "us"], env=display.environment(), check=True)


def position(window: Window) -> np.ndarray:
    window.still()
    return np.array(window.scene().camera.position)


def test_flight_forward_is_towards_the_target_and_slows_down(window: Window) -> None:
    before = position(window)
    window.hold("w", 0.5)
    after = position(window)
    assert after[1] > before[1] + 0.05
    assert np.abs(after[[0, 2]]).max() < 1e-9
    assert after[1] < -1  # not into the sphere
    assert (position(window) == after).all()


def test_keys_of_flight_are_places(window: Window, french: None) -> None:
    """On a French keyboard Z is where W was; it flies, and the key that is called W there does not fly forward."""
    window.still()
    before = position(window)
    window.hold(PLACE_W, 0.3)
    ahead = position(window)
    assert ahead[1] > before[1] + 0.02
    window.hold(PLACE_A, 0.3)
    aside = position(window)
    assert aside[0] < ahead[0] - 0.02
    # Other keys are letters: Ctrl+Z of this layout is where Ctrl+W was.
    window.keys("equal")
    window.still()
    lighter = window.scene()
    window.keys(f"ctrl+{PLACE_W}")
    window.still()
    assert window.scene().output.exposure != lighter.output.exposure


def test_signs_of_this_layout(window: Window, french: None) -> None:
    """A French keyboard has its minus where a US one has the 6."""
    window.still()
    window.keys(PLACE_6)
    window.still()
    assert window.scene().output.exposure == -0.25


@pytest.mark.parametrize(("key", "back"), [("F1", "Escape"), ("F2", "F2")], ids=["help", "panels"])
def test_help_and_panels_come_and_go(window: Window, key: str, back: str) -> None:
    plain = window.still(8.0)  # messages have gone
    window.keys(key)
    assert (window.still() != plain).any(axis=2).mean() > 0.2
    window.keys(back)
    wait_for(lambda: np.array_equal(window.pixels(), plain), "the picture of before")


def test_a_held_key_ends_when_the_window_loses_the_keyboard(window: Window) -> None:
    window.display.xdotool("keydown", "w", "sleep", 0.1)
    window.display.xdotool("windowunmap", window.id, "sleep", 0.2, "windowmap", window.id)
    window.display.xdotool("keyup", "w", "sleep", 0.3)
    one = position(window)
    assert (position(window) == one).all()


def test_escape_closes_a_menu_and_a_text_alone(display: Display, folder: Path) -> None:
    """The list of formulas, and a number that is typed: the picture goes on, and says nothing."""
    (folder / "s.yaml").write_text(SPHERE)
    with Window(display, folder, "s.yaml", "--size", "900x500") as opened:
        rest = (700, 250)
        opened.move(*rest)
        plain = opened.still(2.0)
        for place in ((130, 86), (210, 114)):
            opened.click(*place)
            opened.move(*rest)
            wait_for(lambda: not np.array_equal(opened.pixels(), plain), "what was clicked on")
            opened.display.xdotool("sleep", 0.3)
            opened.keys("Escape")
            wait_for(lambda: np.array_equal(opened.pixels(), plain), "the picture of before")
        opened.keys("Escape")
        wait_for(lambda: not np.array_equal(opened.pixels(), plain), "the line that gathering has stopped")


def test_tab_goes_into_the_panels_and_escape_back(display: Display, folder: Path) -> None:
    """In the panels arrows move no camera; back in the picture they do."""
    (folder / "s.yaml").write_text(SPHERE)
    with Window(display, folder, "s.yaml", "--size", "900x500") as opened:
        opened.move(700, 250)
        opened.still(1.0)
        before = opened.scene()

        def press(*keys: str) -> None:
            """One after the other, and time to take them in: the cursor of the search line blinks."""
            for key in keys:
                opened.keys(key)
                opened.display.xdotool("sleep", 0.4)

        press("Tab", "Tab", "Left", "Down")
        assert opened.scene().camera == before.camera
        press("Escape", "Left")
        opened.still()
        assert opened.scene().camera != before.camera
