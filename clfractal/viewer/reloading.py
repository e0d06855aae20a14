"""The scene's file while its window is open: what another program changes in it is loaded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from clfractal.errors import ClfractalError
from clfractal.files.watching import Watched
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.viewer.kept_view import seen_as_before
from clfractal.viewer.sources import SceneSource, open_source
from clfractal.viewer.studio import Studio


class Reloading:
    """Follows the files that a scene comes from.

    Args:
        again: loads a scene file as it was opened: with the values of the command line, if it is the one named there.

    Attributes:
        problem: why the file that changed on the disk cannot be shown; empty if it can.
    """

    def __init__(self, again: Callable[[Path, SceneSource], Scene]) -> None:
        self.problem = ""
        self._again = again
        self._watched = Watched(())
        self._stale = False
        self._gone: set[Path] = set()
        self._loads = 0  # how often file and window have come to agree, or parted anew

    def begin(self, source: SceneSource) -> None:
        """Follows another scene; what has changed while it was read is loaded with the next look."""
        self._watched = Watched(source.watched)
        self._stale = source.path is not None and source.changed_on_disk
        self._gone.clear()
        self.problem = ""

    def written(self, source: SceneSource) -> None:
        """The window itself has written the file."""
        self._watched.follow(source.watched)
        self._watched.accept()
        self._gone.clear()
        self._loads += 1

    def look(self, source: SceneSource, studio: Studio) -> SceneSource:
        """Loads what has changed on the disk, or tells why not; gives the source that counts from now on."""
        changed = self._watched.changed() or self._stale
        self._stale = False
        gone = set(self._watched.missing)
        if lost := sorted(gone - self._gone):
            studio.tell(_told_lost(lost, source), wrong=True, holds=lambda: bool(self._gone))
        self._gone = gone
        if not changed:
            return source
        if studio.edited:
            name = source.path.name if source.path is not None else "the file"
            self._loads += 1
            count = self._loads
            studio.tell(
                f"{name} has changed on the disk; F5 loads it (your changes can be undone to)",
                wrong=True,
                holds=lambda: self._loads == count,
            )
            self._watched.accept()
            return source
        return self.reload(source, studio)

    def reload(self, source: SceneSource, studio: Studio) -> SceneSource:
        """Loads the file, also when it did not change. The window looks from where it looked: cameras stay where they were
        moved here. It is a step that can be undone.
        """
        if source.path is None:
            studio.tell("the scene has no file", wrong=True)
            return source
        self._watched.accept()
        try:
            found = open_source(source.path)
            scene = self._again(source.path, found)
        except ClfractalError as error:
            problem = self.problem = str(error)
            studio.tell(problem, wrong=True, holds=lambda: self.problem == problem)
            return source
        self.problem = ""
        self._loads += 1
        studio.load_again(seen_as_before(scene, studio.opened, studio.document), scene, found.loaded or scene)
        self._watched.follow(found.watched)
        studio.tell(f"loaded {source.path.name} again")
        return found


def loaded_again(path: Path, source: SceneSource, overrides: Sequence[str]) -> Scene:
    """The scene of a file that was read, with values of the command line.

    Raises:
        ClfractalError: they do not fit it.
    """
    if source.loaded is not None and not overrides:
        return source.loaded
    return load_scene(path, overrides=list(overrides), posed=False)


def _told_lost(lost: Sequence[Path], source: SceneSource) -> str:
    names = ", ".join(path.name for path in lost)
    if source.path in lost:
        return f"{names} was deleted or moved away; Ctrl+S writes it again"
    return f"{names}, which the scene names, was deleted or moved away"
