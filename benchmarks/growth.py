"""How the rows of volumes and cut planes grow: with the grid's resolution, and with the picture's.

    python -m benchmarks.growth [--device NAME] [--repetitions N] [--largest VOXELS] [--most MEGAPIXELS]

Prints a Markdown table: the device's own time, and the processor time of the whole process over the cores, which other work
on the machine does not lengthen as much. Both are the least of the repetitions.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from clfractal.cli import bench
from clfractal.engine.engine import Engine
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.run import run
from clfractal.integrators.volume import settings_of
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.voxels.fill import fill_grid

RESOLUTIONS = (128, 256, 512, 1024)
SHOWN = (256, 512, 1024)
MEGAPIXELS = (1, 4, 16)


@dataclass(frozen=True, slots=True)
class Figure:
    """One line: the row, its size, milliseconds on the device and of processor time over the cores."""

    row: str
    size: str
    device_ms: float
    processor_ms: float


def scene_of(
    text: str, *, megapixels: int = 1, resolution: int | None = None, surface: bool = False
) -> Scene:
    """A row's scene with another picture and another grid."""
    pixels = round(1000 * megapixels**0.5)
    changes = [f"image.width={pixels}", f"image.height={pixels}"]
    if resolution is not None:
        changes.append(f"renderer.resolution={resolution}")
    if surface:
        changes.append("renderer.transfer={}")
    return load_scene(text, overrides=changes)


def least(work: Callable[[], float], repetitions: int) -> tuple[float, float]:
    """The least time on the device, which `work` returns, and of the process over its cores; the first is left out."""
    times = []
    for _ in range(repetitions + 1):
        start = time.process_time()
        device_ms = work()
        times.append((device_ms, 1e3 * (time.process_time() - start) / len(os.sched_getaffinity(0))))
    device_times, processor_times = zip(*times[1:], strict=True)
    return min(device_times), min(processor_times)


def fill_ms(scene: Scene, engine: Engine) -> float:
    """Fills the scene's grid; milliseconds on the device."""
    job = engine.prepare(scene, precision="float32")
    grid = fill_grid(job.scene, settings_of(job.scene), engine.device, lanes=job.lanes, precision="float32")
    stats = grid.stats
    return stats.octree_ms + stats.fill_ms + stats.store_ms + stats.normals_ms


def frame_ms(scene: Scene, engine: Engine) -> float:
    """Draws the scene into memory; milliseconds on the device. The engine keeps its grid."""
    job = engine.prepare(scene, precision="float32")
    return run(job, JobFramebuffers(job).framebuffers, engine.executor).kernel_ms


def figures(engine: Engine, repetitions: int, largest: int, most: int) -> Iterator[Figure]:
    """Every line of the table, up to grids of `largest` voxels a side and pictures of `most` megapixels."""

    def figure(row: str, size: str, work: Callable[[Scene, Engine], float], scene: Scene) -> Figure:
        return Figure(row, size, *least(lambda: work(scene, engine), repetitions))

    sizes = [megapixels for megapixels in MEGAPIXELS if megapixels <= most]
    for resolution in (n for n in RESOLUTIONS if n <= largest):
        yield figure("grid", f"{resolution}^3", fill_ms, scene_of(bench.VOLUME, resolution=resolution))
    for resolution in (n for n in SHOWN if n <= largest):
        for surface in (False, True):
            row = "volume, a surface" if surface else "volume, composited"
            for megapixels in sizes:
                scene = scene_of(bench.VOLUME, megapixels=megapixels, resolution=resolution, surface=surface)
                yield figure(row, f"{resolution}^3, {megapixels} MP", frame_ms, scene)
    for megapixels in sizes:
        yield figure("cut plane", f"{megapixels} MP", frame_ms, scene_of(bench.PLANE, megapixels=megapixels))


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.growth", description=__doc__.splitlines()[0])
    parser.add_argument("--device", help="which device, as of `clfractal render`")
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument(
        "--largest", type=int, default=RESOLUTIONS[-1], help="voxels a side of the largest grid"
    )
    parser.add_argument("--most", type=int, default=MEGAPIXELS[-1], help="megapixels of the largest picture")
    arguments = parser.parse_args()
    if arguments.repetitions < 1:
        parser.error("--repetitions: must be at least 1")
    print("| row | size | ms on the device | ms of processor time |\n|---|---|--:|--:|")
    for one in figures(Engine(arguments.device), arguments.repetitions, arguments.largest, arguments.most):
        print(f"| {one.row} | {one.size} | {one.device_ms:.0f} | {one.processor_ms:.0f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
