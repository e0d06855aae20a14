"""Programs that are loaded on a device, and kernels of theirs that rest: none is read from the disk twice."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Hashable
from typing import Any

MOST = 24
"""A picture has one program and a grid of voxels five; loading one from the disk takes PoCL some 50 ms.

Each takes some 2 to 8 MB, and in a window every value of a power is a program of its own.
"""
MOST_RESTING = 32
"""Sets of kernels: of a picture's programs, of a program for points, of one that fills grids."""


class BuildTime:
    """The total time of building programs for a device; overlapping builds count once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._under_way = 0
        self._since = 0.0
        self._seconds = 0.0

    def __enter__(self) -> None:
        with self._lock:
            if self._under_way == 0:
                self._since = time.perf_counter()
            self._under_way += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._under_way -= 1
            if self._under_way == 0:
                self._seconds += time.perf_counter() - self._since

    @property
    def milliseconds(self) -> float:
        """Until now, without builds that are under way."""
        return 1e3 * self._seconds


class LoadedPrograms:
    """The programs of one device's context, by key; beyond a number the one used longest ago is forgotten."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._programs: dict[str, Any] = {}  # the one used last at the end
        self._resting: list[tuple[Hashable, tuple[Any, ...], Any]] = []  # the one that came last at the end
        # What is given back is sorted in later: it may come from Python's collection of garbage, at any moment.
        self._returned: deque[tuple[Hashable, tuple[Any, ...], Any]] = deque()
        self.building = BuildTime()

    def get(self, key: str) -> Any | None:
        """The program kept under `key`, or None."""
        with self._lock:
            program = self._programs.pop(key, None)
            if program is not None:
                self._programs[key] = program
            return program

    def keep(self, key: str, program: Any) -> None:
        """Keep `program` under `key`."""
        with self._lock:
            self._programs.pop(key, None)
            self._programs[key] = program
            self._sort_in()
            if len(self._programs) > MOST:
                gone = self._programs.pop(next(iter(self._programs)))
                self._resting = [each for each in self._resting if gone not in each[1]]

    def take_kernels(self, key: Hashable) -> Any | None:
        """Kernels that rest under `key`, which then rest no longer, or None."""
        with self._lock:
            self._sort_in()
            for place in reversed(range(len(self._resting))):
                if self._resting[place][0] == key:
                    return self._resting.pop(place)[2]
        return None

    def rest_kernels(self, key: Hashable, programs: tuple[Any, ...], kernels: Any) -> None:
        """Keep kernels that nobody uses now, as long as their programs are loaded."""
        self._returned.append((key, programs, kernels))

    def _sort_in(self) -> None:
        known = list(self._programs.values())
        while self._returned:
            returned = self._returned.popleft()
            if all(program in known for program in returned[1]):
                self._resting = [*self._resting, returned][-MOST_RESTING:]

    def clear(self) -> None:
        """Forget all of them."""
        with self._lock:
            self._programs.clear()
            self._resting.clear()
            self._returned.clear()
