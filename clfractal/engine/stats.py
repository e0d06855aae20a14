"""The statistics of a render: what `--stats` writes, `--verbose` shows and `framebuffer.stats` holds."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clfractal.camera.views import scene_view
from clfractal.engine.job import Job
from clfractal.engine.run import Progress
from clfractal.files import memory, resources
from clfractal.files.atomic import atomic_writer

if TYPE_CHECKING:
    from clfractal.engine.comfort import Comfort


def statistics(
    job: Job,
    state: Progress,
    *,
    wall_ms: float,
    write_ms: float = 0.0,
    previews_built_ms: float = 0.0,
    comfort: Comfort | None = None,
    remarks: Sequence[str] = (),
) -> dict[str, Any]:
    """Times and counts as plain data; for a stereo scene also its view, under `stereo`; with several devices also the share
    of each, under `devices`.

    `kernel_ms` is the sum over batches from the device's own events; `wall_ms` runs from the start of the command, or
    of the call, to its last file, `write_ms` is the part of it for the files. `rays` are camera rays; `steps_per_ray`
    includes the steps of shadow rays.

    Args:
        previews_built_ms: building programs for the previews before the render; a part of `build_ms`.
        comfort: the parallax of a stereo scene, where it is known.
        remarks: see `remarks.remarks_of`.
    """
    info, region = job.device, job.region
    values = {
        "device": info.name,
        "platform": info.platform,
        "driver": info.driver,
        "version": resources.__version__,
        "precision": job.precision,
        "lanes": job.lanes,
        "samples": job.samples,
        "width": region.width,
        "height": region.height,
        "tiles": state.tiles,
        "tiles_resumed": state.tiles_before,
        "build_ms": round(previews_built_ms + state.build_ms, 3),
        "kernel_ms": round(state.kernel_ms, 3),
        "write_ms": round(write_ms, 3),
        "wall_ms": round(wall_ms, 3),
        "rays": state.rays,
        "hits": state.hits,
        "rays_per_second": round(state.rays / max(1e-3 * state.kernel_ms, 1e-9), 1),
        "iterations": state.iterations,
        "steps": state.steps,
        "steps_per_ray": round(state.steps_per_ray, 4),
        "bad_distances": state.bad_distances,
        "peak_memory_mb": round(peak_memory_mb(), 1),
        "remarks": list(remarks),
    }
    if state.render_devices:
        values["devices"] = [
            {
                "index": render_device.index,
                "device": render_device.name,
                "tiles": tiles,
                "rays": counters.rays,
                "kernel_ms": round(counters.kernel_ms, 3),
            }
            for render_device, (tiles, counters) in sorted(
                state.render_devices.items(), key=lambda each: each[0].index
            )
        ]
    if job.scene.stereo is not None:
        values["stereo"] = _of_stereo(job, comfort)
    return values


def _of_stereo(job: Job, comfort: Comfort | None) -> dict[str, Any]:
    """The stereo view of a pair, as plain data; parallax is None for an empty picture, and where it is unknown."""
    middle, stereo = scene_view(job.scene), job.scene.stereo
    assert stereo is not None
    return {
        "mode": stereo.mode,
        "separation": stereo.separation,
        "eye": None if middle.eye is None else middle.eye.tolist(),
        "plane": {"center": middle.center.tolist(), "width": middle.width, "height": middle.height},
        "parallax": None if comfort is None else asdict(comfort),
    }


def write_statistics(path: Path, values: dict[str, Any]) -> None:
    """Writes statistics as JSON; the file appears whole or not at all.

    Raises:
        FileError: it cannot be written.
    """
    with atomic_writer(path) as beside:
        beside.write_text(json.dumps(values, indent=2) + "\n", encoding="utf-8")


def sentence(values: dict[str, Any]) -> str:
    """The statistics as one line, and one for each of several devices."""
    shares = [
        f"{each['index']} {each['device']}: {each['tiles']} tiles, kernels {each['kernel_ms']:.0f} ms"
        for each in values.get("devices", ())
    ]
    whole = (
        "{device}: {precision}, {lanes} lanes; build {build_ms:.0f} ms, kernels {kernel_ms:.0f} ms, files "
        "{write_ms:.0f} ms; {steps_per_ray:.1f} steps per ray, {bad_distances} bad distances; peak memory "
        "{peak_memory_mb:.0f} MB"
    ).format(**values)
    return "\n".join([whole, *shares])


def peak_memory_mb() -> float:
    """The largest amount of memory that this process has held at one time, in MiB."""
    return memory.peak() / 2**20
