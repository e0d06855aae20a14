"""A screen that nobody sees: an X server in memory, whose pixels can be read, and a window manager if one is needed."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import time
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
import numpy.typing as npt
import pytest

Pixels = npt.NDArray[np.uint8]

EXPECTED = "CLFRACTAL_EXPECT_WINDOWS"
"""Set to 1: what is missing for a real window is a failure, not a reason to skip."""

SIZE = (1400, 900)
_XWD_HEADER = 25  # numbers of 32 bits, the largest first


def missing(what: str) -> None:
    """Skips the test if something is missing (none if empty); fails if windows are expected on this machine."""
    if what and os.environ.get(EXPECTED) == "1":
        pytest.fail(f"missing for a real window: {what}")
    if what:
        pytest.skip(f"missing for a real window: {what}")


def needed(*programs: str) -> None:
    """The same for programs and for the viewer's libraries."""
    packages = {
        "Xvfb": "xvfb",
        "setxkbmap": "x11-xkb-utils",
        "xwininfo": "x11-utils",
        "Xorg": "xserver-xorg-core, xserver-xorg-video-dummy",
        "xrandr": "x11-xserver-utils",
    }
    found = [name for name in programs if shutil.which(name) is None]
    libraries = [name for name in ("glfw", "OpenGL", "imgui_bundle") if not _importable(name)]
    told = [f"{name} (Debian: {packages.get(name, name)})" for name in found]
    missing(", ".join([*told, *(f"{name} (pip install 'clfractal[viewer]')" for name in libraries)]))


def _importable(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ModuleNotFoundError:
        return False


class Display:
    """An X server of its own, on a number that is free.

    Args:
        folder: for the server's memory and messages.
        size: of the screen, pixels.
        managed: whether a window manager (openbox) runs: full screen, moving and minimising need one.
    """

    def __init__(self, folder: Path, size: tuple[int, int] = SIZE, *, managed: bool = False) -> None:
        needed("xdotool", "xwininfo", *(["openbox"] if managed else []))
        self.size = size
        folder.mkdir(parents=True, exist_ok=True)
        reading, writing = os.pipe()
        command = [*self._server_command(folder), "-displayfd", str(writing)]
        command += ["-nocursor", "-noreset", "-nolisten", "tcp", "+extension", "GLX"]
        with open(folder / "server.log", "wb") as log:
            self._server = subprocess.Popen(command, pass_fds=(writing,), stdout=log, stderr=log)
        os.close(writing)
        with os.fdopen(reading, "rb") as pipe:
            number = pipe.readline().strip()
        assert number, (folder / "server.log").read_text()
        self.name = f":{number.decode()}"
        self._manager: subprocess.Popen[bytes] | None = None
        self._set_up(folder)
        if managed:
            with open(folder / "manager.log", "wb") as log:
                self._manager = subprocess.Popen(
                    ["openbox", "--sm-disable"], env=self.environment(), stdout=log, stderr=log
                )
            self._wait_for_manager()

    def _server_command(self, folder: Path) -> list[str]:
        """The server and what it is to have."""
        needed("Xvfb")
        width, height = self.size
        # The screen lies in a file, in the format of xwd, where it can be read at any time.
        return ["Xvfb", "-screen", "0", f"{width}x{height}x24", "-fbdir", str(folder)]

    def _set_up(self, folder: Path) -> None:
        """What is left to do once the server answers."""
        self._memory = np.memmap(folder / "Xvfb_screen0", np.uint8, mode="r")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def environment(self, extra: Mapping[str, str] | None = None) -> dict[str, str]:
        """For programs that shall have their windows here."""
        found = {**os.environ, **(extra or {}), "DISPLAY": self.name}
        found.pop("WAYLAND_DISPLAY", None)
        found.pop("XDG_SESSION_TYPE", None)
        return found

    def xdotool(self, *arguments: object, check: bool = True) -> str:
        """Sends events, or asks for windows; what it prints."""
        return self.ask("xdotool", *map(str, arguments), check=check)

    def ask(self, *command: str, check: bool = False) -> str:
        """Runs a program that talks with the server; what it prints."""
        ended = subprocess.run(
            command, env=self.environment(), capture_output=True, text=True, timeout=120, check=False
        )
        assert not check or ended.returncode == 0, (command, ended.stderr)
        return ended.stdout

    def pixels(self) -> Pixels:
        """The screen as it is now, shape (height, width, 3)."""
        head = struct.unpack(f">{_XWD_HEADER}I", self._memory[: 4 * _XWD_HEADER].tobytes())
        start = head[0] + 12 * head[19]  # after the header and the table of colours
        width, height, line = head[4], head[5], head[12]
        rows = self._memory[start : start + height * line].reshape(height, line)
        blue_first = rows[:, : 4 * width].reshape(height, width, 4)
        return np.ascontiguousarray(blue_first[..., 2::-1])

    def close(self) -> None:
        """Ends the server, and with it every window that is left."""
        for each in (self._manager, self._server):
            if each is not None:
                each.terminate()
                try:
                    each.wait(10)
                except subprocess.TimeoutExpired:
                    each.kill()
                    each.wait(10)

    def _wait_for_manager(self) -> None:
        deadline = time.monotonic() + 120
        # Answered by window managers alone.
        while not self.xdotool("get_desktop", check=False).strip():
            assert time.monotonic() < deadline, "openbox does not answer"
            time.sleep(0.05)
