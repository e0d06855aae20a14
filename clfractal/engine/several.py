"""The executor of several devices: a thread for each, which takes tiles as its device has room."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clfractal.device import cache
from clfractal.device.cancel import CancelToken
from clfractal.device.launch import BUDGET_SECONDS
from clfractal.device.select import SPEEDS, Device, DeviceInfo, has_float64
from clfractal.engine.device_workers import DeviceWorkers
from clfractal.engine.job import Job, Kind
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import lanes_of, pays_to_measure
from clfractal.engine.run import NO_PIXELS, NO_TILES, Counters, Result, WorkItem
from clfractal.engine.sharing import Offer, Shared
from clfractal.errors import STATUS_BAD_INPUT, STATUS_DEVICE_FAILED, DeviceError, KernelBuildError
from clfractal.images.provenance import RenderDevice
from clfractal.images.tiles import TileGrid

# For so long a finished picture waits for programs that are being compiled for the next one, seconds.
_LONGEST_BUILD = 600.0


class SeveralExecutor:
    """Executes work items on several devices, each with an executor of its own. See `Executor`.

    A device that fails, or does not answer for long, is left out from then on, and the others do its tiles. All ranges of
    samples of a tile are made by one device; if that is lost, another begins the tile again.

    Args:
        executors: of each device.
        tell: called with a line when a device is left out.
    """

    def __init__(
        self, executors: Sequence[LocalExecutor], *, tell: Callable[[str], None] | None = None
    ) -> None:
        self.executors = tuple(executors)
        self.tell = tell
        self.failures: dict[int, DeviceError | KernelBuildError] = {}
        """Why devices are left out, by their places in `executors`."""
        # Never touched again, not even to free their memory: that may wait for the device, too.
        self._hung: set[int] = set()
        self._told: set[str] = set()
        self._gave_up = False
        self._speeds = [1.0] * len(self.executors)
        self._measured = False
        # Of a picture in passes: which device has each tile of a view, -1 none.
        self._owners: dict[int, npt.NDArray[np.int16]] = {}

    @classmethod
    def on(
        cls,
        devices: Sequence[Device],
        *,
        budget_seconds: float = BUDGET_SECONDS,
        tell: Callable[[str], None] | None = None,
    ) -> SeveralExecutor:
        """An executor of some devices; arguments as for `LocalExecutor`."""
        return cls(
            [LocalExecutor(each, budget_seconds=budget_seconds, tell=tell) for each in devices], tell=tell
        )

    @property
    def working(self) -> list[LocalExecutor]:
        """Executors of the devices that are not left out."""
        return [each for number, each in enumerate(self.executors) if number not in self.failures]

    @property
    def answering(self) -> list[LocalExecutor]:
        """Executors whose memory can be freed: those of devices that do not hang."""
        return [each for each in self.executors if id(each) not in self._hung]

    def leave_out(self, device: Device, error: DeviceError | KernelBuildError) -> str:
        """Uses a device no more, and gives the line that tells so.

        Raises:
            DeviceError: it was the last one; status 2 if all of them lacked memory, else 3.
        """
        numbers = [number for number, each in enumerate(self.executors) if each.device is device]
        self.failures |= dict.fromkeys(numbers, error)
        if not self.working:
            raise self._nothing_left() from error
        line = f"{device.info.index} {device.info.name} is left out, others do its work: {error.message}"
        self._tell_once(line)
        return line

    def execute(
        self, job: Job, items: Iterable[WorkItem], token: CancelToken | None = None
    ) -> Generator[Result]:
        """See `Executor`.

        Raises:
            DeviceError: no device is left.
        """
        jobs = {
            number: own
            for number, executor in enumerate(self.executors)
            if number not in self.failures and (own := job.on(executor.device.info)) is not None
        }
        if not jobs:
            raise self._nothing_left()
        numbers = list(jobs)
        all_items = list(items)
        shared = Shared(self._offers(job, all_items, numbers), self._known_speeds(numbers))
        workers = DeviceWorkers([self.executors[number] for number in numbers], list(jobs.values()), shared)
        tiles = shared.count
        try:
            workers.start()
            yield from self._results(job, numbers, workers, tiles, token)
        finally:
            for place, seconds in workers.end():
                executor = self.executors[numbers[place]]
                self._hung.add(id(executor))
                with suppress(DeviceError):  # if it was the last one, the next job will tell
                    self.leave_out(executor.device, _silent(executor.device, seconds))
        for number, speed in zip(numbers, shared.speeds(), strict=True):
            self._speeds[number] = speed
        self._measured = True

    def shared(self, job: Job, device: Device) -> Job:
        """A job that was decided for one of the devices, with the others' lanes; it tells of those that can have no part.

        Raises:
            DeviceError: no device is left.
        """
        kinds: dict[str, Kind] = {}
        wanted = {view.plan.precision for view in job.views}
        for executor in self.working:
            info = executor.device.info
            if info.key == device.info.key or info.key in kinds:
                continue
            if "float64" in wanted and not has_float64(info):
                self._tell_once(f"{info.index} {info.name} has no float64, so others do its work")
                continue
            try:
                lanes = lanes_of(
                    job.views,
                    executor.device,
                    measures=pays_to_measure(job.views, executor.device),
                    on_start=self.tell,
                )
            except DeviceError as error:
                if error.status != STATUS_DEVICE_FAILED:
                    raise
                self.leave_out(executor.device, error)
                continue
            kinds[info.key] = Kind(info, lanes)
        return replace(job, others=tuple(kinds.values()))

    def check_room(self, job: Job, token: CancelToken | None = None) -> None:
        """As `LocalExecutor.check_room`, for each device."""
        for executor in self.working:
            own = job.on(executor.device.info)
            if own is not None:
                executor.check_room(own, token)

    def forget(self) -> None:
        """Frees the data kept between the passes of a picture."""
        self._owners.clear()
        for executor in self.answering:
            executor.forget()

    def close(self) -> None:
        """Frees all memory; the executor can be used again."""
        self._owners.clear()
        for executor in self.answering:
            executor.close()

    def _results(
        self,
        job: Job,
        numbers: Sequence[int],
        workers: DeviceWorkers,
        missing: int,
        token: CancelToken | None,
    ) -> Generator[Result]:
        """What the devices tell, until all of so many missing tiles are there."""
        shared = workers.shared
        built = [0.0] * len(numbers)
        # A result of a device that was lost meanwhile may still be on its way.
        while workers.running or (missing and shared.finished):
            if not missing and not self._waits_for(workers):
                return
            if token is not None:
                token.check()
            told = workers.next()
            for place, seconds in workers.silent():
                workers.abandon(place)
                executor = self.executors[numbers[place]]
                self._hung.add(id(executor))
                yield _remark(self.leave_out(executor.device, _silent(executor.device, seconds)))
            if told is None:
                continue
            executor = self.executors[numbers[told.place]]
            if told.result is not None:
                # Devices build side by side.
                before = max(built)
                built[told.place] += told.result.counters.build_ms
                counters = replace(told.result.counters, build_ms=max(built) - before)
                self._own(told.result, numbers[told.place])
                missing -= len(told.result.tiles)
                yield replace(
                    told.result, counters=counters, render_device=render_device_of(executor.device.info)
                )
                continue
            if told.place not in workers.running:  # it hung, and its end is no news
                continue
            workers.running.discard(told.place)
            if told.error is None:
                continue
            failed = told.error
            if not isinstance(failed, (DeviceError, KernelBuildError)) or _is_of_text(failed):
                raise failed
            yield _remark(self.leave_out(executor.device, failed))
        if not shared.finished:  # the devices that are left have no part in this job
            raise self._nothing_left()

    def _waits_for(self, workers: DeviceWorkers) -> bool:
        """Whether programs that are still being built are waited for, when all is done without them.

        Once they are given up, so that a picture is there as soon as it can be. A second picture tells that there will be
        more, and that their devices are worth waiting for; but not for ever.
        """
        if not any(workers.shared.prepares(place) for place in workers.running):
            return False
        waits, self._gave_up = self._gave_up, True
        return waits and workers.idle < _LONGEST_BUILD

    def _offers(self, job: Job, items: Sequence[WorkItem], numbers: Sequence[int]) -> list[Offer]:
        """What is to be done, and which tiles belong to a device."""
        found = []
        for item in items:
            view = job.views[item.view]
            in_passes = item.samples != (0, view.plan.samples)
            if item.samples[0] == 0:
                self._owners.pop(item.view, None)
                if in_passes:
                    self._owners[item.view] = np.full(TileGrid(view.plan.region).count, -1, np.int16)
                found.append(Offer(item, None, deque([item.tiles])))
                continue
            owners = self._owners.get(item.view)
            owner = owners[item.tiles] if owners is not None else np.full(len(item.tiles), -1, np.int16)
            for place, number in enumerate(numbers):
                tiles = item.tiles[owner == number]
                found.append(Offer(replace(item, tiles=tiles), place, deque([tiles])))
            tiles = item.tiles[~np.isin(owner, numbers)]
            again = replace(item, tiles=tiles, samples=(0, item.samples[1]))
            found.append(Offer(again, None, deque([tiles])))
        return found

    def _tell_once(self, line: str) -> None:
        if self.tell is not None and line not in self._told:
            self._told.add(line)
            self.tell(line)

    def _own(self, result: Result, number: int) -> None:
        owners = self._owners.get(result.view)
        if owners is not None and len(result.tiles):
            owners[result.tiles] = number

    def _known_speeds(self, numbers: Sequence[int]) -> list[float]:
        """Of the last job; before it those that were measured when the devices were first used."""
        if self._measured:
            return [self._speeds[number] for number in numbers]
        known = cache.recall(SPEEDS)
        infos = [self.executors[number].device.info for number in numbers]
        speeds = [known.get(info.key) for info in infos]
        if not all(isinstance(speed, (int, float)) and speed > 0 for speed in speeds):
            return [1.0] * len(numbers)
        # Parts of one device were measured as a whole.
        units: dict[str, int] = {}
        for info in infos:
            units[info.key] = max(units.get(info.key, 1), info.compute_units)
        return [
            float(speed or 1) * max(info.compute_units, 1) / units[info.key]
            for speed, info in zip(speeds, infos, strict=True)
        ]

    def _nothing_left(self) -> DeviceError:
        if len(self.failures) < len(self.executors) or not self.failures:
            return DeviceError("no device is left that can do this work")
        last = list(self.failures.values())[-1]
        memory = all(each.status == STATUS_BAD_INPUT for each in self.failures.values())
        return DeviceError(
            f"no device is left: {last.message}",
            details=last.details,
            status=STATUS_BAD_INPUT if memory else STATUS_DEVICE_FAILED,
        )


def _silent(device: Device, seconds: float) -> DeviceError:
    return DeviceError(f"{device.info.name}: the device has not answered for {seconds:.0f} s")


def _remark(line: str) -> Result:
    return Result(0, NO_TILES, NO_PIXELS, Counters(), remark=line)


def _is_of_text(error: DeviceError | KernelBuildError) -> bool:
    """Whether the user's formula does not compile: it would not on any device."""
    return isinstance(error, KernelBuildError) and error.status == STATUS_BAD_INPUT


def render_device_of(device: DeviceInfo) -> RenderDevice:
    """How a picture calls the device."""
    return RenderDevice.of(device.index, device.name, device.key)
