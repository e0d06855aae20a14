"""Compares lane counts in rounds: all take turns, the least of each counts, and halves have to agree.

Other programs take a device for moments, and for longer: whatever runs then looks slow. So no lane count is measured alone,
and the same comparison is made twice, by every other round. Where the two differ, something else was measured than lanes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

# What a picture has beside the trial gains from wide packets: they are chosen up to so many times the best time.
NEARLY = 1.1
# Times that decide may differ by so much between the halves; what that can cost is less than what wide packets are allowed.
_NOISE = 1.05
# An even number, for the halves; and how many at most, where they do not agree.
FEWEST, MOST = 4, 16


def widest(times: Mapping[int, float]) -> int:
    """The lane count to take: the widest of those that are nearly as fast as the best."""
    best = min(times.values())
    return max(lanes for lanes, time in times.items() if time <= NEARLY * best)


def compared(
    lane_counts: Sequence[int], measure: Callable[[int], float], spent: Callable[[], bool] = lambda: False
) -> tuple[dict[int, float], bool]:
    """The least time of each lane count, and whether it can be relied on.

    Args:
        lane_counts: what is compared.
        measure: the time of a lane count, in any unit, each time it is called.
        spent: whether it has taken so long that a round for each half has to do.
    """
    halves: tuple[dict[int, float], dict[int, float]] = ({}, {})
    for number in range(MOST):
        if number % 2 == 0 and number > 0 and (spent() or (number >= FEWEST and agree(*halves))):
            break
        half = halves[number % 2]
        # Back and forth, in either half: none always comes after the same other.
        for lanes in lane_counts if number // 2 % 2 == 0 else reversed(lane_counts):
            half[lanes] = min(half.get(lanes, math.inf), measure(lanes))
    least = {lanes: min(half[lanes] for half in halves) for lanes in lane_counts}
    return least, agree(*halves)


def agree(one: Mapping[int, float], other: Mapping[int, float]) -> bool:
    """Whether two measurements tell the same of all lane counts that are fastest, or would be taken, by either of them."""
    deciding = {each for times in (one, other) for each in (min(times, key=times.__getitem__), widest(times))}
    return all(max(one[each], other[each]) <= _NOISE * min(one[each], other[each]) for each in deciding)
