"""Keeps unsaved changes on the disk, so that the next window can offer them after a crash.

Every window has three files in one folder: the scene's text, a note about it, and a lock that the system gives back
when the window's process ends, however it ends.
"""

from __future__ import annotations

import json
import os
import secrets
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from clfractal.device import cache
from clfractal.errors import ClfractalError
from clfractal.files import system
from clfractal.files.document import read_document
from clfractal.files.regular import read_text_file
from clfractal.scene.load import SceneText, load_scene
from clfractal.scene.model import Scene
from clfractal.viewer.formula_texts import FormulaTexts
from clfractal.viewer.saving import SceneSource, open_source, scene_text
from clfractal.viewer.sources import same_file

_VERSION = 1


@dataclass
class _Held:
    """The files of a window, in a folder, under a name; and their lock, while this process holds it."""

    _folder: Path
    _name: str
    _lock: int | None

    def discard(self) -> None:
        """Removes what was kept, and gives the lock up."""
        _remove(self._folder, self._name)
        if self._lock is not None:
            _end_lock(self._lock, self._folder / f"{self._name}.lock")
            self._lock = None

    def release(self) -> None:
        """Leaves what was kept for the next window."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


class Autosave(_Held):
    """The unsaved changes of one window; a context manager that leaves nothing behind when it is left without error.

    A disk that is full or cannot be written is no reason to end: the work is then not kept, and `write` returns False.
    """

    def __init__(self, folder: Path | None = None) -> None:
        """Args: folder: by default `autosave` in the user's cache folder."""
        super().__init__(folder or default_folder(), f"{os.getpid()}-{secrets.token_hex(4)}", None)
        self._written: str | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
        else:
            self.release()

    def write(self, source: SceneSource, present: Scene, texts: FormulaTexts | None = None) -> bool:
        """Keeps the present scene, in place of what was kept before; False if that is not possible.

        It takes some 10 ms, and does not wait for the disk: the text survives the process, but not a power failure.
        """
        try:
            text = scene_text(source, present, texts)
            if text == self._written:
                return True
            self._folder.mkdir(parents=True, exist_ok=True)
            if self._lock is None:
                self._lock = _locked_file(self._folder / f"{self._name}.lock")
            note = {
                "version": _VERSION,
                "pid": os.getpid(),
                "started": _process_start(os.getpid()),
                "time": time.time(),
                "path": str(source.path.absolute()) if source.path is not None else None,
                "folder": str(present.folder.absolute()),
            }
            _replace(self._folder / f"{self._name}.yaml", text)
            _replace(self._folder / f"{self._name}.json", json.dumps(note, indent=1))
        except (OSError, ClfractalError):
            return False
        self._written = text
        return True

    def clear(self) -> None:
        """Forgets what was kept, because it has been saved or given up."""
        _remove(self._folder, self._name)
        self._written = None

    def close(self) -> None:
        """The same, when the window closes."""
        self.discard()
        self._written = None

    def found(self, of: Path | None = None) -> list[Recovered]:
        """What windows that have ended left behind, the newest first; damaged files are removed.

        Each belongs to this process until it is discarded or released: another window that starts now does not find it.

        Args:
            of: the file that the scene came from; None: of any.
        """
        found = []
        try:
            locks = sorted(self._folder.glob("*.lock"))
        except OSError:
            return []
        for path in locks:
            if path.stem == self._name or (lock := _taken(path)) is None:
                continue
            recovered = _read(self._folder, path.stem, lock)
            if recovered is None:
                _Held(self._folder, path.stem, lock).discard()
            elif of is None or (recovered.path is not None and same_file(recovered.path, of)):
                found.append(recovered)
            else:
                recovered.release()
        return sorted(found, key=lambda each: each.time, reverse=True)


@dataclass
class Recovered(_Held):
    """Unsaved changes of a window that has ended. They are discarded once they are given up, or once
    this window keeps them.

    Attributes:
        time: when they were kept, seconds since 1970.
        path: the file that the scene came from; None if from nowhere.
        folder: where the files that the scene names are looked for.
        text: the scene as YAML.
    """

    time: float
    path: Path | None
    folder: Path
    text: str

    def scene(self) -> Scene:
        """The scene with the changes.

        Raises:
            SceneError, FormulaError, FileError: a file that it names is gone or has changed.
        """
        shown = self.path.name if self.path is not None else "scene"
        return load_scene(SceneText(read_document(self.text, shown), self.folder), posed=False)

    def source(self) -> SceneSource:
        """Where the scene came from, to be saved there; if that cannot be read any more, the text itself."""
        if self.path is not None:
            with suppress(ClfractalError):
                return open_source(self.path)
        return SceneSource("none", None, self.text, self.scene())


def default_folder() -> Path:
    """`autosave` in the user's cache folder."""
    return cache.folder() / "autosave"


def _read(folder: Path, name: str, lock: int) -> Recovered | None:
    """What a note and its text say; None if there is none, or it is damaged."""
    try:
        note: Any = json.loads(read_text_file(folder / f"{name}.json"))
        text = read_text_file(folder / f"{name}.yaml")
        if not isinstance(note, dict) or note.get("version") != _VERSION:
            return None
        if not isinstance(read_document(text).root.value, dict):
            return None
        path = Path(note["path"]) if note["path"] is not None else None
        return Recovered(folder, name, lock, float(note["time"]), path, Path(note["folder"]), text)
    except (ClfractalError, ValueError, TypeError, KeyError):
        return None


def _locked_file(path: Path) -> int:
    """A descriptor of a new file that this process holds locked; OSError if that is not possible."""
    while True:
        descriptor = os.open(path, system.READ_AND_WRITE | os.O_CREAT, 0o600)
        # (Where files cannot be locked, the note's process number has to do.)
        with suppress(OSError):
            system.lock(descriptor, wait=True)
        # Another window may have taken the new file for a left one and removed it before it was locked.
        if _is_at(descriptor, path):
            return descriptor
        os.close(descriptor)


def _end_lock(descriptor: int, path: Path) -> None:
    """Removes a lock that this process holds, before others may take it where a file that is open can be removed."""
    if not system.RENAMES_OPEN_FILES:
        os.close(descriptor)
    with suppress(OSError):
        path.unlink()
    if system.RENAMES_OPEN_FILES:
        os.close(descriptor)


def _taken(path: Path) -> int | None:
    """A descriptor of the lock of a window that has ended, now held by this process; None if it is held elsewhere."""
    try:
        descriptor = os.open(path, system.READ_AND_WRITE)
    except OSError:
        return None
    try:
        system.lock(descriptor)
        gone = _is_at(descriptor, path)
    except system.HeldError:
        gone = False
    except OSError:
        # A file system without locks: the note tells whose it is.
        gone = not _runs(path.with_suffix(".json"))
    if gone:
        return descriptor
    os.close(descriptor)
    return None


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path))
    except OSError:
        return False


def _runs(note: Path) -> bool:
    """Whether the process that wrote a note still runs; a number that another process has by now does not count."""
    try:
        told = json.loads(note.read_text(encoding="utf-8"))
        started = _process_start(int(told["pid"]))
        return started is not None and started == told["started"]
    except (OSError, ValueError, TypeError, KeyError):
        return False


def _process_start(pid: int) -> str | None:
    """When a process started, as the system counts it; None if there is no such process."""
    if sys.platform != "linux":
        import psutil

        try:
            return str(psutil.Process(pid).create_time())
        except psutil.Error:
            return None
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    # The second field, the program's name in parentheses, may hold anything.
    return status.rpartition(")")[2].split()[19]


def _replace(path: Path, text: str) -> None:
    beside = path.with_name(f".{path.name}.new")
    beside.write_bytes(text.encode())
    system.replace(beside, path)


def _remove(folder: Path, name: str) -> None:
    for file in (f"{name}.json", f"{name}.yaml", f".{name}.json.new", f".{name}.yaml.new"):
        with suppress(OSError):
            (folder / file).unlink()
