"""The threads of several devices: each does its device's part of a job, and tells what it has done."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial

from clfractal.device.cancel import CancelToken
from clfractal.engine.job import Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import Result
from clfractal.engine.sharing import Shared
from clfractal.errors import Stopped

# How soon an interrupt, or a token that was set, is seen.
_POLL_SECONDS = 0.02
# Results that wait to be stored: beyond that devices wait, so that memory stays bounded.
_WAITING = 4
# A longer wait counts as this: the machine was asleep, or this process was stopped, and no device is to blame.
_LONGEST_WAIT = 1.0


@dataclass(frozen=True, slots=True)
class Told:
    """What a device's thread tells: a result; or that it has ended, perhaps by an error."""

    place: int
    result: Result | None = None
    error: BaseException | None = None


class DeviceWorkers:
    """A thread for each device of a job. Devices are numbered by their places here.

    Threads are daemons: one that never comes back from its driver does not keep the process from ending.

    Args:
        executors: of each device.
        jobs: as each device does it.
        shared: what is to be done.
    """

    def __init__(self, executors: Sequence[LocalExecutor], jobs: Sequence[Job], shared: Shared) -> None:
        self.shared = shared
        self.running = set(range(len(executors)))
        """Devices that may still tell something."""
        self._inbox: queue.Queue[Told] = queue.Queue(_WAITING * len(executors))
        self._token = CancelToken()
        self.idle = 0.0
        """Seconds for which nobody has told anything."""
        self._quiet = [0.0] * len(executors)
        self._signs = [0] * len(executors)
        self._threads = [
            threading.Thread(
                target=self._work,
                args=(executor, job, place),
                name=f"clfractal-{executor.device.info.index}",
                daemon=True,
            )
            for place, (executor, job) in enumerate(zip(executors, jobs, strict=True))
        ]

    def start(self) -> None:
        """Starts the threads."""
        for thread in self._threads:
            thread.start()

    def next(self) -> Told | None:
        """What a device tells next; None if for a moment none does."""
        began = time.perf_counter()
        told = None
        with suppress(queue.Empty):
            told = self._inbox.get(timeout=_POLL_SECONDS)
        # Only this wait counts: while the caller is busy with other things, devices may have to wait for it.
        waited = min(time.perf_counter() - began, _LONGEST_WAIT)
        self.idle = 0.0 if told is not None else self.idle + waited
        for place in self.running:
            signs = self.shared.signs(place)
            lives = signs != self._signs[place] or not self.shared.owes(place)
            self._signs[place] = signs
            self._quiet[place] = 0.0 if lives else self._quiet[place] + waited
        return told

    def silent(self) -> list[tuple[int, float]]:
        """Devices that owe tiles and give no sign for too long (`Shared.patience`), and for how many seconds."""
        return [
            (place, self._quiet[place])
            for place in sorted(self.running)
            if self._quiet[place] > self.shared.patience(place)
        ]

    def abandon(self, place: int) -> None:
        """Gives the work of a silent device to the others. What it makes from now on is not used."""
        self.running.discard(place)
        self.shared.lose(place)

    def end(self) -> list[tuple[int, float]]:
        """Ends the work of all, and waits until their devices are idle.

        Devices that were abandoned are not waited for.

        Returns:
            Those that did not answer, and for how many seconds.
        """
        self._token.cancel()
        self.shared.stop()
        silent = []
        for place in sorted(self.running):
            thread, waited, patience = self._threads[place], 0.0, self.shared.patience(place)
            while thread.is_alive() and waited < patience:
                began = time.perf_counter()
                thread.join(_POLL_SECONDS)
                waited += min(time.perf_counter() - began, _LONGEST_WAIT)
            if thread.is_alive():
                silent.append((place, waited))
        return silent

    def _work(self, executor: LocalExecutor, job: Job, place: int) -> None:
        """What a device's thread does: tiles as long as there are any for it."""
        error: BaseException | None = None
        executor.supply = partial(self.shared.take, place)
        try:
            with closing(executor.execute(job, self.shared.items(place), self._token)) as results:
                for result in results:
                    # What comes too late, others make.
                    if self.shared.done(place, result.tiles):
                        self._tell(Told(place, result))
        except Stopped:
            pass
        except BaseException as caught:
            error = caught
            self.shared.lose(place)
        finally:
            executor.supply = None
        with suppress(Stopped):
            self._tell(Told(place, error=error))

    def _tell(self, told: Told) -> None:
        while True:
            self._token.check()
            with suppress(queue.Full):
                self._inbox.put(told, timeout=_POLL_SECONDS)
                return
