"""A job's framebuffers in memory, and the picture that is composed of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from clfractal.engine.comfort import comfort_of_framebuffers
from clfractal.engine.finish import finished
from clfractal.engine.job import Job
from clfractal.engine.probing import FramebufferProber
from clfractal.engine.remarks import remarks_of
from clfractal.engine.run import Progress
from clfractal.engine.stats import statistics
from clfractal.images.compose import Side
from clfractal.images.develop import Development
from clfractal.images.framebuffer import Framebuffer, in_memory
from clfractal.images.tiled import Picture


@dataclass(frozen=True, slots=True)
class Took:
    """What a render took: its counts, the time of the whole call, and of building previews' programs before it, in ms."""

    state: Progress
    wall_ms: float
    previews_built_ms: float = 0.0


class JobFramebuffers:
    """An empty framebuffer for each of a job's views. Headers are made when a framebuffer of the job is first asked for
    its own.
    """

    def __init__(self, job: Job) -> None:
        self.job = job
        self.framebuffers = [
            Framebuffer(view.plan.channels, view.size, view.plan.region, partial(self._header_of, number))
            for number, view in enumerate(job.views)
        ]

    @cached_property
    def header(self) -> dict[str, Any]:
        """The header of the whole picture's files."""
        return self.job.header()

    @property
    def development(self) -> Development:
        """How the scene wants its picture shown; without the work of making a header."""
        scene = self.job.scene
        return Development(scene.output.stops, scene.output.tone, scene.background == "transparent")

    def picture(self, took: Took | None = None) -> Framebuffer:
        """The picture, as far as it is finished. Not for a pair whose pictures stay apart.

        Args:
            took: what it took so far, for `Framebuffer.stats`.
        """
        composed = len(self.framebuffers) != 1
        return self._whole(
            self.job.picture(finished(self.job, self.framebuffers), self.header if composed else None),
            took,
            FramebufferProber(self.job),
        )

    def eyes(self, took: Took | None = None) -> dict[Side, Framebuffer]:
        """Each eye's picture; `took` as for `picture`: both framebuffers have the statistics of the pair."""
        return {
            side: self._whole(picture, took, FramebufferProber(self.job, side))
            for side, picture in self.job.eyes(finished(self.job, self.framebuffers)).items()
        }

    def _whole(self, picture: Picture, took: Took | None, prober: FramebufferProber) -> Framebuffer:
        framebuffer = in_memory(picture)
        framebuffer.prober = prober
        framebuffer.inputs = self.job.scene.files
        if took is not None:
            framebuffer.tell_stats(partial(self._statistics, took))
        return framebuffer

    def _statistics(self, took: Took) -> dict[str, Any]:
        comfort = comfort_of_framebuffers(self.job, self.framebuffers)
        remarks = remarks_of(self.job, took.state, self.framebuffers, comfort)
        return statistics(
            self.job,
            took.state,
            wall_ms=took.wall_ms,
            previews_built_ms=took.previews_built_ms,
            comfort=comfort,
            remarks=remarks,
        )

    def _header_of(self, number: int) -> dict[str, Any]:
        return self.job.view_header(number, self.header)
