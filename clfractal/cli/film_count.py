"""How far a film is, and what its frames took."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from clfractal.cli.progress import Lines, shown_rate
from clfractal.cli.shell import Shell
from clfractal.engine.film_stats import FilmStats


class FilmCount:
    """How far a film is, and what its frames took; `begun` is when the command began, by `time.perf_counter`."""

    def __init__(self, shell: Shell, frames: int, begun: float) -> None:
        self._shell, self._frames, self._begun = shell, frames, begun
        self._lines = Lines()
        self._first = begun  # when the first frame was done, for which programs are compiled
        self._rendered, self._rays = 0, 0
        self.stats = FilmStats()
        self.previews_built_ms = 0.0
        self.shares: list[dict[str, Any]] | None = None  # of a cluster's workers

    @property
    def seconds_each(self) -> float | None:
        """The time that a frame takes; None as long as that is unknown: the first one waits for programs."""
        further = self._rendered - 1
        return (time.perf_counter() - self._first) / further if further > 0 else None

    def rendered(self, rays: int) -> None:
        """Counts a frame; now and then it is told how many are left."""
        self._rendered += 1
        self._rays += rays
        if self._rendered == 1:
            self._first = time.perf_counter()
            return
        left = self._frames - self.stats.kept - self._rendered
        done = self._frames - left
        if left and self._lines.due(done / self._frames):
            self._shell.say(
                f"animate: {done} of {self._frames} frames, {left * (self.seconds_each or 0):.0f} s left"
            )

    def interrupted(self, number: int, file: Path) -> str:
        """What to say of an interrupt during a frame."""
        done = self.stats.kept + self._rendered
        return f"{file}: interrupted in frame {number}, with {done} of {self._frames} frames done; --resume continues"

    def summary(self) -> str:
        """The text of the last line."""
        seconds = time.perf_counter() - self._begun
        if not self._rendered:
            return f"all {self._frames} frames were there already"
        kept = f", {self.stats.kept} were there already" if self.stats.kept else ""
        return f"{self._rendered} frames{kept}, {seconds:.2f} s, {shown_rate(self._rays / seconds)}"

    def statistics(self, films_ms: float) -> dict[str, Any]:
        """What `--stats` writes, as of now; `films_ms`: the time for writing films of the frames."""
        values = self.stats.values(
            wall_ms=1e3 * (time.perf_counter() - self._begun),
            films_ms=films_ms,
            previews_built_ms=self.previews_built_ms,
        )
        return values if self.shares is None else {**values, "workers": self.shares}
