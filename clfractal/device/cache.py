"""The user's cache folder: compiled programs, and facts measured once per device and driver.

The cache is optional: if it fails (no space, no permission, a damaged file), the work is
done again. So no function here raises an error because of the disk. Everything has a check sum: what was damaged is
as if it had never been there. What cannot be written is told once, by a `CacheWarning`, and tried again the next time.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import shutil
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from clfractal.device.cache_folder import ENVIRONMENT_VARIABLE as ENVIRONMENT_VARIABLE
from clfractal.device.cache_folder import folder as folder
from clfractal.errors import CacheWarning
from clfractal.files import system

SIZE_VARIABLE = "CLFRACTAL_CACHE_MB"
"""Megabytes that compiled programs may take in the cache; 0: none is kept."""
USUAL_MEGABYTES = 500
"""A program has some 200 to 500 KB: all that the library of formulas and scenes may need are 140 MB."""
_MEGABYTE = 1_000_000
_MOST_MEGABYTES = 1_000_000

_MAGIC = b"clfractal-blob-1\n"
_DIGEST_BYTES = 32
_NEW = ".new-"
_ABANDONED_S = 3600.0  # age of a file that nobody writes any more
_told: set[str] = set()  # folders that take nothing more, and limits that are none
_used: set[Path] = set()
"""Entries that this process has loaded or stored: they are not dropped for others."""


def key_of(*parts: object) -> str:
    """A name that identifies `parts`: SHA-256 of their JSON text, in hexadecimal."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def load_blob(key: str) -> bytes | None:
    """The bytes stored under `key`; None if there are none, or if they are damaged (the file then goes)."""
    path = _blob_path(key)
    try:
        stored = path.read_bytes()
    except OSError:
        return None
    head, payload = stored[: len(_MAGIC) + _DIGEST_BYTES], stored[len(_MAGIC) + _DIGEST_BYTES :]
    if head != _MAGIC + hashlib.sha256(payload).digest():
        drop_blob(key)
        return None
    with contextlib.suppress(OSError):
        os.utime(path)  # the time of last use decides what is dropped first
    _used.add(path)
    return payload


def store_blob(key: str, payload: bytes) -> bool:
    """Keep `payload` under `key`, and say whether that was possible. Readers see all of it or nothing.

    What was used longest ago goes where it would be more than `limit` in all, but nothing that this process uses.
    """
    path, stored = _blob_path(key), _MAGIC + hashlib.sha256(payload).digest() + payload
    try:
        if not _make_room(path, len(stored)):
            return False
        _replace(path, stored)
    except OSError as error:
        _tell(error)
        return False
    _used.add(path)
    return True


def limit() -> int:
    """How many bytes of programs are kept; a variable that is no such number is told once, by a `CacheWarning`."""
    given = os.environ.get(SIZE_VARIABLE, "").strip()
    if not given:
        return USUAL_MEGABYTES * _MEGABYTE
    # (A float may also be written as nan, inf or 1e9.)
    if re.fullmatch(r"\d{1,7}(\.\d{0,6})?", given, re.ASCII) and float(given) <= _MOST_MEGABYTES:
        return int(float(given) * _MEGABYTE)
    _warn(
        f"{SIZE_VARIABLE}={given}",
        f"{SIZE_VARIABLE} must be megabytes from 0 to {_MOST_MEGABYTES}, got {given[:60]!r}; using {USUAL_MEGABYTES}",
    )
    return USUAL_MEGABYTES * _MEGABYTE


def size() -> int:
    """How many bytes of programs there are."""
    return sum(bytes_of for _, bytes_of, _ in _entries(folder() / "programs"))


def drop_blob(key: str) -> None:
    """Forget what is stored under `key`."""
    with contextlib.suppress(OSError):
        _blob_path(key).unlink()


def recall(section: str) -> dict[str, Any]:
    """All facts remembered in `section`, a JSON object; empty if there are none, or if they are damaged."""
    try:
        kept = json.loads((folder() / f"{section}.json").read_text(encoding="utf-8"))
        facts: dict[str, Any] = kept["facts"]
        return facts if kept["sha256"] == _sum_of(facts) else {}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}


def remember(section: str, key: str, fact: object) -> None:
    """Add one fact (plain JSON data) to `section`; other processes may do the same at the same time."""
    try:
        with _locked(section):
            facts = recall(section)
            facts[key] = fact
            text = json.dumps({"facts": facts, "sha256": _sum_of(facts)}, indent=1, sort_keys=True)
            _replace(folder() / f"{section}.json", text.encode())
    except OSError as error:
        _tell(error)


def _sum_of(facts: dict[str, Any]) -> str:
    return key_of("facts", facts)


def _tell(error: OSError) -> None:
    root = str(folder())
    _warn(
        root, f"the cache folder {root!r} takes nothing more: {error.strerror or error}; working without it"
    )


def _warn(subject: str, line: str) -> None:
    if subject not in _told:
        _told.add(subject)
        warnings.warn(line, CacheWarning, stacklevel=4)


def _blob_path(key: str) -> Path:
    return folder() / "programs" / f"{key}.bin"


def _replace(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(prefix=_NEW, dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        system.replace(Path(temporary), path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise


def _make_room(wanted: Path, more: int) -> bool:
    """Drops what was used longest ago, so that there is room for so many bytes, and what nobody uses any more.

    Says whether there is room. Other processes may make some at the same time; what they have loaded they need no longer.
    """
    _drop_left(wanted.parent)
    most = limit()
    if more > most:
        return False
    found = [entry for entry in _entries(wanted.parent) if entry[2] != wanted]
    total = more + sum(bytes_of for _, bytes_of, _ in found)
    for _, bytes_of, entry in sorted(found):
        if total <= most:
            break
        if entry not in _used:
            with contextlib.suppress(OSError):
                entry.unlink(missing_ok=True)
                total -= bytes_of
    return total <= most


def _entries(blobs: Path) -> list[tuple[float, int, Path]]:
    """The time of last use, the size and the path of each entry."""
    found: list[tuple[float, int, Path]] = []
    with contextlib.suppress(OSError), os.scandir(blobs) as entries:
        for entry in entries:
            if entry.name.endswith(".bin"):
                with contextlib.suppress(OSError):  # another process makes room, too
                    status = entry.stat()
                    found.append((status.st_mtime, status.st_size, blobs / entry.name))
    return found


def _drop_left(blobs: Path) -> None:
    """Drops what killed processes left, and what PoCL kept for earlier versions."""
    now = time.time()
    for left in (*blobs.glob(f"{_NEW}*"), *blobs.parent.glob(f"{_NEW}*")):
        with contextlib.suppress(OSError):
            if now - left.stat().st_mtime > _ABANDONED_S:
                left.unlink()
    for left in (blobs.parent / "pocl").glob("*"):
        if re.fullmatch(r"[A-P]{2}", left.name):
            shutil.rmtree(left, ignore_errors=True)
        elif left.name.startswith("tempfile"):
            left.unlink(missing_ok=True)


@contextlib.contextmanager
def _locked(section: str) -> Iterator[None]:
    root = folder()
    root.mkdir(parents=True, exist_ok=True)
    with open(root / f".{section}.lock", "w", encoding="utf-8") as lock:
        system.lock(lock.fileno(), wait=True)
        yield
