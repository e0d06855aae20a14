"""A job's films in memory, and the picture that is composed of them."""

from __future__ import annotations

from functools import cached_property, partial
from typing import Any

from clfractal.pictures.compose import Side
from clfractal.pictures.film import Film, in_memory
from clfractal.work.job import Job


class JobFilms:
    """An empty film for each of a job's views. Headers are made when a film of the job is first asked for its own."""

    def __init__(self, job: Job) -> None:
        self.job = job
        self.films = [
            Film(view.plan.channels, view.size, view.plan.region, partial(self._header_of, number))
            for number, view in enumerate(job.views)
        ]

    @cached_property
    def header(self) -> dict[str, Any]:
        """The header of the whole picture's files."""
        return self.job.header()

    def picture(self) -> Film:
        """The picture, as far as it is finished. Not for a pair whose pictures stay apart."""
        composed = len(self.films) != 1
        return in_memory(self.job.picture(self.films, self.header if composed else None))

    def eyes(self) -> dict[Side, Film]:
        """Each eye's picture."""
        return {side: in_memory(picture) for side, picture in self.job.eyes(self.films).items()}

    def _header_of(self, number: int) -> dict[str, Any]:
        return self.job.view_header(number, self.header)
