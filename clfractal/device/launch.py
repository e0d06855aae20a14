"""Long launches in parts: each short enough for a display's watchdog and for an interrupt to be answered."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

import numpy as np
import pyopencl as cl

from clfractal.device.select import Device
from clfractal.errors import DeviceError

# Time a launch should take.
LAUNCH_SECONDS = 0.1
# A launch grows at most by this factor over the one before: what follows may be much heavier.
GROWTH = 8.0
# Longest sleep between looks at a launch; an interrupt is seen then.
POLL_SECONDS = 0.0005
# PoCL makes other code for more in one dimension.
MOST_GROUPS = 32_768


def wait(event: cl.Event, device: Device, doing: str) -> float:
    """Waits for a launch in short sleeps, so that an interrupt is seen; gives its milliseconds on the device.

    Raises:
        DeviceError: the launch failed.
    """
    pause = POLL_SECONDS / 16
    with device.failures(doing):
        while True:
            status = event.command_execution_status
            if status == cl.command_execution_status.COMPLETE:
                break
            if status < 0:
                raise DeviceError(f"{device.info.name}: the device failed while {doing}: status {status}")
            time.sleep(pause)
            pause = min(2 * pause, POLL_SECONDS)
        return float(event.profile.end - event.profile.start) * 1e-6


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
) -> float:
    """Runs `kernel` over `count` things with `items` work-items each, in parts of about LAUNCH_SECONDS.

    The global size is (items, things); the kernel's argument number `first_argument` (int) is the part's first thing.
    The kernel must leave alone what is past `count`: parts are whole work-groups. Two parts are under way at a time.

    Args:
        device: where the kernel runs.
        kernel: all its other arguments are set.
        first_argument: see above.
        count: things; 0 launches nothing.
        doing: for messages.
        items: work-items along the first dimension.
        group: work-group, along both dimensions.
        first_part: things of the first part.
        done: told how many things are finished after each part.

    Returns:
        Milliseconds on the device.
    """
    size, place, finished, total = float(first_part), 0, 0, 0.0
    flying: deque[tuple[cl.Event, int]] = deque()
    while place < count or flying:
        while place < count and len(flying) < 2:
            part = min(max(int(size), 1), MOST_GROUPS, count - place)
            # A last part that is much shorter than the others would leave the device idle at both its ends.
            if part < count - place < 1.5 * part:
                part = (count - place + 1) // 2
            part = min(-(-part // group[1]) * group[1], -(-(count - place) // group[1]) * group[1])
            with device.failures(doing):
                kernel.set_arg(first_argument, np.int32(place))
                event = cl.enqueue_nd_range_kernel(device.queue, kernel, (items, part), group)
                device.queue.flush()
            flying.append((event, part))
            place += part
        event, part = flying.popleft()
        milliseconds = wait(event, device, doing)
        total += milliseconds
        finished += part
        wanted = part * LAUNCH_SECONDS / max(1e-3 * milliseconds, 1e-6)
        size = float(np.clip(wanted, 1.0, GROWTH * size))
        if done is not None:
            done(min(finished, count))
    return total
