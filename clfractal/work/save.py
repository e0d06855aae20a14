"""The files of a finished job."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from clfractal.device.activity import doing
from clfractal.pictures.outputs import output_files, save_outputs, save_views
from clfractal.pictures.tiled import Picture
from clfractal.work.denoising import finished
from clfractal.work.job import Job


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
        _save(job, stores, paths, header)


def _save(
    job: Job, stores: Sequence[Picture], paths: Sequence[str | Path], header: Mapping[str, Any]
) -> None:
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
