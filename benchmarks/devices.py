"""`python -m benchmarks.devices`: what sharing a picture between devices costs, beside one device that does it alone.

    python -m benchmarks.devices                  the halves of the processor beside the whole
    python -m benchmarks.devices 0:0 1:0/1+1      any devices, as of --device; the first is the measure

Each has an engine that has rendered the scene before. All render in turn, so that a busy machine disturbs all alike; the
table has medians of the wall time, files not counted, and the ratio to the first of the medians and of the best rounds.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Sequence

import numpy as np

from clfractal.cli.bench import HAST, MANDELBULB
from clfractal.device.select import choose
from clfractal.engine.engine import Engine
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene

ROUNDS = 9
SCENES = {"mandelbulb8-shadow": MANDELBULB, "hast2-shadow": HAST}


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the table; the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("devices", nargs="*", help="as of --device; by default the processor, and its halves")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--samples", type=int, default=4, help="rays per pixel")
    given = parser.parse_args(arguments)
    print(f"{'scene':20} {'devices':20} {'ms':>8} {'ratio':>7} {'best':>8} {'ratio':>7}  same bits")
    for name, text in SCENES.items():
        measured = measure(load_scene(text), given.devices or halves(), given.rounds, given.samples)
        first = next(iter(measured.values()))
        for device, (seconds, same) in measured.items():
            median, best = statistics.median(seconds), min(seconds)
            print(
                f"{name:20} {device:20} {1e3 * median:8.0f} {median / statistics.median(first[0]):7.3f}"
                f" {1e3 * best:8.0f} {best / min(first[0]):7.3f}  {'yes' if same else 'no'}",
                flush=True,
            )
    return 0


def halves() -> list[str]:
    """The processor, and its halves."""
    info = choose("cpu").info
    half = info.compute_units // 2
    return [info.index, f"{info.index}/{half}+{info.compute_units - half}"]


def measure(
    scene: Scene, devices: Sequence[str], rounds: int, samples: int
) -> dict[str, tuple[list[float], bool]]:
    """Of each device or several: seconds of each round, and whether the picture has the bits of the first one's."""
    engines = {device: Engine(device) for device in devices}
    framebuffers = {device: engine.render(scene, samples=samples) for device, engine in engines.items()}
    first = framebuffers[devices[0]]
    same = {
        device: all(np.array_equal(framebuffer[name], first[name]) for name in first)
        for device, framebuffer in framebuffers.items()
    }
    seconds: dict[str, list[float]] = {device: [] for device in devices}
    for number in range(rounds):
        # Back and forth: none always comes after the same other.
        for device in devices if number % 2 else reversed(devices):
            start = time.perf_counter()
            engines[device].render(scene, samples=samples)
            seconds[device].append(time.perf_counter() - start)
    return {device: (seconds[device], same[device]) for device in devices}


if __name__ == "__main__":
    raise SystemExit(main())
