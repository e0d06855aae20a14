"""The folder that drivers write into: one for each process, for as long as it lives.

PoCL keeps programs as files and believes what it finds there: a file that was cut short by a full disk or a power failure
ends the process by a signal, at every start. So what PoCL writes stays within a process. The cache keeps copies that have a
check sum (`driver_files.py`), and a process gets those that it needs.

The folder is in memory where the system has such files, or in its temporary folder, which is on this machine where
homes are on a network; else, if these have no room or may not hold programs, in the cache. A process that was killed
leaves its folder; the next one takes it away.
"""

from __future__ import annotations

import atexit
import os
import secrets
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from clfractal.device import cache_folder
from clfractal.errors import DeviceError, FileError, Where
from clfractal.files import system
from clfractal.files.atomic import file_error

POCL_VARIABLE = "POCL_CACHE_DIR"
LEAST_ROOM = 32 << 20
"""Bytes that must be free for a folder: a program has some 250 KB, and a compiler's files while it works as much again."""

_RUNNING = "running"  # within our own folders
_PREFIX = "clfractal-"
_LOCK = ".lock"
_MEMORY = "/dev/shm"
_ABANDONED_S = 3600.0
# What a failure is looked into with; a program of all features takes less.
_TRIAL_BYTES = 8 << 20

users: list[Callable[[], None]] = []
"""Called before the folder goes: they end what writes into it, and keep what is to stay."""


class _Folder:
    """A folder of this process's, and the lock that tells others that it lives."""

    def __init__(self, path: Path, lock: int | None) -> None:
        self.path = path
        self.lock = lock
        self.process = os.getpid()

    def remove(self) -> None:
        _empty(str(self.path))
        if self.lock is None:
            return
        if not system.RENAMES_OPEN_FILES:
            os.close(self.lock)
        with suppress(OSError):
            _lock_of(self.path).unlink()
        if system.RENAMES_OPEN_FILES:
            os.close(self.lock)


_own: _Folder | None = None
_is_nested = False
_making = threading.Lock()


def path() -> Path:
    """The folder, which is made when it is first asked for.

    Raises:
        FileError: it cannot be made anywhere.
    """
    global _own
    with _making:
        if _own is None or _own.process != os.getpid():  # a forked process needs its own
            _own = _made()
        return _own.path


def nest() -> None:
    """From now on this process's folder is made in the one that its parent named, which goes with the parent."""
    global _is_nested
    _is_nested = True


def drop_nested(process: int) -> None:
    """Removes the folder of a child that has ended, if it had one."""
    if _own is not None:
        shutil.rmtree(_own.path / _nested_name(process), ignore_errors=True)


@contextmanager
def given_to_drivers() -> Iterator[None]:
    """While drivers are looked for, PoCL's variable names the folder; it is read once. Raises FileError as `path`."""
    chosen = os.environ.get(POCL_VARIABLE)
    if chosen and not _is_chosen():
        yield  # see `problem`
        return
    os.environ[POCL_VARIABLE] = str(path())
    try:
        yield
    finally:
        # Programs that this process starts are not told of a folder that goes with it.
        if chosen is None:
            del os.environ[POCL_VARIABLE]
        else:
            os.environ[POCL_VARIABLE] = chosen


def problem() -> DeviceError | None:
    """The error for a folder that somebody chose for PoCL and that it cannot use; None if it can."""
    chosen = os.environ.get(POCL_VARIABLE, "")
    reason = cache_folder.problem(os.path.abspath(chosen)) if chosen else ""
    if not reason:
        return None
    return DeviceError(
        f"{POCL_VARIABLE}: PoCL cannot write into {chosen[:200]!r}: {reason}; without the variable it uses "
        "the system's temporary folder",
        status=2,
    )


def no_room(error: OSError) -> FileError:
    """The error for a folder that has no room for what drivers write."""
    # (The folder itself has a name that nobody knows, and is gone when this is read.)
    return file_error(path().parent, "has no room for temporary files", error)


def check_room() -> None:
    """After a failure: makes sure that it was not for want of room, which no driver tells.

    Raises:
        FileError: the folder has no room, or cannot be written.
    """
    trial = path() / f"trial-{secrets.token_hex(4)}"
    try:
        try:
            with open(trial, "wb") as file:
                file.write(bytes(_TRIAL_BYTES))
                file.flush()
                os.fsync(file.fileno())
        finally:
            trial.unlink(missing_ok=True)
    except OSError as error:
        raise no_room(error) from error


def remove(*, in_order: bool = True) -> None:
    """Takes the folder away, at the end of the process.

    Args:
        in_order: whether what writes into it is ended before; that may wait for other threads.
    """
    global _own
    own = _own
    if own is None or own.process != os.getpid():
        return
    for end in users if in_order else ():
        with suppress(OSError):
            end()
    _own = None
    own.remove()


atexit.register(remove)


def _made() -> _Folder:
    chosen = os.path.abspath(os.environ.get(POCL_VARIABLE, ""))
    failure: OSError | None = None
    for base in [Path(chosen)] if _is_chosen() else _bases():
        try:
            if _is_nested:
                path = base / _nested_name(os.getpid())
                path.mkdir(mode=0o700, parents=True)
                return _Folder(path, None)
            return _locked_in(base)
        except OSError as error:
            failure = error
    reason = (
        failure.strerror
        if failure is not None
        else "there is neither a temporary folder nor one for the cache"
    )
    raise FileError(f"drivers have no folder to write into: {reason}", Where(POCL_VARIABLE))


def _nested_name(process: int) -> str:
    return f"child-{process}"


def _is_chosen() -> bool:
    chosen = os.environ.get(POCL_VARIABLE, "")
    return bool(chosen) and not cache_folder.problem(os.path.abspath(chosen))


def _bases() -> Iterator[Path]:
    """Where it may be made, the best place first: one that suits; else where there is most room."""
    left = []
    for find in (_in_memory, cache_folder.private_temporary, cache_folder.folder):
        with suppress(OSError, FileError):
            base = find() / _RUNNING
            base.mkdir(exist_ok=True)
            if _may_run_programs(base) and _room(base) >= LEAST_ROOM:
                yield base
            else:
                left.append(base)
    yield from sorted(left, key=lambda base: (_may_run_programs(base), _room(base)), reverse=True)


def _locked_in(base: Path) -> _Folder:
    """A new folder in `base`, after those are removed whose processes have ended."""
    prefix = f"{_PREFIX}{_machine()}-"
    _sweep(base, prefix)
    while True:
        path = base / f"{prefix}{secrets.token_hex(6)}"
        lock = os.open(_lock_of(path), system.CREATE, 0o600)
        with suppress(OSError):  # where files cannot be locked nobody takes the folder away either
            try:
                system.lock(lock)
            except system.HeldError:
                os.close(lock)
                continue
        # Another process may have taken the new file for a left one before it was locked.
        if not _lock_of(path).exists():
            os.close(lock)
            continue
        try:
            path.mkdir(mode=0o700)
        except OSError:
            _Folder(path, lock).remove()
            raise
        return _Folder(path, lock)


def _sweep(base: Path, prefix: str) -> None:
    with suppress(OSError), os.scandir(base) as entries:
        names = {entry.name for entry in entries if entry.name.startswith(prefix)}
        for name in names:
            with suppress(OSError, system.HeldError):
                if name.endswith(_LOCK):
                    lock = os.open(base / name, system.READ_AND_WRITE)
                    try:
                        system.lock(lock)
                    except BaseException:
                        os.close(lock)
                        raise
                    _Folder(base / name[: -len(_LOCK)], lock).remove()
                elif name + _LOCK not in names and time.time() - (base / name).stat().st_mtime > _ABANDONED_S:
                    # A compiler wrote on for a moment after its process had ended.
                    shutil.rmtree(base / name, ignore_errors=True)


def _empty(folder: str) -> None:
    """Removes a folder that only this user can write into. (`shutil.rmtree` guards against others, and takes five times as
    long; every process waits for it at its end.)"""
    with suppress(OSError):
        with os.scandir(folder) as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    _empty(entry.path)
                else:
                    with suppress(OSError):
                        os.unlink(entry.path)
        os.rmdir(folder)


def _lock_of(folder: Path) -> Path:
    return folder.with_name(folder.name + _LOCK)


def _machine() -> str:
    """Locks are not seen from other machines, where a folder is shared."""
    name = os.environ.get("COMPUTERNAME", "")
    if sys.platform != "win32":
        name = os.uname().nodename
    return "".join(letter if letter.isalnum() else "_" for letter in name[:40]) or "here"


def _room(base: Path) -> int:
    with suppress(OSError):
        return shutil.disk_usage(base).free
    return 0


def _in_memory() -> Path:
    """On Linux a file system in memory, where nobody has named another place: on a disk the folders take longer to make and
    remove than all else here.

    Raises:
        OSError: there is none.
    """
    if any(os.environ.get(name) for name in ("TMPDIR", "TEMP", "TMP")) or not os.path.isdir(_MEMORY):
        raise FileNotFoundError(_MEMORY)
    return cache_folder.private_temporary(_MEMORY)


def _may_run_programs(base: Path) -> bool:
    if sys.platform == "win32" or not hasattr(os, "ST_NOEXEC"):
        return True
    with suppress(OSError):
        return not os.statvfs(base).f_flag & os.ST_NOEXEC
    return True
