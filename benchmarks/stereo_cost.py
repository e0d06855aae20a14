"""What a stereo pair costs beside one picture of the same scene: processor time, medians, in turn.

    python -m benchmarks.stereo_cost [--rounds N] [--size PIXELS]

Prints a Markdown table. Each round renders every row once as one picture (the eye between the two) and once as a
pair, so that a machine that slows down slows both. Programs are compiled before the first round.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from collections.abc import Sequence

import clfractal
from clfractal.scene.model import Scene

# The camera stands where the viewer of the screen sits: 0.6 before the middle of 0.52.
_COMMON = """
version: 1
camera: {position: [-2.4, -2.0, 1.5], target: [-0.5, 0, 0], fov: 46.9}
stereo: {mode: pair, screen_width: 0.52, screen_distance: 0.6, interpupillary_distance: 0.063}
"""
ROWS = {
    "surface, one light with a shadow": "formula: {name: mandelbulb, iterations: 30}",
    "surface by its Jacobian, hits proved": "formula: {name: hast, iterations: 14}",
    "volume of 256^3, coverage": """
formula: {name: hast, iterations: 14}
renderer: {type: volume, box: {center: [-0.65, 0, 0], size: 2.9}, resolution: 256, value: coverage}
""",
    "volume of 256^3, translucent": """
formula: {name: mandelbulb, iterations: 12}
renderer:
  type: volume
  box: {size: 3}
  resolution: 256
  value: iterations
  store: float
  transfer:
    opacity: [{at: 3.2, opacity: 0}, {at: 3.4, opacity: 0.1}, {at: 3.6, opacity: 0}, {at: 6, opacity: 0.4}]
""",
}


def spent(scene: Scene) -> float:
    """Processor seconds of all threads for a scene's picture, or its pair."""
    start = time.process_time()
    if scene.stereo is None:
        clfractal.render(scene)
    else:
        clfractal.render_pair(scene)
    return time.process_time() - start


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures every row and prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--size", type=int, default=1000)
    options = parser.parse_args(arguments)
    size = [f"image.width={options.size}", f"image.height={options.size}"]
    scenes = {
        name: (
            clfractal.load_scene(_COMMON + text, overrides=[*size, "stereo=null"]),
            clfractal.load_scene(_COMMON + text, overrides=size),
        )
        for name, text in ROWS.items()
    }
    for mono, _ in scenes.values():
        clfractal.render(mono, region=(0, 0, 32, 32))
    times: dict[str, list[list[float]]] = {name: [[], []] for name in scenes}
    for _ in range(options.rounds):
        for name, pair in scenes.items():
            for index, scene in enumerate(pair):
                times[name][index].append(spent(scene))
    cores = os.cpu_count() or 1
    print(f"Milliseconds of processor time shared by {cores} cores, median of {options.rounds} rounds:\n")
    print("| scene | picture | pair | ratio |\n|---|--:|--:|--:|")
    for name, (one, two) in times.items():
        mono_ms, pair_ms = (1e3 * statistics.median(each) / cores for each in (one, two))
        print(f"| {name} | {mono_ms:.0f} | {pair_ms:.0f} | {pair_ms / mono_ms:.2f} |")


if __name__ == "__main__":
    main()
