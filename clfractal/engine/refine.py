"""A picture in passes: coarse at first, then whole with more and more samples, the same bits at the end."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from dataclasses import asdict, replace
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from clfractal.device.cancel import CancelToken
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers, Took
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import Counters, Progress, run
from clfractal.errors import DeviceError
from clfractal.images.framebuffer import Framebuffer

if TYPE_CHECKING:
    from clfractal.engine.several import SeveralExecutor

DIVIDERS = (8, 4, 2)
"""Every how many pixels, in each direction, the first passes render.

Later passes do not reuse these pixels: a packet of which a quarter of the lanes is done takes as long as a full one.
"""


class Refinement(Iterator[Framebuffer]):
    """Framebuffers from coarse to finished: see `Engine.refine`. A notebook shows it, and redraws it with every pass."""

    def __init__(self, framebuffers: Generator[Framebuffer]) -> None:
        self._framebuffers = framebuffers

    def __next__(self) -> Framebuffer:
        return next(self._framebuffers)

    def close(self) -> None:
        """Ends the refinement before its last pass; the engine can then be used again."""
        self._framebuffers.close()

    def _ipython_display_(self) -> None:
        display = import_module("IPython.display").display
        handle = None
        for framebuffer in self:
            if handle is None:
                handle = display(framebuffer, display_id=True)
            else:
                handle.update(framebuffer)


def refined(
    job: Job,
    executor: LocalExecutor | SeveralExecutor,
    token: CancelToken | None = None,
    *,
    previews_built_ms: float = 0.0,
) -> Generator[Framebuffer]:
    """The passes of a job, each as a framebuffer of the whole picture. The last one has the same bits as `run`.

    Args:
        previews_built_ms: for the framebuffers' statistics, see `Took`.

    Raises:
        DeviceError, KernelBuildError, Stopped: as of `run`.
    """
    start, total, seconds = time.perf_counter(), Counters(), 0.0
    of_views = [Counters() for _ in job.views]

    def passed(framebuffers: JobFramebuffers, samples: tuple[int, int] | None = None) -> Progress:
        """Makes one pass, and gives the counts and times of all passes so far."""
        nonlocal seconds
        state = run(framebuffers.job, framebuffers.framebuffers, executor, token=token, samples=samples)
        seconds += state.seconds
        total.add(state)
        for so_far, new in zip(of_views, state.views, strict=True):
            so_far.add(new)
        return replace(state, **asdict(total), views=[replace(each) for each in of_views])

    def shown(framebuffers: JobFramebuffers, state: Progress, stage: str) -> Framebuffer:
        framebuffer = framebuffers.picture(
            Took(state, 1e3 * (time.perf_counter() - start), previews_built_ms)
        )
        framebuffer.tell("seconds", seconds)
        framebuffer.stage = stage
        return framebuffer

    try:
        for divider in DIVIDERS:
            small = JobFramebuffers(job.coarse(divider))
            state = passed(small)
            whole = JobFramebuffers(job)
            for framebuffer, found in zip(whole.framebuffers, small.framebuffers, strict=True):
                _enlarge(found, framebuffer, divider)
            stage = {8: "8th", 4: "4th", 2: "2nd"}[divider]
            yield shown(whole, state, f"every {stage} pixel")
        ranges = pass_ranges(job.samples) if has_room(job, executor, token) else [(0, job.samples)]
        framebuffers = JobFramebuffers(job)
        for samples in ranges:
            before, framebuffers = framebuffers, JobFramebuffers(job)
            for view, framebuffer, old in zip(
                job.views, framebuffers.framebuffers, before.framebuffers, strict=True
            ):
                if view.plan.samples <= samples[0]:  # finished before the others
                    framebuffer.take(old)
            state = passed(framebuffers, samples)
            last = samples[1] == job.samples
            yield shown(framebuffers, state, "" if last else f"{samples[1]} of {job.samples} samples")
    finally:
        executor.forget()


def pass_ranges(samples: int) -> list[tuple[int, int]]:
    """The first sample and the one after the last of each pass: one, and then twice as many in all."""
    ends = [0, 1]
    while ends[-1] < samples:
        ends.append(min(2 * ends[-1], samples))
    return list(pairwise(ends))


def has_room(job: Job, executor: LocalExecutor | SeveralExecutor, token: CancelToken | None = None) -> bool:
    """Whether the device has room for the data kept between passes; if not, a message is printed.

    Raises:
        DeviceError, KernelBuildError, Stopped: as of `run`.
    """
    if job.samples == 1:
        return True
    try:
        executor.check_room(job, token)
    except DeviceError as error:
        if executor.tell is not None:
            executor.tell(f"{error.message}; so all samples are made in one pass")
        return False
    return True


def _enlarge(small: Framebuffer, whole: Framebuffer, divider: int) -> None:
    """Copies each pixel of a coarse framebuffer to all the pixels that it stands for."""
    region = whole.region
    rows = np.arange(region.y, region.bottom) // divider - small.region.y
    columns = np.arange(region.x, region.right) // divider - small.region.x
    whole.fill({name: small[name][np.ix_(rows, columns)] for name in whole})
