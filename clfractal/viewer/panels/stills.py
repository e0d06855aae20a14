"""Stills: the present scene as picture files of any size, rendered in the background."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from imgui_bundle import imgui, imgui_ctx

from clfractal.errors import ClfractalError, FileError, Where
from clfractal.files.atomic import PICTURES
from clfractal.images.formats import Content, check_output
from clfractal.images.outputs import output_files
from clfractal.scene.parts import MAX_PIXELS, Image
from clfractal.scene.stereo import Stereo
from clfractal.viewer.background import Still
from clfractal.viewer.panels import layout, right_dock, theme
from clfractal.viewer.panels import order_form as form
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.viewport import image_of

PRESETS: dict[str, tuple[int, int] | None] = {
    "Window": None,
    "1080p": (1920, 1080),
    "4K": (3840, 2160),
    "8K": (7680, 4320),
    "Square 2048": (2048, 2048),
    "Square 4096": (4096, 4096),
}
"""Sizes to choose from; None: as large as the window's picture."""
FORMATS = {"png": "PNG", "jpg": "JPEG", "webp": "WebP", "exr": "EXR", "both": "PNG and EXR"}
_ENDINGS = {
    "png": (".png",),
    "jpg": (".jpg",),
    "webp": (".webp",),
    "exr": (".exr",),
    "both": (".png", ".exr"),
}


@dataclass(slots=True)
class Wanted(form.Wanted):
    """What the panel remembers; without a size it is the window's, without a name a free one.

    Attributes:
        kind: the one of `FORMATS`.
    """

    kind: str = "png"


def draw(ui: Ui) -> None:
    """Draws the panel, if it is open."""
    if "stills" not in ui.show:
        return
    state: Wanted = ui.memory.setdefault("stills", Wanted())
    with (
        right_dock.window(ui, "stills", "Render a still", theme.CAMERA),
        imgui_ctx.begin_child("##stills", imgui.ImVec2(0, 0)),
    ):
        state.size = form.size(ui, "stills", PRESETS, state.size, _window_size(ui))
        state.samples = form.samples(ui, "stills", state.samples)
        form.files(state, "stills", FORMATS, lambda: _suggestion(ui, state))
        _start(ui, state)
        _list(ui)


def paths_of(name: str, kind: str, folder: Path | None = None) -> tuple[Path, ...]:
    """The files of a name; an ending that is one of the formats' is left out."""
    place = Path(name.strip()).expanduser()
    if place.suffix.lower() in PICTURES:
        place = place.with_suffix("")
    whole = (folder or Path.cwd()) / place
    if place.name in ("", ".."):
        return tuple(whole / ending for ending in _ENDINGS[kind])  # without a name: refused by `check`
    return tuple(whole.with_name(f"{whole.name}{ending}") for ending in _ENDINGS[kind])


def free_name(stem: str, kind: str, taken: Collection[Path], stereo: Stereo | None = None) -> str:
    """A name such as `mandelbulb-still-1` under which there is no file, and none is on its way."""
    names = (f"{stem}-still-{number}" for number in count(1))
    return next(
        name
        for name in names
        if not any(_is_taken(path, taken) for path in _all(paths_of(name, kind), stereo))
    )


def check(
    paths: Iterable[Path], taken: Collection[Path], stereo: Stereo | None, content: Content | None = None
) -> None:
    """Makes sure that files can be written, that their formats can hold the picture, and that none is there already.

    Args:
        taken: files that are on their way.
        stereo: of the scene: some modes write a file for each eye.
        content: of the picture; None: it is not known yet.

    Raises:
        FileError: what is wrong with one of them.
    """
    paths = list(paths)
    for path in paths:
        if path.name in PICTURES:
            raise FileError("needs a name, not a folder alone", Where(str(path.parent)))
    for path in _all(paths, stereo):
        check_output(path, content)
        if _is_taken(path, taken):
            raise FileError("is there already; choose another name", Where(path.name))


def _all(paths: Iterable[Path], stereo: Stereo | None) -> list[Path]:
    return [file for path in paths for file in output_files(stereo, path)]


def _is_taken(path: Path, taken: Collection[Path]) -> bool:
    return path in taken or path.exists() or path.is_symlink()


def on_their_way(stills: Iterable[Still]) -> set[Path]:
    """The files of stills that are not finished."""
    return {
        file
        for still in stills
        if not still.finished
        for path in still.paths
        for file in output_files(still.scene.stereo, path)
    }


def _window_size(ui: Ui) -> tuple[int, int]:
    width, height = image_of(ui.studio.scene.stereo, ui.studio.viewport)
    return width, height


def _suggestion(ui: Ui, state: Wanted) -> str:
    """A free name; looked up anew when something has changed that it depends on."""
    stem, stereo = form.scene_name(ui, "scene"), ui.studio.scene.stereo
    ended = sum(1 for still in ui.studio.stills if still.finished)
    key = (stem, state.kind, stereo.mode if stereo else None, len(ui.studio.stills), ended)
    stills = ui.studio.stills
    return ui.kept_for(
        "stills.suggestion", key, lambda: free_name(stem, state.kind, on_their_way(stills), stereo)
    )


def _start(ui: Ui, state: Wanted) -> None:
    size = state.size or _window_size(ui)
    too_large = size[0] * size[1] > MAX_PIXELS
    imgui.dummy(imgui.ImVec2(0, 1))
    if w.button("Render", icon=theme.CAMERA, primary=True, width=-1, enabled=not too_large):
        start(ui, state)
    if too_large:
        layout.warn(f"At most {MAX_PIXELS:,} pixels.")
    elif state.problem:
        layout.warn(state.problem)


def start(ui: Ui, state: Wanted) -> Still | None:
    """Begins a still as the panel is set; None if its files cannot be written."""
    studio = ui.studio
    stereo = studio.scene.stereo
    size = state.size or _window_size(ui)
    ui.memory.pop("stills.suggestion", None)
    paths = paths_of(state.name.strip() or _suggestion(ui, state), state.kind)
    try:
        image = Image.model_construct(width=size[0], height=size[1])
        content = Content.of(studio.scene.model_copy(update={"image": image}))
        check(paths, on_their_way(studio.stills), stereo, content)
        still = studio.render_still(paths, state.size, state.samples)
    except ClfractalError as error:
        state.problem = str(error)
        return None
    state.problem = state.name = ""
    return still


# The list


def _list(ui: Ui) -> None:
    stills = ui.studio.stills
    if stills and form.listed(stills, _still, ended=any(still.finished for still in stills)):
        stills[:] = [still for still in stills if not still.finished]


def _still(still: Still) -> None:
    files, busy = _all(still.paths, still.scene.stereo), not still.finished
    form.head(still, theme.PICTURE, names_of(files), "\n".join(map(str, files)), button=busy)
    if busy and w.icon_button(theme.CROSS, "Cancel it: nothing is written", name="cancel"):
        still.cancel()
    form.foot(still, state_text(still), still.share if busy else None)


def names_of(files: list[Path]) -> str:
    """The names of files in a line; endings alone where the rest is the same: `still-1.png, .exr`."""
    first = files[0]
    return ", ".join(
        file.suffix if place and file.stem == first.stem else file.name for place, file in enumerate(files)
    )


def state_text(still: Still) -> str:
    """How far a still is, in few words."""
    if still.problem:
        return still.problem
    size = f"{still.scene.image.width} x {still.scene.image.height}"
    if still.written:
        return f"{size}, written"
    if still.cancelled:
        return f"{size}, cancelled"
    if still.share >= 1:
        return f"{size}, writing"
    if still.share <= 0:
        return f"{size}, waiting for the picture"
    left = f", {form.time_text(still.remaining)} left" if still.remaining is not None else ""
    return f"{size}, {100 * still.share:.0f} %{left}"
