"""Pictures of the window as PNG files, alone or with its panels, for a key or `--shot`."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clfractal.files.png import SCENE_KEY, write_png_pixels
from clfractal.scene.load import dump_scene
from clfractal.scene.model import Scene
from clfractal.viewer.own_files import is_own
from clfractal.viewer.sources import SceneSource

if TYPE_CHECKING:
    from clfractal.viewer.display import Shown
    from clfractal.viewer.studio import Studio

_STILL_FRAMES = 4
"""Panels need a few frames to find their sizes."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A frame of the window that is drawn and not yet swapped in.

    Attributes:
        shown: the picture in it; None before the first one.
        still: whether nothing moves by itself, and nothing of a recording is left to play.
        whole, picture: read the pixels of all of it, and of the picture without what lies over it.
    """

    shown: Shown | None
    still: bool
    whole: Callable[[], Any]
    picture: Callable[[], Any]


class Screenshots:
    """Writes what was drawn before it is shown.

    Args:
        wanted: the file of `--shot`; None: none.

    Attributes:
        finished: whether that file is written.
    """

    def __init__(self, wanted: Path | None) -> None:
        self.wanted, self.finished = wanted, False
        self._next: list[tuple[Path, bool]] = []
        self._ready = 0

    def take(self, source: SceneSource, *, panels: bool) -> None:
        """The next frame goes to a PNG beside the scene: the picture alone, or with the panels that lie over it."""
        # (Two keys may be pressed before a frame is drawn.)
        taken = [path for path, _ in self._next]
        self._next.append((free_name(source, "png", taken), panels))

    def after_draw(self, drawn: Drawn, studio: Studio) -> bool:
        """Writes what is wanted of a frame; whether another one is to be drawn for what `--shot` waits for.

        Raises:
            ClfractalError: what `--shot` waits for cannot be rendered or written.
        """
        wanted, self._next = self._next, []
        for target, panels in wanted:
            with studio.telling():
                write_screenshot(target, drawn.whole() if panels else drawn.picture(), studio.shown_scene)
                studio.tell(f"saved {target.name if target.parent == Path.cwd() else target}")
        return self.wanted is not None and self._waits(drawn, studio, self.wanted)

    def _waits(self, drawn: Drawn, studio: Studio, target: Path) -> bool:
        """Writes `--shot`'s file as soon as the picture is finished; whether panels need another frame before."""
        shown, session = drawn.shown, studio.session
        if session.problem is not None and session.idle:
            raise session.problem
        settled = shown is not None and shown.frame.finished and shown.frame.request == session.newest
        current = settled and shown is not None and shown.look == studio.look
        if not (current and drawn.still and session.idle):
            self._ready = 0
            return False
        self._ready += 1
        if self._ready < _STILL_FRAMES:
            return True
        write_screenshot(target, drawn.whole(), studio.shown_scene)
        self.finished = True
        return False


def free_name(source: SceneSource, ending: str, taken: list[Path] | None = None) -> Path:
    """A name for a picture of a scene that no file has: beside the scene, if that is the user's own folder.

    Args:
        taken: names that others will have.
    """
    stem, folder = source.path.stem if source.path is not None else "scene", _folder(source)
    names = (folder / f"{stem}-{number:03}.{ending}" for number in count(1))
    return next(each for each in names if not os.path.lexists(each) and each not in (taken or ()))


def write_screenshot(target: Path, pixels: Any, scene: Scene) -> None:
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
