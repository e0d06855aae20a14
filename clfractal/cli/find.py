"""`clfractal find`: views of a scene's set that are worth a look, as scene files, or as bookmarks of one."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.cli.new import EXTENSIONS
from clfractal.cli.order import Order, naming_options
from clfractal.cli.pipes import piped
from clfractal.cli.proposals import (
    CHANNELS,
    Moved,
    Pixels,
    Proposals,
    refuse_existing,
    small_size,
    write_scene,
)
from clfractal.cli.render import ordered_scene
from clfractal.cli.shell import Shell
from clfractal.engine.finding import found_views
from clfractal.engine.found import MOST, check_suitable, checked, checked_magnification
from clfractal.engine.variations import small_scene
from clfractal.errors import SceneError, Where, speaking_of
from clfractal.files.atomic import check_output
from clfractal.files.inputs import refuse_overwriting
from clfractal.scene.bookmarks import MAX_BOOKMARKS
from clfractal.scene.load import load_scene

if TYPE_CHECKING:
    from clfractal.engine.found import FoundView
    from clfractal.images.framebuffer import Framebuffer
    from clfractal.scene.model import Scene

_OPTIONS = {"count": "--count", "seed": "--seed", "magnification": "--magnification"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice(Proposals):
    """The options of `clfractal find` beside those of a render; `order.size` is that of the small pictures.

    `output` may also be a scene file: the scene with the best view as its camera, and all of them as bookmarks.
    """

    seed: int = 0
    magnification: float | None = None

    @property
    def is_scene(self) -> bool:
        """Whether the output is one scene with all views."""
        return self.output.suffix.lower() in EXTENSIONS and not self.output.is_dir()

    @property
    def is_sheet(self) -> bool:
        """As of all proposals."""
        return bool(self.output.suffix) and not self.is_scene and not self.output.is_dir()

    @property
    def folder(self) -> Path:
        """As of all proposals."""
        return self.output.parent if self.is_sheet or self.is_scene else self.output


def find_views(order: Order, choice: Choice, shell: Shell) -> None:
    """Writes views of a scene to NAME-01.yaml, NAME-02.yaml, ..., the best first; or to one scene, as bookmarks.

    All files appear complete or not at all; files that exist are never replaced.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device; nothing was found.
    """
    choice.check("views", MOST)
    with naming_options(_OPTIONS):
        checked(choice.count, choice.seed)
    if choice.magnification is not None and choice.is_scene:
        raise SceneError(
            f"{choice.output}: bookmarks have no iterations of their own; name a folder with -o",
            Where("--magnification"),
        )
    with piped(shell, order.scene, ()) as files:
        _find(replace(order, scene=files.source, folder=files.folder), choice, shell)


def _find(order: Order, choice: Choice, shell: Shell) -> None:
    begun = time.perf_counter()
    sized = ordered_scene(order)
    # The scene files keep the scene's own size: the option is for the small pictures.
    scene = load_scene(Path(order.scene), overrides=order.overrides, folder=order.folder)
    with speaking_of(order.scene):
        check_suitable(scene, deeper=choice.magnification is not None)
        if choice.magnification is not None:
            with naming_options(_OPTIONS):
                checked_magnification(scene, choice.magnification)
    size = (sized.image.width, sized.image.height) if order.size is not None else small_size(scene)
    moved = Moved(Path(order.scene), scene, choice.folder, "views")
    shell.state = lambda: "clfractal: interrupted; nothing was written"
    names = choice.names(Path(order.scene))
    _check_files(scene, choice, names, order.scene)
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.engine.engine import Engine

    pictures: list[Pixels] = []
    with choice.folder_made(), Engine(order.device, tell=shell.say) as engine, speaking_of(order.scene):
        found = found_views(
            scene, engine, count=choice.count, seed=choice.seed, magnification=choice.magnification
        )

        def picture(view: FoundView) -> Framebuffer:
            return engine.render(small_scene(view.scene, *size), channels=CHANNELS)

        written = 0
        shell.state = lambda: f"clfractal: interrupted with {written} of {len(found)} views written"
        for number, (name, view) in enumerate(zip(names, found, strict=False), start=1):
            line = f"{number}: {view.remark}"
            if not choice.is_scene or choice.sheets:
                small = picture(view)
                pictures.append(small.to_rgb8())
                if not choice.is_scene:
                    heading = (f"View {number} of {Path(order.scene).name} (seed {choice.seed})", view.remark)
                    line = f"{choice.write(name, moved.text(view.scene), heading, small)}: {view.remark}"
                    written = number
            shell.say(line)
    if choice.is_scene:
        lines = [
            f"Views of {Path(order.scene).name} (seed {choice.seed}); the camera is the first of the bookmarks"
        ]
        write_scene(choice.output, moved.text(_with_bookmarks(scene, found)), lines)
        shell.state = lambda: f"clfractal: interrupted; {choice.output} is written"
        shell.say(f"{choice.output}: {_counted(found, 'bookmark')}")
    for line in choice.save_sheets(pictures):
        shell.say(line)
    shell.state = lambda: "clfractal: interrupted"
    few = f" (no more of {choice.count} differ and show as much)" if len(found) < choice.count else ""
    shell.say(f"{_counted(found, 'view')}{few}: {time.perf_counter() - begun:.2f} s")


def _counted(found: list[FoundView], thing: str) -> str:
    return f"{len(found)} {thing}{'' if len(found) == 1 else 's'}"


def _check_files(scene: Scene, choice: Choice, names: list[str], source: str) -> None:
    if not choice.is_scene:
        choice.check_files(scene, names)
        return
    if len(scene.bookmarks) + choice.count > MAX_BOOKMARKS:
        raise SceneError(
            f"a scene has at most {MAX_BOOKMARKS} bookmarks, and this one has {len(scene.bookmarks)} already;"
            " write the views to a folder with -o",
            Where(source, path="bookmarks"),
        )
    refuse_existing((choice.output, *choice.sheets), (choice.output, *choice.sheets))
    choice.check_sheets()
    check_output(choice.output, EXTENSIONS)
    refuse_overwriting([choice.output, *choice.sheets], scene.files)


def _with_bookmarks(scene: Scene, found: list[FoundView]) -> Scene:
    """The scene with the best view, and all of them as bookmarks after its own, whose names they do not take."""
    known = [re.fullmatch(r"view 0*(\d{1,9})", name) for name in scene.bookmarks]
    last = max((int(each[1]) for each in known if each), default=0)
    digits = len(str(last + len(found)))
    cameras = {
        f"view {number:0{digits}d}": view.scene.camera for number, view in enumerate(found, start=last + 1)
    }
    best = found[0].scene
    return best.model_copy(update={"bookmarks": {**scene.bookmarks, **cameras}})
