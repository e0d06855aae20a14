"""Work in progress of a job: a journal for each of its views, beside the first output."""

from __future__ import annotations

import glob
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from clfractal.cli.shell import Shell
from clfractal.device.tune import LANE_COUNTS
from clfractal.engine.job import Job
from clfractal.files.frame_names import PARTIAL
from clfractal.files.journal import identity_of
from clfractal.images.compose import Side
from clfractal.images.store import JournalFramebuffer
from clfractal.scene.model import Scene


class Unfinished:
    """The open journals of a job's views. After an exception they stay, for `--resume`; those without a tile are removed.

    Args:
        job: what is rendered.
        header: the header of its whole picture's files.
        output: the first output, which they stand beside.
        resume: whether to continue earlier ones.
        shell: prints a message if earlier work is discarded; takes the files away at an interrupt, too.

    Raises:
        FileError: see `JournalFramebuffer`.
    """

    def __init__(
        self, job: Job, header: Mapping[str, Any], output: Path, shell: Shell, *, resume: bool
    ) -> None:
        self.shell = shell
        self.paths = partial_paths(job, output)
        self.output = output
        self.first = output.with_name(output.name + PARTIAL)
        self.framebuffers: list[JournalFramebuffer] = []
        try:
            for number, (view, path) in enumerate(zip(job.views, self.paths, strict=True)):
                discards = path.exists() and not resume
                self.framebuffers.append(
                    JournalFramebuffer(
                        path,
                        job.identity(number),
                        view.plan.channels,
                        view.size,
                        view.plan.region,
                        job.view_header(number, header),
                        resume=resume,
                        also=job.also_continues(number),
                    )
                )
                if discards:
                    shell.say(f"{path}: earlier work is discarded; --resume would have continued it")
        except BaseException:
            self._leave()
            raise
        if not resume:
            self._drop_others(output, shell)

    def __enter__(self) -> Self:
        self.shell.leaving.append(self._leave)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            for framebuffer in self.framebuffers:
                framebuffer.discard()
        else:
            self._leave()
        self.shell.leaving.remove(self._leave)

    def interrupted(self) -> str:
        """What to say of an interrupt."""
        done = sum(int(framebuffer.done.sum()) for framebuffer in self.framebuffers)
        tiles = sum(framebuffer.grid.count for framebuffer in self.framebuffers)
        if not done:  # journals without a tile do not stay
            return f"{self.output}: interrupted before a tile was done"
        return f"{self.first}: interrupted with {done} of {tiles} tiles done; --resume continues"

    def _leave(self) -> None:
        for framebuffer in self.framebuffers:
            if framebuffer.done.any():
                framebuffer.close()
            else:
                framebuffer.discard()

    def _drop_others(self, output: Path, shell: Shell) -> None:
        """Removes the journals of views that an earlier render to the same output had, but this one does not."""
        for stale in _of_views(output):
            if stale not in self.paths:
                shell.say(f"{stale}: earlier work is discarded")
                stale.unlink(missing_ok=True)


def continued(job: Job, output: Path) -> Job:
    """The job with the lanes of the unfinished work beside an output, if this device's driver began it.

    That may have been before the fastest lanes were measured.
    """
    views = []
    for view, path in zip(job.views, partial_paths(job, output), strict=True):
        begun = identity_of(path) or {}
        lanes = begun.get("lanes")
        if begun.get("driver") == job.device.key and lanes in LANE_COUNTS:
            view = replace(view, plan=replace(view.plan, lanes=lanes))
        views.append(view)
    return replace(job, views=tuple(views))


def partial_paths(job: Job, output: Path) -> list[Path]:
    """The file for the unfinished work of each view; for the first view it is OUTPUT.partial."""
    sides: list[Side] = [side for side in job.sides if side is not None]
    found = []
    for number, (view, side) in enumerate(zip(job.views, job.sides, strict=True)):
        words = [
            *(["right"] if side == "right" and "left" in sides else []),
            *([f"view{view.number + 1}"] if view.number and number else []),
        ]
        found.append(output.with_name("".join([output.name, *(f".{word}" for word in words), PARTIAL])))
    return found


def possible_paths(scene: Scene, output: Path) -> list[Path]:
    """All files that a render of the scene to `output` may use for unfinished work, or remove as an earlier one's."""
    views = [
        "",
        *(f".view{number + 1}" for number in range(1, len(scene.layout.views) if scene.layout else 1)),
    ]
    eyes = [""] if scene.stereo is None else ["", ".right"]
    names = [f"{output.name}{eye}{view}{PARTIAL}" for eye in eyes for view in views]
    return list(dict.fromkeys([*map(output.with_name, names), *_of_views(output)]))


def _of_views(output: Path) -> list[Path]:
    """The journals of views that are there, beside the first one."""
    return [
        path
        for path in output.parent.glob(f"{glob.escape(output.name)}.*{PARTIAL}")
        if re.fullmatch(r"(\.right|\.view\d+)*", path.name[len(output.name) : -len(PARTIAL)])
    ]
