"""What a picture costs while the camera moves, beside the same picture with a ray for each pixel.

    python -m benchmarks.moving                  the table
    python -m benchmarks.moving mandelbulb hast  only these
    python -m benchmarks.moving --json FILE      also as JSON

The camera turns round its target by a degree a frame, at 1280 x 720, as a session of the window renders it: most pixels
come from the frame before. After each frame the same picture is rendered from scratch. Times are wall time, medians of all
frames after the first two. `away` is how far a moving picture lies from the one from scratch: the mean of all screen
values, of 1. `truth` is how far each of them lies from one with 16 samples a pixel, in decibels.
"""

from __future__ import annotations

import argparse
import json
import statistics
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.window import SCENES as WINDOW_SCENES
from benchmarks.window import SIZE
from clfractal import camera
from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device, choose
from clfractal.engine.canvas import CHANNELS, Canvas
from clfractal.engine.job import Job
from clfractal.engine.prepare import prepare
from clfractal.files import resources, srgb
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.viewer.frame import CanvasPool, Frame, Growth
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.painting import Executors, Moved, Painter

SCENES = ("mandelbulb", "mandelbox", "hast")
_FIRST = 2
"""Frames that are not counted."""
_SAMPLES = 16


@dataclass(frozen=True)
class Row:
    """Seconds of a frame; how far moving pictures lie from those from scratch, and both from the truth."""

    name: str
    moving: float
    scratch: float
    away: float
    moving_truth: float
    scratch_truth: float

    @property
    def ratio(self) -> float:
        """The part of a picture from scratch that a moving one costs."""
        return self.moving / self.scratch


def measure(name: str, device: Device, frames: int, step: float) -> Row:
    """Turns the camera of a scene, by degrees."""
    file, overrides = WINDOW_SCENES[name]
    sized = [*overrides, f"image={{width: {SIZE[0]}, height: {SIZE[1]}}}", "output.denoise=false"]
    scene = load_scene(resources.folder("scenes") / file, overrides=sized)
    executors, token = Executors(device, lambda line: None), CancelToken()
    pool = CanvasPool(device)
    painter = Painter(device, pool, executors.picture)
    painter.prepare(token)
    moving: list[float] = []
    scratch: list[float] = []
    away: list[float] = []
    try:
        front, moved = _drawn(painter, _turned(scene, 0.0, device), None, token)
        for number in range(1, frames + 1):
            job = _turned(scene, step * number, device)
            front, moved = _drawn(painter, job, front, token)
            assert moved.carried
            found = _screen(front.canvas, device)
            # (On a canvas that is none of the frame's: the next one looks at it.)
            whole = painter.moved(job, 1, front, token, Pacing(), carries=False)
            exact = _screen(whole.canvas, device)
            if number > _FIRST:
                moving.append(moved.seconds)
                scratch.append(whole.seconds)
                away.append(float(np.abs(found - exact).mean()))
        true = _true(painter, job, front, token)
    finally:
        executors.close()
    truths = (_decibels(found - true), _decibels(exact - true))
    return Row(name, statistics.median(moving), statistics.median(scratch), statistics.mean(away), *truths)


def _turned(scene: Scene, angle: float, device: Device) -> Job:
    return prepare(camera.turn(scene, azimuth=angle), device, channels=CHANNELS)


def _drawn(painter: Painter, job: Job, front: Frame | None, token: CancelToken) -> tuple[Frame, Moved]:
    made = painter.moved(job, 1, front, token, Pacing(), carries=painter.carries(front, job))
    growth = Growth.coarse(made.views, made.carried, made.seconds, made.seconds)
    number = front.number + 1 if front is not None else 1
    return Frame.of(number, number, job.scene, job, made.canvas, growth), made


def _true(painter: Painter, job: Job, front: Frame, token: CancelToken) -> Any:
    views = tuple(replace(view, plan=replace(view.plan, samples=_SAMPLES)) for view in job.views)
    canvas = painter.canvas(job, front)
    painter.run(replace(job, views=views), canvas, token)
    return _screen(canvas, painter.device)


def _screen(canvas: Canvas, device: Device) -> Any:
    planes = canvas.read(device.queue, 0)
    return srgb.encode(np.clip(np.stack([planes[name] for name in "RGB"]), 0.0, 1.0))


def _decibels(differences: Any) -> float:
    return float(-10 * np.log10(np.mean(np.square(differences))))


def main() -> None:
    """Measures, prints the table, and writes JSON if that is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"some of {', '.join(SCENES)}")
    parser.add_argument("--device", help="as for `clfractal view`")
    parser.add_argument("--frames", type=int, default=12, help="of each scene, at least 3")
    parser.add_argument("--degrees", type=float, default=1.0, help="by which the camera turns in a frame")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures as JSON")
    chosen = parser.parse_args()
    if unknown := [name for name in chosen.scenes if name not in SCENES]:
        parser.error(f"unknown scene {unknown[0]!r}; there are {', '.join(SCENES)}")
    if chosen.frames <= _FIRST:
        parser.error(f"--frames must be at least {_FIRST + 1}")
    device = choose(chosen.device).reopened()
    print(device.info.name)
    print(f"{'':12}{'moving ms':>11}{'scratch ms':>12}{'ratio':>8}{'away':>8}{'truth dB':>18}")
    rows = []
    for name in chosen.scenes or SCENES:
        row = measure(name, device, chosen.frames, chosen.degrees)
        rows.append(row)
        times = f"{1e3 * row.moving:11.0f}{1e3 * row.scratch:12.0f}{row.ratio:8.2f}"
        print(
            f"{row.name:12}{times}{row.away:8.4f}{row.moving_truth:9.1f}{row.scratch_truth:9.1f}", flush=True
        )
    if chosen.json is not None:
        told = {row.name: {**vars(row), "ratio": row.ratio} for row in rows}
        chosen.json.write_text(json.dumps(told, indent=1) + "\n")


if __name__ == "__main__":
    main()
