"""A Dask cluster as an executor: its work is done by many workers, and survives the loss of any of them."""

from __future__ import annotations

import asyncio
import queue
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotYet
from contextlib import suppress
from dataclasses import dataclass, replace
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self
from uuid import uuid4

import numpy as np

from clfractal.cluster import local_cluster as local
from clfractal.cluster.dispatch import Dispatcher, Work
from clfractal.cluster.guard import check_main
from clfractal.cluster.link import ANSWER_SECONDS, Link, usual_key
from clfractal.cluster.local_cluster import Place
from clfractal.cluster.message import Array, Digests, Message, pack, unpack
from clfractal.device.activity import doing
from clfractal.device.cancel import CancelToken
from clfractal.engine.job import Job
from clfractal.engine.run import Result, WorkItem
from clfractal.errors import ClfractalError, DeviceError, arguments
from clfractal.images.tiles import TileGrid

if TYPE_CHECKING:
    from clfractal.cluster.cluster_engine import ClusterEngine
    from clfractal.cluster.tasks import Answer

# How often who waits looks for Ctrl-C and tokens, seconds.
_LOOK_SECONDS = 0.1
_CLOSE_SECONDS = 10.0


@dataclass(slots=True)
class Share:
    """What one worker has done.

    Attributes:
        name: what Dask calls it.
        address: where it is.
        device: what it renders with.
        bundles, tiles: how many it has rendered.
        seconds: wall time of its tasks.
        kernel_ms, build_ms: see `Counters`.
    """

    name: str
    address: str
    device: str
    bundles: int = 0
    tiles: int = 0
    seconds: float = 0.0
    kernel_ms: float = 0.0
    build_ms: float = 0.0


class Cluster:
    """Workers of a Dask cluster, for the argument `executor` of `clfractal.render` and others.

        with clfractal.Cluster("tcp://scheduler:8786") as cluster:
            framebuffer = clfractal.render(scene, executor=cluster)

    Only one thread may use it at a time. A script that starts workers with `local:N` needs the usual
    `if __name__ == "__main__":`, since these are new processes.

    Args:
        address: of a scheduler, `tcp://HOST:8786` or `tls://HOST:8786`; or `local:N`, which starts N workers here.
        device: what each worker renders with, as for `clfractal.render`; None: what CLFRACTAL_DEVICE says there, else the
            best.
        tell: called, from another thread, with a message if a worker is left out, or the scheduler is gone.
        security: Dask's certificates for `tls://`, a `distributed.Security`; None: those of Dask's configuration.

    Raises:
        SceneError: the address is none, or needs certificates and there are none; `local:N` without that line.
        FileError: the package `distributed` is not installed, or a certificate is not there.
        DeviceError: status 3, the scheduler does not answer within 10 s.
    """

    def __init__(
        self,
        address: str,
        *,
        device: str | None = None,
        tell: Callable[[str], None] | None = None,
        security: Any = None,
    ) -> None:
        arguments.function("tell", tell)
        if not isinstance(address, str):
            arguments.refuse("address", "must be text such as tcp://HOST:8786 or local:4", address)
        self.place = Place.of(address)
        if self.place.workers:
            check_main(str(self.place))
        local.library()
        local.check_certificates(self.place, security)
        from clfractal.cluster.tasks import Seat

        self._security = security
        self._tell = tell or (lambda _: None)
        self._seat = Seat(uuid4().hex, device)
        self._digests = Digests()
        self._number = 0
        self._begun: dict[int, Work] = {}
        self._shares: dict[tuple[str, str], Share] = {}  # by address and device
        self._closed = False
        self._processes: Any = None
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="clfractal-cluster", daemon=True)
        self._thread.start()
        self._dispatcher = Dispatcher(self._open, str(self.place), self._seat, self._tell)
        try:
            with doing(f"connecting to {self.place}"):
                self._wait(self._begin())
        except BaseException:
            self._abandon()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Cancels all work and leaves the cluster; workers of `local:N` end. A second call does nothing."""
        if not self._closed:
            self._closed = True
            with suppress(Exception):
                self._wait(self._end())
            self._stop()

    def engine(self) -> ClusterEngine:
        """An engine whose decisions are made, and whose pictures are rendered, on the workers."""
        from clfractal.cluster.cluster_engine import ClusterEngine

        return ClusterEngine(self)

    def shares(self) -> list[Share]:
        """What each worker has done so far, by name."""
        return sorted(self._shares.values(), key=lambda share: (share.name, share.address))

    # Of an executor

    def execute(
        self, job: Job, items: Iterable[WorkItem], token: CancelToken | None = None
    ) -> Generator[Result]:
        """See `Executor`. When the iterator is closed, the work is cancelled: workers end it within a launch.

        Raises:
            DeviceError: the cluster is lost, or none of its workers is fit.
        """
        items = [item for item in items if len(item.tiles)]
        work = self._begun.pop(id(job), None)
        wanted = {
            item.view: np.zeros(TileGrid(job.views[item.view].plan.region).count, bool) for item in items
        }
        for item in items:
            wanted[item.view][item.tiles] = True
        left = sum(int(each.sum()) for each in wanted.values())
        if work is None:
            work = self._new(job, items)
        try:
            self._call(work.wanted.set)
            while left:
                answer = self._next(work, token)
                try:
                    chosen = wanted[answer.view][answer.tiles] if answer.view in wanted else np.zeros(0, bool)
                    if answer.view not in wanted or not chosen.any():
                        continue
                    tiles, framebuffer = answer.tiles, answer.framebuffer
                    if not chosen.all():
                        tiles, framebuffer = tiles[chosen], framebuffer[chosen]
                    wanted[answer.view][tiles] = False
                    left -= len(tiles)
                    self._count(answer)
                    # Programs are built side by side.
                    counters = replace(
                        answer.counters, build_ms=answer.counters.build_ms / max(len(self._shares), 1)
                    )
                    yield Result(answer.view, tiles, framebuffer, counters, answer.render_device)
                finally:
                    self._call(self._dispatcher.stored)
        finally:
            self._call(self._dispatcher.drop, work)

    def begin(self, job: Job) -> None:
        """Begins to render a job, all of it, before `execute` asks for it: after those that were begun before."""
        items = [
            WorkItem(number, TileGrid(view.plan.region).order_from_center(), (0, view.plan.samples))
            for number, view in enumerate(job.views)
        ]
        self._begun[id(job)] = self._new(job, items)

    def leave(self, job: Job) -> None:
        """Ends a job that was begun, if nobody has asked for it."""
        work = self._begun.pop(id(job), None)
        if work is not None:
            self._call(self._dispatcher.drop, work)

    def _new(self, job: Job, items: list[WorkItem]) -> Work:
        self._check()
        self._number += 1
        work = Work(self._number, job, pack(job, self._digests), deque(items))
        self._call(self._dispatcher.give, work)
        return work

    def _next(self, work: Work, token: CancelToken | None) -> Answer:
        with doing("waiting for the cluster"):
            while True:
                if token is not None:
                    token.check()
                with suppress(queue.Empty):
                    answer = work.answers.get(timeout=_LOOK_SECONDS)
                    if isinstance(answer, ClfractalError):
                        raise answer
                    found: Answer = answer
                    return found
                if self._dispatcher.error is not None:
                    raise self._dispatcher.error

    def _count(self, answer: Answer) -> None:
        share = self._shares.setdefault(
            (answer.worker, answer.render_device.key),
            Share(answer.name, answer.worker, answer.render_device.name),
        )
        share.bundles += 1
        share.tiles += len(answer.tiles)
        share.seconds += answer.seconds
        share.kernel_ms += answer.counters.kernel_ms
        share.build_ms += answer.counters.build_ms

    # Questions to a worker

    def asking(
        self, function: Callable[..., Any], thing: Any, *more: Any, float64: bool = False
    ) -> tuple[Future[Any], Message]:
        """Asks a function of `tasks`, of a worker with the device that most have; what is asked for is not waited for.

        Args:
            float64: whether the answer needs a device with float64, if the cluster has ever had one.
        """
        self._check()
        message = pack(thing, self._digests)
        asked = asyncio.run_coroutine_threadsafe(
            self._dispatcher.ask(function, message, *more, float64=float64), self._loop
        )
        return asked, message

    def answered(self, asked: Future[Any]) -> Any:
        """The answer; KeyboardInterrupt and errors come through."""
        with doing("waiting for the cluster"):
            return self._result(asked)

    def unpacked(self, message: Message, asked: Message) -> Any:
        """The thing in an answer; its arrays are those of what was asked, where it has the same."""
        arrays: Mapping[str, Array] = {**asked.arrays, **message.arrays}
        return unpack(message.data, arrays)

    def others(self) -> tuple[int, int, list[str]]:
        """The number of workers, of those whose device is another than most have, and the names of these devices."""
        link = self._dispatcher.link
        roll = link.roll if link is not None else ()
        key = usual_key(roll)
        other = [member.device.name for member in roll if member.device.key != key]
        return len(roll), len(other), sorted(set(other))

    # The loop's thread

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_forever()

    async def _begin(self) -> None:
        if self.place.workers:
            self._processes = await local.start(self.place.workers)
        try:
            await self._dispatcher.begin()
        except (TimeoutError, OSError) as error:
            raise DeviceError(
                f"{self.place}: the scheduler does not answer within {ANSWER_SECONDS:.0f} s",
                details=str(error),
            ) from error

    async def _open(self) -> Link:
        client = local.library().Client(
            self._processes if self._processes is not None else self.place.address,
            asynchronous=True,
            timeout=ANSWER_SECONDS,
            set_as_default=False,
            security=self._security,
            name="clfractal",
        )
        try:
            await asyncio.wait_for(client, ANSWER_SECONDS)
        except BaseException:
            with suppress(Exception):
                await asyncio.wait_for(client.close(timeout=1), 2)
            raise
        return Link(client, self._seat, self._tell, self.place.workers or None)

    async def _end(self) -> None:
        await self._dispatcher.end()
        with suppress(Exception):
            if self._dispatcher.link is not None:
                await asyncio.wait_for(self._dispatcher.link.client.close(timeout=2), 4)
        with suppress(Exception):
            if self._processes is not None:
                await asyncio.wait_for(self._processes.close(timeout=4), 6)
        for task in asyncio.all_tasks():
            if task is not asyncio.current_task():
                task.cancel()

    def _call(self, function: Callable[..., Any], *values: Any) -> None:
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(function, *values)

    def _wait(self, coroutine: Any) -> Any:
        return self._result(asyncio.run_coroutine_threadsafe(coroutine, self._loop))

    def _result(self, asked: Future[Any]) -> Any:
        while True:
            # (A wait without an end would not see Ctrl-C on Windows.)
            try:
                return asked.result(_LOOK_SECONDS)
            except NotYet:
                if asked.done():
                    return asked.result()

    def _abandon(self) -> None:
        self._closed = True
        with suppress(Exception):
            asyncio.run_coroutine_threadsafe(self._end(), self._loop).result(1)
        self._stop()

    def _stop(self) -> None:
        self._call(self._loop.stop)
        self._thread.join(_CLOSE_SECONDS)

    def _check(self) -> None:
        if self._closed:
            raise ClfractalError("this cluster is closed")
