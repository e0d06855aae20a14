"""Denoising a job's pictures: each view by itself, once its rays are done and before any tone curve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clfractal.files.channels import ALBEDO, NOISY, NORMAL
from clfractal.pictures.denoise import denoised
from clfractal.pictures.film import Film, in_memory
from clfractal.pictures.tiled import Floats, Picture
from clfractal.work.job import Job


def finished(job: Job, stores: Sequence[Picture]) -> Sequence[Picture]:
    """The views' pictures as the scene's output wants them: without noise and with its channels; or unchanged.

    A pair's eyes, the views of a layout and the frames of a film are denoised each by itself; of a region only what it
    shows. Memory needed: all channels of every view.

    Raises:
        FileError: Open Image Denoise is not installed, or failed.
    """
    if not job.denoises:
        return stores
    return [_finished(job, in_memory(store)) for store in stores]


def _finished(job: Job, film: Film) -> Film:
    colors = _stacked(film, ("R", "G", "B"))
    if film.done.any():
        aids = (ALBEDO, NORMAL) if set(ALBEDO) <= set(film.channels) else ()
        clean = denoised(colors, *(_stacked(film, names) for names in aids))
    else:
        clean = colors
    made = {
        **dict(zip(("R", "G", "B"), np.moveaxis(clean, -1, 0), strict=True)),
        **dict(zip(NOISY, np.moveaxis(colors, -1, 0), strict=True)),
    }
    return film.with_planes({name: made[name] if name in made else film[name] for name in job.channels})


def _stacked(film: Film, names: Sequence[str]) -> Floats:
    return np.stack([film[name] for name in names], axis=-1)
