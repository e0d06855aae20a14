"""Films ordered in a real window: it stays usable while they are rendered, and what is done is kept when it closes."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from clfractal.viewer.panels import menu, theme
from tests.window.display import Display
from tests.window.driver import Window, wait_for

pytestmark = pytest.mark.quiet

SIZE = (900, 640)
FILM = """version: 1
formula: {name: mandelbulb, iterations: 5}
image: {width: 320, height: 200}
camera: {position: [0, -3, 0.5], fov: 45}
renderer: {samples: SAMPLES}
animation:
  fps: 10
  frames: 8
  tracks: {camera.position: {keys: [{frame: 0, value: [0, -3, 0.5]}, {frame: 7, value: [2, -2, 0.5]}]}}
"""
# The button that orders, below six lines of the panel at the right.
RENDER = (SIZE[0] - 130, menu.HEIGHT + 2 * theme.MARGIN + 222)


def test_the_window_is_usable_while_its_film_is_rendered(display: Display, folder: Path) -> None:
    (folder / "film.yaml").write_text(FILM.replace("SAMPLES", "16"))
    with Window(display, folder, "film.yaml", "--size", "900x640") as window:
        window.keys("shift+F9")
        window.still()
        window.click(*RENDER)
        partial = folder / "film.mp4.partial"
        wait_for(partial.exists, "the film's frames")
        wait_for(lambda: len(list(partial.glob("*.png"))) >= 1, "the first frame")
        # A step of the film and back: pictures come while its frames are rendered.
        picture = (slice(80, 330), slice(330, 600))
        before, begun = window.pixels()[picture].copy(), time.monotonic()
        window.keys("shift+End")
        wait_for(lambda: (window.pixels()[picture] != before).mean() > 0.01, "another picture")
        answered = time.monotonic() - begun
        assert answered < 3, answered
        wait_for((folder / "film.mp4").exists, "the film")
        wait_for(lambda: not partial.exists(), "its frames to go")
        assert (folder / "film.mp4").stat().st_size > 1000
        assert window.process.poll() is None


def test_a_film_that_the_window_leaves_is_continued_by_the_next(display: Display, folder: Path) -> None:
    (folder / "film.yaml").write_text(FILM.replace("SAMPLES", "200"))
    partial = folder / "film.mp4.partial"
    with Window(display, folder, "film.yaml", "--size", "900x640") as window:
        window.keys("shift+F9")
        window.still()
        window.click(*RENDER)
        wait_for(lambda: partial.exists() and len(list(partial.glob("*.png"))) >= 1, "the first frame")
        window.keys("ctrl+q")
        ended = window.ended()
        assert ended.status == 0, ended
        assert "film.mp4: interrupted with" in window.told, ended
    kept = {path.name: path.stat().st_mtime_ns for path in partial.glob("*.png")}
    assert 1 <= len(kept) < 8
    with Window(display, folder, "film.yaml", "--size", "900x640") as window:
        window.keys("shift+F9")
        window.still()
        window.click(RENDER[0] - 60, RENDER[1])  # Continue; to begin anew is at its right
        wait_for(lambda: len(list(partial.glob("*.png"))) > len(kept), "one frame more")
        assert {name: (partial / name).stat().st_mtime_ns for name in kept} == kept


def test_without_a_film_the_panel_says_how_one_begins(display: Display, folder: Path) -> None:
    (folder / "still.yaml").write_text(FILM.replace("SAMPLES", "1").partition("animation:")[0])
    with Window(display, folder, "still.yaml", "--size", "900x640") as window:
        before = window.still()
        window.keys("shift+F9")
        part = (slice(60, 200), slice(SIZE[0] - 270, SIZE[0] - 20))
        assert (np.abs(window.still()[part].astype(int) - before[part]) > 8).mean() > 0.3
        window.click(*RENDER)
        window.still()
        assert window.process.poll() is None
