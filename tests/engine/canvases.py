"""Canvases with pictures on them, rendered or made up, and what the kernel shows of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

import clfractal
from clfractal.device.select import Device
from clfractal.engine.canvas import CHANNELS, Canvas, CanvasKernels, CanvasStore
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare
from clfractal.engine.run import run
from clfractal.engine.show import Arrangement, Look, Shower
from clfractal.images.tiled import Floats
from tests.scenes import bulb_text

SIZE = (96, 64)
BULB = bulb_text(SIZE, "renderer: {samples: 2}\n")
LAYOUT = (
    "layout={columns: 2, gap: 5, background: [0.2, 0.1, 0.3], views: [{}, {renderer: {type: cut_plane}}, {}]}"
)


def scene_of(*overrides: str) -> clfractal.Scene:
    """A small scene with values replaced as by `--set`."""
    return clfractal.load_scene(BULB, overrides=overrides)


def job_of(scene: clfractal.Scene, device: Device) -> Job:
    """The job of a picture on a canvas."""
    return prepare(scene, device, channels=CHANNELS)


def look_of(scene: clfractal.Scene, **values: Any) -> Look:
    """How a scene wants to be shown."""
    output = scene.output
    settings = {"exposure": output.stops, "tone": output.tone, "stereo": scene.stereo, **values}
    return Look(**settings)


def drawn(job: Job, device: Device, canvas: Canvas | None = None) -> Canvas:
    """A canvas with a job's picture."""
    canvas = canvas or Canvas(device)
    canvas.fit(job.views)
    executor, writer = LocalExecutor(device), CanvasKernels(device)
    executor.outlet = lambda view, framebuffer, places, tiles: writer.place(
        canvas, view, job.views[view].plan.region, framebuffer, places, tiles
    )
    run(job, [CanvasStore(canvas, view, number) for number, view in enumerate(job.views)], executor)
    device.queue.finish()
    return canvas


def painted(job: Job, device: Device, pictures: Sequence[Mapping[str, Floats]]) -> Canvas:
    """A canvas with pictures of one's own: of each view its channels."""
    canvas = Canvas(device)
    canvas.fit(job.views)
    for part, planes in zip(canvas.parts, pictures, strict=True):
        colors = np.ascontiguousarray(np.stack([planes[name] for name in "RGBA"], axis=-1), np.float32)
        cl.enqueue_copy(device.queue, canvas.colors, colors, dst_offset=16 * part.offset)
        depths = np.ascontiguousarray(planes["Z"], np.float32)
        cl.enqueue_copy(device.queue, canvas.depths, depths, dst_offset=4 * part.offset)
    device.queue.finish()
    return canvas


def shown(
    canvas: Canvas,
    arrangement: Arrangement,
    look: Look,
    shower: Shower,
    *,
    reduced: bool = False,
    smoothing: Sequence[float] = (),
) -> npt.NDArray[np.uint8]:
    """The kernel's pixels, shape (height, width, 3); alpha has been checked."""
    record, _ = shower.records(canvas, arrangement, look, reduced=reduced)
    width, height = int(record["width"][0]), int(record["height"][0])
    device = canvas.device
    # A guard behind the last pixel.
    out = np.full(width * height * 4 + 64, 77, np.uint8)
    buffer = cl.Buffer(device.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=out)
    shower.enqueue(canvas, arrangement, look, buffer, reduced=reduced, smoothing=smoothing).wait()
    cl.enqueue_copy(shower.queue, out, buffer)
    assert (out[-64:] == 77).all()
    pixels = out[:-64].reshape(height, width, 4)
    assert (pixels[..., 3] == 255).all()
    return pixels[..., :3]


def framebuffers_of(job: Job, pictures: Sequence[Mapping[str, Floats]]) -> JobFramebuffers:
    """Framebuffers with pictures of one's own."""
    framebuffers = JobFramebuffers(job)
    for framebuffer, planes in zip(framebuffers.framebuffers, pictures, strict=True):
        framebuffer.fill({name: planes[name] for name in framebuffer})
    return framebuffers
