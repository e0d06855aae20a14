"""A whole picture that gathers samples, pass by pass."""

from __future__ import annotations

import time
from dataclasses import replace

from clfractal.engine.canvas import Canvas
from clfractal.engine.job import Job
from clfractal.engine.refine import pass_ranges
from clfractal.engine.show import Arrangement, smoothing_of
from clfractal.images.tiles import Region
from clfractal.integrators.plan import PlannedView
from clfractal.viewer.frame import Growth
from clfractal.viewer.pacing import Schedule
from clfractal.viewer.preparing import Wanted


class Gathering:
    """A whole picture that gathers samples; `part` is the job of what is refined of it, by the views with `numbers`."""

    def __init__(self, wanted: Wanted, job: Job, seconds: float) -> None:
        self.wanted, self.job, self.seconds = wanted, job, seconds
        self.part, self.numbers = clipped(job, wanted.region)
        self.canvas: Canvas | None = None
        self.ranges: list[tuple[int, int]] = []
        self.begun = self.in_passes = False
        self.schedule = Schedule(0.0)
        self.samples = 0
        self.prepared = False
        self.finished = False
        self.cleans = wanted.scene.output.denoise and wanted.region is None  # of its noise, at the end

    def begin(self, *, in_passes: bool) -> None:
        """All samples are still to be made, in passes or at once."""
        samples = self.part.samples
        self.begun, self.in_passes = True, in_passes
        self.ranges = pass_ranges(samples) if in_passes else [(0, samples)]
        self.schedule = Schedule(time.perf_counter())

    def growth(self, frame_seconds: float = 0.0, *, more: float = 0.0, finished: bool = False) -> Growth:
        """How far it is; `more`: seconds of a pass that is under way."""
        seconds = self.seconds + more
        smoothed = self._smoothing(finished)
        return Growth(self.job.views, 1, self.samples, finished, False, seconds, frame_seconds, smoothed)

    def _smoothing(self, finished: bool) -> tuple[float, ...]:
        """How strongly each view is smoothed: views that have all their samples are shown as files have them.

        So is a picture of which only a part is refined: the rest of it has samples of its own.
        """
        made = self.samples or self.ranges[0][1]  # before a pass is whole: those of the pixels that have any
        return tuple(
            0.0 if finished or self.wanted.region or made >= view.plan.samples else smoothing_of(made)
            for view in self.job.views
        )

    def again(self) -> Gathering:
        """The same, to be gone on with after something else was tried; anew if it has no sample yet."""
        return self if self.samples > 0 else Gathering(self.wanted, self.job, self.seconds)


def clipped(job: Job, region: tuple[int, int, int, int] | None) -> tuple[Job, tuple[int, ...]]:
    """A job's views as far as they lie in a part of each eye's picture, and their numbers; all if nothing lies there."""
    if region is None:
        return job, tuple(range(len(job.views)))
    views: dict[int, PlannedView] = {}
    left, top, right, bottom = region[0], region[1], region[0] + region[2], region[1] + region[3]
    for number, (view, place) in enumerate(zip(job.views, Arrangement.of(job).places, strict=True)):
        whole = view.plan.region
        x, y = max(left - place.x, whole.x), max(top - place.y, whole.y)
        width, height = min(right - place.x, whole.right) - x, min(bottom - place.y, whole.bottom) - y
        if width > 0 and height > 0:
            plan = replace(view.plan, region=Region(x, y, width, height))
            views[number] = replace(view, plan=plan)
    if not views:
        return job, tuple(range(len(job.views)))
    return replace(job, views=tuple(views.values())), tuple(views)
