"""Runs the program as users do: within this process for speed, or as a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

import clfractal
from clfractal.cli import run
from clfractal.cli.shell import Shell

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
    ended = subprocess.run(
        command(*arguments), cwd=folder, env=environment(extra), capture_output=True, text=True, timeout=240
    )
    return Ended(ended.returncode, ended.stdout, ended.stderr)
