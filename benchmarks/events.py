"""Sends real events to a display, as its mouse and keyboard would: XTest, by way of the libraries that are there anyway.

    python -m benchmarks.events <script >times     what `python -m benchmarks.window` starts

A script is a JSON list of steps: ["sleep", seconds], ["move", x, y], ["button", number, down], ["key", name, down],
["wheel", steps]. Each step but `sleep` is answered by a line of JSON: when it was sent (seconds of the monotonic clock,
which all processes share) and the step.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import json
import os
import sys
import time
from typing import Any


class Events:
    """The mouse and the keyboard of a display.

    Raises:
        OSError: there is no such display, or the libraries are missing.
    """

    def __init__(self, display: str | None = None) -> None:
        self._x11, self._test = _library("X11", 6), _library("Xtst", 6)
        self._x11.XOpenDisplay.restype = ctypes.c_void_p
        self._x11.XStringToKeysym.restype = ctypes.c_ulong
        name = (display or os.environ.get("DISPLAY", "")).encode()
        self._display = ctypes.c_void_p(self._x11.XOpenDisplay(name))
        if not self._display:
            raise OSError(f"no display {name.decode()!r}")
        self._now = ctypes.c_ulong(0)

    def move(self, x: int, y: int) -> float:
        """The pointer goes to a place of the screen; when that was sent."""
        return self._sent(self._test.XTestFakeMotionEvent, -1, int(x), int(y))

    def button(self, number: int, down: bool) -> float:
        """A button goes down or up; 1 is the left one."""
        return self._sent(self._test.XTestFakeButtonEvent, number, int(down))

    def wheel(self, steps: int) -> float:
        """The wheel turns; positive steps are away from the hand."""
        sent = 0.0
        for _ in range(abs(steps)):
            sent = self.button(4 if steps > 0 else 5, True)
            self.button(4 if steps > 0 else 5, False)
        return sent

    def key(self, name: str, down: bool) -> float:
        """A key goes down or up, by X's name of its symbol."""
        symbol = ctypes.c_ulong(self._x11.XStringToKeysym(name.encode()))
        return self._sent(
            self._test.XTestFakeKeyEvent, self._x11.XKeysymToKeycode(self._display, symbol), int(down)
        )

    def close(self) -> None:
        """Leaves the display."""
        self._x11.XCloseDisplay(self._display)

    def _sent(self, function: Any, *values: int) -> float:
        now = time.perf_counter()
        function(self._display, *values, self._now)
        self._x11.XFlush(self._display)
        return now


def _library(name: str, version: int) -> Any:
    return ctypes.CDLL(ctypes.util.find_library(name) or f"lib{name}.so.{version}")


def main() -> None:
    """Does a script from standard input."""
    events = Events()
    doing: dict[str, Any] = {
        "move": events.move,
        "button": events.button,
        "key": events.key,
        "wheel": events.wheel,
    }
    due = time.perf_counter()
    for kind, *values in json.load(sys.stdin):
        if kind == "sleep":
            due += values[0]
            time.sleep(max(due - time.perf_counter(), 0.0))
        else:
            print(json.dumps([doing[kind](*values), kind, *values]), flush=True)
    events.close()


if __name__ == "__main__":
    main()
