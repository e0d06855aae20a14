"""Tiles that several devices share: each takes those of its next launch, so that all end together.

What a device takes depends on how fast all of them are, measured as they work. Far from the end it takes as many tiles as
its launches hold; towards the end less, down to what is worth a launch. A device that would hold up the end leaves the last
tiles to the others.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from clfractal.engine.run import NO_TILES, Tiles, WorkItem

# A device that waits looks again after this time whether it should take tiles: others may be late.
_LOOK_SECONDS = 0.02
# Of what a device should still do, the part that its next launch has at most.
_PART = 0.5
# The smallest launch, as a part of the largest that its device would make now.
_SMALLEST = 0.125
# A device is taken for hung after so many times the seconds that its launches should take, and never earlier than this.
_TIMES_LATE = 20.0
_SHORTEST_PATIENCE = 30.0


@dataclass(slots=True, eq=False)
class Offer:
    """Tiles of an item that are left; `device` is the only one that may take them, None: any."""

    item: WorkItem
    device: int | None = None
    left: deque[Tiles] = field(default_factory=deque)

    @property
    def count(self) -> int:
        """Tiles that are left."""
        return sum(map(len, self.left))

    def take(self, most: int) -> Tiles:
        """The next tiles, at most so many."""
        found, missing = [], most
        while missing > 0 and self.left:
            part = self.left.popleft()
            if len(part) > missing:
                self.left.appendleft(part[missing:])
                part = part[:missing]
            found.append(part)
            missing -= len(part)
        return np.concatenate(found) if found else NO_TILES


@dataclass(slots=True)
class _WorkerState:
    """What one device does: launches under way, and its speed in this job."""

    speed: float
    """Tiles a second as they were known before, perhaps only in proportion to the others'."""
    offer: Offer | None = None
    flying: deque[tuple[Offer, Tiles]] = field(default_factory=deque)
    flown: int = 0
    """Tiles of the launches under way."""
    done: int = 0
    began: float | None = None
    last: float = 0.0
    lost: bool = False
    signs: int = 0


class Shared:
    """Tiles of a job for several devices, which are numbers here. Every thread may call it.

    Args:
        offers: what is to be done.
        speeds: of each device, in proportion; used until they are measured.
    """

    def __init__(self, offers: Sequence[Offer], speeds: Sequence[float]) -> None:
        self._offers = [offer for offer in offers if offer.count]
        self._workers = [_WorkerState(speed) for speed in speeds]
        self._changed = threading.Condition()
        self._stopped = False

    @property
    def count(self) -> int:
        """Tiles that nobody has taken yet."""
        with self._changed:
            return sum(offer.count for offer in self._offers)

    def prepares(self, device: int) -> bool:
        """Whether a device has not come to its first launch yet."""
        with self._changed:
            return self._workers[device].began is None

    @property
    def finished(self) -> bool:
        """Whether all tiles are done."""
        with self._changed:
            return self._all_done()

    def speeds(self) -> list[float]:
        """Tiles a second of each device, as far as they were measured."""
        with self._changed:
            return self._speeds()

    def items(self, device: int) -> Generator[WorkItem]:
        """Items for a device, of whose tiles it may `take`; it waits for those that others leave, until all are done."""
        while True:
            with self._changed:
                while (offer := self._next(device)) is None:
                    if self._stopped or self._workers[device].lost or self._all_done():
                        return
                    self._changed.wait(_LOOK_SECONDS)
                self._workers[device].offer = offer
            yield offer.item

    def take(self, device: int, most: int) -> Tiles:
        """Tiles for a device's next launch, of the item that it has got: at most so many; none if it should take none."""
        with self._changed:
            worker, now = self._workers[device], time.perf_counter()
            worker.signs += 1
            if worker.began is None:
                worker.began = worker.last = now
            if self._stopped or worker.lost or worker.offer is None:
                return NO_TILES
            tiles = worker.offer.take(self._allowed(device, worker.offer, most, now))
            if len(tiles):
                if not worker.flying:
                    worker.last = now
                worker.flying.append((worker.offer, tiles))
                worker.flown += len(tiles)
            return tiles

    def done(self, device: int, tiles: Tiles) -> bool:
        """A device tells of tiles that are done, perhaps none; in the order in which they were taken, but perhaps fewer.

        Returns:
            Whether they count: those of a lost device are others' work by now.
        """
        with self._changed:
            worker = self._workers[device]
            if worker.lost:
                return False
            worker.signs += 1
            if len(tiles):
                offer, taken = worker.flying.popleft()
                assert np.array_equal(taken[: len(tiles)], tiles)
                if len(taken) > len(tiles):
                    worker.flying.appendleft((offer, taken[len(tiles) :]))
                worker.flown -= len(tiles)
                worker.done += len(tiles)
                worker.last = time.perf_counter()
                self._changed.notify_all()
            return True

    def owes(self, device: int) -> bool:
        """Whether tiles wait for a device that has begun: those that it has taken, and those that only it may take."""
        with self._changed:
            worker = self._workers[device]
            own = any(offer.device == device and offer.left for offer in self._offers)
            return worker.began is not None and not worker.lost and (bool(worker.flying) or own)

    def signs(self, device: int) -> int:
        """How often a device has taken tiles or told of its work: if that grows, it lives."""
        with self._changed:
            return self._workers[device].signs

    def patience(self, device: int) -> float:
        """For how many seconds a device may give no sign before it is taken for hung."""
        with self._changed:
            measured = any(each.done for each in self._workers)
            expected = self._workers[device].flown / self._speeds()[device] if measured else 0.0
            return max(_TIMES_LATE * expected, _SHORTEST_PATIENCE)

    def lose(self, device: int) -> None:
        """A device has failed, or hangs: the others do what it has taken, from the first sample on."""
        with self._changed:
            worker = self._workers[device]
            worker.lost = True
            again = [*worker.flying]
            again += [
                (offer, part) for offer in self._offers if offer.device == device for part in offer.left
            ]
            worker.flying.clear()
            worker.flown = 0
            for offer in self._offers:
                if offer.device == device:
                    offer.left.clear()
            for offer, tiles in again:
                item = replace(offer.item, tiles=tiles, samples=(0, offer.item.samples[1]))
                self._offers.append(Offer(item, None, deque([tiles])))
            self._changed.notify_all()

    def stop(self) -> None:
        """Nothing more is given."""
        with self._changed:
            self._stopped = True
            self._changed.notify_all()

    def _all_done(self) -> bool:
        return not any(worker.flying for worker in self._workers) and not any(
            offer.left for offer in self._offers
        )

    def _next(self, device: int) -> Offer | None:
        """The first offer of which a device should take some tiles now."""
        if self._stopped or self._workers[device].lost:
            return None
        now = time.perf_counter()
        for offer in self._offers:
            if offer.left and offer.device in (None, device) and self._allowed(device, offer, 1, now):
                return offer
        return None

    def _allowed(self, device: int, offer: Offer, most: int, now: float) -> int:
        """How many tiles a device should take for one launch, of an offer's and at most so many."""
        left = offer.count
        if offer.device is not None or not left:
            return min(most, left)
        speeds = self._speeds()
        working = [
            number
            for number, worker in enumerate(self._workers)
            if not worker.lost and worker.began is not None
        ]
        others = [number for number in working if number != device]
        if not others:
            return min(most, left)
        worker = self._workers[device]
        all_left = sum(each.count for each in self._offers if each.device is None)
        all_left += sum(self._workers[number].flown for number in working)
        share = speeds[device] / sum(speeds[number] for number in {*working, device})
        fair = share * all_left - worker.flown
        least = max(1, min(int(_SMALLEST * most), left))
        wanted = min(most, left, max(least, int(_PART * fair)))
        if wanted <= fair:
            return wanted
        # It would be the last: only if no other ends earlier with these tiles.
        for count in dict.fromkeys((wanted, 1)):
            own = self._busy(device, speeds, now) + count / speeds[device]
            if all(own <= self._busy(number, speeds, now) + count / speeds[number] for number in others):
                return count
        return 0

    def _busy(self, device: int, speeds: Sequence[float], now: float) -> float:
        """Seconds until a device is done with what it has taken; one that is late will be as late again."""
        worker = self._workers[device]
        if not worker.flown:
            return 0.0
        late = now - worker.last - worker.flown / speeds[device]
        return -late if late < 0 else late

    def _speeds(self) -> list[float]:
        """Tiles a second; of devices that have not done any yet, in proportion to what was known before."""
        measured = {
            number: worker.done / max(worker.last - worker.began, 1e-6)
            for number, worker in enumerate(self._workers)
            if worker.done and worker.began is not None
        }
        ratios = [math.log(measured[number] / self._workers[number].speed) for number in measured]
        scale = math.exp(sum(ratios) / len(ratios)) if ratios else 1.0
        return [measured.get(number, worker.speed * scale) for number, worker in enumerate(self._workers)]
