"""The statistics of a film: those of a render, as sums over its frames, and the times of each frame."""

from __future__ import annotations

from typing import Any

from clfractal.engine.job import Job
from clfractal.engine.run import Counters, Progress
from clfractal.engine.stats import statistics


class FilmStats:
    """Sums over the frames that were rendered, and one entry for each of them."""

    def __init__(self) -> None:
        self._job: Job | None = None
        self._sum = Progress(tiles=0)
        self._precisions: set[str] = set()
        self._remarks: dict[str, None] = {}
        self._frames: list[dict[str, Any]] = []
        self._write_ms, self.kept = 0.0, 0

    def keep(self, job: Job) -> None:
        """Counts a frame that was there already."""
        self._job, self.kept = self._job or job, self.kept + 1

    def add(self, number: int, job: Job, state: Progress, *, wall_ms: float, write_ms: float) -> None:
        """Counts a frame that was rendered.

        Args:
            number: the frame's.
            state: the last one of its work.
            wall_ms: the time of its work and files, of which `write_ms` are for the files.
        """
        if not self._frames:
            self._job = job
        self._precisions |= set(job.precision.split(", "))
        self._remarks |= dict.fromkeys(remark for remark in (job.remark, *state.remarks) if remark)
        self._sum.add(state)
        self._sum.tiles += state.tiles
        self._sum.tiles_before += state.tiles_before
        for render_device, (tiles, counters) in state.render_devices.items():
            before, total = self._sum.render_devices.get(render_device, (0, Counters()))
            total.add(counters)
            self._sum.render_devices[render_device] = (before + tiles, total)
        self._write_ms += write_ms
        times = {
            "build_ms": state.build_ms,
            "kernel_ms": state.kernel_ms,
            "write_ms": write_ms,
            "wall_ms": wall_ms,
        }
        self._frames.append(
            {
                "frame": number,
                "tiles": state.tiles,
                "tiles_resumed": state.tiles_before,
                **{name: round(value, 3) for name, value in times.items()},
                "rays": state.rays,
            }
        )

    def values(
        self, *, wall_ms: float, films_ms: float = 0.0, previews_built_ms: float = 0.0
    ) -> dict[str, Any]:
        """The keys of `stats.statistics` but `stereo`, whose view moves, then `frames_kept` and `frames`, as plain data.

        At least one frame was counted. What may differ from frame to frame is that of the first frame that was rendered;
        number types are all that were used.

        Args:
            wall_ms: from the start of the command to its last file.
            films_ms: the part of it for writing films of the frames.
            previews_built_ms: building programs for previews.
        """
        assert self._job is not None
        found = statistics(
            self._job,
            self._sum,
            wall_ms=wall_ms,
            write_ms=self._write_ms + films_ms,
            previews_built_ms=previews_built_ms,
            remarks=list(self._remarks),
        )
        found.pop("stereo", None)
        if self._precisions:
            found["precision"] = ", ".join(sorted(self._precisions))
        return {**found, "frames_kept": self.kept, "frames": self._frames}
