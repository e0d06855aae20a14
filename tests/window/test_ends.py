"""Ctrl-C in the shell, and quitting by key: at once, with the status of other commands, whatever is going on."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

import pytest

from clfractal.viewer.autosave import Autosave
from tests.window.display import Display
from tests.window.driver import Window, wait_for
from tests.window.scenes import SURFACE

pytestmark = pytest.mark.quiet

PLAIN = ("--size", "480x320", "--no-panels")
# What one answer may take on a loaded machine; the promise, half a second, the fastest of three has to keep.
LIMIT_SECONDS, PROMISE_SECONDS = 5.0, 0.5
# Gathers samples for minutes.
LONG = SURFACE.replace("samples: 3", "samples: 4096").replace("iterations: 7", "iterations: 40")


def _shows_something(window: Window) -> bool:
    return bool(window.pixels().any())


def interrupted(window: Window) -> float:
    """Ctrl-C; how long it took."""
    start = time.monotonic()
    window.interrupt()
    ended = window.ended()
    seconds = time.monotonic() - start
    assert (ended.status, ended.out, ended.err) == (130, "", "clfractal: interrupted\n")
    return seconds


@pytest.mark.parametrize("text", [SURFACE, LONG], ids=["at rest", "while it renders"])
def test_ctrl_c_ends_it_at_once(display: Display, folder: Path, text: str) -> None:
    (folder / "s.yaml").write_text(text)
    took = []
    for _ in range(3):
        with Window(display, folder, "s.yaml", *PLAIN, open=text is SURFACE) as window:
            if text is LONG:
                window.id = wait_for(window._found)
                wait_for(partial(_shows_something, window), "a picture")
            took.append(interrupted(window))
        assert took[-1] < LIMIT_SECONDS
        if took[-1] < PROMISE_SECONDS:
            return
    assert min(took) < PROMISE_SECONDS


def test_ctrl_c_keeps_what_is_unsaved(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(SURFACE)
    cache = folder / "cache"
    with Window(display, folder, "s.yaml", *PLAIN, extra={"CLFRACTAL_CACHE": str(cache)}) as window:
        window.keys("minus")
        window.still()
        interrupted(window)
    kept = Autosave(cache / "autosave").found()
    assert [each.scene().output.exposure for each in kept] == [0.25]
    for each in kept:
        each.release()


def test_ctrl_q_closes_it(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(LONG)
    with Window(display, folder, "s.yaml", *PLAIN, open=False) as window:
        window.id = wait_for(window._found)
        wait_for(lambda: window.pixels().any(), "a picture")
        window.move(200, 200)
        window.keys("ctrl+q")
        ended = window.ended()
        assert (ended.status, ended.out, ended.err) == (0, "", "")


def test_the_display_goes_away(tmp_path_factory: pytest.TempPathFactory, folder: Path) -> None:
    """Nothing can be shown any more; the process does not stay behind, and what is unsaved is kept."""
    (folder / "s.yaml").write_text(SURFACE)
    (folder / "settings.yaml").write_text("autosave: 0.2\n")
    cache = folder / "cache"
    extra = {"CLFRACTAL_CACHE": str(cache), "CLFRACTAL_SETTINGS": str(folder / "settings.yaml")}
    with (
        Display(tmp_path_factory.mktemp("lost")) as display,
        Window(display, folder, "s.yaml", *PLAIN, extra=extra) as window,
    ):
        window.keys("minus")
        window.still()
        wait_for(lambda: list((cache / "autosave").glob("*.json")), "the safety copy")
        display.close()
        assert window.ended().status != 0
    kept = Autosave(cache / "autosave").found()
    assert len(kept) == 1
    kept[0].release()
