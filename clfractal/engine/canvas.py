"""Canvases: pictures that stay on the device, so that they are shown without passing through the host."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device import program
from clfractal.device.compiler import Argument, Warm
from clfractal.device.groups import fitting
from clfractal.device.select import Device
from clfractal.device.source import FlatText, flatten
from clfractal.images.provenance import Provenance, RenderDevice
from clfractal.images.tiled import Bands, Floats
from clfractal.images.tiles import TILE, Region, TileGrid
from clfractal.integrators.plan import PlannedView

CHANNELS = ("R", "G", "B", "A", "Z")
"""What a canvas holds of each pixel, so the channels of jobs that are rendered onto one."""
ROW_GROUP = (16, 1)
PIXEL_GROUP = (32, 8)


def whole_groups(size: tuple[int, int], group: tuple[int, int]) -> tuple[int, int]:
    """The smallest global size of whole work-groups that covers a size."""
    return -(-size[0] // group[0]) * group[0], -(-size[1] // group[1]) * group[1]


@dataclass(frozen=True, slots=True)
class Part:
    """Where a canvas holds one view's picture.

    Attributes:
        offset: its first pixel in the canvas.
        region: the part of the view that is held, in the view's own (perhaps coarse) pixels.
        divider: how many of the picture's pixels, in each direction, one pixel stands for.
    """

    offset: int
    region: Region
    divider: int

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.region.pixels


def program_text() -> FlatText:
    """The whole text of the program."""
    return flatten("images/canvas.cl", defines={"TILE": TILE, "CHANNELS": len(CHANNELS)})


class CanvasKernels:
    """The kernels that write to canvases, on one device.

    Raises:
        DeviceError, KernelBuildError: they cannot be built.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        text = program_text()
        flags = program.math_flags("float32")
        buffers = (Argument("buffer", 4096),) * 4
        whole = Argument("scalar", dtype="int32")
        warm = Warm("place_tiles", (TILE, 1), ROW_GROUP, (*buffers, *(whole,) * 8))
        self._built = program.build(device, text.text, flags=flags, sources=text.sources, warm=[warm])
        self._place, self._enlarge = self._built.kernel("place_tiles"), self._built.kernel("enlarge")

    def place(
        self, canvas: Canvas, number: int, clip: Region, framebuffer: cl.Buffer, places: cl.Buffer, tiles: int
    ) -> None:
        """Copies finished tiles of a view into a canvas, behind the launch that makes them; nobody waits.

        Args:
            clip: the part of the view that was rendered; it may be less than what the canvas holds.
            framebuffer, places: as the launch has them (see `OutputSet`).
            tiles: how many there are.
        """
        part = canvas.parts[number]
        region = part.region
        numbers = (part.offset, region.x, region.y, region.width, clip.x, clip.y, clip.right, clip.bottom)
        self._place.set_args(
            framebuffer, places, canvas.colors, canvas.depths, *(np.int32(each) for each in numbers)
        )
        group = fitting(self.device, self._place, ROW_GROUP)
        cl.enqueue_nd_range_kernel(self.device.queue, self._place, (TILE, tiles), group)

    def enlarge(self, old: Canvas, canvas: Canvas) -> None:
        """Fills a canvas with an older picture of the same views, whatever the sizes of both."""
        for before, part in zip(old.parts, canvas.parts, strict=True):
            was, region = before.region, part.region
            sizes = [np.int32(each) for each in (part.offset, region.width, region.height)]
            self._enlarge.set_args(
                old.colors,
                old.depths,
                *(np.int32(each) for each in (before.offset, was.width, was.height)),
                canvas.colors,
                canvas.depths,
                *sizes,
                np.float32(was.width / region.width),
                np.float32(was.height / region.height),
            )
            size = whole_groups((region.width, region.height), PIXEL_GROUP)
            with self.device.failures("enlarging a picture"):
                group = fitting(self.device, self._enlarge, PIXEL_GROUP)
                cl.enqueue_nd_range_kernel(self.device.queue, self._enlarge, size, group)
        self.device.queue.flush()


class Canvas:
    """The pictures of a job's views on a device; its memory is used again for the next job.

    `stamp` rises whenever its picture gives way to another one.

    Raises:
        DeviceError: status 2, there is no room.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.parts: tuple[Part, ...] = ()
        self.stamp = 0
        self._room = 0
        self.colors: Any = None
        self.depths: Any = None

    def fit(self, views: Sequence[PlannedView]) -> None:
        """Makes room for the views of a job; what is on the canvas is lost."""
        parts, offset = [], 0
        for view in views:
            parts.append(Part(offset, view.plan.region, view.plan.divider))
            offset += view.plan.region.pixels
        if offset > self._room:
            self.colors = self.depths = None
            self._room = 0
            self.colors = self.device.buffer(16 * offset, "a picture on the screen")
            self.depths = self.device.buffer(4 * offset, "a picture on the screen")
            self._room = offset
        self.parts = tuple(parts)

    @property
    def pixels(self) -> int:
        """Pixels of all its pictures."""
        return sum(part.pixels for part in self.parts)

    def read(self, queue: cl.CommandQueue, number: int) -> dict[str, Floats]:
        """A view's channels, each of shape (rows, columns) of its region."""
        part = self.parts[number]
        shape = (part.region.height, part.region.width)
        colors, depths = np.empty((*shape, 4), np.float32), np.empty(shape, np.float32)
        with self.device.failures("reading a picture"):
            cl.enqueue_copy(queue, colors, self.colors, src_offset=16 * part.offset)
            cl.enqueue_copy(queue, depths, self.depths, src_offset=4 * part.offset)
        planes = {name: np.ascontiguousarray(colors[..., index]) for index, name in enumerate("RGBA")}
        return {**planes, "Z": depths}

    def write_colors(self, queue: cl.CommandQueue, number: int, colors: Floats) -> None:
        """Replaces a view's R, G, B, of shape (rows, columns, 3) of its region; coverage stays."""
        part = self.parts[number]
        shape = (part.region.height, part.region.width)
        whole = np.empty((*shape, 4), np.float32)
        with self.device.failures("changing a picture"):
            cl.enqueue_copy(queue, whole, self.colors, src_offset=16 * part.offset)
            whole[..., :3] = colors
            cl.enqueue_copy(queue, self.colors, whole, dst_offset=16 * part.offset)

    def start_reading_depths(self, queue: cl.CommandQueue) -> tuple[list[Floats], cl.Event]:
        """Depths of all views, arrays of shape (rows, columns), which are there when the event is complete."""
        depths = np.empty(self.pixels, np.float32)
        with self.device.failures("reading depths"):
            event = cl.enqueue_copy(queue, depths, self.depths, is_blocking=False)
        parts = [
            depths[part.offset : part.offset + part.pixels].reshape(part.region.height, part.region.width)
            for part in self.parts
        ]
        return parts, event


class CanvasStore:
    """A view's picture on a canvas, as a store for `run`: tiles are on the device already, and only counted here.

    Args:
        view: as it is rendered; perhaps less of it than the canvas holds.
        number: of the canvas's part.
    """

    def __init__(self, canvas: Canvas, view: PlannedView, number: int) -> None:
        self.canvas, self.number = canvas, number
        self.channels = view.plan.channels
        self.display = view.size
        self.region = view.plan.region
        self.grid = TileGrid(self.region)
        self.header: dict[str, Any] = {}
        self.done = np.zeros(self.grid.count, np.bool_)
        """For each tile, whether it is finished."""
        self.provenance = Provenance(0)  # one device draws on a canvas

    def put_tiles(
        self, indices: npt.NDArray[np.int32], framebuffer: Floats, render_device: RenderDevice | None = None
    ) -> None:
        """Counts finished tiles; `framebuffer` holds none of them."""
        self.done[indices] = True

    def tell(self, key: str, value: Any) -> None:
        """Adds an entry to the header."""
        self.header[key] = value

    def bands(self) -> Bands:
        """The whole picture as one band, read from the device."""
        yield self.region.y, self.canvas.read(self.canvas.device.transfers, self.number)
