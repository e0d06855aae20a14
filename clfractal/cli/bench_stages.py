"""Where the device's time of a picture goes: a table of its stages, and how busy the lanes of packets are."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clfractal.cli.bench import ROWS, chosen_device, chosen_rows, headline, report_of, tell
from clfractal.cli.shell import Shell
from clfractal.device.select import Device
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.observer import Observer
from clfractal.engine.prepare import prepare
from clfractal.engine.run import Progress
from clfractal.engine.run import run as do
from clfractal.formulas.opencl import operations_per_application
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene


@dataclass(frozen=True, slots=True)
class StageRow:
    """A stage: its launches, their milliseconds on the device, and the part of the picture's."""

    name: str
    launches: int
    ms: float
    share: float


@dataclass(frozen=True, slots=True)
class PictureRow:
    """A picture of the table.

    Attributes:
        ms: the device's milliseconds from the first to the last stage of each launch, `between_ms` among them without one.
        rays: camera rays.
        applications: of the formula, by all rays.
        applications_ms: what these would take at the device's measured peak.
        waited_ms: and what lanes would that waited in orbits for others.
        busy_in_march: the part of a packet's lanes that had a ray while others marched; None where lanes do not wait.
        busy_in_orbits: of those the part whose orbit had not ended while others' went on.
        state_bytes: what a pixel carries from stage to stage, and in `queue_bytes` its rays, with what they have met.
    """

    name: str
    lanes: int
    ms: float
    between_ms: float
    rays: int
    applications: int
    applications_ms: float
    waited_ms: float
    busy_in_march: float | None
    busy_in_orbits: float | None
    state_bytes: int
    queue_bytes: int
    stages: tuple[StageRow, ...]


def run(*, device: str | None, json_file: Path | None, shell: Shell, wanted: Sequence[str] = ()) -> None:
    """Measures the stages of the wanted rows, or of every one that is a picture; prints them, and writes them as `bench`.

    Raises:
        ClfractalError: there is no such row.
        DeviceError: there is no device, or it failed.
        FileError: the file cannot be written.
    """
    names = chosen_rows(wanted, list(ROWS), json_file)
    chosen, peak = chosen_device(device, shell)
    rows = []
    for name in names:
        text, changes, repetitions = ROWS[name]
        rows.append(picture_row(name, load_scene(text, overrides=changes), chosen, peak, repetitions))
        shell.say(f"{name}: {rows[-1].ms:.1f} ms")
    tell(report_of(chosen, peak, rows), table, json_file, shell)


def picture_row(name: str, scene: Scene, device: Device, peak: float, repetitions: int) -> PictureRow:
    """One scene, rendered into memory repeatedly: the one whose time is the median. The first one builds the programs."""
    executor = LocalExecutor(device)
    executor.observer = observer = Observer()
    job = prepare(scene, device, precision="float32")
    renders: list[tuple[Progress, tuple[StageRow, ...]]] = []
    for _ in range(repetitions + 1):
        observer.forget()
        state = do(job, JobFramebuffers(job).framebuffers, executor)
        sums = observer.stages()
        rows = [
            StageRow(stage, sums[stage].launches, sums[stage].ms, sums[stage].ms / state.kernel_ms)
            for stage in sums
        ]
        renders.append((state, tuple(rows)))
    median = statistics.median_low(state.kernel_ms for state, _ in renders[1:])
    state, stages = next(each for each in renders[1:] if each[0].kernel_ms == median)
    return _row(name, job, state, stages, peak, observer)


def _row(
    name: str, job: Job, state: Progress, stages: tuple[StageRow, ...], peak: float, observer: Observer
) -> PictureRow:
    # At 1e6 operations a millisecond for each GFLOP/s.
    ms_of_application = operations_per_application(job.scene.chain) / (1e6 * peak)
    waits = job.scene.renderer.type == "surface" and job.lanes > 1
    return PictureRow(
        name,
        job.lanes,
        ms=state.kernel_ms,
        between_ms=state.kernel_ms - sum(stage.ms for stage in stages),
        rays=state.rays,
        applications=state.iterations,
        applications_ms=state.iterations * ms_of_application,
        waited_ms=state.orbit_waits * ms_of_application,
        busy_in_march=1.0 - state.waiting if waits else None,
        busy_in_orbits=state.iterations / max(state.iterations + state.orbit_waits, 1) if waits else None,
        state_bytes=observer.state_bytes,
        queue_bytes=observer.queue_bytes,
        stages=stages,
    )


def table(report: Mapping[str, Any]) -> list[str]:
    """The report as lines of text."""
    lines = [headline(report)]
    for row in report["rows"]:
        lines += ["", f"{row['name']:30} {'launches':>8} {'ms':>9} {'share':>6}"]
        lines += [
            f"{stage['name']:30} {stage['launches']:8} {stage['ms']:9.2f} {stage['share']:6.1%}"
            for stage in row["stages"]
        ]
        lines += [
            f"{'between stages':30} {'':8} {row['between_ms']:9.2f} {row['between_ms'] / row['ms']:6.1%}",
            f"{'all':30} {sum(stage['launches'] for stage in row['stages']):8} {row['ms']:9.2f} {1:6.1%}",
            *_counts(row),
        ]
    return lines


def _counts(row: Mapping[str, Any]) -> list[str]:
    """What stands below a picture's stages."""
    applications, waits = row["applications"], row["busy_in_march"] is not None
    lines = [
        f"{1e-6 * applications:.1f} million applications, {applications / max(row['rays'], 1):.1f} for a ray: "
        f"{row['applications_ms']:.1f} ms at the peak"
    ]
    if waits:
        lines[0] += f", and {row['waited_ms']:.1f} ms for lanes that waited"
        busy = f"{row['busy_in_march']:.1%} in the march, of these {row['busy_in_orbits']:.1%} in orbits"
        lines.append(f"{row['lanes']} lanes, busy: {busy}")
    if row["state_bytes"]:
        carried = f"{row['state_bytes']} bytes of state, {row['queue_bytes']} of rays and of what these met"
        lines.append(f"for a pixel {carried}")
    return lines
