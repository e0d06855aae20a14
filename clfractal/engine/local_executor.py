"""The executor of this process: one device, launches sized to a time budget."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from contextlib import closing
from functools import partial as partial_of

import numpy as np
import pyopencl as cl

from clfractal.device.cancel import CancelToken
from clfractal.device.launch import BUDGET_SECONDS, IN_FLIGHT, Part, in_launches
from clfractal.device.select import Device, shown_size
from clfractal.engine.drawing import SLOTS, TILE_PIXELS, Drawing, OutputBuffers
from clfractal.engine.job import Job
from clfractal.engine.observer import Observer
from clfractal.engine.run import NO_PIXELS, NO_TILES, Counters, Result, Tiles, WorkItem
from clfractal.engine.stages import Span
from clfractal.errors import STATUS_BAD_INPUT, DeviceError
from clfractal.images.tiles import TileGrid
from clfractal.integrators.kept import Kept, Resources
from clfractal.integrators.passes import PASS_ADD, PASS_KEEP, STATISTICS
from clfractal.integrators.plan import PlannedView

ViewOutlet = Callable[[int, cl.Buffer, cl.Buffer, int], None]
"""An `Outlet` for several views: the view's number, then as there."""
Supply = Callable[[int], Tiles]
"""Gives the tiles of a launch, at most so many; none if there are no more."""

# Device memory for what samples of scenes of their own keep for the next one, unless a picture is made in passes.
_KEPT_BETWEEN_SAMPLES = 256 << 20
# Into so many parts the tiles of such a picture are cut, where several devices share them.
_SHARES = 32
# A GPU hides the time that a ray waits for memory behind other rays, and is idle while the longest of them end: so many
# pixels for each of its units make both short. (Of an H200's 132 units a quarter as many take 1.5 to 1.9 times as long, and
# a sixteenth 3.6 to 5.3 times.)
_PIXELS_OF_UNIT = 8192
# On a processor a launch costs as much as what a kernel does for some hundreds of pixels, and a sample along paths is
# dozens of stages: so many pixels for each hide that, and what they keep between stages is still in the caches.
_PIXELS_OF_STAGE = 16_384
# A sample of many bounces is hundreds of kernels, of which most have little left to do, and a launch takes a tenth of a
# millisecond for each, whatever its size. If launches of more than so many had no more time than others, that would be
# all of it, and each would be smaller than the one before, down to single packets. So they have more, and so many pixels.
_FEW_KERNELS = 100
_SECONDS_OF_KERNEL = 3e-4
_PIXELS_OF_KERNEL = 32
# Device memory for passes that the user is told of before it is taken.
_WORTH_TELLING = 1 << 28


class LocalExecutor:
    """Executes work items on one device. Context, programs, buffers, grids and maps stay from one job to the next.

    Args:
        device: where.
        budget_seconds: limit of the work that is queued on the device: cancelled work ends after about this time.
        tell: called with a message if a program has to be compiled first, or if something does not fit.

    `outlet`, if it is set, takes the tiles on the device (see `Outlet`); results then have no framebuffers and no
    statistics. `supply`, if it is set, gives each launch its tiles; an item then only tells which ones it may give.
    `waits` is whether programs are built and grids filled that are not there yet; else there is `NotReady`. `observer`, if
    it is set, sums what each stage takes, and lanes that wait in orbits are counted.
    """

    def __init__(
        self,
        device: Device,
        *,
        budget_seconds: float = BUDGET_SECONDS,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        self.device = device
        self.budget_seconds = budget_seconds
        self.tell = tell
        self.kept = Kept()
        self.outlet: ViewOutlet | None = None
        self.supply: Supply | None = None
        self.waits = True
        self.observer: Observer | None = None
        self._outputs = OutputBuffers(device)
        self._drawings: dict[int, Drawing] = {}

    def execute(
        self, job: Job, items: Iterable[WorkItem], token: CancelToken | None = None
    ) -> Generator[Result]:
        """See `Executor`. Tiles of a view come in the order in which they are wanted."""
        if self.waits:  # else it may come to nothing, and what the picture before needs has to stay
            self.kept.begin_picture()
        for item in items:
            if len(item.tiles):
                view = job.views[item.view]
                take = self.supply or _in_order(item.tiles)
                if view.changing:
                    yield from self._by_samples(view, item, take, token)
                else:
                    in_passes = item.samples != (0, view.plan.samples)
                    places = _all_places(view) if in_passes else None
                    yield from self._drawn(view, item, take, token, places)
        for number in [number for number in self._drawings if number >= len(job.views)]:
            del self._drawings[number]

    def keeps(self, views: int) -> bool:
        """Whether the data kept between passes of so many views are there."""
        return all(number in self._drawings and self._drawings[number].keeps for number in range(views))

    def check_room(self, job: Job, token: CancelToken | None = None) -> None:
        """Makes sure that a job can be rendered in passes, and tells what a large one needs.

        Raises:
            DeviceError: status 2, with the memory needed and available, if the data kept between passes do not fit.
            Stopped: the token was set while a program was built or a grid was filled.
        """
        needs = [
            self._drawing(number, view, 1, token).kept_bytes(TileGrid(view.plan.region).count)
            for number, view in enumerate(job.views)
        ]
        self.device.check_memory(sum(needs), "a picture in passes", largest=max(needs))
        if self.tell is not None and sum(needs) >= _WORTH_TELLING:
            self.tell(f"a picture in passes needs {shown_size(sum(needs))} of device memory")

    def make_ready(self, job: Job, token: CancelToken | None = None) -> None:
        """Builds the programs of a job and fills its grids, which stay in `kept`; nothing is rendered.

        Raises:
            DeviceError, KernelBuildError: as of a render.
            Stopped: the token was set.
        """
        for number, view in enumerate(job.views):
            self._drawing(number, view, 1, token)

    def forget(self) -> None:
        """Frees the data kept between the passes of a picture."""
        for drawing in self._drawings.values():
            drawing.forget()

    def close(self) -> None:
        """Frees all memory; the executor can be used again."""
        self._drawings.clear()
        self._outputs = OutputBuffers(self.device)
        self.kept = Kept()

    def _by_samples(
        self, view: PlannedView, item: WorkItem, take: Supply, token: CancelToken | None
    ) -> Generator[Result]:
        """Renders tiles of a view that has a scene of its own for each sample: one sample of some tiles after the other."""
        in_passes = item.samples != (0, view.plan.samples)
        some = len(item.tiles)
        if not in_passes:  # what a sample leaves for the next one is kept only while these tiles are made
            each = self._drawing(item.view, view.at_sample(item.samples[0]), 1, token).kept_bytes(1)
            some = max(_KEPT_BETWEEN_SAMPLES // each, 1)
        if self.supply is not None:  # others want some, too
            some = min(some, max(len(item.tiles) // _SHARES, 1))
        while len(tiles := take(some)):
            places = _all_places(view) if in_passes else _places_of(tiles)
            for sample in range(*item.samples):
                part = WorkItem(item.view, tiles, (sample, sample + 1))
                last = part.samples[1] == item.samples[1]
                shown = view.at_sample(sample)
                yield from self._drawn(shown, part, _in_order(tiles), token, places, last=last)

    def _drawn(
        self,
        view: PlannedView,
        item: WorkItem,
        take: Supply,
        token: CancelToken | None,
        places: Tiles | None,
        *,
        last: bool = True,
    ) -> Generator[Result]:
        """Launches an item's tiles and gives them as they are finished.

        Args:
            places: by tiles' numbers, where they keep what one pass leaves for the next.
            last: else more of the item is to come, and only counts are given.
        """
        drawing = self._drawing(item.view, view, len(item.tiles), token)
        if places is not None:
            drawing.keep(int(places.max()) + 1)
        outlet = partial_of(self.outlet, item.view) if self.outlet is not None else None
        # Of what devices share each takes only what its launches under way hold.
        staged = bool(drawing.wave.sizes)
        group = pixels_at_a_time(self.device, staged=staged) // TILE_PIXELS if self.supply is None else 0
        cutter = _Cutter(drawing, item, take, places, group)
        pace = drawing.pace
        many = max(drawing.kernels - _FEW_KERNELS, 0)
        pace.seconds = max(self.budget_seconds / IN_FLIGHT, many * _SECONDS_OF_KERNEL)
        pace.most = float(drawing.capacity * cutter.per_tile)
        pace.least = max(1.0, min(float(many * _PIXELS_OF_KERNEL // view.plan.lanes), pace.most))
        pace.begin()
        counters = Counters(build_ms=drawing.build_ms)
        launches = in_launches(
            self.device, cutter.enqueue, pace, doing="rendering", token=token, watched=drawing.watched
        )
        with closing(launches):
            for span, milliseconds in launches:
                counters.kernel_ms += milliseconds
                if span.packets[1] < drawing.packets or span.samples[1] < item.samples[1]:
                    # Only a part of a tile is done: there is nothing to read yet.
                    yield Result(item.view, NO_TILES, NO_PIXELS, counters)
                elif outlet is not None and last:
                    # Only now: a launch that was cancelled has left unfinished tiles.
                    drawing.hand_over(span, outlet)
                    yield Result(item.view, span.tiles, NO_PIXELS, counters)
                else:
                    framebuffer, sums = drawing.collect(span)
                    for name, count in zip(STATISTICS, sums, strict=True):
                        setattr(counters, name, int(count))
                    done = (span.tiles, framebuffer) if last else (NO_TILES, NO_PIXELS)
                    yield Result(item.view, *done, counters)
                counters = Counters()

    def _drawing(self, number: int, view: PlannedView, tiles: int, token: CancelToken | None) -> Drawing:
        # Put back only when it is complete: one whose update failed is half of each view.
        drawing = self._drawings.pop(number, None) or Drawing(self.device, self._outputs)
        drawing.observer = self.observer
        resources = Resources(
            self.device, self.kept, self.tell, token, self.waits, counts_waits=self.observer is not None
        )
        drawing.update(view, resources, tiles=tiles)
        self._drawings[number] = drawing
        return drawing


def pixels_at_a_time(device: Device, *, staged: bool) -> int:
    """How many pixels a launch should have at least, even if it can have only one sample of each; 0: it does not matter.

    Args:
        staged: whether its samples go from stage to stage, so that each is several kernels.
    """
    if device.info.kind == "gpu":
        return _PIXELS_OF_UNIT * device.info.compute_units
    return _PIXELS_OF_STAGE if staged else 0


def _all_places(view: PlannedView) -> Tiles:
    """A place for each tile of a view."""
    return np.arange(TileGrid(view.plan.region).count, dtype=np.int32)


def _places_of(tiles: Tiles) -> Tiles:
    """Places for some tiles, by the tiles' numbers."""
    places = np.zeros(int(tiles.max()) + 1, np.int32)
    places[tiles] = np.arange(len(tiles))
    return places


def _in_order(tiles: Tiles) -> Supply:
    """All tiles, as they are wanted."""
    place = 0

    def take(most: int) -> Tiles:
        nonlocal place
        left = len(tiles) - place
        # The last launch is not much shorter than the others: no core idles long at the end.
        count = (left + 1) // 2 if most < left < 1.5 * most else min(most, left)
        place += count
        return tiles[place - count : place]

    return take


class _Cutter:
    """Cuts an item into launches; work is counted in samples of a packet.

    Most launches are of whole tiles. A tile that is too heavy is rendered in parts: some of its packets with all samples,
    or if one work-group is still too heavy some of its samples, down to one sample of one packet. Where a device wants many
    pixels at a time, a group of tiles is rendered in parts instead: each launch takes some samples of all of them.

    Args:
        group: how many tiles the device wants at a time; 0: it is content with few.
    """

    def __init__(
        self, drawing: Drawing, item: WorkItem, take: Supply, places: Tiles | None, group: int = 0
    ) -> None:
        self.drawing, self.item, self.take, self.places = drawing, item, take, places
        self.first, self.end = item.samples
        self.per_tile = drawing.packets * (self.end - self.first)
        self.most = min(group, drawing.capacity)
        self.slot = 0
        # Tiles that are rendered in parts: their numbers, packets and next sample; no packets between two of them.
        self.tiles = NO_TILES
        self.packets = (0, 0)
        self.sample = self.first

    def enqueue(self, size: float) -> Part[Span] | None:
        """Starts the next launch, of at most `size` samples of packets where possible."""
        span = self._next(size)
        if span is None:
            return None
        begun, event = self.drawing.start(span)
        amount = (
            len(span.tiles) * (span.packets[1] - span.packets[0]) * max(span.samples[1] - span.samples[0], 1)
        )
        return Part(event, float(amount), span, begun)

    def _next(self, size: float) -> Span | None:
        drawing = self.drawing
        if self.packets == (0, 0):
            in_waves = drawing.wave.packets >= drawing.packets
            whole = int(min(size / self.per_tile, drawing.capacity)) if in_waves else 0
            several = self._with_room(int(min(size / drawing.packets, self.most))) if in_waves else 0
            chosen = self.take(max(whole, several, 1))
            if not len(chosen):
                return None
            if len(chosen) <= whole:
                return self._span(chosen, (0, drawing.packets), self.item.samples, last=True)
            self.tiles = chosen
            self.packets = (0, drawing.packets) if several else self._some_packets(0, size)
            self.sample = self.first
        packets, sample = self.packets, self.sample
        width = len(self.tiles) * (packets[1] - packets[0])
        samples = (sample, min(sample + max(int(size / width), 1), self.end))
        last = samples[1] == self.end and packets[1] == drawing.packets
        span = self._span(self.tiles, packets, samples, last=last)
        if samples[1] < self.end:
            self.sample = samples[1]
        elif last:
            self.packets = (0, 0)
        else:
            self.packets = self._some_packets(packets[1], size)
            self.sample = self.first
        return span

    def _with_room(self, several: int) -> int:
        """So many tiles, or one where the device has no room for what the parts of several keep."""
        if several > 1 and self.places is None and self.end - self.first > 1:
            try:
                self.drawing.keep(self.most)
            except DeviceError as error:
                if error.status != STATUS_BAD_INPUT:
                    raise
                self.most = several = 1
        return several

    def _some_packets(self, first: int, size: float) -> tuple[int, int]:
        """Packets of a tile from the first on: whole groups with all samples, one group, or a part of one."""
        group, samples = self.drawing.group, self.end - self.first
        count = max(int(size / samples) // group * group, group) if size >= group else max(int(size), 1)
        return first, min(first + min(count, self.drawing.wave.packets), self.drawing.packets)

    def _span(self, tiles: Tiles, packets: tuple[int, int], samples: tuple[int, int], *, last: bool) -> Span:
        mode = PASS_ADD if samples[0] > self.first else 0
        if self.places is not None or samples[1] < self.end:
            mode |= PASS_KEEP
        if self.places is not None:
            kept = self.places[tiles]
        else:
            kept = np.arange(len(tiles), dtype=np.int32)
            if mode & PASS_KEEP:
                self.drawing.keep(max(self.most, 1))
        span = Span(tiles, packets, samples, mode, kept, self.slot)
        if last:
            self.slot = (self.slot + 1) % SLOTS
        return span
