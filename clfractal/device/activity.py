"""What this process is doing, for whoever waits: work that may last says so while it lasts."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, eq=False)
class Activity:
    """Something under way: words such as `filling the grid`, and when it began (`time.monotonic`)."""

    what: str
    began: float = field(default_factory=time.monotonic)


_lock = threading.Lock()
_running: list[Activity] = []


@contextmanager
def doing(what: str) -> Iterator[None]:
    """Says what the process is doing until the block ends. The block that began last is the one that is told."""
    activity = Activity(what)
    with _lock:
        _running.append(activity)
    try:
        yield
    finally:
        with _lock:
            _running.remove(activity)


def current() -> Activity | None:
    """What the process is doing; None if nothing that may last."""
    with _lock:
        return _running[-1] if _running else None
