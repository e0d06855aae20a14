"""Tiles that are shared by measured speed: devices whose launches take as long as a clock of the test says."""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.engine import sharing
from clfractal.engine.sharing import Shared
from tests.engine.offers import Clock, offer

LAUNCH_SECONDS = 0.05


def simulated(
    tiles: int, speeds: Sequence[float], known: Sequence[float], monkeypatch: pytest.MonkeyPatch
) -> tuple[list[float], list[int]]:
    """When each device ends, seconds, and how many tiles it has done; each has two launches under way at a time."""
    clock = Clock()
    monkeypatch.setattr(sharing, "time", clock)
    shared = Shared([offer(tiles)], known)
    for device in range(len(speeds)):
        shared._workers[device].offer = shared._offers[0]  # as `items` does, which may wait
        assert not len(shared.take(device, 0))  # its programs are there
    ends, done, free = [0.0] * len(speeds), [0] * len(speeds), [0.0] * len(speeds)
    seen = np.zeros(tiles, np.int64)
    events: list[tuple[float, int, int]] = []  # time, device, the tiles that are done then; 0 to look again
    flying: list[deque[np.ndarray]] = [deque() for _ in speeds]

    def begin(device: int) -> None:
        while len(flying[device]) < 2:
            most = max(int(LAUNCH_SECONDS / 2 * speeds[device]), 1)
            taken = shared.take(device, most)
            if not len(taken):
                if not flying[device] and not shared.finished:
                    heapq.heappush(events, (clock.now + 0.02, device, 0))
                return
            seen[taken] += 1
            flying[device].append(taken)
            free[device] = max(free[device], clock.now) + len(taken) / speeds[device]
            heapq.heappush(events, (free[device], device, len(taken)))

    for device in range(len(speeds)):
        begin(device)
    while events:
        clock.now, device, count = heapq.heappop(events)
        if count:
            shared.done(device, flying[device].popleft())
            ends[device], done[device] = clock.now, done[device] + count
        begin(device)
    assert (seen == 1).all()
    assert shared.finished
    return ends, done


@settings(max_examples=40)
@given(
    st.integers(1, 1000),
    st.lists(st.floats(30, 1e5), min_size=2, max_size=4),
)
def test_devices_end_together(tiles: int, speeds: list[float]) -> None:
    """At the end at most some launches are waited for, however different the devices are."""
    with pytest.MonkeyPatch.context() as patch:
        ends, _ = simulated(tiles, speeds, speeds, patch)
    ideal = tiles / sum(speeds)
    # What the fastest needs for a tile more, and the last launches.
    assert max(ends) <= 1.02 * ideal + 2.5 * LAUNCH_SECONDS + 2 / max(speeds)


def test_speeds_that_are_not_known_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    ends, done = simulated(4000, [9000.0, 1000.0], [1.0, 1.0], monkeypatch)
    assert done[0] == pytest.approx(3600, rel=0.05)
    assert max(ends) - min(ends) <= 2 * LAUNCH_SECONDS


def test_a_slow_device_leaves_the_last_tile_to_the_fast_one(monkeypatch: pytest.MonkeyPatch) -> None:
    _, done = simulated(3, [100.0, 0.01], [100.0, 0.01], monkeypatch)
    assert done == [3, 0]
    ends, _ = simulated(50, [100.0, 1.0], [100.0, 1.0], monkeypatch)
    assert max(ends) < 1.1


def test_a_lost_device_s_tiles_are_done_by_others() -> None:
    shared = Shared([offer(10), offer(4, device=1, samples=(4, 8))], [1.0, 1.0])
    first, second = shared.items(0), shared.items(1)
    next(second)
    lost = shared.take(1, 3)
    shared.lose(1)
    found = []
    for item in first:
        while len(tiles := shared.take(0, 4)):
            found.append((item.samples, tiles.tolist()))
            shared.done(0, tiles)
    assert shared.finished
    assert list(second) == []
    assert sorted(tile for samples, tiles in found if samples == (0, 1) for tile in tiles) == list(range(10))
    # The ranges before are gone with the device, so these begin at the first sample.
    assert sorted(tile for samples, tiles in found if samples == (0, 8) for tile in tiles) == list(range(4))
    assert len(lost)
