"""Films: the scene's film as a file, rendered beside the window; how far films are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from imgui_bundle import imgui, imgui_ctx

from clfractal.errors import ClfractalError, FileError, Where
from clfractal.files.film_kinds import CONTAINERS
from clfractal.scene.animation import Animation
from clfractal.viewer.film_queue import FilmOrder, RenderedFilm
from clfractal.viewer.number_words import counted
from clfractal.viewer.panels import layout, right_dock, theme
from clfractal.viewer.panels import order_form as form
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

PRESETS: dict[str, form.Size | None] = {
    "Scene": None,
    "720p": (1280, 720),
    "1080p": (1920, 1080),
    "4K": (3840, 2160),
}
"""Sizes to choose from; None: the scene's."""
KINDS: dict[str, tuple[str, tuple[str, ...]]] = {
    "MP4, H.264": (".mp4", ()),
    "MP4, H.265": (".mp4", ("--codec", "h265")),
    "MOV, ProRes": (".mov", ()),
    "MKV, without loss": (".mkv", ()),
    "PNG pictures": ("_####.png", ()),
    "EXR pictures": ("_####.exr", ()),
}
"""Kinds of films: how their names end, and what `clfractal animate` is told more."""


@dataclass(slots=True)
class Wanted(form.Wanted):
    """What the panel remembers; without a size it is the scene's.

    Attributes:
        kind: the one of `KINDS`.
        part: the first and the last frame; None: all.
    """

    kind: str = "MP4, H.264"
    part: tuple[int, int] | None = None


def draw(ui: Ui) -> None:
    """Draws the panel, if it is open."""
    if "films" not in ui.show:
        return
    state: Wanted = ui.memory.setdefault("films", Wanted())
    animation = ui.studio.scene.animation
    with (
        right_dock.window(ui, "films", "Render the film", theme.FILM),
        imgui_ctx.begin_child("##films", imgui.ImVec2(0, 0)),
    ):
        if animation is None:
            w.hint(ui, f"The scene has no film yet. {ui.keys.hint('timeline') or 'The timeline'} begins one.")
        else:
            _settings(ui, state, animation)
            _start(ui, state, animation)
        _list(ui)


def output_of(ui: Ui, state: Wanted) -> Path:
    """The file of a film as the panel is set."""
    ending = KINDS[state.kind][0]
    place = Path(state.name.strip() or form.scene_name(ui, "film")).expanduser()
    if place.suffix.lower() in (*CONTAINERS, ".png", ".exr"):
        place = place.with_suffix("")
    return Path.cwd() / place.with_name(f"{place.name}{ending}") if place.name else Path.cwd() / ending


def order_of(ui: Ui, state: Wanted, animation: Animation) -> FilmOrder:
    """What is ordered as the panel is set.

    Raises:
        ClfractalError: the name cannot be used, or the scene cannot be written.
    """
    output = output_of(ui, state)
    if output.name == KINDS[state.kind][0]:
        raise FileError("needs a name, not a folder alone", Where(str(output.parent)))
    if output.exists():
        raise FileError("is there already; choose another name", Where(output.name))
    if ui.studio.films.under_way(output):
        raise FileError("is under way already", Where(output.name))
    first, last = _part(state, animation)
    return FilmOrder(
        ui.memory["files"].text(),
        ui.studio.document.folder.absolute(),
        output,
        first,
        last,
        ui.studio.session.device.info.index,
        state.size,
        state.samples,
        KINDS[state.kind][1],
        ui.studio.scene.stereo,
    )


def _part(state: Wanted, animation: Animation) -> tuple[int, int]:
    last = animation.count - 1
    first, end = state.part or (0, last)
    return min(first, last), max(min(end, last), min(first, last))


def _settings(ui: Ui, state: Wanted, animation: Animation) -> None:
    image = ui.studio.scene.image
    state.size = form.size(ui, "films", PRESETS, state.size, (image.width, image.height))
    state.samples = form.samples(ui, "films", state.samples)
    width = form.label("Frames")
    first, last = _part(state, animation)
    each = (width - 50) / 2
    begin = form.number(ui, "films.first", first, each, animation.count - 1, 0)
    w.in_row(5)
    w.beside("to", theme.FAINT)
    w.in_row(5)
    end = form.number(ui, "films.last", last, each, animation.count - 1, 0)
    if begin is not None or end is not None:
        state.part = (first if begin is None else begin, last if end is None else end)
    w.in_row(4)
    if w.icon_button(theme.RESET, "All frames", name="films.all", enabled=state.part is not None):
        state.part = None
    kinds = {kind: kind for kind in KINDS}
    form.files(state, "films", kinds, lambda: output_of(ui, Wanted(kind=state.kind)).stem)


def _start(ui: Ui, state: Wanted, animation: Animation) -> None:
    imgui.dummy(imgui.ImVec2(0, 1))
    there = _there(ui, state, animation)
    if not there:
        if w.button("Render", icon=theme.FILM, primary=True, width=-1):
            start(ui, state, animation)
    else:
        half = (imgui.get_content_region_avail().x - 4) / 2
        about = f"{counted(there, 'frame')} of it are there" if there > 1 else "a frame of it is there"
        if w.button("Continue", icon=theme.FILM, primary=True, width=half, about=about):
            start(ui, state, animation, resume=True)
        w.in_row(4)
        if w.button("Begin anew", width=half, about=f"{about}, and would be removed"):
            start(ui, state, animation)
    if state.problem:
        layout.warn(state.problem)


def _there(ui: Ui, state: Wanted, animation: Animation) -> int:
    """How many frames of an earlier run there are; looked at now and then, since files are asked."""
    now = imgui.get_time()
    key = (output_of(ui, state), _part(state, animation), len(ui.studio.films.films), ui.studio.films.busy)
    known = ui.memory.get("films.there")
    if known is None or known[0] != key or now - known[1] > 1.0:
        output, (first, last) = key[0], key[1]
        order = FilmOrder("", Path(), output, first, last, "", stereo=ui.studio.scene.stereo)
        there = 0 if ui.studio.films.under_way(output) else len(order.there())
        known = ui.memory["films.there"] = (key, now, there)
    return int(known[2])


def start(ui: Ui, state: Wanted, animation: Animation, *, resume: bool = False) -> RenderedFilm | None:
    """Orders a film as the panel is set; None if it cannot begin."""
    ui.memory.pop("films.there", None)
    try:
        order = order_of(ui, state, animation)
    except ClfractalError as error:
        state.problem = str(error)
        return None
    state.problem = ""
    return ui.studio.films.order(order, resume=resume)


# The list


def _list(ui: Ui) -> None:
    films = list(ui.studio.films.films)
    ended = not all(film.under_way for film in films)
    if form.listed(films, lambda film: _film(ui, film), ended=ended):
        ui.studio.films.clear()


def _film(ui: Ui, film: RenderedFilm) -> None:
    output = film.order.output
    form.head(film, theme.FILM, output.name, str(output), button=not film.written)
    if film.under_way:
        if w.icon_button(theme.CROSS, "Cancel it: what is done is kept", name="cancel"):
            film.cancel()
    elif not film.written and w.icon_button(theme.REFRESH, "Continue it", name="continue"):
        ui.studio.films.order(film.order, resume=True)
    form.foot(film, state_text(film), film.done / film.order.count if film.under_way else None)


def state_text(film: RenderedFilm) -> str:
    """How far a film is, in few words."""
    if film.problem:
        return film.problem
    frames = f"{film.done} of {counted(film.order.count, 'frame')}"
    if film.written:
        return f"{counted(film.order.count, 'frame')}, written"
    if film.cancelled and film.running:
        return f"being cancelled, {frames}"
    if film.cancelled:
        return f"cancelled, {frames} are kept"
    if not film.running:
        return "waiting for the film before"
    if film.done >= film.order.count:
        return f"{counted(film.order.count, 'frame')}, writing"
    left = f", {form.time_text(film.remaining)} left" if film.remaining is not None else ""
    return f"{frames}{left}"
