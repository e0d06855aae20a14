"""Programs that are loaded on a device, so that they are not read from the disk again."""

from __future__ import annotations

import threading
import time
from typing import Any

MOST = 24
"""A picture has one program and a grid of voxels five; loading one from the disk takes PoCL some 50 ms.

Each takes some 8 MB, and in a window every value of a power is a program of its own.
"""


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
            if len(self._programs) > MOST:
                del self._programs[next(iter(self._programs))]

    def clear(self) -> None:
        """Forget all of them."""
        with self._lock:
            self._programs.clear()
