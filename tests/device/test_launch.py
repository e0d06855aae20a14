"""Launches in parts: every thing once, whatever the parts, and an interrupt between them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl
import pytest

from clfractal.device import launch
from clfractal.device.launch import run_in_parts
from clfractal.device.program import build, math_flags
from clfractal.device.select import Device

TEXT = """
__kernel void count(__global int *times, int first, int count) {
    const int thing = first + (int)get_global_id(1);
    if (thing < count) times[thing * 4 + get_global_id(0)] += 1;
}
"""


class Counter:
    """A kernel that counts how often each thing and item is visited."""

    def __init__(self, device: Device, things: int) -> None:
        self.device, self.things = device, things
        self.kernel = build(device, TEXT, flags=math_flags("float32"), isolated=False).kernel("count")
        zeros = np.zeros(max(4 * things, 4), np.int32)
        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        self.buffer = cl.Buffer(device.context, flags, hostbuf=zeros)
        self.kernel.set_args(self.buffer, np.int32(0), np.int32(things))

    def run(self, **options: Any) -> npt.NDArray[np.int32]:
        run_in_parts(self.device, self.kernel, 1, self.things, doing="counting", items=4, **options)
        found = np.empty(max(4 * self.things, 4), np.int32)
        cl.enqueue_copy(self.device.queue, found, self.buffer)
        return found[: 4 * self.things]


@pytest.mark.parametrize("things", [0, 1, 7, 1000, 100_000])
@pytest.mark.parametrize(("group", "first_part"), [((1, 1), 1), ((2, 16), 5), ((4, 1), 40_000)])
def test_every_thing_is_visited_once(
    device: Device, things: int, group: tuple[int, int], first_part: int
) -> None:
    told: list[int] = []
    counter = Counter(device, things)
    found = counter.run(group=group, first_part=first_part, done=told.append)
    assert (found == 1).all()
    assert told == sorted(told)
    assert (told[-1] if told else 0) == things


def test_parts_grow_to_their_time_and_no_further(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launch, "MOST_GROUPS", 300)
    told: list[int] = []
    Counter(device, 2000).run(first_part=10, done=told.append)
    parts = np.diff([0, *told])
    # Two are under way before the first is timed.
    assert parts[0] == parts[1] == 10
    assert 80 <= parts.max() <= 300


def test_an_interrupt_ends_the_parts(device: Device) -> None:
    told: list[int] = []

    def stop(done: int) -> None:
        told.append(done)
        raise KeyboardInterrupt

    counter = Counter(device, 1000)
    with pytest.raises(KeyboardInterrupt):
        counter.run(first_part=10, done=stop)
    assert told == [10]
    device.queue.finish()
