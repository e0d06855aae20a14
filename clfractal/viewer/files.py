"""Files of the window: the scene that is opened, saved and watched, its safety copies, and pictures of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.errors import SceneError
from clfractal.files import resources
from clfractal.files.atomic import check_output
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.viewer.autosave import Autosave, Recovered
from clfractal.viewer.reloading import Reloading, loaded_again
from clfractal.viewer.saving import save_scene, scene_text
from clfractal.viewer.screenshots import Drawn, Screenshots, free_name
from clfractal.viewer.sources import SceneSource, is_protected, open_source, suggested_name
from clfractal.viewer.window_options import Options

if TYPE_CHECKING:
    from clfractal.viewer.screens import Outputs
    from clfractal.viewer.settings import Settings
    from clfractal.viewer.studio import Studio

_FIRST_SCENE = "mandelbulb.yaml"
_STEREO_WORDS = {"off": None, "none": None}


class Files:
    """What a window reads and writes.

    Attributes:
        source: where the scene came from.
        remarks: lines for the user about the start.
        wanted: a scene that is opened when it is clear what becomes of unsaved changes.
        recovered: unsaved changes to this scene, of windows that ended without saving; see `offered`.
    """

    def __init__(self, options: Options) -> None:
        self.options = options
        self.source = SceneSource()
        self.remarks: list[str] = []
        self.recovered: list[Recovered] = []
        self.wanted: Path | None = None
        self._studio: Studio | None = None
        self._outputs: Outputs | None = None
        self._parts: set[str] = set()  # of the window that are open
        self._set_title: Callable[[str], None] = lambda title: None
        self._left = False
        self._autosave = Autosave()
        self._autosaved = 0.0
        self._kept: Scene | None = None
        self._overrides, self._stereo = tuple(options.overrides), options.stereo
        self._reloading = Reloading(self._again)
        self._screenshots = Screenshots(options.shot)
        for path, kinds in ((options.shot, (".png",)), (options.save, (".yaml", ".yml"))):
            if path is not None:
                check_output(path, kinds)

    @property
    def studio(self) -> Studio:
        """The window's, once it is there."""
        assert self._studio is not None
        return self._studio

    @property
    def finished(self) -> bool:
        """Whether the window is to close."""
        return self._left or self._screenshots.finished

    # Opening

    def first_scene(self) -> Scene:
        """The scene of the command line, or the first of those that come with the program.

        Raises:
            ClfractalError: it is wrong, or a value of `--set` or `--stereo` is.
        """
        options = self.options
        path = Path(options.scene) if options.scene else resources.folder("scenes") / _FIRST_SCENE
        self.source = open_source(path)
        self._reloading.begin(self.source)
        return self._again(path, self.source)

    def _again(self, path: Path, source: SceneSource) -> Scene:
        """The scene of a file that was read; of the command line's one with the values from there."""
        scene = loaded_again(path, source, self._overrides)
        return scene if self._stereo is None else _with_stereo(scene, self._stereo)

    def attach(
        self, studio: Studio, outputs: Outputs, parts: set[str], set_title: Callable[[str], None]
    ) -> None:
        """The window is there.

        Args:
            parts: names of its parts that are open; see `Ui.show`.
            set_title: gives it a title.
        """
        self._studio, self._outputs, self._parts, self._set_title = studio, outputs, parts, set_title
        if self.source.loaded is not None:
            studio.saved = self.source.loaded
        studio.shared_in_text = lambda: self.source.shared
        self._kept = studio.document
        self._title()
        self._look_for_kept()
        if self.options.scene is None and self.options.shot is None:
            parts.add("gallery")

    def open(self, path: Path, *, sure: bool = False) -> None:
        """Shows another scene; asks first if the present one has unsaved changes.

        Args:
            sure: unsaved changes are given up.

        Raises:
            ClfractalError: it is wrong; the present one stays.
        """
        if self.studio.unsaved and not sure:
            self.wanted = path
            self._parts.add("replace")
            return
        source = open_source(path)
        scene = source.loaded or load_scene(path, posed=False)
        self.take(source, scene, saved=scene)
        self._look_for_kept()
        self.studio.tell(f"opened {path.name}")

    def take(self, source: SceneSource, scene: Scene, *, saved: Scene | None = None) -> None:
        """Shows a scene that was loaded; `saved`: what its file has, if that is another."""
        self.source = source
        self._overrides, self._stereo = (), None
        studio = self.studio
        studio.open(scene)
        if saved is not None:
            studio.saved = studio.opened = saved
        self._kept = studio.document
        self._reloading.begin(source)
        self._autosave.clear()
        self._title()

    def reload(self) -> None:
        """Loads the scene's file again, also when it did not change; see `Reloading`."""
        self.source = self._reloading.reload(self.source, self.studio)

    @property
    def offered(self) -> list[Recovered]:
        """Unsaved changes to this scene that are offered now, the newest first: never over a projector's picture."""
        return [] if self._outputs is not None and self._outputs.fills_screens else self.recovered

    def _look_for_kept(self) -> None:
        """Looks for unsaved changes to the scene that was opened; those to other scenes wait until these are opened."""
        self.put_off()
        if self.options.shot is None and self.options.play is None:
            self.recovered = self._autosave.found(self.source.path)

    def recover(self, found: Recovered) -> None:
        """Goes on with unsaved changes of a window that ended."""
        scene, source = found.scene(), found.source()
        self.take(source, scene, saved=source.loaded)
        self._autosave.write(source, scene)  # before the only copy goes away
        self.discard(found)
        self.put_off()

    def discard(self, found: Recovered) -> None:
        """Forgets unsaved changes of a window that ended."""
        self.recovered.remove(found)
        found.discard()

    def put_off(self) -> None:
        """Leaves unsaved changes for the next time that their scene is opened."""
        for each in self.recovered:
            each.release()
        self.recovered = []

    # Saving

    def text(self) -> str:
        """The scene as YAML."""
        return scene_text(self.source, self.studio.document, self.studio.formula_texts)

    @property
    def suggestion(self) -> Path:
        """A name under which the scene can be saved."""
        own = self.source.path if self.source.kind == "scene" else None
        return self.options.save or own or suggested_name(self.source, Path.cwd())

    def save(self) -> None:
        """Saves where Ctrl+S saves; asks for a name where nothing may be overwritten."""
        own = self.source.path
        target = self.options.save or (own if own is not None and not is_protected(own) else None)
        if target is None:
            self._parts.add("save")
        else:
            self.save_as(target)

    def save_as(self, target: Path, *, even_if_changed: bool = False) -> None:
        """Saves under a name.

        Raises:
            FileError: it is protected, cannot be written, or has changed on the disk since it was read.
        """
        studio = self.studio
        scene = studio.document
        self.source = save_scene(
            self.source, scene, target, even_if_changed=even_if_changed, texts=studio.formula_texts
        )
        # In another folder maps and grids may have other names.
        studio.keep(self.source.loaded or scene)
        self._kept = studio.document
        self._overrides, self._stereo = (), None  # the file has them now
        self._reloading.written(self.source)
        self._autosave.clear()
        self._title()
        studio.tell(f"saved {target}")

    def screenshot(self, *, panels: bool = False) -> None:
        """The next frame goes to a PNG beside the scene, alone or with the panels over it."""
        self._screenshots.take(self.source, panels=panels)

    def export(self) -> None:
        """The picture with all channels, at the window's size, as EXR beside the scene."""
        target = free_name(self.source, "exr")
        still = self.studio.render_still((target,))
        self.studio.tell(f"rendering {target.name} in the background", holds=lambda: not still.finished)

    # Again and again

    def tick(self, now: float, settings: Settings, *, dragging: bool, played: bool) -> None:
        """Looks after the file on the disk and the safety copy; leaves when a recording is played.

        Args:
            dragging: whether the scene changes with the pointer right now.
            played: whether nothing of a recording is left.
        """
        studio = self.studio
        if settings.watch:
            self.source = self._reloading.look(self.source, studio)
        every = settings.autosave
        if every and now - self._autosaved >= every:
            self._autosaved = now
            document = studio.document
            if document is not self._kept and studio.edited and not dragging:
                self._kept = document
                self._autosave.write(self.source, document, studio.formula_texts)
        self._title()
        if self.options.play is not None and played and self.options.shot is None and studio.session.idle:
            self.leave()

    @property
    def patience(self) -> float:
        """How long the window's loop may sleep, seconds."""
        return 0.02 if self.options.shot is not None else 0.5

    def ask_to_close(self) -> None:
        """Closes the window, or asks first if something is unsaved; asked while it asks, it closes."""
        if self.studio.unsaved and self.options.shot is None and "close" not in self._parts:
            self._parts.add("close")
        else:
            self.leave()

    def leave(self) -> None:
        """Closes the window; unsaved changes are given up."""
        self._left = True

    def after_draw(self, drawn: Drawn) -> bool:
        """Takes screenshots of what was drawn and not yet shown; whether one waits for another frame."""
        return self._screenshots.after_draw(drawn, self.studio)

    def keep(self) -> None:
        """The window ends without being closed: what is unsaved is offered at the next start."""
        if self._studio is not None and self.options.shot is None and self.studio.edited:
            self._autosave.write(self.source, self.studio.document, self.studio.formula_texts)
            self._autosave.release()

    def close(self) -> None:
        """A clean end: the safety copy is not needed any more."""
        self.put_off()
        self._autosave.close()

    def _title(self) -> None:
        name = self.source.path.name if self.source.path is not None else "new scene"
        text = f"{name}{' *' if self.studio.unsaved else ''}"
        if text != self._titled:
            self._titled = text
            self._set_title(text)

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
        return edited(scene, {"stereo.mode": word})
    except SceneError as error:
        where = replace(error.where, file="--stereo", line=None, column=None)
        raise SceneError(error.message, where) from error
