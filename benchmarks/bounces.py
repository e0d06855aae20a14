"""Light that bounces, beside Mandelbulber's Monte Carlo: what an equally noisy picture costs.

    python -m benchmarks.bounces [--size PIXELS] [--samples N] [--rounds N] [--device NAME]

A matt Mandelbulb of albedo 0.8 under a white sky, paths of four bounces. Each program draws the picture twice with other
random numbers: half the mean square of what differs is the variance of a pixel, as it would be against a picture without
noise. Variance falls with the time, so their product is the cost; the table shows it over the square of the mean light.
Only pixels that show the set in all four pictures count.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import png

from benchmarks.rivals import mandelbulber
from benchmarks.rivals.base import MissingError, run
from clfractal.api import load_scene, render

SCENE = """\
version: 1
formula: {name: mandelbulb, parameters: {power: 8}, iterations: 250}
image: {width: 1000, height: 1000}
camera: {position: [0, -3, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 53.13}
lighting: {mode: path, bounces: 4, roulette: 4}
lights: []
background: [1, 1, 1]
materials: {matt: {base: {color: [0.8, 0.8, 0.8]}, specular: {weight: 0}}}
material: {name: matt}
"""
RIVAL = Path(mandelbulber.__file__).with_name("scene_mandelbulb8_paths.fract")

Light = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Drawn:
    """A picture's green light, of shape (rows, columns), and the seconds that it took."""

    light: Light
    seconds: float


def ours(size: int, samples: int, seed: int, device: str | None) -> Drawn:
    """This engine's picture; the time is that of its kernels."""
    changes = {"image.width": size, "image.height": size, "renderer.samples": samples, "renderer.seed": seed}
    scene = load_scene(SCENE, overrides=[f"{key}={value}" for key, value in changes.items()])
    framebuffer = render(scene, device=device)
    return Drawn(framebuffer["G"].astype(np.float64), framebuffer.stats["kernel_ms"] / 1e3)


def theirs(size: int, samples: int) -> Drawn:
    """Mandelbulber's picture; the time is that which it reports. Raises MissingError."""
    with tempfile.TemporaryDirectory(prefix="mandelbulber-") as home:
        picture = Path(home, "picture.png")
        output = run(
            [
                *("mandelbulber2", "-n", "-C", "--stats", "-f", "png16", "-r", f"{size}x{size}"),
                *("-O", f"DOF_samples={samples}#DOF_min_samples={samples}", "-o", str(picture), str(RIVAL)),
            ],
            environment={"QT_QPA_PLATFORM": "offscreen", "HOME": home, "LC_ALL": "C.UTF-8"},
            timeout_s=3600,
        )
        if not picture.is_file():
            raise MissingError("it wrote no picture")
        width, height, rows, facts = png.Reader(filename=str(picture)).read()
        values = np.array([list(row) for row in rows], np.float64).reshape(height, width, -1)
        return Drawn(values[..., 1] / (2 ** facts["bitdepth"] - 1), mandelbulber.rendering_seconds(output))


def figures(pairs: list[tuple[Drawn, Drawn]], shown: npt.NDArray[np.bool_]) -> tuple[float, float, float]:
    """Medians over rounds: seconds of a picture, mean light, and the variance of a pixel over its square."""
    seconds = statistics.median(drawn.seconds for pair in pairs for drawn in pair)
    mean = statistics.median(float(drawn.light[shown].mean()) for pair in pairs for drawn in pair)
    variance = statistics.median(float(((a.light - b.light)[shown] ** 2).mean() / 2) for a, b in pairs)
    return seconds, mean, variance / mean**2


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bounces", description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=1000, help="pixels a side")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--device", help="which device, as of `clfractal render`")
    arguments = parser.parse_args()
    size, samples = arguments.size, arguments.samples
    mine: list[tuple[Drawn, Drawn]] = []
    other: list[tuple[Drawn, Drawn]] = []
    ours(size, 1, 0, arguments.device)  # compiles
    for number in range(arguments.rounds):
        seeds = (2 * number, 2 * number + 1)
        mine.append(
            (ours(size, samples, seeds[0], arguments.device), ours(size, samples, seeds[1], arguments.device))
        )
        try:
            other.append((theirs(size, samples), theirs(size, samples)))
        except MissingError as error:
            print(f"Mandelbulber: {error}", file=sys.stderr)
            return 1
    shown = np.all([drawn.light < 0.999 for pair in (*mine, *other) for drawn in pair], axis=0)
    table = {"clfractal": figures(mine, shown), "Mandelbulber": figures(other, shown)}
    least = np.prod(table["clfractal"][::2])
    print(f"{size} x {size}, {samples} samples, {len(os.sched_getaffinity(0))} cores")
    print("| program | seconds | mean light | variance | cost at equal noise |")
    print("|---|--:|--:|--:|--:|")
    for name, (seconds, mean, variance) in table.items():
        print(f"| {name} | {seconds:.1f} | {mean:.3f} | {variance:.5f} | {seconds * variance / least:.0f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
