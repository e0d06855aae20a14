"""The speed table of a device: medians, measured in one session."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clfractal.cli import bench_frames as frames
from clfractal.cli.shell import Shell
from clfractal.device.peak import fma_peak
from clfractal.device.select import Device, choose
from clfractal.engine.engine import Engine
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.prepare import prepare
from clfractal.engine.run import Progress
from clfractal.engine.run import run as do
from clfractal.errors import ClfractalError, DeviceError, Where
from clfractal.files.atomic import atomic_writer, check_output
from clfractal.formulas.opencl import operations_per_application
from clfractal.integrators.lanes import march_reports
from clfractal.integrators.volume import settings_of
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.voxels.fill import fill_grid

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

REPETITIONS = 7
STILL_REPETITIONS = 3
SHELL_REPETITIONS = 5

# Row 1: what fills most of a megapixel with the Mandelbulb, one directional light with a hard shadow.
MANDELBULB = """\
version: 1
formula: {name: mandelbulb, parameters: {power: 8}, iterations: 250}
image: {width: 1000, height: 1000}
camera: {position: [0, -3, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 53.13}
lights: [{direction: [0.5, 0.6, -0.62], shadow: true}]
"""
# Row 2: the thesis's own fractal by its Jacobian, with a hard shadow.
HAST = """\
version: 1
formula: {name: hast, parameters: {power: 2}, iterations: 40}
image: {width: 1000, height: 1000}
camera: {position: [-0.8, 2.2, 3.0], target: [-0.5, 0, 0], up: [0, 1, 0], fov: 53.13}
renderer: {bounds: {center: [-0.3, 0, 0], radius: 2}}
lights: [{direction: [-0.4, -0.5, -0.77], shadow: true}]
"""
# Row 5: the thesis's grid, composited; row 4 is filling it.
VOLUME = HAST.replace(
    "renderer: {bounds: {center: [-0.3, 0, 0], radius: 2}}",
    "renderer: {type: volume, box: {center: [-0.3, 0, 0], size: 4}, resolution: 512,"
    " transfer: {opacity: [{at: 0.2, opacity: 0}, {at: 0.8, opacity: 1}]}}",
)
# Row 6: the Mandelbrot set as hast's plane z = 0.
PLANE = """\
version: 1
formula: {name: hast, parameters: {power: 2}, iterations: 256}
image: {width: 1000, height: 1000}
camera: {}
renderer: {type: cut_plane, plane: {width: 4, height: 4}, colors: {mode: stepped}}
"""
POINTS = "renderer.points={count: 9}"
# A row: its scene, what it changes in it, and how often it is rendered.
ROWS: dict[str, tuple[str, tuple[str, ...], int]] = {
    "mandelbulb8-shadow": (MANDELBULB, (), REPETITIONS),
    "hast2-shadow": (HAST, (), REPETITIONS),
    # Row 3: nine points to a pixel that share its march and its shadow ray; its rival, nine whole samples.
    "hast2-points9-shadow": (HAST, (POINTS,), STILL_REPETITIONS),
    "hast2-samples9-shadow": (HAST, ("renderer.samples=9",), STILL_REPETITIONS),
    # The other normals: row 3 has the gradients of its nine points.
    "hast2-one-triangle": (HAST, (POINTS, "renderer.normal=one_triangle"), STILL_REPETITIONS),
    "hast2-eight-shading": (HAST, (POINTS, "renderer.normal=eight_triangles_shading"), STILL_REPETITIONS),
    "hast2-eight-normal": (HAST, (POINTS, "renderer.normal=eight_triangles_normal"), STILL_REPETITIONS),
    "hast2-least-squares": (HAST, (POINTS, "renderer.normal=least_squares"), STILL_REPETITIONS),
    # The other search, without and with points.
    "hast2-steps": (HAST, ("renderer.search=steps",), STILL_REPETITIONS),
    "hast2-steps-points9": (HAST, ("renderer.search=steps", POINTS), STILL_REPETITIONS),
    "hast2-occlusion8": (HAST, ("renderer.ambient_occlusion={rays: 8}",), STILL_REPETITIONS),
    # Frames of a volume, composited and as a surface, without filling its grid; and a cut plane.
    "hast2-volume512": (VOLUME, (), REPETITIONS),
    "hast2-volume512-surface": (VOLUME, ("renderer.transfer={}",), REPETITIONS),
    "hast2-plane256": (PLANE, (), REPETITIONS),
}
# Other rows: filling the grid of row 5, and the whole program.
GRID_ROW, SHELL_ROW = "hast2-grid512", "shell-to-png"


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table. Times in milliseconds, medians; `ms` is the device's own time where there is one.

    Rays are camera rays: one for each sample of a pixel. Steps and iterations also include the rays that follow from
    these: points, rays to the lights and into the hemisphere. `waiting` is the part of a packet's lanes that had no ray
    while others marched.
    """

    name: str
    ms: float
    wall_ms: float
    rays_per_s: float | None = None
    iterations_per_s: float | None = None
    steps_per_ray: float | None = None
    waiting: float | None = None
    fma_share: float | None = None
    lanes: int | None = None


def row_names() -> list[str]:
    """The table's rows, in its order."""
    return [*ROWS, GRID_ROW, *frames.ROWS, SHELL_ROW]


def chosen_device(device: str | None, shell: Shell) -> tuple[Device, float]:
    """The device, and its peak of fused multiply-adds, once it is known how many lanes suit it.

    Raises:
        DeviceError: there is none, or it failed.
    """
    chosen = choose(device)
    shell.say(f"measuring {chosen.info.name}, {chosen.info.version}")
    peak = fma_peak(chosen, "float32")
    march_reports(chosen, "float32", on_start=shell.say)
    return chosen, peak


def run(*, device: str | None, json_file: Path | None, shell: Shell, wanted: Sequence[str] = ()) -> None:
    """Measures the wanted rows, or every one, prints the table, and writes JSON if a file is named.

    Raises:
        ClfractalError: there is no such row.
        DeviceError: there is no device, or it failed.
        FileError: the file cannot be written.
    """
    names = chosen_rows(wanted, row_names(), json_file)
    chosen, peak = chosen_device(device, shell)
    rows = []
    for name in names:
        if name == GRID_ROW:
            rows.append(_grid_row(chosen))
        elif name in frames.ROWS:
            ms, wall_ms = frames.frame_times(name, chosen)
            rows.append(Row(name, ms=ms, wall_ms=wall_ms))
        elif name == SHELL_ROW:
            rows.append(_shell_row(chosen))
        else:
            text, changes, repetitions = ROWS[name]
            rows.append(_render_row(name, load_scene(text, overrides=changes), chosen, peak, repetitions))
        shell.say(f"{name}: {rows[-1].ms:.1f} ms")
    tell(report_of(chosen, peak, rows), table, json_file, shell)


def chosen_rows(wanted: Sequence[str], known: Sequence[str], json_file: Path | None) -> list[str]:
    """The wanted ones of known rows, or every one.

    Raises:
        ClfractalError: there is no such row.
        FileError: the file cannot be written.
    """
    for name in wanted:
        if name not in known:
            raise ClfractalError(f"unknown row {name!r}; known: {', '.join(known)}", Where("--row"))
    if json_file is not None:
        check_output(json_file, (json_file.suffix.lower(),))
    return [name for name in known if name in wanted or not wanted]


def report_of(device: Device, peak: float, rows: Sequence[DataclassInstance]) -> dict[str, Any]:
    """What was measured, as plain data."""
    return {
        "device": device.info.name,
        "platform": f"{device.info.platform}, {device.info.version}",
        "peak_gflops_float32": round(peak, 1),
        "rows": [asdict(row) for row in rows],
    }


def headline(report: Mapping[str, Any]) -> str:
    """The device, and how fast it is at best."""
    return f"{report['device']}; {report['platform']}; FMA peak {report['peak_gflops_float32']:.0f} GFLOP/s"


def tell(
    report: dict[str, Any],
    lines: Callable[[Mapping[str, Any]], list[str]],
    json_file: Path | None,
    shell: Shell,
) -> None:
    """Prints a report as `lines` of text, and writes it as JSON if a file is named."""
    for line in lines(report):
        shell.print(line)
    if json_file is not None:
        with atomic_writer(json_file) as beside:
            beside.write_text(json.dumps(report, indent=1) + "\n")


def table(report: Mapping[str, Any]) -> list[str]:
    """The report as lines of text."""
    lines = [
        headline(report),
        f"{'row':24} {'ms':>8} {'wall ms':>8} {'Mrays/s':>8} {'Miter/s':>8} {'steps/ray':>9} {'waiting':>8} "
        f"{'of peak':>8} {'lanes':>5}",
    ]
    for row in report["rows"]:
        cells = [
            _cell(row["rays_per_s"], 8, 2, 1e-6),
            _cell(row["iterations_per_s"], 8, 1, 1e-6),
            _cell(row["steps_per_ray"], 9, 2),
            _cell(row["waiting"], 7, 1, 100.0, "%"),
            _cell(row["fma_share"], 7, 1, 100.0, "%"),
            _cell(row["lanes"], 5, 0),
        ]
        lines.append(f"{row['name']:24} {row['ms']:8.1f} {row['wall_ms']:8.1f} " + " ".join(cells))
    return lines


def _cell(value: float | None, width: int, digits: int, factor: float = 1.0, unit: str = "") -> str:
    if value is None:
        return "-".rjust(width + len(unit))
    return f"{value * factor:{width}.{digits}f}{unit}"


def _render_row(name: str, scene: Scene, device: Device, peak: float, repetitions: int) -> Row:
    """One scene, rendered into memory repeatedly; the first render builds the program and does not count."""
    engine = Engine(device)
    job = engine.prepare(scene, precision="float32")
    _once(job, engine)
    results = [_once(job, engine) for _ in range(repetitions)]
    state = results[0][1]
    kernel_ms = statistics.median(state.kernel_ms for _, state in results)
    operations = state.iterations * operations_per_application(job.scene.chain)
    return Row(
        name,
        ms=kernel_ms,
        wall_ms=1e3 * statistics.median(seconds for seconds, _ in results),
        rays_per_s=1e3 * state.rays / kernel_ms,
        iterations_per_s=1e3 * state.iterations / kernel_ms,
        steps_per_ray=state.steps_per_ray,
        waiting=state.waiting if job.scene.renderer.type == "surface" and job.lanes > 1 else None,
        fma_share=operations / (1e-3 * kernel_ms) / (1e9 * peak),
        lanes=job.lanes,
    )


def _once(job: Job, engine: Engine) -> tuple[float, Progress]:
    framebuffers = JobFramebuffers(job)
    start = time.perf_counter()
    state = do(job, framebuffers.framebuffers, engine.executor)
    return time.perf_counter() - start, state


def _grid_row(device: Device) -> Row:
    """Filling the grid of row 5: octree, values and normals."""
    job = prepare(load_scene(VOLUME), device, precision="float32")
    settings, lanes = settings_of(job.scene), job.lanes
    times = []
    for _ in range(STILL_REPETITIONS + 1):
        start = time.perf_counter()
        stats = fill_grid(job.scene, settings, device, lanes=lanes, precision="float32").stats
        on_device = stats.octree_ms + stats.fill_ms + stats.store_ms + stats.normals_ms
        times.append((on_device, 1e3 * (time.perf_counter() - start) - stats.build_ms))
    ms, wall_ms = (statistics.median(column) for column in zip(*times[1:], strict=True))
    return Row(GRID_ROW, ms=ms, wall_ms=wall_ms, lanes=lanes)


def _shell_row(device: Device) -> Row:
    """The time of the shell command for row 1's PNG, with warm caches: a new process each time."""
    environment = {**os.environ, "CLFRACTAL_DEVICE": device.info.index}
    with tempfile.TemporaryDirectory(prefix="clfractal-bench-") as folder:
        scene, picture = Path(folder, "scene.yaml"), Path(folder, "picture.png")
        scene.write_text(MANDELBULB)
        command = [sys.executable, "-m", "clfractal", "render", str(scene), "-o", str(picture), "--quiet"]
        times = []
        for _ in range(SHELL_REPETITIONS + 1):
            start = time.perf_counter()
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
            times.append(1e3 * (time.perf_counter() - start))
            if done.returncode != 0:
                raise DeviceError(f"the shell's row failed: {done.stderr.strip()}")
    median = statistics.median(times[1:])
    return Row(SHELL_ROW, ms=median, wall_ms=median)
