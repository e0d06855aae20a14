"""Where the cache is, and that drivers find a folder for theirs in it.

The usual place may be missing: a service user without a home, a read-only container. PoCL has no device at all without a
folder that it can write into. So a temporary folder takes the cache's place, with a remark.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
import warnings
from functools import lru_cache
from pathlib import Path

from clfractal.errors import CacheWarning, DeviceError, FileError, Where

ENVIRONMENT_VARIABLE = "CLFRACTAL_CACHE"
POCL_VARIABLE = "POCL_CACHE_DIR"


def folder() -> Path:
    """The cache folder, which can be written: `CLFRACTAL_CACHE`, else the system's usual place, else a temporary one.

    A temporary one is told once, by a `CacheWarning`.

    Raises:
        FileError: there is no temporary folder either.
    """
    override = os.environ.get(ENVIRONMENT_VARIABLE)
    return _usable(os.path.abspath(override) if override else _usual(), bool(override))


def set_drivers_folder() -> None:
    """Lets PoCL keep its programs in our cache folder, unless its own variable names another one.

    To be called before OpenCL is used; child processes inherit it. Raises FileError as `folder` does.
    """
    if not os.environ.get(POCL_VARIABLE):
        own = folder() / "pocl"
        own.mkdir(exist_ok=True)
        os.environ[POCL_VARIABLE] = str(own)


def drivers_problem() -> DeviceError | None:
    """The error for a folder that somebody chose for PoCL and that it cannot use; None if it can."""
    chosen = os.environ.get(POCL_VARIABLE, "")
    reason = problem(os.path.abspath(chosen)) if chosen else ""
    if not reason:
        return None
    return DeviceError(
        f"{POCL_VARIABLE}: PoCL cannot write into {chosen[:200]!r}: {reason}; without the variable it uses "
        "clfractal's cache",
        status=2,
    )


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


def _temporary(wanted: str, reason: str) -> Path:
    """A temporary folder that nobody else can write into: always the same one for a user, if nobody took its name."""
    own = -1
    if sys.platform != "win32":
        own = os.getuid()
    user = "" if own < 0 else f"-{own}"
    try:
        path = Path(tempfile.gettempdir(), f"clfractal-cache{user}")
        path.mkdir(mode=0o700, exist_ok=True)
        status = path.lstat()
        is_ours = own < 0 or (status.st_uid == own and not status.st_mode & 0o022)
        if stat.S_ISDIR(status.st_mode) and is_ours and not problem(str(path)):
            return path
    except OSError:
        pass
    try:
        return Path(tempfile.mkdtemp(prefix="clfractal-"))
    except OSError as error:
        raise FileError(
            f"the cache folder {wanted!r} cannot be used: {reason}; and there is no temporary folder",
            Where(ENVIRONMENT_VARIABLE),
        ) from error
