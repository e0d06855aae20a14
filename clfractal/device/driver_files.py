"""What PoCL keeps of a program, as bytes for the cache: packed after compiling, laid out before loading.

PoCL has a folder for each program, with machine code for each kernel and size of work-group, in folders of two letters. It
notes the last use of each, which tells the folders of one program from those of others.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath

from clfractal.device import cache, drivers_folder
from clfractal.files import system

MAGIC = b"clfractal-files-1\n"
_USED = "last_accessed"
# How names of files begin and end that are being written.
_UNFINISHED, _TEMPORARY = (".new-", "tempfile"), (".temp", ".tmp", ".o")

_recording = threading.RLock()
_kept: dict[str, tuple[tuple[str, ...], frozenset[str]]] = {}
"""By the key in the cache: the folders of a program, and which files of them the cache has."""


@contextmanager
def recorded() -> Iterator[list[str]]:
    """The folders of the programs that PoCL makes or loads within the block, which are known at its end; those of other
    threads may be among them.
    """
    root = drivers_folder.path()
    folders: list[str] = []
    with _recording:
        for note in root.glob(f"??/*/{_USED}"):
            note.unlink(missing_ok=True)
        yield folders
        folders += sorted(note.parent.relative_to(root).as_posix() for note in root.glob(f"??/*/{_USED}"))


def packed(folders: tuple[str, ...]) -> bytes:
    """The files of programs as bytes; empty if there are none."""
    root = drivers_folder.path()
    found = {name: (root / name).read_bytes() for name in _files(root, folders)}
    if not found:
        return b""
    index = json.dumps([list(folders), [[name, len(content)] for name, content in found.items()]])
    return b"".join([MAGIC, index.encode(), b"\n", *found.values()])


def is_packed(payload: bytes) -> bool:
    """Whether it is the result of `packed`."""
    return payload.startswith(MAGIC)


def contents(payload: bytes) -> Iterator[tuple[str, memoryview]]:
    """The names of the files in the result of `packed`, and what is in them."""
    start = payload.index(b"\n", len(MAGIC)) + 1
    for name, size in _index(payload)[1]:
        yield name, memoryview(payload)[start : start + size]
        start += size


def unpack(payload: bytes) -> None:
    """Lays the files out for PoCL, but those that are there.

    Raises:
        FileError: there is no room for them.
    """
    root = drivers_folder.path()
    try:
        for name, content in contents(payload):
            _lay_out(f"{root}/{name}", content)
    except OSError as error:
        raise drivers_folder.no_room(error) from error


def _lay_out(path: str, content: memoryview) -> None:
    """Writes a file for PoCL, whole before it has its name; plain system calls, since every start waits for them."""
    if os.path.exists(path):
        return
    beside = f"{path}.{threading.get_ident()}.tmp"
    try:
        descriptor = os.open(beside, system.CREATE, 0o700)
    except FileNotFoundError:
        os.makedirs(os.path.dirname(path), mode=0o700, exist_ok=True)
        descriptor = os.open(beside, system.CREATE, 0o700)
    try:
        try:
            system.write_at(descriptor, [bytes(content)], 0)
        finally:
            os.close(descriptor)
        os.replace(beside, path)
    except BaseException:
        with suppress(OSError):
            os.unlink(beside)
        raise


def note(key: str, payload: bytes) -> None:
    """The cache has `payload`, a result of `packed`, under `key`: see `keep_new`."""
    folders, files = _index(payload)
    _kept[key] = tuple(folders), frozenset(name for name, _ in files)


def keep_new() -> None:
    """Adds to the cache what PoCL has made since for programs in it: machine code for another size of work-group."""
    root = drivers_folder.path() if _kept else Path()
    for key, (folders, files) in list(_kept.items()):
        with suppress(OSError):
            if files.issuperset(_files(root, folders)):
                continue
            payload = packed(folders)
            if payload and cache.store_blob(key, payload):
                note(key, payload)


drivers_folder.users.append(keep_new)


def _index(payload: bytes) -> tuple[list[str], list[tuple[str, int]]]:
    folders, files = json.loads(payload[len(MAGIC) : payload.index(b"\n", len(MAGIC))])
    names = [*folders, *(name for name, _ in files)]
    if any(PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts for name in names):
        raise ValueError("a name leads out of the folder")
    return folders, [(name, size) for name, size in files]


def _files(root: Path, folders: tuple[str, ...]) -> list[str]:
    """The files of folders, by names that begin at `root`; without empty ones and those that are being written."""
    found: list[str] = []
    waiting = list(folders)
    while waiting:
        folder = waiting.pop()
        with suppress(FileNotFoundError), os.scandir(root / folder) as entries:
            for entry in entries:
                name = f"{folder}/{entry.name}"
                if entry.is_dir(follow_symlinks=False):
                    waiting.append(name)
                elif not (entry.name.startswith(_UNFINISHED) or entry.name.endswith(_TEMPORARY)):
                    found += [name] if entry.stat().st_size else []
    return sorted(found)
