"""Sliders of a formula: pictures come while they are dragged, however long a value takes to prepare."""

from __future__ import annotations

import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.window.changes import changes, seen
from tests.window.display import Display
from tests.window.driver import Window, wait_for
from tests.window.scenes import SURFACE

pytestmark = pytest.mark.quiet

BOX = SURFACE.replace("mandelbulb, iterations: 7", "mandelbox, iterations: 8").replace(
    "[1.25, -2.05, 0.85]", "[6, -14, 7]"
)
SLIDER = (190, 113)
"""The first parameter's, in a window of 1280 x 720."""


def preparation(window: Window, value: str) -> float:
    """Seconds that one value takes from the key that ends it to its first picture."""
    x, y = (each + offset for each, offset in zip(window.place[:2], SLIDER, strict=True))
    window.display.xdotool("mousemove", x, y, "keydown", "ctrl", "click", 1, "keyup", "ctrl")
    window.still()
    window.keys("ctrl+a")
    window.type(value)
    before, start = seen(window), time.monotonic()
    window.keys("Return")
    wait_for(lambda: not np.array_equal(seen(window), before), "the typed value's picture")
    taken = time.monotonic() - start
    window.still(1.0)
    return taken


@pytest.mark.parametrize(("scene", "value"), [(SURFACE, "6.37"), (BOX, "1.87")], ids=["power", "scale"])
def test_a_slow_drag_shows_pictures(display: Display, folder: Path, scene: str, value: str) -> None:
    """No longer without one than two preparations take, whatever the machine; and then for nearly each value."""
    (folder / "s.yaml").write_text(scene.replace("samples: 3", "samples: 1"))
    extra = {"CLFRACTAL_CACHE": str(folder / "cache")}  # nothing is compiled yet
    with Window(display, folder, "s.yaml", "--size", "1280x720", extra=extra) as window:
        window.still(1.0)
        one = preparation(window, value)
        x, y = (each + offset for each, offset in zip(window.place[:2], SLIDER, strict=True))
        steps = 40
        script: list[object] = ["mousemove", x, y, "sleep", 0.1, "mousedown", 1]
        for step in range(1, steps + 1):
            script += ["sleep", 0.11, "mousemove", x + step, y]
        script += ["sleep", 0.1, "mouseup", 1]
        found, end = changes(window, script, 2 * one + 1.0)
        during = [at for at in found if at < end]
        told = f"pictures at {found}, the end at {end}, one preparation takes {one}"
        longest = max(after - before for before, after in pairwise([0.0, *during, end]))
        assert during, told
        assert longest < 2 * one + 1.0, told
        rate = len(during) / max(end - during[0], 0.5)
        assert rate > 2, told
        # It ends with the scene's own picture.
        window.still(1.0)
        assert window.process.poll() is None
