"""A picture that takes long enough to be stopped halfway, and one that never ends, for tests of Ctrl-C and of resuming."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from tests.shell import Running

# Heavy enough for several batches of tiles, each of a fraction of a second.
HEAVY = """version: 1
formula: {name: mandelbulb, iterations: 60}
image: {width: 224, height: 160}
camera: {position: [0, -2.2, 0.4], fov: 40}
renderer: {type: surface, samples: 16, detail: 0.2}
output:
  channels: [R, G, B, A, Z, N.X, iterations, steps]
  precision: {R: float, G: float, B: float, N.X: float}
"""

TILES = 7 * 5

# One tile of this takes a CPU several seconds: its kernel cannot be stopped, only left.
ENDLESS = """version: 1
formula: {name: mandelbulb, iterations: 3000}
image: {width: 256, height: 256}
camera: {position: [0, -2.2, 0], fov: 40}
renderer: {type: surface, samples: 65536, detail: 0.01, max_steps: 100000}
"""

# The program, which goes no further when it has stored so many tiles, until it is ended or a file `go` is there: so it is
# not done before it is stopped, however fast the machine is, and however late who stops it.
HOLD = """
import os, sys, time
from clfractal.images.store import JournalFramebuffer
put, most, stored = JournalFramebuffer.put_tiles, int(sys.argv.pop(1)), []

def held(framebuffer, indices, tiles, *more):
    # (A launch may have all tiles of a picture.)
    now = max(most - len(stored), 0)
    for some in (slice(now), slice(now, None)):
        put(framebuffer, indices[some], tiles[some], *more)
        stored.extend(indices[some])
        while len(stored) >= most and not os.path.exists("go"):
            time.sleep(0.005)

JournalFramebuffer.put_tiles = held
sys.argv[0] = "clfractal"
"""
MAIN = "from clfractal.cli import main\nmain()\n"

# What an answer may take on a machine that is loaded: ten times the promise. The promise itself is kept by its parts: see
# `test_interrupt.test_the_promise`.
LIMIT_SECONDS = 5.0

PROMISE_SECONDS = 0.5


def holding(tiles: int, *arguments: str, code: str = MAIN) -> list[str]:
    """The command line of the program that holds after so many tiles; `code` calls it."""
    return [sys.executable, "-P", "-c", HOLD + code, str(tiles), *arguments]


def interrupt(
    folder: Path, ready: Callable[[], bool], extra: dict[str, str], *options: str
) -> tuple[int, str, float]:
    """Starts a render, waits until it is `ready`, sends SIGINT; gives status, standard error and seconds."""
    running = Running(folder, "render", "endless.yaml", "-o", "out.exr", *options, extra=extra)
    running.wait_until_it_listens()
    running.wait_until(ready)
    start = time.monotonic()
    status, told = running.ended_by(signal.SIGINT)
    return status, told, time.monotonic() - start


def interrupted_in_a_kernel(folder: Path, *options: str) -> list[str]:
    """What three renders told that were interrupted while their kernels ran: soon, and without a lost tile."""
    (folder / "endless.yaml").write_text(ENDLESS)
    journal, told = folder / "out.exr.partial", []

    def rendering() -> bool:
        if not journal.exists():
            return False
        time.sleep(1.0)  # the program is loaded and its kernel runs
        return True

    for _ in range(3):
        status, line, took = interrupt(folder, rendering, {}, *options)
        assert status == 130, line
        assert not (folder / "out.exr").exists()
        assert journal.exists() == ("--resume" in line), "without a finished tile nothing stays"
        assert took < LIMIT_SECONDS
        told.append(line)
    return told
