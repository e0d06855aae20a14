"""Pictures of the window: what it shows as a PNG, alone or with its panels, beside the scene or where `--shot` says."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clfractal.errors import ClfractalError
from clfractal.files.png import SCENE_KEY, write_png_pixels
from clfractal.scene.load import dump_scene
from clfractal.scene.model import Scene
from clfractal.viewer.own_files import is_own
from clfractal.viewer.sources import SceneSource

if TYPE_CHECKING:
    from clfractal.viewer.app import Viewer

_STILL_FRAMES = 4
"""Panels need a few frames to find their sizes."""


class Shots:
    """Writes what was drawn before it is shown.

    Args:
        wanted: the file of `--shot`; None: none.
    """

    def __init__(self, wanted: Path | None) -> None:
        self.wanted = wanted
        self._next: list[tuple[Path, bool]] = []
        self._ready = 0

    def take(self, source: SceneSource, *, panels: bool) -> None:
        """The next frame goes to a PNG beside the scene: the picture alone, or with the panels that lie over it."""
        # (Two keys may be pressed before a frame is drawn.)
        taken = [path for path, _ in self._next]
        self._next.append((free_name(source, "png", taken), panels))

    def after_draw(self, viewer: Viewer) -> None:
        """Writes what is wanted of the frame that was drawn.

        Raises:
            ClfractalError: what `--shot` waits for cannot be rendered or written.
        """
        wanted, self._next = self._next, []
        for target, panels in wanted:
            try:
                pixels = viewer.outputs.read() if panels else viewer.picture_alone()
                write_shot(target, pixels, viewer.studio.shown_scene)
                viewer.studio.tell(f"saved {_shown(target)}")
            except ClfractalError as error:
                viewer.studio.tell(str(error), wrong=True)
        if self.wanted is not None:
            self._finished(viewer, self.wanted)

    def _finished(self, viewer: Viewer, target: Path) -> None:
        """Writes `--shot`'s file and closes the window, as soon as the picture is finished."""
        shown, session = viewer.surface.shown, viewer.studio.session
        if session.problem is not None and session.idle:
            viewer.finished = True
            raise session.problem
        settled = shown is not None and shown.frame.finished and shown.frame.request == session.newest
        current = settled and shown is not None and shown.look == viewer.studio.look
        if not (current and viewer.inputs.played and not viewer.motion.active and session.idle):
            self._ready = 0
            return
        self._ready += 1
        if self._ready < _STILL_FRAMES:
            viewer.redraw()
            return
        write_shot(target, viewer.outputs.read(), viewer.studio.shown_scene)
        viewer.finished = True


def free_name(source: SceneSource, ending: str, taken: list[Path] | None = None) -> Path:
    """A name for a picture of a scene that no file has: beside the scene, if that is the user's own folder.

    Args:
        taken: names that others will have.
    """
    stem = source.path.stem if source.path is not None else "scene"
    folder, number = _folder(source), 1
    while True:
        found = folder / f"{stem}-{number:03}.{ending}"
        if not os.path.lexists(found) and found not in (taken or ()):
            return found
        number += 1


def write_shot(target: Path, pixels: Any, scene: Scene) -> None:
    """Writes a screenshot, uint8 of shape (height, width, 3); it holds the scene, so that it can be opened again.

    Raises:
        FileError: it cannot be written.
    """
    write_png_pixels(target, np.ascontiguousarray(pixels), {SCENE_KEY: dump_scene(scene)})


def _folder(source: SceneSource) -> Path:
    """The scene's folder; the current one for what comes with the program, or where nothing can be written."""
    if source.path is None or is_own(source.path):
        return Path.cwd()
    folder = source.path.absolute().parent
    return folder if os.access(folder, os.W_OK) else Path.cwd()


def _shown(target: Path) -> str:
    """A file's name, with its folder unless that is the current one."""
    return target.name if target.parent == Path.cwd() else str(target)
