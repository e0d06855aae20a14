"""Drives a real window from outside, as a user does: with the mouse, the keyboard, and eyes on the screen."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

import numpy as np

from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from tests.shell import Ended, command, environment
from tests.window.display import Display, Pixels

PATIENCE = 60.0
"""Seconds after which something that has to happen is not waited for any more."""
# Buttons of X.
LEFT, MIDDLE, RIGHT, WHEEL_UP, WHEEL_DOWN = 1, 2, 3, 4, 5

T = TypeVar("T")


def wait_for(what: Callable[[], T], told: object = "", seconds: float = PATIENCE) -> T:
    """Asks again and again until the answer is true; gives the answer."""
    deadline = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < deadline, f"waited in vain for {told or what}"
        time.sleep(0.02)
    return found


class Window:
    """The program in a process of its own, and its window.

    Args:
        display: where it appears.
        folder: current folder of the process; files go there.
        arguments: of `clfractal view`; `--save saved.yaml` is added unless it is given.
        extra: environment variables.
        open: wait until the window is there.

    Attributes:
        saves: where Ctrl+S saves.
    """

    def __init__(
        self,
        display: Display,
        folder: Path,
        *arguments: str | Path,
        extra: Mapping[str, str] | None = None,
        save: bool = True,
        open: bool = True,
    ) -> None:
        self.display, self.folder = display, folder
        self.saves = folder / "saved.yaml"
        given = [*map(str, arguments), *(["--save", str(self.saves)] if save else [])]
        self._out, self._errors = folder / "standard-output", folder / "standard-error"
        with self._out.open("wb") as out, self._errors.open("wb") as errors:
            self.process = subprocess.Popen(
                command("view", *given),
                cwd=folder,
                env=display.environment(environment({"CLFRACTAL_DEVICE": "pthread", **(extra or {})})),
                stdout=out,
                stderr=errors,
                start_new_session=True,
            )
        self.id = ""
        if open:
            self.id = wait_for(self._found, "the window")
            self.still()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kill()

    def _found(self) -> str:
        assert self.process.poll() is None, self.told
        found = self.display.xdotool("search", "--onlyvisible", "--name", "^clfractal", check=False).split()
        return found[0] if found else ""

    # What it shows

    @property
    def told(self) -> str:
        """Its standard error so far."""
        return self._errors.read_text(errors="replace")

    @property
    def title(self) -> str:
        """Of the window."""
        return self.display.xdotool("getwindowname", self.id).rstrip("\n")

    @property
    def place(self) -> tuple[int, int, int, int]:
        """x, y, width, height of its content on the screen, pixels."""
        # (xdotool counts a manager's frame twice.)
        told = self.display.ask("xwininfo", "-id", self.id)
        assert told, f"the window is gone: {self.told}"
        found = {
            name.strip(): value for name, _, value in (line.partition(":") for line in told.splitlines())
        }
        names = ("Absolute upper-left X", "Absolute upper-left Y", "Width", "Height")
        x, y, width, height = (int(found[name]) for name in names)
        return x, y, width, height

    def pixels(self) -> Pixels:
        """What can be seen of it, shape (height, width, 3)."""
        x, y, width, height = self.place
        return self.display.pixels()[y : y + height, x : x + width]

    def still(self, seconds: float = 0.6) -> Pixels:
        """Waits until it shows something and has not changed for a while; what it shows."""
        deadline = time.monotonic() + PATIENCE
        before, since = self.pixels(), time.monotonic()
        while time.monotonic() - since < seconds or not before.any():
            assert self.process.poll() is None, self.told
            assert time.monotonic() < deadline, "the window does not come to rest"
            time.sleep(0.05)
            now = self.pixels()
            if now.shape != before.shape or not np.array_equal(now, before):
                before, since = now, time.monotonic()
        return before

    def shows(self, picture: Pixels, seconds: float = PATIENCE) -> None:
        """Waits until it shows a picture: at most one step of 8 bits off, in at most 0.01 % of the bytes."""
        deadline = time.monotonic() + seconds
        while (difference := differs(self.pixels(), picture)) != "":
            assert self.process.poll() is None, self.told
            assert time.monotonic() < deadline, difference
            time.sleep(0.05)

    # What a user does

    def keys(self, *chords: str) -> None:
        """Presses and releases keys, as xdotool names them (`ctrl+shift+z`, `Page_Up`; a number from 10 is a place)."""
        self.display.xdotool("key", "--delay", "20", *chords)

    def type(self, text: str) -> None:
        """Types a text."""
        self.display.xdotool("type", "--delay", "20", text)

    def hold(self, key: str, seconds: float) -> None:
        """Holds a key down for a while."""
        self.display.xdotool("keydown", key, "sleep", seconds, "keyup", key)

    def move(self, x: float, y: float) -> None:
        """The pointer goes to a place of the window, pixels from its top left."""
        self.display.xdotool(*self._moved(x, y))

    def click(self, x: float, y: float, button: int = LEFT, *, count: int = 1) -> None:
        """Clicks, once or more."""
        clicks = ["click", "--repeat", count, "--delay", 60, button]
        self.display.xdotool(*self._moved(x, y), "sleep", 0.03, *clicks)

    def drag(
        self,
        start: tuple[float, float],
        end: tuple[float, float],
        button: int = LEFT,
        *,
        steps: int = 8,
        held: str = "",
    ) -> None:
        """Presses at a place, moves to another, and lets go; `held`: a key that is down meanwhile."""
        script: list[object] = [*self._moved(*start), "sleep", 0.03]
        script += ["keydown", held] if held else []
        script += ["mousedown", button]
        for step in range(1, steps + 1):
            part = step / steps
            place = [first + part * (last - first) for first, last in zip(start, end, strict=True)]
            script += ["sleep", 0.02, *self._moved(*place)]
        script += ["sleep", 0.03, "mouseup", button]
        script += ["keyup", held] if held else []
        self.display.xdotool(*script)

    def wheel(self, x: float, y: float, steps: int) -> None:
        """Turns the wheel over a place; positive steps zoom in."""
        button = WHEEL_UP if steps > 0 else WHEEL_DOWN
        self.display.xdotool(
            *self._moved(x, y), "sleep", 0.03, "click", "--repeat", abs(steps), "--delay", 40, button
        )

    def _moved(self, x: float, y: float) -> list[object]:
        left, top, _, _ = self.place
        return ["mousemove", left + round(x), top + round(y)]

    def resize(self, width: int, height: int) -> None:
        """Gives it another size."""
        self.display.xdotool("windowsize", self.id, width, height)

    # Its scene

    def save(self) -> Path:
        """Presses Ctrl+S and waits for the file."""
        before = _stamp(self.saves)
        self.keys("ctrl+s")
        wait_for(lambda: _stamp(self.saves) not in (None, before), "the saved scene")
        return self.saves

    def scene(self) -> Scene:
        """Its scene as it is now, by way of the file that Ctrl+S writes."""
        self.saves.unlink(missing_ok=True)
        return load_scene(self.save())

    # Its end

    def ended(self, seconds: float = PATIENCE) -> Ended:
        """Waits for the end of the process."""
        try:
            status = self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"the window does not close: {self.told}") from None
        return Ended(status, self._out.read_text(errors="replace"), self.told)

    def interrupt(self) -> None:
        """Ctrl-C in the shell that it was started from."""
        self.process.send_signal(signal.SIGINT)

    def kill(self) -> None:
        """Ends the process at once, as a crash would."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(30)


def differs(one: Pixels, other: Pixels) -> str:
    """Why two pictures are not the same but for rounding; empty if they are."""
    if one.shape != other.shape:
        return f"{one.shape} is not {other.shape}"
    steps = np.abs(one.astype(int) - other)
    off = int((steps > 0).sum())
    if steps.max() <= 1 and off <= 1e-4 * steps.size:
        return ""
    return f"{off} of {steps.size} bytes differ, by {steps.max()} at most"


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns
