"""Launching batches of tiles: what all renderers have in common.

A renderer's kernel takes, in this order: the film, statistics, the tiles' corners, its own constants, the number of
channels, and the first packet of each tile to render.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device import program
from clfractal.device.compiler import Argument, Warm
from clfractal.device.select import Device
from clfractal.device.source import FlatText
from clfractal.files.channels import CHANNELS
from clfractal.pictures.tiles import TILE, TileGrid
from clfractal.renderers.plan import Plan
from clfractal.scene.model import Scene

TILE_PIXELS = TILE * TILE
# Work-items of a group: enough for a GPU's wave, and one part of a tile for a CPU thread.
GROUP_PIXELS = {1: 64, 4: 256, 8: 256, 16: 256}

Floats = npt.NDArray[np.float32]
T = TypeVar("T")
KernelArgument: TypeAlias = npt.NDArray[Any] | cl.Buffer


def tile_defines(plan: Plan) -> dict[str, object]:
    """What the text of every renderer of tiles depends on."""
    names = {"CHANNEL_" + name.replace(".", "").upper(): place for place, name in enumerate(CHANNELS)}
    return {
        "LANES": plan.lanes,
        "REAL_IS_DOUBLE": int(plan.precision == "float64"),
        "TILE": TILE,
        **names,
    }


def channel_slots(plan: Plan) -> npt.NDArray[np.int32]:
    """For each channel its place among the wanted ones, or -1."""
    slots = [plan.channels.index(name) if name in plan.channels else -1 for name in CHANNELS]
    return np.array(slots, np.int32)


class Shared:
    """What several renders of one picture have in common: the grid that both eyes see, say. It lives as long as they."""

    def __init__(self) -> None:
        self._kept: dict[str, Any] = {}

    def once(self, key: str, make: Callable[[], T]) -> T:
        """What was made for this key, or is made now."""
        if key not in self._kept:
            self._kept[key] = make()
        found: T = self._kept[key]
        return found


@dataclass(frozen=True, slots=True)
class Batch:
    """Tiles on their way: their indices, the part of each tile's packets, and the event that ends them."""

    tiles: npt.NDArray[np.int32]
    packets: tuple[int, int]
    event: cl.Event
    slot: int


class TileWorker(ABC):
    """Renders tiles of one scene on one device. Two batches may be under way at a time."""

    kernel_name: ClassVar[str]

    def __init__(
        self,
        scene: Scene,
        plan: Plan,
        device: Device,
        *,
        capacity: int,
        on_compile: Callable[[str], None] | None = None,
        shared: Shared | None = None,
    ) -> None:
        """`capacity` is the most tiles of a batch; `on_compile` is told a line if the program is compiled first;
        `shared` has what other renders of the same picture made.

        Raises:
            DeviceError: too little memory (status 2), or the device failed.
            KernelBuildError: the program does not compile.
        """
        self.scene, self.plan, self.device = scene, plan, device
        self.on_compile = on_compile
        self.shared = shared if shared is not None else Shared()
        self.packets = TILE_PIXELS // plan.lanes
        self.group = max(GROUP_PIXELS[plan.lanes] // plan.lanes, 1)
        self.capacity = capacity
        records = self.records()
        film_bytes = capacity * len(plan.channels) * TILE_PIXELS * 4
        statistic_bytes = capacity * self.packets * 16
        constant_bytes = [_size(record) for record in records]
        device.check_memory(
            2 * (film_bytes + statistic_bytes) + sum(constant_bytes),
            "rendering",
            largest=max(film_bytes, *constant_bytes),
        )
        text = self.text()
        self.program = program.build(
            device,
            text.text,
            flags=program.math_flags(plan.precision),
            sources=text.sources,
            warm=self._warm(records),
            on_compile=on_compile,
        )
        self.films = [device.buffer(film_bytes, "the film") for _ in range(2)]
        self.statistics = [device.buffer(statistic_bytes, "statistics") for _ in range(2)]
        self.corners = [device.buffer(capacity * 8, "tile corners", read_only=True) for _ in range(2)]
        self.constants = [self._upload(record) for record in records]
        self.kernels = [self._kernel(slot) for slot in range(2)]
        # Transfers have a queue of their own: in the kernels' queue they would wait for the batch before or after.
        with device.failures("opening a queue"):
            self.transfers = cl.CommandQueue(device.context)

    @abstractmethod
    def text(self) -> FlatText:
        """The whole text of the scene's program."""

    @abstractmethod
    def records(self) -> list[KernelArgument]:
        """The kernel's own arguments, in its order: constants, or buffers that are on the device already."""

    def start(
        self, tiles: npt.NDArray[np.int32], packets: tuple[int, int] | None = None, *, slot: int = 0
    ) -> Batch:
        """Enqueues tiles (indices in the plan's grid); `packets` (first, count) renders a part of each."""
        first, count = packets or (0, self.packets)
        grid = self._grid
        columns, rows = tiles % grid.columns, tiles // grid.columns
        corners = (
            np.stack([grid.first_column + columns, grid.first_row + rows], axis=1).astype(np.int32) * TILE
        )
        with self.device.failures("rendering"):
            queue = self.device.queue
            cl.enqueue_copy(self.transfers, self.corners[slot], np.ascontiguousarray(corners))
            self.kernels[slot].set_arg(len(self.constants) + 4, np.int32(first))
            event = cl.enqueue_nd_range_kernel(
                queue, self.kernels[slot], (count, len(tiles)), (self.group, 1)
            )
            queue.flush()
        return Batch(tiles, (first, count), event, slot)

    def collect(self, batch: Batch) -> tuple[Floats, npt.NDArray[np.uint64]]:
        """Channels of a finished batch, shape (tiles, channels, TILE, TILE), and its sums of the statistics."""
        shape = (len(batch.tiles), len(self.plan.channels), TILE, TILE)
        film = np.empty(shape, np.float32)
        statistics = np.empty((len(batch.tiles), self.packets, 4), np.uint32)
        with self.device.failures("reading the film"):
            cl.enqueue_copy(self.transfers, statistics, self.statistics[batch.slot])
            cl.enqueue_copy(self.transfers, film, self.films[batch.slot])
        first, count = batch.packets
        used = statistics[:, first : first + count].astype(np.uint64)
        return film, used.sum(axis=(0, 1), dtype=np.uint64)

    @property
    def _grid(self) -> TileGrid:
        return TileGrid(self.plan.region)

    def _upload(self, record: KernelArgument) -> cl.Buffer:
        if isinstance(record, cl.Buffer):
            return record
        data = np.ascontiguousarray(record).reshape(-1)
        buffer = self.device.buffer(max(data.nbytes, 16), "constants", read_only=True)
        with self.device.failures("uploading constants"):
            cl.enqueue_copy(self.device.queue, buffer, data.view(np.uint8))
        return buffer

    def _kernel(self, slot: int) -> cl.Kernel:
        kernel = self.program.kernel(self.kernel_name)
        buffers = [self.films[slot], self.statistics[slot], self.corners[slot], *self.constants]
        with self.device.failures("setting arguments"):
            for index, buffer in enumerate(buffers):
                kernel.set_arg(index, buffer)
            kernel.set_arg(len(buffers), np.int32(len(self.plan.channels)))
            kernel.set_arg(len(buffers) + 1, np.int32(0))
        return kernel

    def _warm(self, records: list[KernelArgument]) -> Warm:
        """A first launch that renders nothing: with a view of zeros the region is empty."""
        sizes = [TILE_PIXELS * 4 * len(self.plan.channels), self.packets * 16, 8]
        # Of a large environment map a part is enough.
        sizes += [min(max(_size(record), 16), 65_536) for record in records]
        arguments = [Argument("buffer", size) for size in sizes]
        arguments += [Argument("scalar", dtype="int32", value=0.0)] * 2
        return Warm(self.kernel_name, (self.packets, 1), (self.group, 1), tuple(arguments))


def _size(argument: KernelArgument) -> int:
    return int(argument.size if isinstance(argument, cl.Buffer) else argument.nbytes)
