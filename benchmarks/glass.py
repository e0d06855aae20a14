"""Glass beside Mitsuba 3 (`pip install mitsuba`): what pictures of equal error cost.

    python -m benchmarks.glass [--samples N] [--rounds N] [--device NAME]

Both stand on a plane under an even sky and a lamp, without a formula, along paths of twelve bounces; Mitsuba is its variant
scalar_rgb. In turn, each program draws pictures with other random numbers, which tell the variance: of pixels, and of
blocks of 8 x 8 pixels, in which noise that neighbours share does not fade. Where both agree in the mean light, that is the
mean square of the error. It falls with the time, so their product is the cost of some error. Times are those of all cores
together, which both programs keep busy, and of rendering alone, without compiling.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.rivals.base import MissingError
from clfractal.api import load_scene, render

WIDTH, HEIGHT, BLOCK = 320, 240, 8
EYE, TARGET, FOV = [2.5, -5, 2.2], [0, 0, 0.45], 30
BOUNCES, ROULETTE = 12, 4
SKY, LIGHT, FLOOR = [0.5, 0.55, 0.6], [12, 12, 12], [0.6, 0.6, 0.55]
LAMP: dict[str, Any] = {
    "position": [1.2, 1.5, 4],
    "direction": [-0.3, -0.35, -1],
    "width": 1.5,
    "height": 1.5,
}
GLASS: dict[str, Any] = {"specular": {"roughness": 0, "ior": 1.5}, "transmission": {"weight": 1}}
WATER: dict[str, Any] = {"specular": {"roughness": 0, "ior": 1.33}, "transmission": {"weight": 1}}
# From 0.002 to 1.3; and water in it from 0.08 to 1.31, a little above the rim.
TUMBLER: dict[str, Any] = {"type": "cylinder", "position": [0, 0, 0.651], "radius": 0.6, "height": 1.298}
DRINK: dict[str, Any] = {"type": "cylinder", "position": [0, 0, 0.695], "radius": 0.54, "height": 1.23}
SCENES: dict[str, dict[str, Any]] = {
    "ball": {"ball": {"type": "sphere", "position": [0, 0, 0.8], "radius": 0.8, "material": "glass"}},
    "water": {"tumbler": {**TUMBLER, "material": "glass"}, "drink": {**DRINK, "material": "water"}},
}

Floats = npt.NDArray[np.float64]


@dataclass(slots=True)
class Drawn:
    """A program's pictures, each of shape (height, width, 3), and the seconds of all cores for each."""

    pictures: list[Floats] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)


def ours(scene: str, samples: int, seed: int, device: str | None) -> tuple[Floats, float]:
    """This engine's picture, and the seconds of all cores."""
    found = load_scene(
        {
            "version": 1,
            "formula": "none",
            "image": {"width": WIDTH, "height": HEIGHT},
            "camera": {"position": EYE, "target": TARGET, "fov": FOV},
            "lighting": {"mode": "path", "bounces": BOUNCES, "roulette": ROULETTE},
            "background": SKY,
            "lights": [{"type": "rectangle", **LAMP, "color": LIGHT}],
            "materials": {
                "floor": {"base": {"color": FLOOR}, "specular": {"weight": 0}},
                "glass": GLASS,
                "water": WATER,
            },
            "objects": {"floor": {"type": "plane", "material": "floor"}, **SCENES[scene]},
            "renderer": {"samples": samples, "seed": seed},
        }
    )
    begun = time.process_time()
    framebuffer = render(found, device=device)
    seconds = time.process_time() - begun
    light = np.stack([framebuffer[name] for name in "RGB"], axis=-1).astype(np.float64)
    return light, seconds


def theirs(scene: str, samples: int, seed: int) -> tuple[Floats, float]:
    """Mitsuba's picture, and the seconds of its rendering. Raises MissingError."""
    with tempfile.TemporaryDirectory(prefix="glass-") as folder:
        file = Path(folder, "found.npz")
        told = {
            "scene": scene,
            "samples": samples,
            "seeds": [seed],
            "size": [WIDTH, HEIGHT],
            "file": str(file),
            "eye": EYE,
            "target": TARGET,
            "fov": FOV,
            "bounces": BOUNCES,
            "roulette": ROULETTE,
            "sky": SKY,
            "light": LIGHT,
            "floor": FLOOR,
            "lamp": LAMP,
        }
        command = [sys.executable, "-m", "benchmarks.rivals.mitsuba_glass"]
        ended = subprocess.run(command, input=json.dumps(told), text=True, capture_output=True, check=False)
        if ended.returncode:
            raise MissingError((ended.stderr.strip().splitlines() or ["Mitsuba failed"])[-1])
        with np.load(file) as found:
            return found["light"][0].astype(np.float64), float(found["seconds"][0])


def blocks(light: Floats) -> Floats:
    """The means of blocks."""
    return np.asarray(
        light.reshape(HEIGHT // BLOCK, BLOCK, WIDTH // BLOCK, BLOCK, 3).mean(axis=(1, 3)), np.float64
    )


def variances(drawn: Drawn) -> tuple[float, float]:
    """Of pixels, and of blocks."""
    pictures = np.stack(drawn.pictures)
    of_blocks = np.stack([blocks(each) for each in drawn.pictures])
    return float(pictures.var(axis=0, ddof=1).mean()), float(of_blocks.var(axis=0, ddof=1).mean())


def main() -> None:
    """Measures both scenes, and prints a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--device")
    given = parser.parse_args()
    print(
        "| scene | program | seconds | mean light | variance of pixels | of blocks | cost by pixels | by blocks |"
    )
    print("|---|---|--:|--:|--:|--:|--:|--:|")
    for scene in SCENES:
        ours(scene, 1, 0, given.device)  # builds the programs
        drawn = {"clfractal": Drawn(), "Mitsuba": Drawn()}
        for seed in range(given.rounds):
            for name, (light, seconds) in (
                ("clfractal", ours(scene, given.samples, seed, given.device)),
                ("Mitsuba", theirs(scene, given.samples, seed)),
            ):
                drawn[name].pictures.append(light)
                drawn[name].seconds.append(seconds)
        costs: dict[str, tuple[float, float]] = {}
        rows = []
        for name, each in drawn.items():
            pixels, of_blocks = variances(each)
            seconds = statistics.median(each.seconds)
            costs[name] = (pixels * seconds, of_blocks * seconds)
            rows.append((name, seconds, float(np.mean(each.pictures)), pixels, of_blocks))
        for name, seconds, mean, pixels, of_blocks in rows:
            beside = [own / other for own, other in zip(costs[name], costs["Mitsuba"], strict=True)]
            print(
                f"| {scene} | {name} | {seconds:.2f} | {mean:.4f} | {pixels:.3g} | {of_blocks:.3g} |"
                f" {beside[0]:.2f} | {beside[1]:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
