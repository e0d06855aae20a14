"""What the program's start costs: processor and wall time of whole commands, new processes, in turn, with warm caches; and
what a first picture costs, whose programs are compiled.

    python -m benchmarks.start [--rounds N] [NAME=FOLDER ...]

Prints a Markdown table. On Linux processor time includes that of the processes that compile. Each FOLDER is a checkout to
compare; without any it is this one. A round runs every command of every checkout once, so that a machine that slows down
slows all. Bytecode is kept, as pip makes it.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

# The Mandelbulb of the speed table, whose kernel takes some 3 ms at this size.
SCENE = """
version: 1
formula: {name: mandelbulb, parameters: {power: 8}, iterations: 250}
camera: {position: [0, -3, 0], target: [0, 0, 0]}
image: {width: 320, height: 180}
"""
RENDER = ("render", "scene.yaml", "-o", "picture.png")
FIRST = "first picture of a formula"
COMMANDS = {"render, 320 x 180": RENDER, "check": ("check", "scene.yaml"), FIRST: RENDER}
# Parts of the program's cache folder that hold programs; the rest is what was measured of devices.
_PROGRAMS = ("programs",)
_PR_SET_CHILD_SUBREAPER = 36  # <sys/prctl.h>
_WITHOUT = ("PYTHONDONTWRITEBYTECODE", "PYTHONUNBUFFERED", "POCL_CACHE_DIR")


def spent(package: Path, command: Sequence[str], folder: Path) -> tuple[float, float]:
    """Wall and processor seconds of a command of the package in a checkout.

    Raises:
        subprocess.CalledProcessError: the command failed.
    """
    kept = {name: value for name, value in os.environ.items() if name not in _WITHOUT}
    before, start = os.times(), time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "clfractal", *command],
        cwd=folder,
        env={**kept, "PYTHONPATH": str(package), "CLFRACTAL_CACHE": str(folder / "cache")},
        check=True,
        capture_output=True,
    )
    wall = time.perf_counter() - start
    # Those that outlive the command are ours now, and end with it.
    with contextlib.suppress(ChildProcessError):
        while sys.platform == "linux":
            os.wait()
    after = os.times()
    both = after.children_user + after.children_system - before.children_user - before.children_system
    return wall, both


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures every command of every checkout and prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--rounds", type=int, default=11)
    parser.add_argument("checkouts", nargs="*", metavar="NAME=FOLDER")
    options = parser.parse_args(arguments)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    named = [text.partition("=") for text in options.checkouts]
    places = {name: Path(folder).resolve() for name, _, folder in named}
    places = places or {"this": Path(__file__).resolve().parents[1]}
    print("| command | checkout | wall ms, median | best | processor ms, median | best |")
    print("|---|---|--:|--:|--:|--:|")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")
        for title, command in COMMANDS.items():
            times: dict[str, list[tuple[float, float]]] = {name: [] for name in places}
            for _ in range(options.rounds + 1):
                for name, place in places.items():
                    for part in _PROGRAMS if title == FIRST else ():
                        shutil.rmtree(folder / "cache" / part, ignore_errors=True)
                    times[name].append(spent(place, command, folder))
            for name, found in times.items():
                columns = zip(*found[1:], strict=True)  # the first fills caches
                figures = [f(column) for column in columns for f in (statistics.median, min)]
                print(f"| {title} | {name} | {' | '.join(f'{1e3 * each:.0f}' for each in figures)} |")


if __name__ == "__main__":
    main()
