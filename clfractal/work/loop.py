"""The loop that renders a scene: batches of tiles sized to a time budget, nearest to the centre first."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.select import Device
from clfractal.errors import DeviceError
from clfractal.pictures.tiled import TiledStore
from clfractal.pictures.tiles import TILE, Tile
from clfractal.renderers.plan import Plan
from clfractal.renderers.worker import Batch, Shared, TileWorker
from clfractal.renderers.workers import make_worker
from clfractal.scene.model import Scene

Floats = npt.NDArray[np.float32]

# Time a batch should take. Long enough to keep a GPU busy, short enough for its watchdog, and for Ctrl-C.
BATCH_SECONDS = 0.1
# A batch grows at most by this factor over the one before: the next tiles may be much heavier.
GROWTH = 4.0
# Tiles of the largest batch: 1024 of them are a megapixel.
CAPACITY = 512
# How long to sleep between looks at a batch; Ctrl-C is seen then.
POLL_SECONDS = 0.0005


@dataclass(slots=True)
class Progress:
    """How far a render is; `remaining` is None until it can be told."""

    tiles: int
    tiles_done: int = 0
    rays: int = 0
    iterations: int = 0
    steps: int = 0
    bad_distances: int = 0
    kernel_ms: float = 0.0
    build_ms: float = 0.0
    started: float = field(default_factory=time.perf_counter)
    tiles_before: int = 0

    @property
    def seconds(self) -> float:
        """Wall time since the first tile was begun."""
        return time.perf_counter() - self.started

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
        """Distance evaluations per camera ray, shadow rays' included."""
        return self.steps / max(self.rays, 1)


ProgressCallback = Callable[[Progress], None]


def render_one(
    scene: Scene,
    plan: Plan,
    device: Device,
    store: TiledStore,
    progress: ProgressCallback | None = None,
    *,
    on_compile: Callable[[str], None] | None = None,
    shared: Shared | None = None,
) -> Progress:
    """Renders every tile that `store` lacks, of a scene with one view.

    `progress` is called after each batch. An exception in it, or a KeyboardInterrupt, ends the render between two
    tiles; what is finished is in the store. `on_compile` is told a line if the program has to be compiled first.
    `shared` keeps what further renders of the same picture need again.

    Raises:
        DeviceError, KernelBuildError: see `TileWorker`.
    """
    order = store.grid.order_from_center()
    pending = order[~store.done[order]]
    state = Progress(store.grid.count, int(store.grid.count - len(pending)))
    state.tiles_before = state.tiles_done
    if len(pending) == 0:
        return state
    capacity = min(CAPACITY, len(pending))
    worker = make_worker(scene, plan, device, capacity=capacity, on_compile=on_compile, shared=shared)
    state.build_ms = worker.program.build_ms
    state.started = time.perf_counter()
    _Loop(worker, store, state, progress).run(pending)
    return state


def render_tile(scene: Scene, plan: Plan, device: Device, tile: Tile) -> Floats:
    """One tile on its own: float32 of shape (channels, height, width), the same bits as in a whole render."""
    worker = make_worker(scene, plan, device, capacity=1)
    batch = worker.start(np.array([tile.index], np.int32))
    wait(batch, device)
    film, _ = worker.collect(batch)
    return _cut(film[0], tile)


def wait(batch: Batch, device: Device) -> float:
    """Waits for a batch in short sleeps, so that Ctrl-C is seen; gives the milliseconds that it took on the device."""
    with device.failures("rendering"):
        while True:
            status = batch.event.command_execution_status
            if status == cl.command_execution_status.COMPLETE:
                break
            if status < 0:
                raise DeviceError(f"{device.info.name}: the device failed while rendering: status {status}")
            time.sleep(POLL_SECONDS)
        profile = batch.event.profile
        return float(profile.end - profile.start) * 1e-6


class _Loop:
    """Keeps two batches under way, so that the device does not wait for the host."""

    def __init__(
        self, worker: TileWorker, store: TiledStore, state: Progress, progress: ProgressCallback | None
    ) -> None:
        self.worker, self.store, self.state, self.progress = worker, store, state, progress
        units = max(worker.device.info.compute_units, 1)
        # In tiles; below 1 a tile is rendered in parts.
        self.size = float(min(2 * units, worker.capacity))
        self.smallest = worker.group / worker.packets

    def run(self, pending: npt.NDArray[np.int32]) -> None:
        flying: list[Batch] = []
        place, slot = 0, 0
        while place < len(pending) or flying:
            while place < len(pending) and len(flying) < 2 and self.size >= 1:
                # The last batches are kept short, so that no core idles long at the end.
                left = len(pending) - place
                count = int(max(1, min(self.size, self.worker.capacity, left)))
                flying.append(self.worker.start(pending[place : place + count], slot=slot))
                place, slot = place + count, 1 - slot
            if flying:
                self._finish(flying.pop(0))
            elif place < len(pending):
                self._in_parts(pending[place : place + 1])
                place += 1

    def _finish(self, batch: Batch) -> None:
        milliseconds = wait(batch, self.worker.device)
        film, sums = self.worker.collect(batch)
        for index, array in zip(batch.tiles.tolist(), film, strict=True):
            self.store.put(index, _cut(array, self.store.grid.tile(index)))
        self._account(milliseconds, sums, len(batch.tiles))
        self._adapt(milliseconds, len(batch.tiles))

    def _in_parts(self, tile: npt.NDArray[np.int32]) -> None:
        """One tile so heavy that it takes several launches to stay within the budget."""
        first = 0
        worker = self.worker
        while first < worker.packets:
            groups = max(1, int(self.size * worker.packets) // worker.group)
            count = min(groups * worker.group, worker.packets - first)
            batch = worker.start(tile, (first, count))
            milliseconds = wait(batch, worker.device)
            film, sums = worker.collect(batch)
            first += count
            self._adapt(milliseconds, count / worker.packets)
            self._account(milliseconds, sums, int(first >= worker.packets))
        self.store.put(int(tile[0]), _cut(film[0], self.store.grid.tile(int(tile[0]))))

    def _account(self, milliseconds: float, sums: npt.NDArray[np.uint64], tiles: int) -> None:
        state = self.state
        state.kernel_ms += milliseconds
        state.rays += int(sums[0])
        state.steps += int(sums[1])
        state.iterations += int(sums[2])
        state.bad_distances += int(sums[3])
        state.tiles_done += tiles
        if self.progress is not None:
            self.progress(state)

    def _adapt(self, milliseconds: float, tiles: float) -> None:
        wanted = tiles * BATCH_SECONDS / max(1e-3 * milliseconds, 1e-6)
        self.size = float(np.clip(wanted, self.smallest, min(self.size * GROWTH, self.worker.capacity)))


def _cut(array: Floats, tile: Tile) -> Floats:
    """The part of a whole tile that lies in the region."""
    left, top = tile.x % TILE, tile.y % TILE
    return array[:, top : top + tile.height, left : left + tile.width]
