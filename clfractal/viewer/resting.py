"""The window's picture without its noise, once all samples are made, where the scene wants that."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clfractal.device.cancel import CancelToken
from clfractal.engine.canvas import Canvas
from clfractal.engine.finish import darkness_is_certain
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare
from clfractal.engine.run import run
from clfractal.errors import FileError
from clfractal.files.channels import ALBEDO, NORMAL
from clfractal.images.denoise import check_installed, denoised
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.tiled import Floats
from clfractal.scene.model import Scene
from clfractal.scene.surface import SurfaceRenderer

GUIDE_SAMPLES = 4
"""Samples of what surfaces reflect and of their normals, which the filter is told; it knows that they are noisy, too."""


def cleaned(
    scene: Scene, canvas: Canvas, executor: LocalExecutor, token: CancelToken, tell: Callable[[str], None]
) -> FileError | None:
    """Takes the noise out of a picture as `clean` does; one that cannot be cleaned stays as it is, and this tells why."""
    try:
        clean(scene, canvas, executor, token, tell)
    except FileError as error:
        return error
    return None


def clean(
    scene: Scene, canvas: Canvas, executor: LocalExecutor, token: CancelToken, tell: Callable[[str], None]
) -> None:
    """Replaces the colours on a canvas that holds the finished picture of a scene.

    Args:
        executor: of the canvas's device; it renders what the filter is told beside the colours.

    Raises:
        FileError: Open Image Denoise is not installed, or failed.
        Stopped: the token was set; the canvas is as it was.
        DeviceError: the device failed.
    """
    check_installed()
    tell("taking out the noise")
    guides = _guides(scene, canvas, executor, token, tell)
    certain = all(darkness_is_certain(each) for each in _shown(scene))
    cleaned: list[Floats] = []
    for number, guide in enumerate(guides):
        planes = canvas.read(executor.device.queue, number)
        colors = np.stack([planes[name] for name in "RGB"], axis=-1)
        aids = [] if guide is None else [_stacked(guide, names) for names in (ALBEDO, NORMAL)]
        cleaned.append(denoised(colors, *aids, coverage=planes["A"] if certain else None))
        token.check()
    for number, colors in enumerate(cleaned):
        canvas.write_colors(executor.device.queue, number, colors)


def _guides(
    scene: Scene, canvas: Canvas, executor: LocalExecutor, token: CancelToken, tell: Callable[[str], None]
) -> list[Framebuffer | None]:
    """What each part of the canvas shows of surfaces; None where only colours are known."""
    plain = scene.model_copy(update={"output": scene.output.model_copy(update={"denoise": False})})
    if not all(isinstance(each.renderer, SurfaceRenderer) for each in _shown(scene)):
        return [None] * len(canvas.parts)
    job = prepare(
        plain,
        executor.device,
        channels=("R", "G", "B", *ALBEDO, *NORMAL),  # a pair is put together of colours
        samples=min(GUIDE_SAMPLES, scene.renderer.samples),
        on_start=tell,
    )
    framebuffers = JobFramebuffers(job)
    run(job, framebuffers.framebuffers, executor, token=token)
    token.check()
    return [*framebuffers.framebuffers]


def _shown(scene: Scene) -> list[Scene]:
    return [view for view, _ in scene.views] if scene.layout is not None else [scene]


def _stacked(framebuffer: Framebuffer, names: tuple[str, ...]) -> Floats:
    return np.stack([framebuffer[name] for name in names], axis=-1)
