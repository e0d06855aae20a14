"""Splits long work into launches that are short enough for a display's watchdog and for quick interrupts."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import pyopencl as cl

from clfractal.device import activity
from clfractal.device.cancel import CancelToken
from clfractal.device.groups import fitting
from clfractal.device.select import Device
from clfractal.device.watched import Watched
from clfractal.errors import ClfractalError, DeviceError

# Time that the work under way on a device should take, unless a caller gives another.
BUDGET_SECONDS = 0.1
# Launches under way at a time: the device must not wait for the host between them.
IN_FLIGHT = 2
# A launch grows at most by this factor over the one before: what follows may be much heavier.
GROWTH = 3.0
# From picture to picture the heaviest launch counts less, by this factor.
FORGETTING = 1.5
# Longest sleep between checks of a launch; an interrupt is noticed after it.
POLL_SECONDS = 0.0005
# With more work-items in one dimension PoCL compiles the kernel again.
MOST_GROUPS = 32_768

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Part(Generic[T]):
    """A launch that is under way: its event, its amount of work, and data that the caller gets back with it.

    Of a launch of several kernels `begun` is the event of the first one, and `event` that of the last one.
    """

    event: cl.Event
    amount: float
    about: T
    begun: cl.Event | None = None


@dataclass(slots=True)
class Pace:
    """How much work a launch gets, so that it takes the wanted time; measured speeds also serve the next picture.

    Attributes:
        size: work of the next launch, in units of the caller's.
        least, most: bounds of it.
        seconds: how long a launch should take.
        slowest: units a second of the heaviest launch so far; None before the first.
    """

    size: float
    least: float = 1.0
    most: float = float("inf")
    seconds: float = BUDGET_SECONDS / IN_FLIGHT
    slowest: float | None = None

    def begin(self) -> None:
        """Starts again with a size that is safe for the heaviest work so far, because the last work may have been light."""
        self.size = max(self.size, self.least)
        if self.slowest is not None:
            self.size = float(np.clip(self.slowest * self.seconds, self.least, self.most))
            # One slow launch, such as a driver's first, must not make all later pictures slow.
            self.slowest *= FORGETTING

    def learn(self, amount: float, milliseconds: float) -> None:
        """Sets the next size by what `amount` of work took."""
        rate = amount / max(1e-3 * milliseconds, 1e-6)
        # A short launch leaves cores idle, so its rate says nothing about longer ones.
        if 1e-3 * milliseconds >= self.seconds / 4:
            self.slowest = rate if self.slowest is None else min(self.slowest, rate)
        largest = min(max(amount, self.least) * GROWTH, self.most)
        self.size = float(np.clip(rate * self.seconds, self.least, largest))


def wait(
    event: cl.Event,
    device: Device,
    doing: str,
    token: CancelToken | None = None,
    begun: cl.Event | None = None,
) -> float:
    """Waits for a launch in short sleeps, so that an interrupt is seen; gives its milliseconds on the device, from where
    `begun` began if it is given.

    Raises:
        DeviceError: the launch failed.
        Stopped: the token was set.
    """
    wait_for_copy(event, device, doing, token)
    with device.failures(doing):
        return float(event.profile.end - (begun or event).profile.start) * 1e-6


def wait_for_copy(event: cl.Event, device: Device, doing: str, token: CancelToken | None = None) -> None:
    """As `wait`, for a copy: a blocking one may wait for a kernel, and then nothing can interrupt it.

    Raises:
        DeviceError: the copy failed.
        Stopped: the token was set.
    """
    start = time.perf_counter()
    with device.failures(doing):
        while True:
            status = event.command_execution_status
            if status == cl.command_execution_status.COMPLETE:
                break
            if status < 0:
                raise DeviceError(f"{device.info.name}: the device failed while {doing}: status {status}")
            if token is not None:
                token.check()
            # Short launches are looked at often, long ones are not kept from their cores.
            pause = (time.perf_counter() - start) / 32
            time.sleep(min(max(pause, POLL_SECONDS / 16), POLL_SECONDS))


def in_launches(
    device: Device,
    enqueue: Callable[[float], Part[T] | None],
    pace: Pace,
    *,
    doing: str,
    token: CancelToken | None = None,
    watched: Sequence[Watched] = (),
) -> Generator[tuple[T, float]]:
    """Runs work in launches, two at a time, and yields the data that `enqueue` gave for each, with its milliseconds.

    While the caller handles one result, the next two launches are under way, so launches need three sets of output buffers.

    Afterwards the device is idle, however it ends (completed, by an error, an interrupt, or because the caller stops).

    Args:
        enqueue: starts the next part, of at most the given amount; None if there is nothing more to do.
        pace: sizes the launches, and learns from them.
        token: ends the work.
        watched: records that can make the kernel's running launches end early, if the device allows it.

    Raises:
        DeviceError: a launch failed.
        Stopped: the token was set.
    """
    flying: deque[Part[T]] = deque()
    more = True

    def fill() -> None:
        nonlocal more
        while more and len(flying) < IN_FLIGHT:
            if token is not None:
                token.check()
            part = enqueue(pace.size)
            if part is None:
                more = False
            else:
                flying.append(part)

    with activity.doing(doing):
        try:
            fill()
            while flying:
                milliseconds = wait(flying[0].event, device, doing, token, flying[0].begun)
                part = flying.popleft()
                pace.learn(part.amount, milliseconds)
                # Before the caller reads what is finished: the device must not wait for that.
                fill()
                yield part.about, milliseconds
        finally:
            if flying:
                _end(flying, device, doing, watched)


def _end(flying: Iterable[Part[T]], device: Device, doing: str, watched: Sequence[Watched]) -> None:
    """Waits until running launches end; launches that watch a record are told to end early."""
    for records in watched:
        records.cancel(True)
    try:
        for part in flying:
            with suppress(ClfractalError):
                wait(part.event, device, doing)
    finally:
        for records in watched:
            records.cancel(False)


def run_in_parts(
    device: Device,
    kernel: cl.Kernel,
    first_argument: int,
    count: int,
    *,
    doing: str,
    items: int = 1,
    group: tuple[int, int] = (1, 1),
    first_part: int = 256,
    done: Callable[[int], None] | None = None,
    token: CancelToken | None = None,
    watched: Sequence[Watched] = (),
) -> float:
    """Runs `kernel` over `count` things with `items` work-items each, in launches of about the usual budget.

    The global size is (items, things); the kernel's argument number `first_argument` (int) is the part's first thing.
    The kernel must leave alone what is past `count`: parts are whole work-groups.

    Args:
        device: where the kernel runs.
        kernel: all its other arguments are set.
        first_argument: see above.
        count: things; 0 launches nothing.
        doing: for messages.
        items: work-items along the first dimension.
        group: work-group, along both dimensions, as far as the device takes it (`groups.fitting`).
        first_part: things of the first part.
        done: told how many things are finished after each part.
        token: ends the work.
        watched: see `in_launches`.

    Returns:
        Milliseconds on the device.

    Raises:
        DeviceError: a launch failed.
        Stopped: the token was set.
    """
    place = 0

    def enqueue(size: float) -> Part[int] | None:
        nonlocal place
        if place >= count:
            return None
        part = min(max(int(size), 1), MOST_GROUPS, count - place)
        # A last part that is much shorter than the others would leave the device idle at both its ends.
        if part < count - place < 1.5 * part:
            part = (count - place + 1) // 2
        part = min(-(-part // group[1]) * group[1], -(-(count - place) // group[1]) * group[1])
        with device.failures(doing):
            kernel.set_arg(first_argument, np.int32(place))
            fits = fitting(device, kernel, group)
            event = cl.enqueue_nd_range_kernel(device.queue, kernel, (items, part), fits)
            device.queue.flush()
        place += part
        return Part(event, part, min(place, count))

    total = 0.0
    launches = in_launches(
        device, enqueue, Pace(float(first_part)), doing=doing, token=token, watched=watched
    )
    with closing(launches):
        for finished, milliseconds in launches:
            total += milliseconds
            if done is not None:
                done(finished)
    return total
