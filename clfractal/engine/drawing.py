"""One view on one device: its programs, their data, and its launches. Data stay while they do not change."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device import children, program
from clfractal.device.compiler import Argument, Warm
from clfractal.device.kernels import Lease
from clfractal.device.launch import Pace
from clfractal.device.select import Device, is_simulator
from clfractal.device.threads import ending_together
from clfractal.device.watched import Watched, is_watched
from clfractal.engine.observer import Observer
from clfractal.engine.stages import CAPACITY, Span, Wave, group_of, number_count, wave_of
from clfractal.images.tiles import TILE, TileGrid
from clfractal.integrators.kept import Resources
from clfractal.integrators.kernel import (
    BLOCK,
    LANE_SHARE,
    STAGE_NUMBERS,
    STATE_PADDING,
    KernelArgument,
    ProgramText,
    Stage,
    TileKernel,
)
from clfractal.integrators.passes import STATISTICS, kept_numbers
from clfractal.integrators.plan import PlannedView
from clfractal.integrators.waves import rays_of_item
from clfractal.shading.cryptomatte import told

TILE_PIXELS = TILE * TILE
# Work-items of a group: enough for a GPU's wave, and one part of a tile for a CPU thread.
GROUP_PIXELS = {1: 64, 4: 256, 8: 256, 16: 256}
SLOTS = 3
"""Sets of buffers for results: two launches are under way, and one is being read."""
_ALIGNMENT = 4096

Outlet = Callable[[cl.Buffer, cl.Buffer, int], None]
"""Takes finished tiles on the device by a kernel in its queue: of the framebuffer, at these places, so many."""
Floats = npt.NDArray[np.float32]
Counts = npt.NDArray[np.uint64]


@dataclass(frozen=True, slots=True)
class OutputSet:
    """Where one launch leaves its results: `results` as a whole, of which `statistics` are the head and `framebuffer`
    the rest.
    """

    results: cl.Buffer
    statistics: cl.Buffer
    framebuffer: cl.Buffer
    places: cl.Buffer


class OutputBuffers:
    """Buffers for the results of launches: several sets, so that the device does not wait while the host reads one."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.sizes = (0, 0, 0)
        self.sets: list[OutputSet] = []
        self.wave: list[cl.Buffer] = []
        self._wave_sizes: list[int] = []

    def fit_wave(self, sizes: list[int]) -> None:
        """Makes sure that what a wave keeps, in buffers of so many bytes, has room; launches come one after the other."""
        before = self._wave_sizes or [0] * len(sizes)
        wanted = [max(pair) for pair in zip(before, sizes, strict=True)] if sizes else before
        if wanted != self._wave_sizes:
            self.wave, self._wave_sizes = [], []
            self.wave = [self.device.buffer(size, "pixels between stages") for size in wanted]
            if is_simulator(self.device.info):
                # Lanes without a ray compute with what happens to be in the queue, and a checker of memory minds it.
                for buffer, size in zip(self.wave[1:], wanted[1:], strict=True):
                    cl.enqueue_copy(self.device.queue, buffer, np.zeros(size, np.uint8))
            self._wave_sizes = wanted

    def fit(self, framebuffer: int, statistics: int, places: int) -> None:
        """Makes sure that each set has room for so many bytes."""
        if all(
            have >= want for have, want in zip(self.sizes, (framebuffer, statistics, places), strict=True)
        ):
            return
        # Parts of a buffer begin at multiples of what any device asks for.
        wide = -(-max(self.sizes[1], statistics) // _ALIGNMENT) * _ALIGNMENT
        self.sizes = (max(self.sizes[0], framebuffer), wide, max(self.sizes[2], places))
        self.sets = []
        for _ in range(SLOTS):
            results = self.device.buffer(wide + self.sizes[0], "the framebuffer")
            with self.device.failures("allocating the framebuffer"):
                statistics_part = results.get_sub_region(0, wide)
                framebuffer_part = results.get_sub_region(wide, self.sizes[0])
            places_buffer = self.device.buffer(self.sizes[2], "tiles' places")
            self.sets.append(OutputSet(results, statistics_part, framebuffer_part, places_buffer))


@dataclass(frozen=True, slots=True)
class Wanted:
    """A program that a view may need: its text, the compiler's flags, and its first launches."""

    text: ProgramText
    flags: tuple[str, ...]
    warm: tuple[Warm, ...]


class Drawing:
    """A view's program and arguments on a device, ready to be launched."""

    def __init__(self, device: Device, outputs: OutputBuffers) -> None:
        self.device, self.outputs = device, outputs
        self.view: PlannedView | None = None
        self.packets = self.group = self.capacity = 0
        self.kernels = 1  # of a sample
        self.wave = Wave(0, 0, [])
        self.build_ms = 0.0
        self.pace = Pace(1.0)
        self.observer: Observer | None = None
        self._kernels: Lease | None = None
        self._kernel: TileKernel | None = None
        self._stages: dict[tuple[int, int], list[Stage]] = {}
        self._programs: list[program.Program] = []
        self._texts: list[ProgramText] = []
        self._flags: tuple[str, ...] = ()
        self._buffers: list[cl.Buffer] = []
        self._given: list[KernelArgument] = []
        self._watched: dict[int, Watched] = {}
        self._places: dict[int, cl.Event] = {}
        self._sending: list[cl.Event] = []
        self._kept: cl.Buffer | None = None
        self._kept_count = self._kept_width = 0

    def update(self, view: PlannedView, resources: Resources, *, tiles: int) -> None:
        """Takes a view, of which at most `tiles` tiles are rendered at a time.

        Only data that differ from the view before are sent; a program is built only if its text has changed. After an
        exception the drawing must not be used again: some of its buffers may hold the new view's data.

        Raises:
            DeviceError: too little memory (status 2), or the device failed.
            KernelBuildError: the program does not compile.
            Stopped: cancelled while a program was built or a grid was filled.
            NotReady: something of that would have to be made first, and is not waited for.
        """
        plan, built_before = view.plan, self.device.loaded.building.milliseconds
        kernel = _kernel_of(view.scene.renderer.type)(view, resources)
        arguments = kernel.arguments()
        self._divide(kernel, tiles)
        framebuffer = self.capacity * len(plan.channels) * TILE_PIXELS * 4
        statistics = self.capacity * self.packets * 4 * len(STATISTICS)
        sizes = [_size(argument) for argument in arguments]
        self.device.check_memory(
            SLOTS * (framebuffer + statistics) + sum(sizes) + sum(self.wave.sizes),
            "rendering",
            largest=max(framebuffer, *sizes, *self.wave.sizes),
        )
        built = self._built(kernel, sizes, resources)
        self.build_ms = self.device.loaded.building.milliseconds - built_before
        other = [each.cl_program for each in built] != [each.cl_program for each in self._programs]
        if other or self.view is None or view.scene.formula.iterations > self.view.scene.formula.iterations:
            # One sample of a tile for each core, because the speed is not known yet.
            self.pace = Pace(float(max(self.device.info.compute_units, 1) * self.packets))
        self._programs, self.view = built, view
        self.outputs.fit(framebuffer, statistics, self.capacity * 16)
        self.outputs.fit_wave(self.wave.sizes)
        self._upload(arguments)
        self._kept_count = len(kept_numbers(plan, view.scene.renderer))
        self._kept_width = np.dtype(kernel.precision).itemsize
        if other or self._kernels is None:
            named = [(made, text.kernels) for text, made in zip(self._texts, built, strict=True)]
            self._kernels = Lease(self.device, named, 2 + number_count(kernel))
        self._kernel, self._stages = kernel, {}
        self.kernels = sum(1 for _ in kernel.stages((0, 1)))
        if self.observer is not None:
            self.observer.sees(kernel)

    def wanted(self, view: PlannedView, resources: Resources) -> list[Wanted]:
        """The programs of all stages that pictures of the view's formula may have; nothing is built. Not for volumes."""
        kernel = _kernel_of(view.scene.renderer.type)(view, resources)
        self._divide(kernel, 1)
        # A map may take seconds to make, and is no part of a program.
        plain = replace(view, scene=view.scene.model_copy(update={"environment": None}))
        sizes = [_size(each) for each in _kernel_of(view.scene.renderer.type)(plain, resources).arguments()]
        flags = program.math_flags(view.plan.precision)
        return [
            Wanted(text, flags, tuple(self._warm(kernel, name, sizes) for name in text.kernels))
            for text in kernel.possible_texts()
        ]

    @property
    def watched(self) -> list[Watched]:
        """Arguments that can make running launches end early, if the device allows it."""
        return list(self._watched.values())

    def keep(self, tiles: int) -> None:
        """Makes room for the data of so many tiles that one pass keeps for the next.

        Raises:
            DeviceError: status 2, with the memory needed and available, if it does not fit.
        """
        needed = self.kept_bytes(tiles)
        if self._kept is None or self._kept.size < needed:
            self._kept = None
            self._kept = self.device.buffer(needed, "unfinished pixels")

    def kept_bytes(self, tiles: int) -> int:
        """Memory that so many tiles need between passes."""
        return tiles * self._kept_count * TILE_PIXELS * self._kept_width

    @property
    def keeps(self) -> bool:
        """Whether it has data kept between passes."""
        return self._kept is not None

    def forget(self) -> None:
        """Frees the data kept between passes."""
        self._kept = None

    def start(self, span: Span) -> tuple[cl.Event, cl.Event]:
        """Enqueues a launch: its first kernel's event, and its last one's; its results are there when that is complete."""
        kernel, kernels = self._kernel, self._kernels
        assert kernel is not None
        assert kernels is not None
        if span.samples not in self._stages:
            self._stages[span.samples] = list(kernel.stages(span.samples))
        most = max(self.wave.packets // self.packets, 1)
        grid = TileGrid(kernel.plan.region)
        places = np.zeros((len(span.tiles), 4), np.int32)
        places[:, 0] = (grid.first_column + span.tiles % grid.columns) * TILE
        places[:, 1] = (grid.first_row + span.tiles // grid.columns) * TILE
        places[:, 2] = span.kept_places
        with self.device.failures("rendering"):
            # In the kernels' own queue, and nobody waits: while every core is at work PoCL lets a write wait for the
            # launch before. The event holds the array, and waits for the write when it is dropped: so it is kept.
            own = self.outputs.sets[span.slot]
            self._places[span.slot] = cl.enqueue_copy(
                self.device.queue, own.places, places, is_blocking=False
            )
            kept = self._kept if self._kept is not None else own.places  # a stand-in: nobody reads it
            buffers = [own.framebuffer, kept, own.statistics, own.places, *self._buffers[:-1]]
            buffers += [*self.outputs.wave[: len(self.wave.sizes)], self._buffers[-1]]
            arguments = [*buffers, len(kernel.plan.channels), self._kept_count]
            events = [
                self._enqueue(
                    kernel, kernels, stage, span, range(first, min(first + most, len(span.tiles))), arguments
                )
                for first in range(0, len(span.tiles), most)
                for stage in self._stages[span.samples]
            ]
            self.device.queue.flush()
        return events[0], events[-1]

    def hand_over(self, span: Span, outlet: Outlet) -> None:
        """Lets an outlet take the tiles of a launch that has ended, before the launch's buffers are used again."""
        own = self.outputs.sets[span.slot]
        with self.device.failures("showing tiles"):
            outlet(own.framebuffer, own.places, len(span.tiles))

    def collect(self, span: Span) -> tuple[Floats, Counts]:
        """Channels of finished tiles, shape (tiles, channels, TILE, TILE), and the sums of STATISTICS."""
        assert self.view is not None
        shape = (len(span.tiles), len(self.view.plan.channels), TILE, TILE)
        head, counts = self.outputs.sizes[1], len(span.tiles) * self.packets * len(STATISTICS)
        found = np.empty(head + 4 * int(np.prod(shape)), np.uint8)
        with self.device.failures("reading the framebuffer"):
            cl.enqueue_copy(self.device.transfers, found, self.outputs.sets[span.slot].results)
        # By tiles first: numbers in few long rows are summed eight times as fast as in many short ones.
        rows = found[: 4 * counts].view(np.uint32).reshape(len(span.tiles), -1)
        sums = rows.sum(axis=0, dtype=np.uint64).reshape(-1, len(STATISTICS)).sum(axis=0)
        framebuffer = told(
            found[head:].view(np.float32).reshape(shape), self.view.plan.channels, self.view.scene
        )
        return framebuffer, sums

    def _enqueue(
        self,
        of: TileKernel,
        kernels: Lease,
        stage: Stage,
        span: Span,
        tiles: range,
        arguments: Sequence[Any],
    ) -> cl.Event:
        """Enqueues the kernel of a stage for some of a launch's tiles, one wave of them.

        Args:
            arguments: of every kernel, up to the numbers of the launch.
        """
        lanes, (first, end) = of.plan.lanes, span.packets
        kernel = kernels.kernel(stage.kernel)
        group = kernels.group(stage.kernel, group_of(stage.over, lanes, self.group))
        numbers = [first, end, *span.samples, span.mode]
        size: tuple[int, ...] = (-(-(end - first) // self.group) * self.group, len(tiles))
        if of.waves:
            sent_by = wave = (end - first) * len(tiles) * lanes
            if stage.of == "blocks":
                packets = BLOCK * BLOCK // lanes
                sent_by = ((end - 1) // packets - first // packets + 1) * len(tiles)
            rays = sent_by * stage.turns
            share = rays_of_item(lanes, rays, self.device.info.compute_units)
            numbers += [tiles.start, sent_by, wave * self.wave.turns + STATE_PADDING, stage.turns, share]
            numbers += [stage.numbers.get(name, 0) for name in STAGE_NUMBERS]
            if stage.over == "shares of pixels" and lanes > 1:
                size = (-(-(end - first) * lanes // LANE_SHARE), len(tiles))
            elif stage.over.endswith("rays"):
                of_item = {
                    "rays": share,
                    "packets of rays": lanes,
                    "shares of rays": LANE_SHARE if lanes > 1 else 1,
                }
                each = group[0] * of_item[stage.over]
                size = (-(-rays // each) * group[0],)
        kernel.set_args(*arguments, *numbers)
        event = cl.enqueue_nd_range_kernel(self.device.queue, kernel, size, group)
        if self.observer is not None:
            self.observer.launched(stage, event)
        return event

    def _divide(self, kernel: TileKernel, tiles: int) -> None:
        """Into packets, groups and waves."""
        self.packets = TILE_PIXELS // kernel.plan.lanes
        self.group = max(GROUP_PIXELS[kernel.plan.lanes] // kernel.plan.lanes, 1)
        self.capacity = max(1, min(CAPACITY, tiles))
        self.wave = wave_of(kernel, self.device, self.capacity)

    def _built(self, kernel: TileKernel, sizes: list[int], resources: Resources) -> list[program.Program]:
        """The kernel's programs: those before, if their texts are the same."""
        # A volume's rays may be float32 whatever its grid was filled with: then the texts are the same, and the flags not.
        texts, flags = kernel.texts(), program.math_flags(kernel.plan.precision)
        if self._programs and texts == self._texts and flags == self._flags:
            return self._programs

        warm = [[self._warm(kernel, name, sizes) for name in text.kernels] for text in texts]
        loaded = [
            program.loaded(self.device, text.flat.text, flags=flags, warm=launches)
            for text, launches in zip(texts, warm, strict=True)
        ]
        found = [each for each in loaded if each is not None]
        if len(found) == len(texts):
            self._texts, self._flags = texts, flags
            return found

        def build(text: ProgramText, launches: list[Warm]) -> program.Program:
            return program.build(
                self.device,
                text.flat.text,
                flags=flags,
                sources=text.flat.sources,
                warm=launches,
                on_compile=resources.on_compile,
                stopped=lambda: ended() or (resources.token is not None and resources.token()),
                waits=resources.waits,
                what=text.name,
            )

        # Side by side: each is compiled by a process of its own. What ends one, or this thread, ends all. Those begin first
        # that take longest, which are the longest texts, since a compiler that is left with one at the end is waited for.
        # One thread more than compilers, so that none waits while what it has made is loaded.
        with ending_together(min(len(texts), children.processors() + 1)) as (pool, ended):
            # Oclgrind's checks of memory are lost with the thread that they began in.
            if is_simulator(self.device.info):
                built = list(map(build, texts, warm))
            else:
                jobs = sorted(zip(texts, warm, strict=True), key=lambda job: -len(job[0].flat.text))
                under_way = {job[0].name: pool.submit(build, *job) for job in jobs}
                built = [under_way[text.name].result() for text in texts]
        self._texts, self._flags = texts, flags
        return built

    def _upload(self, arguments: list[KernelArgument]) -> None:
        """Brings arguments to the device that differ from those of the view before."""
        given = [each if isinstance(each, cl.Buffer) else np.ascontiguousarray(each) for each in arguments]
        self._sending.clear()  # of the view before, whose launches have ended
        buffers = []
        for index, argument in enumerate(given):
            if isinstance(argument, cl.Buffer):
                buffers.append(argument)
                continue
            before = self._given[index] if index < len(self._given) else None
            if before is not argument and not _same(before, argument):
                reusable = isinstance(before, np.ndarray) and before.nbytes == argument.nbytes
                buffers.append(self._sent(index, argument, self._buffers[index] if reusable else None))
            else:
                buffers.append(self._buffers[index])
        self._buffers, self._given = buffers, given
        self._watched = {index: each for index, each in self._watched.items() if index < len(given)}

    def _sent(self, index: int, data: npt.NDArray[Any], buffer: cl.Buffer | None) -> cl.Buffer:
        """A buffer, perhaps one that is there, with the bytes of an argument."""
        self._watched.pop(index, None)
        if is_watched(data):
            self._watched[index] = Watched(self.device, data)
            return self._watched[index].buffer
        if buffer is None:
            buffer = self.device.buffer(max(data.nbytes, 16), "constants", read_only=True)
        with self.device.failures("uploading constants"):
            # Before all launches to come, and nobody waits: see `start`.
            bytes_of = data.reshape(-1).view(np.uint8)
            self._sending.append(cl.enqueue_copy(self.device.queue, buffer, bytes_of, is_blocking=False))
        return buffer

    def _warm(self, kernel: TileKernel, name: str, sizes: list[int]) -> Warm:
        """A first launch that renders nothing: it ends before its first packet."""
        channels, lanes = len(kernel.plan.channels), kernel.plan.lanes
        outputs = [TILE_PIXELS * 4 * channels, 16, self.packets * 4 * len(STATISTICS), 16]
        # A part of a large environment map is enough.
        constants = [min(max(size, 16), 65_536) for size in sizes]
        waves = [16] * len(self.wave.sizes)
        buffers = [*outputs, *constants[:-1], *waves, constants[-1]]
        arguments = [Argument("buffer", size) for size in buffers]
        numbers = 2 + number_count(kernel)
        arguments += [Argument("scalar", dtype="int32", value=0.0)] * numbers
        over = kernel.over(name)
        group = group_of(over, lanes, self.group)
        size = (self.packets, 1) if over.endswith("pixels") else group
        return Warm(name, size, group, tuple(arguments))


def _kernel_of(renderer: str) -> type[TileKernel]:
    """The kernel of a kind of renderer. Each is imported when it is needed: volumes bring all of `voxels` along."""
    kernel: type[TileKernel] = import_module(f"clfractal.integrators.{renderer}").KERNEL
    return kernel


def _size(argument: KernelArgument) -> int:
    return int(argument.size if isinstance(argument, cl.Buffer) else argument.nbytes)


def _same(before: KernelArgument | None, now: npt.NDArray[Any]) -> bool:
    """Whether two arrays have the same bytes; records are compared whole, not field by field."""
    return (
        isinstance(before, np.ndarray) and before.nbytes == now.nbytes and before.tobytes() == now.tobytes()
    )
