"""One of several pictures that a command writes, such as slices and the frames of a film."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clfractal.cli.progress import Reporter
from clfractal.cli.unfinished import Unfinished, continued
from clfractal.engine.finish import save_job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.run import run

if TYPE_CHECKING:
    from clfractal.cli.shell import Shell
    from clfractal.engine.any_engine import AnyEngine
    from clfractal.engine.job import Job
    from clfractal.engine.run import Progress
    from clfractal.images.tiled import TiledStore

# Pictures larger than this are kept on disk until they are complete, bytes.
_IN_MEMORY = 1 << 28


@dataclass(frozen=True, slots=True)
class Made:
    """One picture that was made: the last state of its work, and the times of all, and of writing its files, in ms."""

    state: Progress
    wall_ms: float
    write_ms: float


def render_one(
    job: Job,
    engine: AnyEngine,
    paths: tuple[Path, ...],
    shell: Shell,
    *,
    resume: bool = False,
    keep: bool = False,
    bits: Mapping[Path, int] | None = None,
) -> Made:
    """Renders one picture and writes its files.

    Args:
        resume: whether to continue tiles that an earlier run has kept.
        keep: whether tiles are kept beside the first file until it is whole, however small the picture is.
        bits: of PNG files that have others than the scene wants.
    """
    begun = time.perf_counter()
    header = job.header()
    work: AbstractContextManager[JobFramebuffers | Unfinished]
    if keep or 4 * job.region.pixels * len(job.channels) > _IN_MEMORY:
        if resume:
            job = continued(job, paths[0])
        work = Unfinished(job, header, paths[0], shell, resume=resume)
    else:
        work = nullcontext(JobFramebuffers(job))
    reporter = Reporter(shell, job.tiles)
    with work as stores:
        try:
            state = run(job, stores.framebuffers, engine.executor, progress=reporter)
        finally:
            reporter.close()
        rendered = time.perf_counter()
        _save(job, stores.framebuffers, paths, header, bits or {})
        now = time.perf_counter()
        return Made(state, 1e3 * (now - begun), 1e3 * (now - rendered))


def _save(
    job: Job,
    stores: Sequence[TiledStore],
    paths: tuple[Path, ...],
    header: Mapping[str, Any],
    bits: Mapping[Path, int],
) -> None:
    usual = tuple(path for path in paths if path not in bits)
    if usual:
        save_job(job, stores, usual, header)
    for path in paths:
        if path in bits:
            output = job.scene.output.model_copy(update={"png_bits": bits[path]})
            wanted = job.scene.model_copy(update={"output": output})
            save_job(replace(job, scene=wanted), stores, (path,), header)
