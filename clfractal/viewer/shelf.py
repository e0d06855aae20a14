"""Scene files with small pictures, as a gallery shows them, read by a thread."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from clfractal.engine import thumbnails
from clfractal.engine.thumbnails import Pixels
from clfractal.errors import ClfractalError
from clfractal.scene.load import load_scene, read_text
from clfractal.scene.model import Scene
from clfractal.viewer.background import opaque
from clfractal.viewer.preparing import internal_error


@dataclass(slots=True, eq=False)
class Entry:
    """A scene file.

    Attributes:
        path: the file.
        title, about: its first line of comment, and those that follow.
        scene: as its picture shows it; None before it was read.
        kind: `surface`, `volume`, `cut` or `stereo`; empty before it was read.
        key: of its picture on the disk; empty before it was looked for.
        pixels: its picture, shape (270, 480, 4); None if there is none yet.
        problem: why there is none, or empty.
    """

    path: Path
    title: str
    about: str = ""
    scene: Scene | None = None
    kind: str = ""
    key: str = ""
    pixels: Pixels | None = None
    problem: str = ""


class Shelf:
    """Scene files and their pictures.

    Args:
        paths: of the scenes.
        device: key of the device that renders the pictures (`DeviceInfo.key`).
        woken: called from the thread when something was read.

    Attributes:
        entries: one for each scene, in the order of `paths`.
    """

    def __init__(self, paths: Iterable[Path], device: str, woken: Callable[[], None]) -> None:
        self.entries = [Entry(path, path.stem.replace("_", " ").capitalize()) for path in paths]
        self.device, self.woken = device, woken
        self._asked: set[Entry] = set()
        self._urgent: deque[Entry] = deque()
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="clfractal-shelf")
        self._pool.submit(self._read_words)
        for _ in self.entries:
            self._pool.submit(self._go_on)

    def look(self, entry: Entry) -> None:
        """Reads a scene before the others, and looks for its picture on the disk; `entry.key` is set when that was done."""
        if entry not in self._asked:
            self._asked.add(entry)
            self._urgent.append(entry)
            self._pool.submit(self._go_on)

    def keep(self, entry: Entry) -> None:
        """Keeps the picture of a scene on the disk."""
        if entry.key and entry.pixels is not None:
            self._pool.submit(thumbnails.store, entry.key, entry.pixels)

    @property
    def read(self) -> bool:
        """Whether all scenes were read."""
        return all(entry.scene is not None or entry.problem for entry in self.entries)

    def close(self) -> None:
        """Waits until all pictures are kept."""
        self._pool.shutdown()

    def _read_words(self) -> None:
        for entry in self.entries:
            _read_words(entry)
        self.woken()

    def _go_on(self) -> None:
        """The next piece of work: a scene that is looked at, else one that was not read yet."""
        urgent = bool(self._urgent)
        unread = (each for each in self.entries if each.scene is None and not each.problem)
        entry = self._urgent.popleft() if urgent else next(unread, None)
        if entry is None:
            return
        try:
            if entry.scene is None:
                _read_scene(entry)
            if urgent and entry.scene is not None:
                self._find(entry, entry.scene)
        except ClfractalError as error:
            entry.problem = error.message
        except Exception as error:  # the others can be shown
            entry.problem = internal_error(error).message
        self.woken()

    def _find(self, entry: Entry, scene: Scene) -> None:
        key = thumbnails.key_of(scene, self.device)
        found = thumbnails.load(key)
        if found is not None:
            entry.pixels = opaque(found)
        entry.key = key


def kind_of(scene: Scene) -> str:
    """What a scene is an example of: `stereo`, `volume`, `cut` (planes) or `surface`."""
    if scene.stereo is not None:
        return "stereo"
    renderers = [scene.renderer, *(view.renderer for view in (scene.layout.views if scene.layout else ()))]
    kinds = {renderer.type for renderer in renderers if renderer is not None}
    if "volume" in kinds:
        return "volume"
    return "cut" if "cut_plane" in kinds or scene.cut_planes else "surface"


def _read_words(entry: Entry) -> None:
    with suppress(ClfractalError):
        title, entry.about = thumbnails.words_of(read_text(entry.path))
        entry.title = title or entry.title


def _read_scene(entry: Entry) -> None:
    scene = load_scene(entry.path)
    entry.kind = kind_of(scene)
    entry.scene = thumbnails.shown_scene(scene)
