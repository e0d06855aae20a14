"""What a job's finished pictures become: each view without noise, before any tone curve, and files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from clfractal.device.activity import doing
from clfractal.engine.job import Job
from clfractal.files.channels import ALBEDO, NOISY, NORMAL
from clfractal.images.denoise import denoised
from clfractal.images.framebuffer import Framebuffer, in_memory
from clfractal.images.outputs import output_files, save_outputs, save_views
from clfractal.images.tiled import Floats, Picture
from clfractal.integrators.plan import PlannedView
from clfractal.scene.model import Scene
from clfractal.scene.objects import VolumeObject
from clfractal.scene.parts import PerspectiveCamera
from clfractal.scene.volume import VolumeRenderer


def finished(job: Job, stores: Sequence[Picture]) -> Sequence[Picture]:
    """The views' pictures as the scene's output wants them: without noise and with its channels; or unchanged.

    A pair's eyes, the views of a layout and the frames of a film are denoised each by itself; of a region only what it
    shows. Memory needed: all channels of every view.

    Raises:
        FileError: Open Image Denoise is not installed, or failed.
    """
    if not job.denoises:
        return stores
    return [_finished(job, view, in_memory(store)) for view, store in zip(job.views, stores, strict=True)]


def save_job(
    job: Job, stores: Sequence[Picture], paths: Sequence[str | Path], header: Mapping[str, Any]
) -> None:
    """Writes a finished job's picture to files, as the scene's `output` and `stereo.mode` want them.

    Args:
        stores: of each view.
        header: what files tell about the whole picture.

    Raises:
        FileError: a file cannot be written.
    """
    with doing(f"writing {', '.join(str(path) for path in paths)}"):
        output = job.scene.output
        stores = finished(job, stores)
        save = partial(save_outputs, half=output.half_channels, bits=output.png_bits, quality=output.quality)
        if not job.stays_apart:
            save(job.picture(stores, header), paths)
            return
        eyes = job.eyes(stores)
        for path in paths:
            files = output_files(job.scene.stereo, path)
            if len(files) == 2:
                for eye, file in zip((eyes["left"], eyes["right"]), files, strict=True):
                    save(eye, [file])
            else:
                save_views(eyes["left"], eyes["right"], path, half=output.half_channels)


def darkness_is_certain(scene: Scene) -> bool:
    """Whether no other samples would find anything where a view's samples have found nothing and no light.

    Else one or the other comes by chance: light in fog, clouds and paths through volumes, what a lens blurs, or a
    picture as background.
    """
    fog, around, camera = scene.fog, scene.environment, scene.camera
    return not (
        (fog is not None and fog.scattering is not None)
        or any(isinstance(each, VolumeObject) and each.is_cloud for each in scene.objects.values())
        or (isinstance(scene.renderer, VolumeRenderer) and scene.lighting.mode == "path")
        or (isinstance(camera, PerspectiveCamera) and camera.lens_radius > 0)
        or (around is not None and around.background and scene.background != "transparent")
    )


def _finished(job: Job, view: PlannedView, framebuffer: Framebuffer) -> Framebuffer:
    colors = _stacked(framebuffer, ("R", "G", "B"))
    if framebuffer.done.any():
        aids = (ALBEDO, NORMAL) if set(ALBEDO) <= set(framebuffer.channels) else ()
        certain = view.shutter is None and darkness_is_certain(view.scene)
        coverage = framebuffer["A"] if certain else None
        clean = denoised(colors, *(_stacked(framebuffer, names) for names in aids), coverage=coverage)
    else:
        clean = colors
    made = {
        **dict(zip(("R", "G", "B"), np.moveaxis(clean, -1, 0), strict=True)),
        **dict(zip(NOISY, np.moveaxis(colors, -1, 0), strict=True)),
    }
    return framebuffer.with_planes(
        {name: made[name] if name in made else framebuffer[name] for name in job.channels}
    )


def _stacked(framebuffer: Framebuffer, names: Sequence[str]) -> Floats:
    return np.stack([framebuffer[name] for name in names], axis=-1)
