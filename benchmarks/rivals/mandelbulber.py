"""Mandelbulber 2 (Debian package `mandelbulber2`), on the CPU, without a screen.

`scene_mandelbulb8.fract` is the view of row `mandelbulb8-shadow`: power 8, the eye at (0, -3, 0), 53.13
degrees, one directional light with a hard shadow, 250 iterations, detail of a pixel. Mandelbulber measures
elevation where White's rule measures the angle from the pole: a `beta_angle_offset` of 90/8 degrees turns
one into the other.
"""

from __future__ import annotations

import re
import shutil
import tempfile
import time
from pathlib import Path

from benchmarks.rivals.base import MissingError, Sample, run

SCENE = Path(__file__).with_name("scene_mandelbulb8.fract")
RAYS = 1000 * 1000
SECONDS = {"h": 3600.0, "m": 60.0, "s": 1.0}


def rendering_seconds(output: str) -> float:
    """What the program reports as `total time: 1m 2.5s`, in steps of 0.1 s; MissingError where absent."""
    found = re.findall(r"total time:((?:\s*[\d.,]+\s*[hms])+)", output)
    if not found:
        raise MissingError("its output has no `total time`")
    parts = re.findall(r"([\d.,]+)\s*([hms])", found[-1])
    return sum(float(number.replace(",", ".")) * SECONDS[unit] for number, unit in parts)


class Mandelbulber:
    """One run serves two rows: its own rendering time, and the wall time from shell to finished PNG."""

    name = "Mandelbulber 2"
    rows = ("mandelbulb8-shadow", "shell-to-png")

    def __init__(self) -> None:
        self._home = tempfile.TemporaryDirectory(prefix="mandelbulber-")  # its settings must be the defaults

    def prepare(self) -> None:
        if shutil.which("mandelbulber2") is None:
            raise MissingError("mandelbulber2 is not installed (apt-get install mandelbulber2)")
        version = self._run("--version").strip().splitlines()
        self.name = next((line for line in version if line.startswith("Mandelbulber")), self.name)

    def measure(self) -> list[Sample]:
        picture = Path(self._home.name, "picture.png")
        picture.unlink(missing_ok=True)
        start = time.perf_counter()
        output = self._run("-n", "-C", "--stats", "-f", "png", "-o", picture, SCENE)
        wall = time.perf_counter() - start
        if not picture.is_file():
            raise MissingError("it wrote no picture")
        rendering = rendering_seconds(output)
        counted = re.findall(
            r"Total number of iters\s*:\s*([\d.e+]+)", output
        )  # the last report is a little early
        return [
            Sample(
                "mandelbulb8-shadow",
                1e3 * rendering,
                rays_per_second=RAYS / rendering,
                iterations_per_second=float(counted[-1]) / rendering if counted else None,
            ),
            Sample("shell-to-png", 1e3 * wall),
        ]

    def _run(self, *arguments: str | Path) -> str:
        return run(
            ["mandelbulber2", *arguments],
            environment={"QT_QPA_PLATFORM": "offscreen", "HOME": self._home.name, "LC_ALL": "C.UTF-8"},
            timeout_s=300,
        )
