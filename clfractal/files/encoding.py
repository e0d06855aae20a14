"""Keeps an encoder from changing how the process is scheduled, and from talking to its user."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

# SVT-AV1 writes its settings to standard error; at this level only what is wrong.
_SVT_LOG = ("SVT_LOG", "1")
_THREADS = Path("/proc/self/task")


@contextmanager
def as_usual_threads(library: str) -> Iterator[None]:
    """While an encoder is opened: afterwards all threads have the scheduling that the caller has before.

    As root SVT-AV1 makes the calling thread, and all that this starts, real-time ones of the highest priority: then
    other programs hardly run any more. All of its threads are there when it is open, so they are made usual ones then.
    Only Linux tells of threads and their scheduling; SVT-AV1 changes it nowhere else.

    Args:
        library: FFmpeg's name of the encoder.
    """
    if library != "libsvtav1":
        yield
        return
    os.environ.setdefault(*_SVT_LOG)
    if sys.platform != "linux":
        yield
        return
    policy, priority = os.sched_getscheduler(0), os.sched_getparam(0)
    known = _threads()
    try:
        yield
    finally:
        for thread in {threading.get_native_id(), *(_threads() - known)}:
            with suppress(ProcessLookupError):  # it has ended
                os.sched_setscheduler(thread, policy, priority)


def _threads() -> set[int]:
    """The numbers of this process's threads."""
    return {int(path.name) for path in _THREADS.iterdir()}
