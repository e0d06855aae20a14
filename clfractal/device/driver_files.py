"""What PoCL keeps of a program, as bytes for the cache: packed after compiling, laid out before loading.

PoCL has a folder for each program, with machine code for each kernel and size of work-group, in folders of two letters. It
notes the last use of each, which tells the folders of one program from those of others.

PoCL finds such a folder by the program's text, which it reads anew for that, with all its own headers: some 35 ms. From a
binary it makes the folder in a tenth of the time. But into a binary it puts machine code for any size of work-group, too,
which nobody launches, and for which it compiles each kernel once more. So while it makes a binary it finds a stand-in
there: the code for the one size that is launched. Stand-ins go before anything is launched.
"""

from __future__ import annotations

import json
import os
import shutil
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath

from clfractal.device import cache, drivers_folder
from clfractal.files import system

MAGIC = b"clfractal-files-2\n"
_USED = "last_accessed"
_WHOLE = "program.bc"  # of the whole program: a binary has it
_ANY_SIZE = "0-0-0"  # the folder of machine code for any size of work-group
_BINARY = "binary"  # our own name, in the index
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


@contextmanager
def stand_ins(folders: Sequence[str]) -> Iterator[bool]:
    """Within the block PoCL has stand-ins (see above) for the kernels of programs; tells whether there are any."""
    root = drivers_folder.path()
    codes = [name for name in _files(root, folders) if name.endswith(".so")]
    made = {f"{_any_size(name)}/{PurePosixPath(name).name}": name for name in codes}
    try:
        for stand_in, code in made.items():
            (root / stand_in).parent.mkdir(exist_ok=True)
            shutil.copyfile(root / code, root / stand_in)
        yield bool(made)
    finally:
        _drop_stand_ins(codes)


def _drop_stand_ins(codes: Iterable[str]) -> None:
    root = drivers_folder.path()
    for folder in {_any_size(code) for code in codes}:
        shutil.rmtree(root / folder, ignore_errors=True)


def _any_size(code: str) -> str:
    """The folder of a kernel's machine code for any size of work-group, from the name of that for one."""
    return f"{PurePosixPath(code).parent.parent}/{_ANY_SIZE}"


def packed(folders: Sequence[str], binary: bytes = b"") -> bytes:
    """The files of programs as bytes; empty if there are none.

    Args:
        folders: of the programs.
        binary: of the one program, if it can be loaded from that; it was made with stand-ins.
    """
    root = drivers_folder.path()
    found = {name: (root / name).read_bytes() for name in _files(root, folders)}
    if not found:
        return b""
    if binary:
        found = {name: content for name, content in found.items() if not name.endswith(_WHOLE)}
        found[_BINARY] = binary
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


def binary_in(payload: bytes) -> bytes:
    """The binary that was packed; empty if there was none."""
    return next((bytes(content) for name, content in contents(payload) if name == _BINARY), b"")


@contextmanager
def laid_out(payload: bytes) -> Iterator[None]:
    """Lays the files out for PoCL, but those that are there. Within the block it loads the program.

    Raises:
        FileError: there is no room for them.
    """
    root = drivers_folder.path()
    try:
        for name, content in contents(payload):
            if name != _BINARY:
                _lay_out(f"{root}/{name}", content)
    except OSError as error:
        raise drivers_folder.no_room(error) from error
    try:
        yield
    finally:
        _drop_stand_ins(name for name, _ in contents(payload) if name.endswith(".so"))


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
            if all(name in files or name.endswith(_WHOLE) for name in _files(root, folders)):
                continue
            before = cache.load_blob(key)
            payload = packed(folders, binary_in(before)) if before is not None else b""
            if payload and cache.store_blob(key, payload):
                note(key, payload)


drivers_folder.users.append(keep_new)


def _index(payload: bytes) -> tuple[list[str], list[tuple[str, int]]]:
    folders, files = json.loads(payload[len(MAGIC) : payload.index(b"\n", len(MAGIC))])
    names = [*folders, *(name for name, _ in files)]
    if any(PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts for name in names):
        raise ValueError("a name leads out of the folder")
    return folders, [(name, size) for name, size in files]


def _files(root: Path, folders: Sequence[str]) -> list[str]:
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
