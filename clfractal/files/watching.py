"""Looks now and then whether files have changed on the disk, such as a scene's and its formulas'."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeAlias

INTERVAL = 0.5
"""Seconds between two looks at the disk, at least."""

# Device, inode, size in bytes, time of the last change in nanoseconds.
_State: TypeAlias = tuple[int, int, int, int]


class Watched:
    """Files that are looked at without threads, cheaply enough for every frame.

    To miss nothing, watch a file before it is read. A change is told once, also if the file is only half written: when
    the rest follows, this is another change. A file that is missing, as for a moment when an editor renames, is no
    change; it is one if another file appears in its place. One that stays away is `missing`.
    """

    def __init__(
        self,
        paths: Iterable[Path] = (),
        *,
        interval: float = INTERVAL,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._interval = interval
        self._clock = clock
        self._looked = clock()
        self._states: dict[Path, _State | None] = {}
        self._absent: dict[Path, int] = {}
        self.follow(paths)

    @property
    def paths(self) -> tuple[Path, ...]:
        """The files that are watched."""
        return tuple(self._states)

    @property
    def missing(self) -> tuple[Path, ...]:
        """Files that were there, and were not found by the last two looks."""
        return tuple(path for path, looks in self._absent.items() if looks >= 2)

    def follow(self, paths: Iterable[Path]) -> None:
        """Watches these files from now on; of files that were watched before, a change is still told."""
        self._states = {path: self._states[path] if path in self._states else _state(path) for path in paths}

    def accept(self) -> None:
        """Takes the files as they are: what has changed up to now is not told (the program itself has written them)."""
        self._states = {path: _state(path) or before for path, before in self._states.items()}

    def changed(self) -> bool:
        """Whether a file has changed since the last time that this was told; at most every half second a look."""
        now = self._clock()
        if now - self._looked < self._interval:
            return False
        self._looked = now
        before, found = dict(self._states), {path: _state(path) for path in self._states}
        self._absent = {
            path: self._absent.get(path, 0) + 1 for path in found if found[path] is None and before[path]
        }
        self._states = {path: found[path] or before[path] for path in found}
        return self._states != before


def _state(path: Path) -> _State | None:
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
