"""Work that devices are offered, and a clock that a test turns."""

from __future__ import annotations

from collections import deque

import numpy as np

from clfractal.engine.run import WorkItem
from clfractal.engine.sharing import Offer


class Clock:
    """The time of the test."""

    now = 0.0

    def perf_counter(self) -> float:
        return self.now


def offer(tiles: int, device: int | None = None, samples: tuple[int, int] = (0, 1)) -> Offer:
    numbers = np.arange(tiles, dtype=np.int32)
    return Offer(WorkItem(0, numbers, samples), device, deque([numbers]))
