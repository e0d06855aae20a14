"""Runs the program as users do: within this process for speed, or as a process of its own."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

import clfractal
from clfractal.cli import run
from clfractal.cli.shell import Shell
from clfractal.files.journal import SIDE, identity_of

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 40, height: 36}
camera: {position: [0, -3, 0]}
"""
"""A small scene; its line 2 is the formula, its line 4 the camera."""


@dataclass(frozen=True, slots=True)
class Ended:
    """How a run ended."""

    status: int
    out: str
    err: str

    def is_one_line(self, status: int, *parts: str) -> bool:
        """Whether it failed as promised: the status, one line that has all parts, and nothing else."""
        whole = self.err.count("\n") == 1 and self.err.endswith("\n") and not self.out
        missing = [part for part in parts if part not in self.err]
        assert self.status == status, self
        assert whole, self
        assert not missing, (self, missing)
        return True


def works(ended: Ended) -> Ended:
    """What a run that shall end well told."""
    assert ended.status == 0, ended
    return ended


class InProcess:
    """Calls the program as a function, in the current folder."""

    def __init__(self, capture: pytest.CaptureFixture[str]) -> None:
        self.capture = capture

    def __call__(self, *arguments: str | Path) -> Ended:
        self.capture.readouterr()
        status = run([str(argument) for argument in arguments], Shell(owns_process=False))
        told = self.capture.readouterr()
        return Ended(status, told.out, told.err)


def environment(extra: Mapping[str, str] | None = None) -> dict[str, str]:
    """For a process that shall run the program under test, wherever that is installed."""
    home = str(Path(clfractal.__file__).resolve().parents[1])
    return {**os.environ, "PYTHONPATH": home, **(extra or {})}


def command(*arguments: str | Path) -> list[str]:
    """The command line of the program under test."""
    return [sys.executable, "-P", "-m", "clfractal", *map(str, arguments)]


def process(arguments: Sequence[str | Path], folder: Path, extra: Mapping[str, str] | None = None) -> Ended:
    """Runs the program as a process of its own in a folder."""
    return _run(command(*arguments), folder, extra)


def python(
    code: str, *arguments: str | Path, folder: Path | None = None, extra: Mapping[str, str] | None = None
) -> Ended:
    """Runs a text that may import the program under test, as a process of its own."""
    return _run([sys.executable, "-P", "-c", code, *map(str, arguments)], folder, extra)


def _run(words: Sequence[str], folder: Path | None, extra: Mapping[str, str] | None) -> Ended:
    ended = subprocess.run(
        words, cwd=folder, env=environment(extra), capture_output=True, text=True, timeout=240
    )
    return Ended(ended.returncode, ended.stdout, ended.stderr)


def wait_until(
    ready: Callable[[], bool], running: subprocess.Popen[str] | None = None, seconds: float = 120
) -> None:
    """Until something is so; that takes too long, or who should bring it about ends before, is a failure."""
    deadline = time.monotonic() + seconds
    while not ready():
        assert running is None or running.poll() is None, running.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.005)


class Running:
    """The program at work in a folder, in a session of its own; or another command."""

    def __init__(
        self,
        folder: Path,
        *arguments: str,
        words: Sequence[str] | None = None,
        extra: Mapping[str, str] | None = None,
        before: Callable[[], object] | None = None,
    ) -> None:
        self.process = subprocess.Popen(
            words or command(*arguments),
            cwd=folder,
            env=environment(extra),
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=before,
        )

    def wait_until(self, ready: Callable[[], bool]) -> None:
        wait_until(ready, self.process)

    def wait_until_it_listens(self) -> None:
        """Until it answers signals itself; an interpreter that is still starting is just ended by them."""
        told = Path(f"/proc/{self.process.pid}/status")
        if not told.exists():
            time.sleep(0.5)  # such a system does not tell
            return

        def listens() -> bool:
            caught = re.search(r"^SigCgt:\s*(\w+)", told.read_text(), re.MULTILINE)
            return caught is not None and bool(int(caught[1], 16) >> (signal.SIGTERM - 1) & 1)

        self.wait_until(listens)

    def ended_by(self, *signals: signal.Signals, seconds: float = 200) -> tuple[int, str]:
        """Sends the signals; gives status and standard error."""
        for each in signals:
            self.process.send_signal(each)
        try:
            told = self.process.communicate(timeout=seconds)[1]
        finally:
            if self.process.poll() is None:
                os.killpg(self.process.pid, signal.SIGKILL)
                self.process.wait()
        return self.process.returncode, told


def has_bytes(path: Path, least: int) -> Callable[[], bool]:
    """Whether a file is there that has more than so many."""
    return lambda: path.exists() and path.stat().st_size > least


def has_tiles(path: Path, least: int = 1) -> Callable[[], bool]:
    """Whether a journal is there that has so many whole tiles; notes of who made them are records of the same size."""
    return lambda: _tiles_in(path) >= least


def _tiles_in(path: Path) -> int:
    identity = identity_of(path)
    if identity is None:
        return 0
    record = 8 + len(identity["channels"]) * SIDE * SIDE * 4
    data = path.read_bytes()
    start = 16 + int.from_bytes(data[8:12], "little")
    whole = range(start, len(data) - record + 1, record)
    return sum(data[place : place + 4] != b"\xff\xff\xff\xff" for place in whole)
