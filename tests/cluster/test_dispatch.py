"""How a cluster's work is given out and counted, with connections and workers that are played: no processes."""

from __future__ import annotations

import asyncio
import sys
import threading
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine
from concurrent.futures import Future
from dataclasses import replace
from functools import wraps
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.cluster import dispatch, tasks
from clfractal.cluster.cluster_engine import ClusterEngine
from clfractal.cluster.dispatch import Dispatcher, Work
from clfractal.cluster.link import Link, Member, usual_key
from clfractal.cluster.message import Message
from clfractal.device.select import DeviceInfo
from clfractal.engine.job import Job
from clfractal.engine.run import Counters, WorkItem
from clfractal.errors import STATUS_BAD_INPUT, STATUS_DEVICE_FAILED, DeviceError, KernelBuildError
from clfractal.images.tiles import TILE
from tests.shell import SCENE


def in_a_loop(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    """A test that is run in an event loop of its own."""

    @wraps(test)
    def run(*arguments: Any, **named: Any) -> None:
        asyncio.run(test(*arguments, **named))

    return run


@pytest.fixture(scope="module")
def job() -> Job:
    with clfractal.Engine() as engine:
        return engine.prepare(SCENE)


def member(number: int, info: DeviceInfo) -> Member:
    return Member(f"tcp://host:{number}", f"w{number}", info, number)


class Played:
    """Dask's client, whose tasks are done at once; `answer` says what comes back from a bundle."""

    status = "running"

    def __init__(self, answer: Callable[[WorkItem], Any]) -> None:
        self._answer, self._loop = answer, asyncio.get_running_loop()
        self.asked: list[tuple[str, Any]] = []  # the function, and among which workers
        self.rpc = SimpleNamespace(remove=lambda _: None)

    def submit(self, function: Any, *values: Any, key: str, workers: Any = None, **_: Any) -> Any:
        self.asked.append((function.__name__, workers))
        done = SimpleNamespace(key=key, status="finished", values=values)
        done.add_done_callback = lambda call: self._loop.call_soon(call, done)
        done.release = lambda: None
        return done

    async def gather(self, future: Any, direct: bool) -> Any:
        await asyncio.sleep(0)
        return self._answer(future.values[-1])

    async def close(self, timeout: float) -> None:
        """As of Dask."""


def an_answer(job: Job, item: WorkItem, worker: str = "tcp://host:0") -> tasks.Answer:
    film = np.zeros((len(item.tiles), len(job.channels), TILE, TILE), np.float32)
    return tasks.Answer(
        item.view, item.tiles, film, Counters(), 1.0, worker, "w0", tasks.render_device_of(job.device)
    )


def linked(client: Any, members: list[Member], told: list[str] | None = None) -> Link:
    seat = tasks.Seat("test", None)
    link = Link(client, seat, (told if told is not None else []).append, None)
    link.members = {each.address: each for each in members}
    link._changed()
    return link


def dispatcher(open_link: Callable[[], Awaitable[Link]], told: list[str] | None = None) -> Dispatcher:
    return Dispatcher(
        open_link, "tcp://farm:1", tasks.Seat("test", None), (told if told is not None else []).append
    )


def work(job: Job, number: int = 1) -> Work:
    item = WorkItem(0, np.arange(2, dtype=np.int32), (0, job.samples))
    found = Work(number, job, Message(b""), deque([item]))
    found.wanted.set()
    return found


async def until(condition: Callable[[], bool]) -> None:
    for _ in range(24_000):
        if condition():
            return
        await asyncio.sleep(0.005)
    raise AssertionError("it did not come")


@in_a_loop
async def test_permits_come_back_when_work_is_dropped_as_its_answer_comes(job: Job) -> None:
    """As many times as there are permits: the next work is still read."""
    current: list[Work] = []

    def answer(item: WorkItem) -> tasks.Answer:
        if current:
            # (It runs when the answer is there, and whoever waits for it has not gone on.)
            asyncio.get_running_loop().call_soon(own.drop, current.pop())
        return an_answer(job, item)

    client = Played(answer)
    own = dispatcher(lambda: asyncio.sleep(0, linked(client, [])))
    own._use(linked(client, [member(0, job.device)]))
    for number in range(2 * dispatch._READ_AT_ONCE):
        each = work(job, number)
        current.append(each)
        own.give(each)
        await until(lambda: not current)
        for _ in range(100):  # whatever follows from it is done by then, turn by turn
            await asyncio.sleep(0)
        while not each.answers.empty():
            each.answers.get()
            own.stored()
    last = work(job, 99)
    own.give(last)
    await until(lambda: not last.answers.empty())


def test_each_answer_tells_its_render_device(job: Job) -> None:
    """In the results, and in what each worker has done; the first worker's device counts for no other's tiles."""
    other = replace(job.device, name="another", driver="another")
    answers = {
        0: replace(an_answer(job, WorkItem(0, np.array([0], np.int32), (0, 1)))),
        1: replace(
            an_answer(job, WorkItem(0, np.array([1, 2, 3], np.int32), (0, 1)), "tcp://host:1"),
            name="w1",
            render_device=tasks.render_device_of(other),
        ),
    }
    cluster = clfractal.Cluster.__new__(clfractal.Cluster)
    cluster._begun, cluster._shares, cluster._closed, cluster._number = {}, {}, False, 0
    cluster._dispatcher = SimpleNamespace(  # type: ignore[assignment]
        give=lambda work: [work.answers.put(each) for each in answers.values()],
        drop=None,
        stored=None,
        error=None,
    )
    from clfractal.cluster.message import Digests

    cluster._digests = Digests()
    cluster._call = lambda function, *values: function(*values) if function else None  # type: ignore[method-assign]
    items = [WorkItem(0, np.arange(4, dtype=np.int32), (0, job.samples))]
    found = {result.render_device: result.tiles.tolist() for result in cluster.execute(job, items)}
    assert found == {tasks.render_device_of(job.device): [0], tasks.render_device_of(other): [1, 2, 3]}
    assert [(each.name, each.device, each.tiles) for each in cluster.shares()] == [
        ("w0", job.device.name, 1),
        ("w1", "another", 3),
    ]


def test_workers_are_counted_while_they_come_and_go(job: Job) -> None:
    """Another thread reads what the loop's thread changes."""
    own = linked(SimpleNamespace(rpc=SimpleNamespace(remove=lambda _: None)), [])
    cluster = clfractal.Cluster.__new__(clfractal.Cluster)
    cluster._dispatcher = SimpleNamespace(link=own)  # type: ignore[assignment]
    ended = threading.Event()

    def come_and_go() -> None:
        number = 0
        while not ended.is_set():
            number += 1
            new = member(number % 50, job.device)
            if new.address in own.members:
                own._gone(new.address)
            else:
                own.members[new.address] = new
                own._changed()

    usual, thread = sys.getswitchinterval(), threading.Thread(target=come_and_go)
    sys.setswitchinterval(1e-6)
    try:
        thread.start()
        for _ in range(3000):
            workers, others, names = cluster.others()
            assert workers <= 50
            assert (others, names) == (0, [])
    finally:
        ended.set()
        thread.join()
        sys.setswitchinterval(usual)


def test_jobs_that_nobody_executes_are_left(job: Job) -> None:
    begun: list[Job] = []
    left: list[Job] = []

    def asking(*_: Any, **__: Any) -> tuple[Future[Any], Message]:
        future: Future[Any] = Future()
        future.set_result(None)
        return future, Message(b"")

    cluster = SimpleNamespace(
        asking=asking,
        answered=lambda _: (None, 0.0),
        unpacked=lambda *_: replace(job),
        others=lambda: (2, 0, []),
        begin=begun.append,
        leave=left.append,
    )
    engine = ClusterEngine(cluster)
    jobs = engine.in_order([job.scene] * 5, lambda _: True)
    taken = [next(jobs)[0] for _ in range(2)]
    jobs.close()
    assert len(begun) > 2
    assert {id(each) for each in taken} <= {id(each) for each in begun}
    assert sorted(map(id, left)) == sorted(map(id, begun))


def test_all_frames_of_a_film_have_the_lanes_of_the_first(job: Job) -> None:
    """Whichever worker decides about them, and whatever it has measured meanwhile; another device has its own."""
    view, other = job.views[0], replace(job.device, driver="another")
    decided = [
        replace(job, device=device, views=(replace(view, plan=replace(view.plan, lanes=lanes)),))
        for device, lanes in ((job.device, 16), (job.device, 8), (other, 4), (job.device, 4), (other, 16))
    ]
    answers = iter(decided)
    cluster = SimpleNamespace(
        asking=lambda *_, **__: (Future(), Message(b"")),
        answered=lambda _: (None, 0.0),
        unpacked=lambda *_: next(answers),
        others=lambda: (2, 0, []),
    )
    engine = ClusterEngine(cluster)
    assert [engine.prepare(job.scene).lanes for _ in decided] == [16, 16, 4, 16, 4]


@in_a_loop
async def test_a_picture_in_float64_waits_for_its_workers_only(
    job: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the last one is gone, that is told, and ends the work after a while; others' work goes on."""
    monkeypatch.setattr(dispatch, "RETURN_SECONDS", 0.6)
    told: list[str] = []
    view = job.views[0]
    double = replace(job, views=(replace(view, plan=replace(view.plan, precision="float64")),))
    small = replace(job.device, has_float64=False, driver="small")
    client = Played(lambda item: an_answer(job, item))
    link = linked(client, [member(0, replace(job.device, has_float64=True)), member(1, small)])
    own = dispatcher(lambda: asyncio.sleep(0, link), told)
    own._use(link)
    watching = asyncio.create_task(asyncio.sleep(60))
    guard = asyncio.create_task(own._guarded(link, watching))
    link._gone("tcp://host:0")
    far, near = work(double, 1), work(job, 2)
    own.give(far)
    own.give(near)
    await until(lambda: not near.answers.empty())
    assert far.answers.empty()
    error = await asyncio.wait_for(guard, 5)
    watching.cancel()
    assert isinstance(error, DeviceError)
    assert error.status == STATUS_DEVICE_FAILED
    assert error.message == "tcp://farm:1: there has been no worker with float64 for 1 s"
    assert told == ["tcp://farm:1: no worker with float64 is left; waiting 1 s for one"]
    # With one it goes on.
    link.members["tcp://host:2"] = member(2, replace(job.device, has_float64=True))
    link._changed()
    await until(lambda: not far.answers.empty())


def test_the_usual_device_has_float64_where_that_is_needed(job: Job) -> None:
    large = replace(job.device, has_float64=True, driver="large")
    small = replace(job.device, has_float64=False, driver="small")
    roll = [member(0, small), member(1, small), member(2, large)]
    assert usual_key(roll) == small.key
    assert usual_key(roll, float64=True) == large.key
    assert usual_key(roll[:2], float64=True) == small.key
    assert usual_key([]) is None


class Registered:
    """A scheduler's answers: workers that were last seen at some time."""

    def __init__(self) -> None:
        self.removed: list[str] = []

    async def unregister(self, address: str, stimulus_id: str) -> None:
        self.removed.append(address)


@in_a_loop
async def test_only_our_own_silent_workers_are_taken_off(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that never took part, of another program's, stays, however silent it is."""
    from clfractal.cluster import link as module

    monkeypatch.setattr(module, "SILENT_SECONDS", -1.0)
    told: list[str] = []
    scheduler, closed = Registered(), list[str]()
    client = SimpleNamespace(scheduler=scheduler, rpc=SimpleNamespace(remove=closed.append))
    own = linked(client, [member(0, job.device)], told)
    own.refused.add("tcp://host:1")
    about = {f"tcp://host:{number}": {"last_seen": 1.0, "name": f"w{number}"} for number in range(2)}
    for _ in range(3):
        await own._look(about)
    assert scheduler.removed == closed == ["tcp://host:0"]
    assert own.serving == []
    assert told == ["worker w0 (tcp://host:0) does not answer; its work goes to others"]


@in_a_loop
async def test_a_worker_that_returns_is_asked_again(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also the only one that was left out."""
    asked: list[str] = []

    async def enlist(address: str, name: object) -> None:
        asked.append(address)
        own._enlisting.pop(address)

    own = linked(Played(lambda _: None), [member(0, job.device)])
    monkeypatch.setattr(own, "_enlist", enlist)
    own.leave_out("tcp://host:0", "its device failed")
    there = {"tcp://host:0": {"last_seen": 1.0, "name": "w0"}}
    await own._look(there)
    await asyncio.sleep(0)
    assert asked == []
    await own._look({})
    await own._look(there)
    await asyncio.sleep(0)
    assert asked == ["tcp://host:0"]


@pytest.mark.parametrize("failure", [KernelBuildError("a bug of this driver's"), DeviceError("it burns")])
@in_a_loop
async def test_a_worker_that_fails_is_left_out_alone(job: Job, failure: clfractal.ClfractalError) -> None:
    """Its bundle is done by another one, in spite of a program that only this driver cannot compile."""
    told: list[str] = []
    failed = tasks.Failure.of(failure, "tcp://host:0")
    answers = iter([failed])
    client = Played(lambda item: next(answers, None) or an_answer(job, item, "tcp://host:1"))
    link = linked(client, [member(0, job.device), member(1, job.device)], told)
    own = dispatcher(lambda: asyncio.sleep(0, link))
    own._use(link)
    one = work(job)
    own.give(one)
    await until(lambda: one.answers.qsize() == 2)
    done = [one.answers.get() for _ in range(2)]
    assert sorted(tile for each in done for tile in each.tiles) == [0, 1]
    assert link.serving == ["tcp://host:1"]
    assert told == [f"worker w0 (tcp://host:0) is left out: {failure.message}"]
    assert ("tiles", ["tcp://host:1"]) in client.asked


@in_a_loop
async def test_mistakes_of_the_formula_leave_nobody_out(job: Job) -> None:
    error = KernelBuildError("no such function", status=STATUS_BAD_INPUT)
    client = Played(lambda item: tasks.Failure.of(error, "tcp://host:0"))
    link = linked(client, [member(0, job.device), member(1, job.device)])
    own = dispatcher(lambda: asyncio.sleep(0, link))
    own._use(link)
    one = work(job)
    own.give(one)
    await until(lambda: not one.answers.empty())
    found = one.answers.get()
    assert isinstance(found, KernelBuildError)
    assert (found.message, found.status) == ("no such function", STATUS_BAD_INPUT)
    assert len(link.serving) == 2


@pytest.mark.parametrize("problem", [OSError("refused"), RuntimeError("half started"), ValueError("what?")])
@in_a_loop
async def test_any_failure_to_connect_again_is_tried_again(job: Job, problem: Exception) -> None:
    """A scheduler that is about to start may answer anything."""
    told: list[str] = []
    tries = iter([problem, problem])
    link = linked(Played(lambda item: None), [member(0, job.device)])

    async def open_link() -> Link:
        failed = next(tries, None)
        if failed is not None:
            raise failed
        return link

    own = dispatcher(open_link, told)
    await own._again(linked(Played(lambda item: None), []))
    assert (own.link, own.error) == (link, None)
    assert told == ["tcp://farm:1: the scheduler is back"]
