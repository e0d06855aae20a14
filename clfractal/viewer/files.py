"""Files of the window: the scene that is opened, saved and watched, its safety copies, and pictures of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clfractal import resources
from clfractal.errors import ClfractalError, SceneError
from clfractal.files.atomic import check_output
from clfractal.files.png import SCENE_KEY, write_png_pixels
from clfractal.files.watching import Watched
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from clfractal.viewer.autosave import Autosave, Recovered
from clfractal.viewer.options import Options
from clfractal.viewer.saving import save_scene, scene_text
from clfractal.viewer.sources import SceneSource, is_protected, open_source, suggested_name

if TYPE_CHECKING:
    from clfractal.viewer.app import Viewer

_FIRST_SCENE = "mandelbulb.yaml"
_STEREO_WORDS = {"off": None, "none": None}


class Files:
    """What a window reads and writes.

    Attributes:
        source: where the scene came from.
        remarks: lines for the user about the start.
        wanted: a scene that is opened when it is clear what becomes of unsaved changes.
        recovered: unsaved changes of windows that ended without saving; panels offer them.
        reload_problem: why the file that changed on the disk cannot be shown; empty if it can.
    """

    def __init__(self, options: Options) -> None:
        self.options = options
        self.source = SceneSource()
        self.remarks: list[str] = []
        self.recovered: list[Recovered] = []
        self.reload_problem = ""
        self.wanted: Path | None = None
        self._viewer: Viewer | None = None
        self._autosave = Autosave()
        self._autosaved = 0.0
        self._kept: Scene | None = None
        self._watched = Watched(())
        self._shot_ready = 0
        self._stale = False
        for path, kinds in ((options.shot, (".png",)), (options.save, (".yaml", ".yml"))):
            if path is not None:
                check_output(path, kinds)

    @property
    def viewer(self) -> Viewer:
        """The window, once it is there."""
        assert self._viewer is not None
        return self._viewer

    # Opening

    def first_scene(self) -> Scene:
        """The scene of the command line, or the first of those that come with the program.

        Raises:
            ClfractalError: it is wrong, or a value of `--set` or `--stereo` is.
        """
        options = self.options
        path = Path(options.scene) if options.scene else resources.folder("scenes") / _FIRST_SCENE
        overrides = list(options.overrides)
        self.source = open_source(path)
        self._watched = Watched(self.source.watched)
        loaded = self.source.loaded
        scene = (
            loaded
            if loaded is not None and not overrides
            else load_scene(path, overrides=overrides, posed=False)
        )
        if options.stereo is not None:
            scene = _with_stereo(scene, options.stereo)
        return scene

    def attach(self, viewer: Viewer) -> None:
        """The window is there."""
        self._viewer = viewer
        viewer.ui.memory["files"] = self
        if self.source.loaded is not None:
            viewer.studio.saved = self.source.loaded
        self._kept = viewer.studio.document
        self._title()
        if self.options.shot is None and self.options.play is None:
            self.recovered = self._autosave.found()
        if self.options.scene is None and self.options.shot is None:
            viewer.ui.show.add("gallery")

    def open(self, path: Path, *, sure: bool = False) -> None:
        """Shows another scene; asks first if the present one has unsaved changes.

        Args:
            sure: unsaved changes are given up.

        Raises:
            ClfractalError: it is wrong; the present one stays.
        """
        if self.viewer.studio.unsaved and not sure:
            self.wanted = path
            self.viewer.ui.show.add("replace")
            return
        source = open_source(path)
        scene = source.loaded or load_scene(path, posed=False)
        self.take(source, scene, saved=scene)
        self.viewer.studio.tell(f"opened {path.name}")

    def take(self, source: SceneSource, scene: Scene, *, saved: Scene | None = None) -> None:
        """Shows a scene that was loaded; `saved`: what its file has, if that is another."""
        self.source = source
        self.viewer.studio.open(scene)
        if saved is not None:
            self.viewer.studio.saved = saved
        self._kept = self.viewer.studio.document
        # What has changed while it was read is told with the next look.
        self._watched = Watched(source.watched)
        self._stale = source.changed_on_disk if source.path is not None else False
        self._autosave.clear()
        self.reload_problem = ""
        self._title()

    def reload(self) -> None:
        """Loads the scene's file again, also when it did not change."""
        if self.source.path is None:
            self.viewer.studio.tell("the scene has no file", wrong=True)
            return
        self._watched.accept()
        try:
            source = open_source(self.source.path)
            scene = source.loaded or load_scene(self.source.path, posed=False)
        except ClfractalError as error:
            self.reload_problem = str(error)
            self.viewer.studio.tell(str(error), wrong=True)
            return
        self.reload_problem = ""
        studio = self.viewer.studio
        self.source = source
        studio.set_document(scene)  # a step that can be undone: nothing is lost
        studio.saved = source.loaded or scene
        self._watched.follow(source.watched)
        studio.tell(f"loaded {source.path.name if source.path else 'the scene'} again")

    def recover(self, found: Recovered) -> None:
        """Goes on with unsaved changes of a window that ended."""
        scene = found.scene()
        source = found.source()
        self.take(source, scene, saved=source.loaded)
        self._autosave.write(source, scene)  # before the only copy goes away
        self.recovered.remove(found)
        found.discard()

    def discard(self, found: Recovered) -> None:
        """Forgets unsaved changes of a window that ended."""
        self.recovered.remove(found)
        found.discard()

    # Saving

    def text(self) -> str:
        """The scene as YAML."""
        return scene_text(self.source, self.viewer.studio.document)

    @property
    def suggestion(self) -> Path:
        """A name under which the scene can be saved."""
        if self.options.save is not None:
            return self.options.save
        if self.source.path is not None and self.source.kind == "scene":
            return self.source.path
        return suggested_name(self.source, Path.cwd())

    def save(self) -> None:
        """Saves where Ctrl+S saves; asks for a name where nothing may be overwritten."""
        target = self.options.save
        if target is None and self.source.path is not None and not is_protected(self.source.path):
            target = self.source.path
        if target is None:
            self.viewer.ui.show.add("save")
        else:
            self.save_as(target)

    def save_as(self, target: Path, *, even_if_changed: bool = False) -> None:
        """Saves under a name.

        Raises:
            FileError: it is protected, cannot be written, or has changed on the disk since it was read.
        """
        studio = self.viewer.studio
        scene = studio.document
        self.source = save_scene(self.source, scene, target, even_if_changed=even_if_changed)
        # In another folder maps and grids may have other names.
        studio.keep(self.source.loaded or scene)
        self._kept = studio.document
        self._watched.follow(self.source.watched)
        self._watched.accept()
        self._autosave.clear()
        self._title()
        studio.tell(f"saved {target}")

    def screenshot(self) -> None:
        """The next frame goes to a PNG beside the scene, or in the current folder."""
        self._shot_to = self._free("png")

    _shot_to: Path | None = None

    def export(self) -> None:
        """The picture with all channels, at the window's size, as EXR."""
        target = self._free("exr")
        self.viewer.studio.render_still((target,))
        self.viewer.studio.tell(f"rendering {target.name} in the background")

    def _free(self, ending: str) -> Path:
        stem = self.source.path.stem if self.source.path is not None else "scene"
        number = 1
        while (found := Path.cwd() / f"{stem}-{number:03}.{ending}").exists():
            number += 1
        return found

    # Again and again

    def tick(self, now: float) -> None:
        """Looks after the file on the disk and the safety copy."""
        viewer = self.viewer
        settings, studio = viewer.settings, viewer.studio
        if settings.watch and (self._stale or self._watched.changed()):
            self._stale = False
            self._changed_on_disk()
        every = settings.autosave
        if every and now - self._autosaved >= every:
            self._autosaved = now
            document = studio.document
            if document is not self._kept and studio.unsaved and not viewer.controls.dragging:
                self._kept = document
                self._autosave.write(self.source, document)
        self._title()
        played = self.options.play is not None and viewer.inputs.played
        if played and self.options.shot is None and studio.session.idle:
            viewer.finished = True

    @property
    def patience(self) -> float:
        """How long the window's loop may sleep, seconds."""
        return 0.02 if self.options.shot is not None else 0.5

    def _changed_on_disk(self) -> None:
        studio = self.viewer.studio
        if studio.unsaved:
            studio.tell("the file has changed on the disk; F5 loads it (your changes can be undone to)")
            self._watched.accept()
        else:
            self.reload()

    def ask_to_close(self) -> None:
        """Closes the window, or asks first if something is unsaved; asked while it asks, it closes."""
        shown = self.viewer.ui.show
        if self.viewer.studio.unsaved and self.options.shot is None and "close" not in shown:
            shown.add("close")
        else:
            self.leave()

    def leave(self) -> None:
        """Closes the window; unsaved changes are given up."""
        self.viewer.finished = True

    def after_draw(self, framebuffer: tuple[int, int]) -> None:
        """Takes screenshots of what was drawn and not yet shown."""
        viewer = self.viewer
        if self._shot_to is not None:
            target, self._shot_to = self._shot_to, None
            try:
                _write(target, viewer.outputs.read(), viewer.studio.shown_scene)
                viewer.studio.tell(f"saved {target.name}")
            except ClfractalError as error:
                viewer.studio.tell(str(error), wrong=True)
        if self.options.shot is None:
            return
        shown, session = viewer.surface.shown, viewer.studio.session
        if session.problem is not None and session.idle:
            viewer.finished = True
            raise session.problem
        settled = shown is not None and shown.frame.finished and shown.frame.request == session.newest
        current = settled and shown is not None and shown.look == viewer.studio.look
        if current and viewer.inputs.played and not viewer.motion.active and session.idle:
            # Panels need a few frames to find their sizes.
            self._shot_ready += 1
            if self._shot_ready < 4:
                viewer.redraw()
                return
            _write(self.options.shot, viewer.outputs.read(), viewer.studio.shown_scene)
            viewer.finished = True
        else:
            self._shot_ready = 0

    def keep(self) -> None:
        """The window ends without being closed: what is unsaved is offered at the next start."""
        if self._viewer is not None and self.options.shot is None and self.viewer.studio.unsaved:
            self._autosave.write(self.source, self.viewer.studio.document)
            self._autosave.release()

    def close(self) -> None:
        """A clean end: the safety copy is not needed any more."""
        for each in self.recovered:
            each.release()
        self._autosave.close()

    def _title(self) -> None:
        viewer = self._viewer
        if viewer is None:
            return
        name = self.source.path.name if self.source.path is not None else "new scene"
        text = f"{name}{' *' if viewer.studio.unsaved else ''}"
        if text != self._titled:
            self._titled = text
            viewer.window.title(text)

    _titled = ""


def _with_stereo(scene: Scene, word: str) -> Scene:
    """The scene with a stereo mode of the command line.

    Raises:
        SceneError: an unknown mode, or a scene that cannot be seen by two eyes.
    """
    from clfractal.viewer.editing import edited

    if word in _STEREO_WORDS:
        return scene.model_copy(update={"stereo": None})
    try:
        if scene.stereo is None:
            return edited(scene, {"stereo": {"mode": word}})
        return edited(scene, {"stereo.mode": word})
    except SceneError as error:
        raise SceneError(
            error.message, replace(error.where, file="--stereo", line=None, column=None)
        ) from error


def _write(target: Path, pixels: Any, scene: Scene) -> None:
    """Writes a screenshot, uint8 of shape (height, width, 3); it holds the scene, so that it can be opened again.

    Raises:
        FileError: it cannot be written.
    """
    write_png_pixels(target, np.ascontiguousarray(pixels), {SCENE_KEY: dump_scene(scene)})
