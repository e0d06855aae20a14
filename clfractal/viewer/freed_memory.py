"""Memory that a window no longer uses goes back to the system, also after hours."""

from __future__ import annotations

import ctypes

# Numbers of glibc's malloc.h.
_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8


def give_memory_back() -> None:
    """Sets glibc's allocator so that large blocks are unmapped when they are freed; elsewhere nothing happens.

    By itself it keeps larger and larger blocks, in an arena for each thread: a window in which scenes, sizes and devices
    change would grow by hundreds of MiB that nobody uses.
    """
    try:
        set_option = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return
    for option, value in ((_MMAP_THRESHOLD, 1 << 20), (_TRIM_THRESHOLD, 4 << 20), (_ARENA_MAX, 2)):
        set_option(option, value)
