"""Programs that are in a device's memory, so that what was built once is not looked for on the disk again."""

from __future__ import annotations

import threading
from typing import Any

_MOST = 64
"""A picture has one program and a grid of voxels five; loading one from the disk takes PoCL some 50 ms."""


class LoadedPrograms:
    """The programs of one device's context, by key; beyond a number the one used longest ago is forgotten."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._programs: dict[str, Any] = {}  # the one used last at the end

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
            if len(self._programs) > _MOST:
                del self._programs[next(iter(self._programs))]

    def clear(self) -> None:
        """Forget all of them."""
        with self._lock:
            self._programs.clear()
