"""What runs on a cluster's workers: each keeps its engines from task to task.

Only one task at a time uses a device of a process. A task ends early when nobody wants its result any more.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from distributed import WorkerPlugin, get_worker
from distributed.utils import sync

from clfractal import errors
from clfractal.cluster.fingerprint import fingerprint
from clfractal.cluster.message import Arrays, Digests, Message, pack, unpack
from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device, DeviceInfo, choose, has_float64
from clfractal.engine.job import Job
from clfractal.engine.prepare import pays_to_measure, with_lanes
from clfractal.engine.run import Counters, Floats, Tiles, WorkItem
from clfractal.errors import ClfractalError, Stopped, Where
from clfractal.files import resources
from clfractal.images.provenance import RenderDevice

if TYPE_CHECKING:
    from clfractal.engine.engine import Engine

T = TypeVar("T")

RESOURCE = "clfractal"
FLOAT64 = "clfractal-float64"
_PLUGIN = "clfractal"
# Engines that a worker keeps: two clients may use it in turn.
_ENGINES = 2
# Jobs that it keeps: those of some frames, whose bundles may come in turn.
_JOBS = 8


@dataclass(frozen=True, slots=True)
class Failure:
    """An error of ours as plain data: exceptions lose their places on the way."""

    kind: str
    message: str
    where: Where
    details: str
    status: int
    worker: str

    @classmethod
    def of(cls, error: ClfractalError, worker: str) -> Failure:
        """What was raised on a worker."""
        return cls(type(error).__name__, error.message, error.where, error.details, int(error.status), worker)

    def error(self) -> ClfractalError:
        """The same as an exception."""
        kind = getattr(errors, self.kind, ClfractalError)
        found: ClfractalError = kind(self.message, self.where, details=self.details, status=self.status)
        return found


@dataclass(frozen=True, slots=True)
class Interrupted:
    """The answer of a task that was cancelled: nobody wants it, or the worker is leaving."""


@dataclass(frozen=True, slots=True)
class Seat:
    """Who asks, and for which device: a worker keeps an engine for each.

    Attributes:
        owner: the cluster object's own name.
        device: as for `--device`; None: the worker's choice.
    """

    owner: str
    device: str | None


@dataclass(frozen=True, slots=True)
class Answer:
    """Finished tiles.

    Attributes:
        view: number of the view.
        tiles: their indices.
        framebuffer: float32 of shape (tiles, channels, TILE, TILE).
        counters: what they took.
        seconds: wall time of the worker, with what it had to build.
        worker: its address.
        name: what Dask calls it.
        render_device: the device.
    """

    view: int
    tiles: Tiles
    framebuffer: Floats
    counters: Counters
    seconds: float
    worker: str
    name: str
    render_device: RenderDevice


def render_device_of(device: DeviceInfo) -> RenderDevice:
    """How a picture calls a worker's device: without the index, which names another device on another machine."""
    return RenderDevice.of("", device.name, device.key)


def enlist(wanted: str, device: str | None, share: tuple[int, int] | None) -> dict[str, Any]:
    """Begins to take part, if this program and the device are fit: offers what our tasks ask for.

    Plain data in and out, since the worker may have another version.

    Args:
        wanted: the client's fingerprint.
        device: as for `--device`.
        share: which of how many equal parts of the processor's cores are this worker's; None: all of them.

    Returns:
        `version`, `fingerprint`, `pid`; `device`, its `DeviceInfo`, or `fault`, why there is none.
    """
    report: dict[str, Any] = {
        "version": resources.__version__,
        "fingerprint": fingerprint(),
        "pid": os.getpid(),
    }
    if report["fingerprint"] != wanted:
        return report
    if share is not None:
        _take_cores(*share)
    try:
        report["device"] = choose(device).info
    except ClfractalError as error:
        return {**report, "fault": str(error)}
    worker = get_worker()
    if _PLUGIN not in worker.plugins:
        sync(worker.loop, worker.plugin_add, plugin=_Ending(), name=_PLUGIN)
    offers = {RESOURCE: 1, FLOAT64: 1 if has_float64(report["device"]) else 0}
    if any(worker.state.total_resources.get(name) != count for name, count in offers.items()):
        sync(worker.loop, worker.set_resources, **offers)
    return report


def tiles(seat: Seat, data: bytes, arrays: Arrays, item: WorkItem) -> Answer | Failure | Interrupted:
    """Renders some tiles of a job."""

    def work(engine: Engine, token: CancelToken) -> Answer:
        start = time.perf_counter()
        job = _fitted(_unpacked(data, arrays), engine.device)
        counters, found, framebuffers = Counters(), [], []
        for result in engine.executor.execute(job, [item], token):
            counters.add(result.counters)
            if len(result.tiles):
                found.append(np.asarray(result.tiles, np.int32))
                framebuffers.append(result.framebuffer)
        return Answer(
            item.view,
            np.concatenate(found),
            framebuffers[0] if len(framebuffers) == 1 else np.concatenate(framebuffers),
            counters,
            time.perf_counter() - start,
            get_worker().address,
            str(get_worker().name),
            render_device_of(engine.device.info),
        )

    return _answered(seat, work)


def prepared(
    seat: Seat, data: bytes, arrays: Arrays, settings: dict[str, Any]
) -> tuple[Message, float] | Failure | Interrupted:
    """The job of a scene, and the milliseconds of building programs for previews."""

    def work(engine: Engine, _: CancelToken) -> tuple[Message, float]:
        job = engine.prepare(unpack(data, arrays), **settings)
        return _packed(job, arrays), engine.previews_built_ms

    return _answered(seat, work)


def settled(seat: Seat, data: bytes, arrays: Arrays) -> Message | Failure | Interrupted:
    """The scene with numbers in the place of what is measured."""
    return _answered(seat, lambda engine, _: _packed(engine.settled(unpack(data, arrays)), arrays))


def points(seat: Seat, data: bytes, arrays: Arrays) -> Any:
    """What an eye sees of a scene, as points: see `Preview.points`."""
    return _answered(seat, lambda engine, _: engine.preview.points(*unpack(data, arrays)))


def kept(array: Any) -> Any:
    """An array as a task of its own: Dask then sends it once to each worker that needs it, and again if it is lost."""
    return array


def _packed(thing: Any, arrays: Arrays) -> Message:
    """A thing made of a message; with the arrays that the message did not have."""
    message = pack(thing, _digests)
    return Message(message.data, {key: message.arrays[key] for key in message.arrays if key not in arrays})


_one_at_a_time = threading.Lock()
_digests = Digests()
_engines: OrderedDict[Seat, Engine] = OrderedDict()
_jobs: OrderedDict[str, Job] = OrderedDict()
_tokens: dict[str, CancelToken] = {}


class _Ending(WorkerPlugin):  # type: ignore[misc]
    """Ends a task that is running when its client cancels it, or is gone."""

    def transition(self, key: Any, start: Any, finish: Any, **_: Any) -> None:
        token = _tokens.get(key)
        if token is not None and finish in ("cancelled", "released", "forgotten"):
            token.cancel()


def _answered(seat: Seat, work: Callable[[Engine, CancelToken], T]) -> T | Failure | Interrupted:
    """What work on the seat's engine gives, or why it failed."""
    with _token() as token, _one_at_a_time:
        try:
            token.check()
            return work(_engine(seat), token)
        except Stopped:
            return Interrupted()
        except ClfractalError as error:
            if isinstance(error, errors.DeviceError):
                _engines.pop(seat, None)  # a driver that failed once is opened anew
            return Failure.of(error, get_worker().address)


@contextmanager
def _token() -> Iterator[CancelToken]:
    key, token = get_worker().get_current_task(), CancelToken()
    _tokens[key] = token
    try:
        yield token
    finally:
        del _tokens[key]


def _engine(seat: Seat) -> Engine:
    from clfractal.engine.engine import Engine

    if seat not in _engines:
        _engines[seat] = Engine(seat.device)
    _engines.move_to_end(seat)
    while len(_engines) > _ENGINES:
        _engines.popitem(last=False)[1].close()
    return _engines[seat]


def _unpacked(data: bytes, arrays: Arrays) -> Job:
    key = Message(data).key
    if key not in _jobs:
        _jobs[key] = unpack(data, arrays)
    _jobs.move_to_end(key)
    while len(_jobs) > _JOBS:
        _jobs.popitem(last=False)
    return _jobs[key]


def _fitted(job: Job, device: Device) -> Job:
    """The job, with this device's lanes if it is of another kind than the one that decided."""
    if device.info.key == job.device.key:
        return job
    views = with_lanes(job.views, device, measures=pays_to_measure(job.views, device))
    return replace(job, views=tuple(views), device=device.info)


def _take_cores(number: int, count: int) -> None:
    """Leaves the other cores to the other workers of this machine. Only before a driver is loaded: it asks then."""
    if sys.platform == "linux":
        cores = sorted(os.sched_getaffinity(os.getpid()))
    else:
        cores = list(range(os.cpu_count() or 1))
    first, end = number * len(cores) // count, (number + 1) * len(cores) // count
    own = cores[first:end] or [cores[number % len(cores)]]
    # PoCL's threads; the first name is that of PoCL before 5, the second of later ones.
    for name in ("POCL_MAX_PTHREAD_COUNT", "POCL_CPU_MAX_CU_COUNT"):
        os.environ.setdefault(name, str(len(own)))
    if sys.platform == "linux":
        # Of this thread, from which the driver's threads have it.
        os.sched_setaffinity(0, own)
