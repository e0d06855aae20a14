"""The engine of a cluster: its workers decide, look and render; this process needs no device."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from clfractal.cluster.message import Message
from clfractal.engine.any_engine import AnyEngine, SceneLike
from clfractal.engine.job import Job
from clfractal.engine.preview import Preview
from clfractal.engine.run import Executor
from clfractal.errors import ClfractalError
from clfractal.integrators.lanes import rule_of
from clfractal.integrators.plan import PlannedView
from clfractal.scene.load import as_scene
from clfractal.scene.model import Scene
from clfractal.scene.stereo import MIDDLE, Eye

# Frames of a film that are rendered before they are asked for, at most: their results lie with the workers, bytes.
_AHEAD_BYTES = 1 << 30
_MOST_AHEAD = 256


class Workers(Executor, Protocol):
    """What the engine asks of a cluster; see `Cluster`, which is one."""

    def asking(
        self, function: Callable[..., Any], thing: Any, *more: Any, float64: bool = False
    ) -> tuple[Future[Any], Message]:
        """Asks a function of `tasks`."""

    def answered(self, asked: Future[Any]) -> Any:
        """The answer."""

    def unpacked(self, message: Message, asked: Message) -> Any:
        """The thing in an answer."""

    def begin(self, job: Job) -> None:
        """Begins to render a job before it is executed."""

    def leave(self, job: Job) -> None:
        """Ends a job that was begun, if nobody has executed it."""

    def others(self) -> tuple[int, int, list[str]]:
        """The number of workers, and of those with another device than most have; the names of these devices."""


class ClusterEngine(AnyEngine):
    """Renders scenes on a cluster; decisions are made there too, so they suit its devices.

    Args:
        cluster: stays open when the engine is closed.
    """

    def __init__(self, cluster: Workers) -> None:
        super().__init__()
        self.cluster = cluster
        self.executor = cluster
        self._job_bytes: int | None = None  # of the results of a job, as far as one is known
        self._lanes: dict[tuple[str, ...], int] = {}  # by device, number type and rule

    def close(self) -> None:
        """The engine cannot be used afterwards; the cluster can."""
        self._closed = True

    @property
    def preview(self) -> Preview:
        """Previews, by a worker."""
        return _DistantPreview(self.cluster)

    def settled(self, scene: SceneLike) -> Scene:
        """See `Engine.settled`; a worker measures."""
        from clfractal.cluster import tasks

        loaded = as_scene(scene)
        asked, message = self.cluster.asking(tasks.settled, loaded)
        found: Scene = self.cluster.unpacked(self.cluster.answered(asked), message)
        return found

    def _prepared(self, scene: Scene, asked: Mapping[str, Any]) -> Job:
        """Decided for the device that most workers have."""
        return self._decided(self._asking(scene, **asked))

    def in_order(
        self, scenes: Iterable[Scene], wanted: Callable[[Job], bool], **settings: Any
    ) -> Generator[tuple[Job, bool]]:
        """See `AnyEngine.in_order`: as many jobs as keep all workers busy are decided, and begun, before their turn."""
        source = iter(scenes)
        asked: deque[_Asked | ClfractalError] = deque()
        begun: deque[tuple[Job, bool] | ClfractalError] = deque()
        more = True
        try:
            while True:
                while more and len(asked) + len(begun) < self._ahead():
                    try:
                        asked.append(self._asking(next(source), **settings))
                    except StopIteration:
                        more = False
                    except ClfractalError as error:
                        asked.append(error)
                        more = False
                while asked and (not begun or isinstance(asked[0], ClfractalError) or asked[0].future.done()):
                    begun.append(self._begun(asked.popleft(), wanted))
                if not begun:
                    return
                found = begun.popleft()
                if isinstance(found, ClfractalError):
                    raise found
                try:
                    yield found
                finally:
                    self.cluster.leave(found[0])  # whoever took it may not have wanted to execute it
        finally:
            for each in begun:
                if not isinstance(each, ClfractalError):
                    self.cluster.leave(each[0])

    def _ahead(self) -> int:
        """How many jobs are asked for before their turn."""
        if self._job_bytes is None:
            return 2
        return max(2, min(2 * self.cluster.others()[0] + 2, _AHEAD_BYTES // self._job_bytes, _MOST_AHEAD))

    def _begun(
        self, asked: _Asked | ClfractalError, wanted: Callable[[Job], bool]
    ) -> tuple[Job, bool] | ClfractalError:
        if isinstance(asked, ClfractalError):
            return asked
        try:
            job = self._decided(asked)
            needed = wanted(job)
        except ClfractalError as error:
            return error
        self._job_bytes = 4 * len(job.channels) * sum(view.plan.region.pixels for view in job.views)
        if needed:
            self.cluster.begin(job)
        return job, needed

    def _asking(self, scene: SceneLike, **settings: Any) -> _Asked:
        from clfractal.cluster import tasks

        loaded = as_scene(scene)
        precision = settings.get("precision") or loaded.renderer.precision
        future, message = self.cluster.asking(
            tasks.prepared, loaded, settings, float64=precision == "float64"
        )
        return _Asked(future, message)

    def _decided(self, asked: _Asked) -> Job:
        answer, self.previews_built_ms = self.cluster.answered(asked.future)
        job: Job = self.cluster.unpacked(answer, asked.message)
        job = replace(job, views=tuple(self._in_first_lanes(view, job.device.key) for view in job.views))
        remark = self._remark(job)
        return replace(job, remark="; ".join(filter(None, (job.remark, remark)))) if remark else job

    def _in_first_lanes(self, view: PlannedView, device: str) -> PlannedView:
        """A view with the lanes that the first like it had: frames of a film are decided by several workers, and one that
        measures its device meanwhile has others."""
        own = device, view.plan.precision, rule_of(view.scene.chain)
        return replace(view, plan=replace(view.plan, lanes=self._lanes.setdefault(own, view.plan.lanes)))

    def _remark(self, job: Job) -> str:
        workers, others, names = self.cluster.others()
        if not others:
            return ""
        return (
            f"{others} of {workers} workers render with another device than {job.device.name} ({', '.join(names)}): their"
            " tiles agree with it as closely as docs/platforms.md tells, but not in every bit"
        )


@dataclass(frozen=True, slots=True)
class _Asked:
    """A job that a worker decides about."""

    future: Future[Any]
    message: Message


class _DistantPreview(Preview):
    """Previews of a worker; what is seen comes back as points."""

    def __init__(self, cluster: Workers) -> None:
        self._cluster = cluster

    def points(self, scene: Scene, eye: Eye = MIDDLE) -> npt.NDArray[np.float64]:
        """See `Preview.points`."""
        from clfractal.cluster import tasks

        asked, _ = self._cluster.asking(tasks.points, (scene, eye))
        found: npt.NDArray[np.float64] = self._cluster.answered(asked)
        return found
