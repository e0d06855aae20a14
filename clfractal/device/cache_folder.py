"""Where the cache is: the user's folder, or that of CLFRACTAL_CACHE.

The usual place may be missing: a service user without a home, a read-only container. Then a temporary folder takes
its place, with a remark.
"""

from __future__ import annotations

import os
import stat
import tempfile
import warnings
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from clfractal.errors import CacheWarning, FileError, Where

ENVIRONMENT_VARIABLE = "CLFRACTAL_CACHE"


def folder() -> Path:
    """The cache folder, which can be written: `CLFRACTAL_CACHE`, else the system's usual place, else a temporary one.

    A temporary one is told once, by a `CacheWarning`.

    Raises:
        FileError: there is no temporary folder either.
    """
    override = os.environ.get(ENVIRONMENT_VARIABLE)
    return _usable(os.path.abspath(override) if override else _usual(), bool(override))


def problem(path: str) -> str:
    """Why a folder cannot be made or written into; empty if it can, and then it is there."""
    if not os.path.isabs(path):
        return "there is no home folder" if path.startswith("~") else "not an absolute path"
    try:
        os.makedirs(path, exist_ok=True)
        with tempfile.TemporaryFile(dir=path) as file:
            file.write(b"?")
    except (OSError, ValueError) as error:
        return (isinstance(error, OSError) and error.strerror) or str(error)
    return ""


def _usual() -> str:
    from platformdirs import user_cache_dir

    return user_cache_dir("clfractal")


@lru_cache(maxsize=16)
def _usable(wanted: str, is_chosen: bool) -> Path:
    reason = problem(wanted)
    if not reason:
        return Path(wanted)
    found = _temporary(wanted, reason)
    name = f"{ENVIRONMENT_VARIABLE}: " if is_chosen else ""
    advice = "" if is_chosen else f"; {ENVIRONMENT_VARIABLE} names another"
    warnings.warn(
        f"{name}the cache folder {wanted!r} cannot be used: {reason}; using {str(found)!r}{advice}",
        CacheWarning,
        stacklevel=3,
    )
    return found


def private_temporary(within: str = "") -> Path:
    """A folder in the system's temporary one that nobody else can write into: always the same one for a user, if nobody
    took its name.

    Args:
        within: instead of the system's temporary folder.

    Raises:
        OSError: none can be made.
    """
    own: int = getattr(os, "getuid", lambda: -1)()  # Windows has no numbers of users
    user = "" if own < 0 else f"-{own}"
    with suppress(OSError):
        path = Path(within or tempfile.gettempdir(), f"clfractal-cache{user}")
        path.mkdir(mode=0o700, exist_ok=True)
        status = path.lstat()
        is_ours = own < 0 or (status.st_uid == own and not status.st_mode & 0o022)
        if stat.S_ISDIR(status.st_mode) and is_ours and not problem(str(path)):
            return path
    return Path(tempfile.mkdtemp(prefix="clfractal-", dir=within or None))


def _temporary(wanted: str, reason: str) -> Path:
    try:
        return private_temporary()
    except OSError as error:
        raise FileError(
            f"the cache folder {wanted!r} cannot be used: {reason}; and there is no temporary folder",
            Where(ENVIRONMENT_VARIABLE),
        ) from error
