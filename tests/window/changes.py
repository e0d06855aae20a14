"""When the picture in a window changes while something is done to it."""

from __future__ import annotations

import subprocess
import time

import numpy as np

from tests.window.display import Pixels
from tests.window.driver import Window

MIDDLE = np.s_[140:640, 420:900]
"""A part of the window where no panel is."""


def seen(window: Window) -> Pixels:
    left, top, _, _ = window.place
    return window.display.pixels()[top : top + 720, left : left + 1280][MIDDLE].copy()


def changes(window: Window, script: list[object], after: float) -> tuple[list[float], float]:
    """When the picture changed while a script ran, and for a while after it; and when the script ended. Seconds."""
    left, top, _, _ = window.place
    process = subprocess.Popen(["xdotool", *map(str, script)], env=window.display.environment())
    start, last, found, end = time.monotonic(), seen(window), [], 0.0
    while not end or time.monotonic() - start < end + after:
        if not end and process.poll() is not None:
            end = time.monotonic() - start
        now = window.display.pixels()[top : top + 720, left : left + 1280][MIDDLE]
        if not np.array_equal(now, last):
            found.append(time.monotonic() - start)
            last = now.copy()
        time.sleep(0.01)
    return found, end
