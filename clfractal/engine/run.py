"""Executes a job: its work is cut into items, an executor renders them, and the tiles go into stores.

An executor is whatever does work items: this process (`local.py`), also for the window, several devices, or a cluster.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field, fields
from typing import Protocol

import numpy as np
import numpy.typing as npt

from clfractal.device.cancel import CancelToken
from clfractal.engine.job import Job
from clfractal.images.provenance import RenderDevice
from clfractal.images.tiled import TiledStore
from clfractal.images.tiles import TILE

Floats = npt.NDArray[np.float32]
Tiles = npt.NDArray[np.int32]

NO_TILES = np.zeros(0, np.int32)
NO_PIXELS = np.zeros((0, 0, TILE, TILE), np.float32)


@dataclass(frozen=True, slots=True)
class WorkItem:
    """A part of a job. It may be split by tiles in any way.

    By samples it may be split only in order, and on one device: float sums depend on their order, so each range of a
    tile's samples continues the sums that the range before left on the device.

    Attributes:
        view: number of the view in the job.
        tiles: indices in the grid of the view's region, in the order in which they are wanted.
        samples: the first sample of each pixel, and the one after the last.
    """

    view: int
    tiles: Tiles
    samples: tuple[int, int]


@dataclass(slots=True, kw_only=True)
class Counters:
    """Counts and times: camera rays (all samples), those of them that found anything, distance evaluations and
    applications of all rays; lanes that waited for others without a ray, in distance evaluations, and, if that
    is observed, those with one whose orbit had ended, in applications; times in ms."""

    rays: int = 0
    hits: int = 0
    steps: int = 0
    iterations: int = 0
    bad_distances: int = 0
    waits: int = 0
    orbit_waits: int = 0
    kernel_ms: float = 0.0
    build_ms: float = 0.0

    def add(self, other: Counters) -> None:
        """Adds what other work took."""
        for each in fields(Counters):
            setattr(self, each.name, getattr(self, each.name) + getattr(other, each.name))


@dataclass(frozen=True, slots=True)
class Result:
    """Finished tiles of a view (perhaps none), with the counts since the result before.

    Attributes:
        view: number of the view in the job.
        tiles: indices of the tiles.
        framebuffer: their channels, shape (tiles, channels, TILE, TILE).
        counters: see `Counters`.
        render_device: the device that made them, where several do a job.
        remark: what the user should know about the work, or empty.
    """

    view: int
    tiles: Tiles
    framebuffer: Floats
    counters: Counters
    render_device: RenderDevice | None = None
    remark: str = ""


class Executor(Protocol):
    """Does work items."""

    def execute(
        self, job: Job, items: Iterable[WorkItem], token: CancelToken | None = None
    ) -> Generator[Result]:
        """Executes the items of a job and yields results as they come: complete tiles, each once, in any order.

        When the iterator is closed, or raises, no work of the job is running any more.

        Raises:
            DeviceError, KernelBuildError: a device failed, or a program does not compile.
            Stopped: the token was set.
        """


@dataclass(slots=True)
class Progress(Counters):
    """The progress of a job, its counts and times; `remaining` is None until it can be estimated.

    `views` has the counts and times of each of the job's views, `render_devices` those of each device where several do the
    job, with its tiles, and `remarks` what the user should know about the work.
    """

    tiles: int
    tiles_done: int = 0
    started: float = field(default_factory=time.perf_counter)
    tiles_before: int = 0
    views: list[Counters] = field(default_factory=list)
    render_devices: dict[RenderDevice, tuple[int, Counters]] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)

    @property
    def seconds(self) -> float:
        """Wall time since the start of the job, without the time for building programs."""
        return max(time.perf_counter() - self.started - 1e-3 * self.build_ms, 0.0)

    @property
    def rays_per_second(self) -> float:
        """Camera rays per second of wall time, over all samples."""
        return self.rays / max(self.seconds, 1e-9)

    @property
    def remaining(self) -> float | None:
        """Seconds left at the present rate."""
        finished = self.tiles_done - self.tiles_before
        if finished == 0:
            return None
        return self.seconds / finished * (self.tiles - self.tiles_done)

    @property
    def steps_per_ray(self) -> float:
        """Distance evaluations per camera ray, including those of shadow rays."""
        return self.steps / max(self.rays, 1)

    @property
    def waiting(self) -> float:
        """The part of all lanes that waited for others while rays marched."""
        return self.waits / max(self.waits + self.steps, 1)


ProgressCallback = Callable[[Progress], None]


def run(
    job: Job,
    stores: Sequence[TiledStore],
    executor: Executor,
    *,
    progress: ProgressCallback | None = None,
    token: CancelToken | None = None,
    samples: tuple[int, int] | None = None,
) -> Progress:
    """Renders every tile that the stores lack, and tells each store's header the seconds that its view took.

    Args:
        stores: where the tiles of each of the job's views go.
        executor: does the work.
        progress: called after each launch. An exception in it, or a KeyboardInterrupt, ends the work between two tiles;
            what is finished is in the stores.
        token: ends the work in the same way, with Stopped.
        samples: the first sample and the one after the last, for a picture that is made in passes: then all tiles are
            rendered, also those that are there. None: all samples of the tiles that are not.

    Raises:
        DeviceError, KernelBuildError, Stopped: see `Executor.execute`.
        FileError: a store cannot be written.
    """
    before = sum(int(np.count_nonzero(store.done)) for store in stores) if samples is None else 0
    state = Progress(sum(store.grid.count for store in stores), before, tiles_before=before)
    state.views = [Counters() for _ in stores]
    items = []
    for number, (view, store) in enumerate(zip(job.views, stores, strict=True)):
        order = store.grid.order_from_center()
        if samples is None:
            items.append(WorkItem(number, order[~store.done[order]], (0, view.plan.samples)))
        elif samples[0] < view.plan.samples:
            items.append(WorkItem(number, order, (samples[0], min(samples[1], view.plan.samples))))
    last, seconds = state.seconds, [0.0] * len(stores)
    # Closed at once, whatever happens here: the device is idle before an error or an interrupt is seen.
    with closing(executor.execute(job, items, token)) as results:
        for result in results:
            store, render_device = stores[result.view], result.render_device
            if render_device is not None:
                tiles, counters = state.render_devices.setdefault(render_device, (0, Counters()))
                counters.add(result.counters)
                state.render_devices[render_device] = (tiles + len(result.tiles), counters)
            elif store.provenance.known:  # an earlier run had several devices
                render_device = RenderDevice.of(job.device.index, job.device.name, job.device.key)
            if len(result.tiles):
                store.put_tiles(result.tiles, result.framebuffer, render_device)
            if result.remark:
                state.remarks.append(result.remark)
            state.tiles_done += len(result.tiles)
            state.add(result.counters)
            state.views[result.view].add(result.counters)
            seconds[result.view] += state.seconds - last
            store.tell("seconds", seconds[result.view])
            last = state.seconds
            if progress is not None:
                progress(state)
    for store in stores:
        for key, value in store.provenance.header(store.done).items():
            store.tell(key, value)
    return state
