"""Work side by side: on parts of arrays, whose loops in numpy let other threads run, and of compilers."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

from clfractal.device.cancel import CancelToken

T = TypeVar("T")
R = TypeVar("R")


def in_threads(work: Callable[[T], R], parts: Sequence[T]) -> list[R]:
    """The results of work on each part, in their order."""
    if not parts:
        return []
    with ThreadPoolExecutor(min(os.cpu_count() or 1, len(parts))) as pool:
        return list(pool.map(work, parts))


@contextmanager
def ending_together(most: int) -> Iterator[tuple[ThreadPoolExecutor, CancelToken]]:
    """At most so many threads, and a token for what they do. It is cancelled where one of them has failed, or this thread
    was interrupted; then nobody waits for the others, nor for a child that is just being started.
    """
    ended, pool = CancelToken(), ThreadPoolExecutor(most)
    try:
        yield pool, ended
    except BaseException:
        ended.cancel()
        raise
    finally:
        pool.shutdown(wait=not ended(), cancel_futures=True)
