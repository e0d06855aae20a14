"""What pictures of equal error cost, beside Mitsuba 3: pictures by turns, their variances, and a table of both programs.

Each program draws pictures with other random numbers, which tell the variance: of pixels, and of blocks of 8 x 8 pixels, in
which noise that neighbours share does not fade. Where both agree in the mean light, that is the mean square of the error.
It falls with the time, so their product is the cost of some error.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.rivals.base import MissingError
from clfractal.api import render
from clfractal.scene.model import Scene

BLOCK = 8  # pixels

Floats = npt.NDArray[np.float64]
Picture = tuple[Floats, float]
"""Light, shape (height, width, 3), and the seconds of all cores."""


@dataclass(slots=True)
class Drawn:
    """A program's pictures, each of shape (height, width, 3), and the seconds of all cores for each."""

    pictures: list[Floats] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    @property
    def variances(self) -> tuple[float, float]:
        """Of pixels, and of blocks."""
        pictures = np.stack(self.pictures)
        _, height, width, _ = pictures.shape
        parts = pictures.reshape(-1, height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).mean(axis=(2, 4))
        return float(pictures.var(axis=0, ddof=1).mean()), float(parts.var(axis=0, ddof=1).mean())


def ours(scene: Scene, device: str | None) -> Picture:
    """This engine's picture."""
    begun = time.process_time()
    framebuffer = render(scene, device=device)
    seconds = time.process_time() - begun
    return np.stack([framebuffer[name] for name in "RGB"], axis=-1).astype(np.float64), seconds


def theirs(rival: str, told: Mapping[str, Any], seed: int) -> Picture:
    """The picture of a module of `benchmarks.rivals`. Raises MissingError."""
    with tempfile.TemporaryDirectory(prefix="beside-") as folder:
        file = Path(folder, "found.npz")
        text = json.dumps({**told, "seeds": [seed], "file": str(file)})
        command = [sys.executable, "-m", f"benchmarks.rivals.{rival}"]
        ended = subprocess.run(command, input=text, text=True, capture_output=True, check=False)
        if ended.returncode:
            raise MissingError((ended.stderr.strip().splitlines() or ["Mitsuba failed"])[-1])
        with np.load(file) as found:
            return found["light"][0].astype(np.float64), float(found["seconds"][0])


def drawn_by_turns(
    rounds: int, own: Callable[[int], Picture], rivals: Callable[[int], Picture]
) -> dict[str, Drawn]:
    """The pictures of both programs, by seeds."""
    drawn = {"clfractal": Drawn(), "Mitsuba": Drawn()}
    for seed in range(rounds):
        for program, (light, seconds) in (("clfractal", own(seed)), ("Mitsuba", rivals(seed))):
            drawn[program].pictures.append(light)
            drawn[program].seconds.append(seconds)
    return drawn


def print_head() -> None:
    """The table's head."""
    print(
        "| scene | program | seconds | mean light | variance of pixels | of blocks | cost by pixels | by blocks |"
    )
    print("|---|---|--:|--:|--:|--:|--:|--:|")


def print_rows(scene: str, drawn: Mapping[str, Drawn]) -> None:
    """A scene's rows, with costs over Mitsuba's."""
    seconds = {name: statistics.median(each.seconds) for name, each in drawn.items()}
    beside = [part * seconds["Mitsuba"] for part in drawn["Mitsuba"].variances]
    for name, each in drawn.items():
        pixels, of_blocks = each.variances
        costs = [part * seconds[name] / other for part, other in zip(each.variances, beside, strict=True)]
        print(
            f"| {scene} | {name} | {seconds[name]:.2f} | {float(np.mean(each.pictures)):.4f} | {pixels:.3g} |"
            f" {of_blocks:.3g} | {costs[0]:.2f} | {costs[1]:.2f} |",
            flush=True,
        )
