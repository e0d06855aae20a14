"""How long a device is busy after a render was cancelled: many cancels at random moments.

    python -m benchmarks.cancel [--device NAME] [--count N] [--budget SECONDS] [--size PIXELS] [--set KEY=VALUE]

The scene is the thesis's fractal with a hard shadow (row 2 of the speed table). After each cancel the engine renders a
small picture, to show that it can be used at once.
"""

from __future__ import annotations

import argparse
import random
import statistics
import threading
import time
from collections.abc import Callable

from clfractal.cli.bench import HAST
from clfractal.device.cancel import CancelToken
from clfractal.engine.engine import Engine
from clfractal.errors import Stopped
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene


def cancelled_after(
    engine: Engine, scene: Scene, delay: float, clock: Callable[[], float] = time.perf_counter
) -> float | None:
    """Seconds from a cancel, `delay` seconds after the render began, until the device is idle; None if it was done."""
    token = CancelToken()
    asked: list[float] = []

    def cancel() -> None:
        asked.append(clock())
        token.cancel()

    timer = threading.Timer(delay, cancel)
    timer.start()
    try:
        engine.render(scene, token=token)
    except Stopped:
        return clock() - asked[0]
    finally:
        timer.cancel()
        timer.join()
    return None


def waits(
    engine: Engine,
    scene: Scene,
    count: int,
    seed: int = 1,
    clock: Callable[[], float] = time.perf_counter,
) -> list[float]:
    """Seconds until the device was idle, for `count` cancels at random moments of a render."""
    engine.render(scene)
    start = time.perf_counter()
    engine.render(scene)
    duration = time.perf_counter() - start
    source = random.Random(seed)
    found: list[float] = []
    small = scene.model_copy(update={"image": {"width": 32, "height": 32}})
    while len(found) < count:
        wait = cancelled_after(engine, scene, source.uniform(0, 0.95 * duration), clock)
        if wait is not None:
            found.append(wait)
        if len(found) % 20 == 0:
            engine.render(small)
    return found


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cancel", description=__doc__.splitlines()[0])
    parser.add_argument("--device")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--budget", type=float, default=0.01)
    parser.add_argument("--size", type=int, default=1000)
    parser.add_argument("--set", action="append", default=[])
    options = parser.parse_args()
    changes = [f"image.width={options.size}", f"image.height={options.size}", *options.set]
    with Engine(options.device, budget_seconds=options.budget) as engine:
        found = sorted(waits(engine, load_scene(HAST, overrides=changes), options.count))
    within = sum(wait <= 2 * options.budget for wait in found) / len(found)
    quantiles = statistics.quantiles(found, n=100)
    print(
        f"{len(found)} cancels, budget {1e3 * options.budget:g} ms: median {1e3 * statistics.median(found):.1f} ms, "
        f"95th percentile {1e3 * quantiles[94]:.1f} ms, longest {1e3 * found[-1]:.1f} ms; "
        f"{within:.1%} within twice the budget, longest {found[-1] / options.budget:.1f} times it"
    )


if __name__ == "__main__":
    main()
