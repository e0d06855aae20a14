"""Gives work to the cluster, a bounded number of bundles at a time, and again what is lost.

All of it runs in one event loop. Whoever waits for results is in another thread, and gets them through a queue.
"""

from __future__ import annotations

import asyncio
import queue
import time
from collections import Counter, deque
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any
from uuid import uuid4

from clfractal.cluster.link import Link, Lost, Tell, usual_key
from clfractal.cluster.message import Array, Message
from clfractal.cluster.sizes import Pace
from clfractal.engine.job import Job
from clfractal.engine.run import WorkItem
from clfractal.errors import STATUS_DEVICE_FAILED, ClfractalError, DeviceError, KernelBuildError
from clfractal.images.tiles import TILE

RETURN_SECONDS = 60.0
"""How long a scheduler may be gone, or be without workers, before a render ends."""
# Bundles for each worker at a time: one that it does, and one that waits there.
_FOR_EACH = 2
# Bundles whose results are read at a time.
_READ_AT_ONCE = 4
# Rounds of Dask's `allowed-failures` after which a bundle is what ends workers.
_ROUNDS = 8
_TRIES = 3
# Of what others wait for.
_URGENT = 500_000
# Until it is believed that no fit worker follows one that is not.
_OTHERS_SECONDS = 3.0
_PAUSE_SECONDS = 0.05
# Arrays of earlier works that stay with the workers: a film's frames mostly have the same.
_KEPT = 4

Submit = Callable[[Link], tuple[Any, Sequence[str] | None]]
Collect = Callable[[Link, Any], Awaitable[Any]]


@dataclass(eq=False)
class Work:
    """A job that is being done.

    Attributes:
        number: its place in the order of need.
        job: the job.
        message: the same, as it is sent.
        items: what is not given out yet.
        answers: answers, errors, and None when all is done; taken by another thread.
        wanted: set when somebody takes them.
    """

    number: int
    job: Job
    message: Message
    items: deque[WorkItem]
    answers: queue.SimpleQueue[Any] = field(default_factory=queue.SimpleQueue)
    wanted: asyncio.Event = field(default_factory=asyncio.Event)
    under_way: set[asyncio.Task[None]] = field(default_factory=set)
    ended: bool = False

    @property
    def float64(self) -> bool:
        """Whether only devices with float64 can do it."""
        return any(view.plan.precision == "float64" for view in self.job.views)

    @property
    def left(self) -> int:
        """Tiles that are not given out yet."""
        return sum(len(item.tiles) for item in self.items)

    def cut(self, size: int) -> WorkItem:
        """Takes the next tiles, at most so many."""
        item = self.items.popleft()
        if len(item.tiles) > size:
            self.items.appendleft(WorkItem(item.view, item.tiles[size:], item.samples))
            item = WorkItem(item.view, item.tiles[:size], item.samples)
        return item


class _Permit:
    """A permit to read a result: whoever holds it gives it back once, however its task ends."""

    def __init__(self, of: asyncio.Semaphore) -> None:
        self._of, self._held = of, False

    async def take(self) -> None:
        await self._of.acquire()
        self._held = True

    def give_back(self) -> None:
        if self._held:
            self._held = False
            self._of.release()

    def pass_on(self) -> None:
        """Another one gives it back."""
        self._held = False


class Dispatcher:
    """The work of one client.

    Args:
        open_link: makes a connection; raises OSError if nobody answers.
        place: what messages call the cluster.
        seat: who asks, for which device.
        tell: told what the user should know.
    """

    def __init__(self, open_link: Callable[[], Awaitable[Link]], place: str, seat: Any, tell: Tell) -> None:
        self._open, self._place, self._seat, self._tell = open_link, place, seat, tell
        self.link: Link | None = None
        self.error: ClfractalError | None = None
        self.pace = Pace()
        self._works: list[Work] = []
        self._given: set[asyncio.Task[None]] = set()  # bundles that are given out
        self._waiting: Counter[bool] = Counter()  # tasks without a worker, by whether they need float64
        self._had_float64 = False  # whether there ever was a worker that has it
        self._alone_since = time.monotonic()
        self._news = asyncio.Event()  # set, and replaced, whenever who works has changed
        self._read = asyncio.Semaphore(_READ_AT_ONCE)
        self._kept: dict[str, tuple[Link, Any]] = {}
        self._supervisor: asyncio.Task[None] | None = None

    # Connections

    async def begin(self) -> None:
        """Connects for the first time.

        Raises:
            OSError: nobody answers.
        """
        self._use(await self._open())
        self._supervisor = asyncio.create_task(self._supervise())

    async def end(self) -> None:
        """Cancels all work."""
        for work in list(self._works):
            self.drop(work)
        if self._supervisor is not None:
            self._supervisor.cancel()
            with suppress(asyncio.CancelledError):
                await self._supervisor

    def _use(self, link: Link) -> None:
        self.link = link
        link.on_news = self._tell_news

    def _tell_news(self) -> None:
        if self.link is not None and self.link.fit(float64=True):
            self._had_float64 = True
        self._news.set()
        self._news = asyncio.Event()
        self._give_out()

    async def _supervise(self) -> None:
        """Looks after the connection, and makes a new one when its scheduler is gone."""
        while self.error is None:
            assert self.link is not None
            watching = asyncio.create_task(self.link.watch())
            try:
                self.error = await self._guarded(self.link, watching)
            finally:
                watching.cancel()
            if self.error is None:
                self._tell(f"{self._place}: the scheduler is gone; waiting {RETURN_SECONDS:.0f} s for it")
                self._alone_since = time.monotonic()
                await self._again(self.link)
        self._tell_news()

    async def _guarded(self, link: Link, watching: asyncio.Task[None]) -> ClfractalError | None:
        """Returns when the scheduler is gone, or with an error when work waits for a worker for too long."""
        told = False
        while not watching.done():
            await asyncio.wait([watching], timeout=0.25)
            needs = {float64 for float64, count in self._waiting.items() if count}
            needs |= {work.float64 for work in self._works if work.items}
            if all(link.fit(float64) for float64 in needs):
                self._alone_since, told = time.monotonic(), False
                continue
            lacking = "worker with float64" if link.serving else "worker"
            waited = time.monotonic() - self._alone_since
            if link.reason and not (link.serving or link.has_lost or link.joining):
                if waited > _OTHERS_SECONDS:
                    return DeviceError(f"{self._place}: no worker is fit: {link.reason}")
            elif link.serving and not told and not link.joining:
                told = True
                self._tell(f"{self._place}: no {lacking} is left; waiting {RETURN_SECONDS:.0f} s for one")
            if waited > RETURN_SECONDS:
                return DeviceError(f"{self._place}: there has been no {lacking} for {RETURN_SECONDS:.0f} s")
        return None

    async def _again(self, old: Link) -> None:
        """Connects again as soon as there is a scheduler."""
        with suppress(Exception):
            await asyncio.wait_for(old.client.close(timeout=1), 3)
        deadline = self._alone_since + RETURN_SECONDS
        while time.monotonic() < deadline:
            try:
                self._use(await asyncio.wait_for(self._open(), max(deadline - time.monotonic(), 0.1)))
            except Exception:  # whatever it is: the scheduler may be about to start
                await asyncio.sleep(0.5)
                continue
            self._tell(f"{self._place}: the scheduler is back")
            return
        self.error = DeviceError(f"{self._place}: the scheduler is gone, and did not return in time")

    async def serving(self, float64: bool = False) -> Link:
        """The connection, as soon as there is one with a worker.

        Args:
            float64: with a worker whose device has it.

        Raises:
            ClfractalError: it was waited for too long.
        """
        self._waiting[float64] += 1
        try:
            while True:
                if self.error is not None:
                    raise self.error
                link = self.link
                if link is not None and not link.over and link.fit(float64):
                    return link
                await self._news.wait()
        finally:
            self._waiting[float64] -= 1

    # Questions

    async def ask(
        self, function: Callable[..., Any], message: Message, *more: Any, float64: bool = False
    ) -> Any:
        """What a function answers to a message, on a worker with the device that most have.

        Args:
            float64: only of a worker with float64, if there ever was one; else what it says to that is the answer.

        Raises:
            ClfractalError: what it failed with.
        """

        def submit(link: Link) -> tuple[Any, Sequence[str] | None]:
            key = usual_key(link.roll, float64=float64)
            assert key is not None
            among = link.with_key(key)
            future = link.client.submit(
                function,
                self._seat,
                message.data,
                self._arrays(link, message),
                *more,
                key=f"clfractal-{function.__name__}-{uuid4().hex}",
                workers=among,
                priority=_URGENT,
                retries=_TRIES,
                pure=False,
            )
            return future, among

        async def collect(link: Link, future: Any) -> Any:
            return await link.client.gather(future, direct=link.direct)

        return await self._done(submit, collect, float64 and await self._has_float64())

    async def _has_float64(self) -> bool:
        """Whether there ever was a worker with float64; the first ones are waited for while others may be joining."""
        await self.serving()
        until = time.monotonic() + _OTHERS_SECONDS
        while not self._had_float64 and self.link is not None:
            if time.monotonic() > until and not self.link.joining:
                break
            await asyncio.sleep(_PAUSE_SECONDS)
        return self._had_float64

    # Work

    def give(self, work: Work) -> None:
        """Begins a work; earlier ones come first."""
        self._works.append(work)
        self._works.sort(key=lambda each: each.number)
        self._give_out()

    def drop(self, work: Work) -> None:
        """Ends a work: its tasks are cancelled, wherever they are."""
        if not work.ended:
            work.ended = True
            self._works.remove(work)
            for task in list(work.under_way):
                task.cancel()
            with suppress(queue.Empty):
                while True:
                    if not isinstance(work.answers.get_nowait(), ClfractalError):
                        self.stored()
            self._give_out()

    def stored(self) -> None:
        """A result was taken out of the queue."""
        self._read.release()

    def _give_out(self) -> None:
        """Gives out bundles as long as there is room for them."""
        link = self.link
        if link is None or link.over or not link.serving:
            return
        for place, work in enumerate(self._works):
            workers = len(link.fit(work.float64))
            if not workers:
                continue
            while work.items and len(self._given) < _FOR_EACH * workers + 1:
                left = sum(each.left for each in self._works[place:])
                samples = work.items[0].samples[1] - work.items[0].samples[0]
                size = self.pace.bundle(samples, left, workers, 4 * TILE * TILE * len(work.job.channels))
                task = asyncio.create_task(self._do(work, work.cut(size)))
                self._given.add(task)
                work.under_way.add(task)
                # (A task that is cancelled before it has begun runs no `finally` of its own.)
                task.add_done_callback(work.under_way.discard)
                task.add_done_callback(self._free)

    async def _do(self, work: Work, item: WorkItem) -> None:
        """Has one bundle done, however often it takes, and puts its answer into the queue."""
        from clfractal.cluster import tasks

        offers = {tasks.RESOURCE: 1, **({tasks.FLOAT64: 1} if work.float64 else {})}
        own, permit = asyncio.current_task(), _Permit(self._read)
        assert own is not None

        def submit(link: Link) -> tuple[Any, Sequence[str] | None]:
            among = link.fit(work.float64) if link.left_out else None
            future = link.client.submit(
                tasks.tiles,
                self._seat,
                work.message.data,
                self._arrays(link, work.message),
                item,
                key=f"clfractal-tiles-{uuid4().hex}",
                resources=offers,
                workers=among,
                priority=-work.number,
                retries=_TRIES,
                pure=False,
            )
            return future, among

        async def collect(link: Link, future: Any) -> Any:
            if not work.wanted.is_set():
                # Its result stays with the worker, which goes on with other bundles.
                self._free(own)
                await work.wanted.wait()
            nonlocal permit
            reading = permit = _Permit(self._read)
            await reading.take()
            answer = None
            try:
                answer = await link.client.gather(future, direct=link.direct)
            finally:
                if not isinstance(answer, tasks.Answer):
                    reading.give_back()
            return answer

        try:
            answer = await self._done(submit, collect, work.float64)
        except ClfractalError as error:
            work.answers.put(error)
        except Exception as error:  # a mistake of this program's
            work.answers.put(_failed(self._place, error))
        else:
            seconds = max(answer.seconds - 1e-3 * answer.counters.build_ms, 1e-6)
            self.pace.learn(len(item.tiles), item.samples[1] - item.samples[0], seconds)
            work.answers.put(answer)
            permit.pass_on()  # to whoever takes the answer out of the queue
        finally:
            permit.give_back()  # of an answer that came when nobody wanted it any more

    def _free(self, task: asyncio.Task[None]) -> None:
        """Counts a bundle as done: there is room for another one."""
        if task in self._given:
            self._given.remove(task)
            self._give_out()

    async def _done(self, submit: Submit, collect: Collect, float64: bool) -> Any:
        """Has a task done, however often it takes; gives its answer.

        Args:
            float64: whether only workers with float64 can do it.

        Raises:
            ClfractalError: what it failed with, or there is nobody who could do it.
        """
        rounds = 0
        while True:
            link = await self.serving(float64)
            if link.client.status != "running":  # it is about to be seen that the scheduler is gone
                await asyncio.sleep(_PAUSE_SECONDS)
                continue
            future, among = submit(link)
            try:
                await link.while_alive(_finished(future), future, among, float64=float64)
                if future.status == "finished":
                    answer = await link.while_alive(collect(link, future), future, among, float64=float64)
                    if self._is_final(link, answer):
                        return answer
                elif future.status == "error":
                    error = await future.exception()
                    rounds += 1
                    if type(error).__name__ != "KilledWorker":
                        raise _failed(self._place, error)
                    if rounds >= _ROUNDS:
                        raise DeviceError(f"{self._place}: {error}")
            except Lost:
                pass  # the next try waits until there is somebody
            finally:
                with suppress(Exception):
                    future.release()
            await asyncio.sleep(_PAUSE_SECONDS)

    def _is_final(self, link: Link, answer: Any) -> bool:
        """Whether an answer counts; else the task is to be done again, by somebody else.

        Raises:
            ClfractalError: what the worker failed with.
        """
        from clfractal.cluster import tasks

        if isinstance(answer, tasks.Interrupted):
            return False
        if not isinstance(answer, tasks.Failure):
            return True
        error = answer.error()
        broken = isinstance(error, KernelBuildError) and error.status == STATUS_DEVICE_FAILED
        if not broken and not isinstance(error, DeviceError):
            raise error
        # A device that failed, or is too small, is left out; if it was the last one, that is what the user is told.
        link.leave_out(answer.worker, error.message)
        if not link.serving and not link.joining:
            raise error
        return False

    def _arrays(self, link: Link, message: Message) -> dict[str, Any]:
        """Futures of a message's arrays, which Dask brings to the workers."""
        found = {}
        for digest, array in message.arrays.items():
            owner, future = self._kept.get(digest, (None, None))
            if owner is not link or future is None or future.status in ("cancelled", "lost", "error"):
                future = self._keep(link, digest, array)
                self._kept[digest] = (link, future)
            found[digest] = future
        for digest in [digest for digest in self._kept if digest not in found][:-_KEPT]:
            del self._kept[digest]
        return found

    def _keep(self, link: Link, digest: str, array: Array) -> Any:
        import warnings

        from clfractal.cluster import tasks

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that it is large
            return link.client.submit(
                tasks.kept,
                array,
                key=f"clfractal-kept-{digest}",
                priority=600_000,
                pure=False,
                resources={tasks.RESOURCE: 1},  # only of workers that are fit
            )


def _failed(place: str, error: BaseException) -> ClfractalError:
    """What is told of an exception that is none of ours."""
    words = " ".join(f"{type(error).__name__}: {error}".split())[:300]
    return ClfractalError(f"{place}: a worker failed: {words}", status=STATUS_DEVICE_FAILED)


async def _finished(future: Any) -> None:
    """Waits until a task has ended, in whichever way; its result is not read."""
    loop, done = asyncio.get_running_loop(), asyncio.Event()
    future.add_done_callback(lambda _: loop.call_soon_threadsafe(done.set))
    await done.wait()
