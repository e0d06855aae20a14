"""The user's cache folder: compiled programs, and facts measured once per device and driver.

The cache is optional: if it fails (no space, no permission, a damaged file), the work is
done again. So no function here raises an error because of the disk.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from clfractal.device.cache_folder import ENVIRONMENT_VARIABLE as ENVIRONMENT_VARIABLE
from clfractal.device.cache_folder import folder as folder
from clfractal.files import system

# A binary is some 100 KB; the oldest go first.
MAXIMUM_BLOBS = 400

_MAGIC = b"clfractal-blob-1\n"
_DIGEST_BYTES = 32


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
    return payload


def store_blob(key: str, payload: bytes) -> None:
    """Keep `payload` under `key`. Readers see all of it or nothing."""
    path = _blob_path(key)
    try:
        _replace(path, _MAGIC + hashlib.sha256(payload).digest() + payload)
        _drop_oldest(path.parent)
    except OSError:
        pass


def drop_blob(key: str) -> None:
    """Forget what is stored under `key`."""
    with contextlib.suppress(OSError):
        _blob_path(key).unlink()


def recall(section: str) -> dict[str, Any]:
    """All facts remembered in `section`, a JSON object; empty if there are none."""
    try:
        facts = json.loads((folder() / f"{section}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return facts if isinstance(facts, dict) else {}


def remember(section: str, key: str, fact: object) -> None:
    """Add one fact (plain JSON data) to `section`; other processes may do the same at the same time."""
    try:
        with _locked(section):
            facts = recall(section)
            facts[key] = fact
            text = json.dumps(facts, indent=1, sort_keys=True)
            _replace(folder() / f"{section}.json", text.encode())
    except OSError:
        pass


def _blob_path(key: str) -> Path:
    return folder() / "programs" / f"{key}.bin"


def _replace(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(prefix=".new-", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        system.replace(Path(temporary), path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise


def _drop_oldest(blobs: Path) -> None:
    entries = list(blobs.glob("*.bin"))
    if len(entries) <= MAXIMUM_BLOBS:
        return
    by_age = sorted(entries, key=lambda entry: entry.stat().st_mtime)
    for entry in by_age[: len(entries) - MAXIMUM_BLOBS * 3 // 4]:
        with contextlib.suppress(OSError):
            entry.unlink()


@contextlib.contextmanager
def _locked(section: str) -> Iterator[None]:
    root = folder()
    root.mkdir(parents=True, exist_ok=True)
    with open(root / f".{section}.lock", "w", encoding="utf-8") as lock:
        system.lock(lock.fileno(), wait=True)
        yield
