"""How much memory the machine has left, to say beforehand that something does not fit."""

from __future__ import annotations

import re
import sys

_UNITS = ("bytes", "kB", "MB", "GB", "TB", "PB")


def available() -> int:
    """Bytes that may be taken without swapping: what the system says, or a container allows, whichever is less."""
    free = _number("/proc/meminfo", r"MemAvailable:\s*(\d+) kB", 1024)
    if free is None:
        import psutil

        return int(psutil.virtual_memory().available)
    limit = _number("/sys/fs/cgroup/memory.max", r"(\d+)", 1)
    used = _number("/sys/fs/cgroup/memory.current", r"(\d+)", 1)
    if limit is not None and used is not None:
        # Pages of files count as used there, and are given up when memory is asked for.
        cached = _number("/sys/fs/cgroup/memory.stat", r"\binactive_file (\d+)", 1) or 0
        free = min(free, max(0, limit - used + cached))
    return free


def peak() -> int:
    """The largest number of bytes that this process has held at one time."""
    if sys.platform != "win32":
        try:
            import resource
        except ImportError:  # a Python without it
            pass
        else:
            most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            return most if sys.platform == "darwin" else 1024 * most
    import psutil

    info = psutil.Process().memory_info()
    return int(getattr(info, "peak_wset", info.rss))


def shown(size: int) -> str:
    """A number of bytes for people: `134 MB`, `1.07 GB`."""
    if size < 1000:
        return f"{size} bytes"
    power = min((len(str(size)) - 1) // 3, len(_UNITS) - 1)
    return f"{size / 1000**power:.3g} {_UNITS[power]}"


def _number(path: str, pattern: str, factor: int) -> int | None:
    """The first number that a pattern finds in a file of the system, None without it."""
    try:
        with open(path, encoding="ascii") as stream:
            found = re.search(pattern, stream.read(1 << 16))
    except (OSError, UnicodeDecodeError):
        return None
    return int(found[1]) * factor if found else None
