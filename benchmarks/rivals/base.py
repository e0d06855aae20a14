"""What every contestant answers, and how a missing one says so."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

# The rows every table starts with.
ROWS = (
    "mandelbulb8-shadow",
    "hast2-shadow",
    "hast2-grid512",
    "hast2-volume512",
    "hast2-plane256",
    "shell-to-png",
)


class MissingError(Exception):
    """This contestant cannot take part here; the message says why, in one line."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One timing of one row; what a contestant does not count is None."""

    row: str
    milliseconds: float
    rays_per_second: float | None = None
    iterations_per_second: float | None = None
    steps_per_ray: float | None = None
    fma_share: float | None = None  # part of the device's measured FMA peak, 0..1


class Contestant(Protocol):
    """A program that draws the rows' pictures."""

    name: str

    def prepare(self) -> None:
        """Everything that happens once: find the program, compile. Raises MissingError."""

    def measure(self) -> list[Sample]:
        """One round. Raises MissingError."""


def run(
    command: Sequence[str | Path],
    *,
    environment: Mapping[str, str | None],
    timeout_s: float,
    cwd: Path | None = None,
) -> str:
    """Run a program to its end and return its standard output.

    `environment` changes the current one; None takes a variable away. Raises MissingError when the program
    does not exist, fails, is ended by a signal or takes longer than `timeout_s`; it quotes the last line of
    its errors.
    """
    changed = {**os.environ, **{key: value for key, value in environment.items() if value is not None}}
    for key in (key for key, value in environment.items() if value is None):
        changed.pop(key, None)
    try:
        done = subprocess.run(
            [str(part) for part in command],
            env=changed,
            cwd=cwd,
            timeout=timeout_s,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
    except FileNotFoundError as error:
        raise MissingError(f"{command[0]} is not installed") from error
    except subprocess.TimeoutExpired as error:
        raise MissingError(f"took longer than {timeout_s:.0f} s") from error
    if done.returncode == 0:
        return done.stdout
    lines = done.stderr.strip().splitlines()
    how = (
        f"ended by {signal.Signals(-done.returncode).name}"
        if done.returncode < 0
        else f"exit status {done.returncode}"
    )
    raise MissingError(f"{how}: {lines[-1].strip()[:160]}" if lines else how)
