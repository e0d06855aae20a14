"""The gallery: the scenes that come with the program as small pictures, to start from."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from clfractal.engine.thumbnails import SAMPLES, SIZE
from clfractal.files import resources
from clfractal.viewer.number_words import counted
from clfractal.viewer.panels import cards, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.shelf import Entry, Shelf

KINDS = {"all": "All", "surface": "Surfaces", "volume": "Volumes", "cut": "Cut planes", "stereo": "Stereo"}
"""What the gallery can be narrowed to, and its words."""
_LEAST = 190.0  # points of a card
_COLUMNS = 6.5  # at most
_NARROW = 640.0  # points: below, switches and search have lines of their own
_LARGEST = 0.8  # of the window
_ABOUT = 320  # characters


@dataclass(slots=True)
class Gallery:
    """What the gallery remembers.

    Attributes:
        shelf: the scenes and their pictures.
        kind: the one of `KINDS` that is shown.
        asked: scenes whose pictures are being rendered.
        sure: the scene to open once the user has said what becomes of unsaved changes.
    """

    shelf: Shelf
    kind: str = "all"
    asked: set[Entry] = field(default_factory=set)
    sure: Entry | None = None


def draw(ui: Ui) -> None:
    """Draws the gallery, if it is open."""
    state: Gallery | None = ui.memory.get("gallery")
    if "gallery" not in ui.show:
        if state is not None:
            _forget(ui, state, set(state.asked))
            state.sure = None
        return
    if state is None:
        device = ui.studio.session.device.info.key
        state = ui.memory["gallery"] = Gallery(Shelf(scene_files(), device, ui.studio.woken))
    if _is_asked(ui):
        return
    (width, height), (wide, high) = _size(ui), ui.size
    with _dim(ui):
        imgui.set_cursor_pos(imgui.ImVec2((wide - width) / 2, (high - height) / 2))
        padding, back = theme.measures(window_padding=(18.0, 14.0), child_rounding=10.0), theme.PANEL_SOLID
        with padding, theme.colors(child_bg=back):
            flags = imgui.ChildFlags_.borders | imgui.ChildFlags_.always_use_window_padding
            imgui.begin_child("##gallery", imgui.ImVec2(width, height), flags)
        _top(ui, state)
        _cards(ui, state)
        if state.sure is not None:
            _ask(ui, state, state.sure)
        imgui.end_child()


def scene_files() -> list[Path]:
    """The scenes that come with the program; the figures of the thesis are the last ones."""
    return sorted(
        resources.folder("scenes").glob("*.yaml"),
        key=lambda path: (path.stem.startswith("figure"), path.stem),
    )


def matches(entry: Entry, kind: str, text: str) -> bool:
    """Whether a scene is of a kind of `KINDS`, and every word of a text stands in its name, title or description."""
    if kind != "all" and entry.kind != kind:
        return False
    there = f"{entry.path.stem} {entry.title} {entry.about} {entry.kind}".lower()
    return all(word in there for word in text.lower().split())


def _size(ui: Ui) -> tuple[float, float]:
    """Most of the window; all of a small one."""
    width, height = ui.size
    return (
        min(max(_LARGEST * width, 720.0), width - 2 * theme.MARGIN),
        min(max(0.86 * height, 480.0), height - 2 * theme.MARGIN),
    )


@contextmanager
def _dim(ui: Ui) -> Iterator[None]:
    """A window over everything, which keeps the pointer from what is below; a click on it closes the gallery."""
    kinds = imgui.WindowFlags_
    flags = kinds.no_scrollbar | kinds.no_scroll_with_mouse | kinds.no_nav
    bare: dict[str, Any] = {"window_padding": (0.0, 0.0), "window_border_size": 0.0, "window_rounding": 0.0}
    with (
        theme.colors(window_bg=(0.02, 0.022, 0.028, 0.72)),
        theme.window("gallery.dim", (0.0, 0.0), ui.size, flags=flags, **bare),
    ):
        if imgui.is_window_hovered() and imgui.is_mouse_clicked(0) and not imgui.is_window_appearing():
            ui.show.discard("gallery")
        yield


def _top(ui: Ui, state: Gallery) -> None:
    start = imgui.get_cursor_pos_x()
    wide = imgui.get_content_region_avail().x
    imgui.align_text_to_frame_padding()
    with theme.font("bold", 18.0):
        imgui.text("Gallery")
    w.in_row(10)
    w.beside(counted(len(_shown(ui, state)), "scene"), theme.FAINT)
    close = imgui.get_frame_height()
    narrow = wide < _NARROW
    find = wide if narrow else min(220.0, 0.24 * wide)
    chips = wide if narrow else min(430.0, wide - 190.0 - find - close - 18)
    imgui.same_line(start + wide - close - (0 if narrow else chips + find + 18))
    if narrow:
        _close(ui)
    state.kind = w.segments("gallery.kind", KINDS, state.kind, chips) or state.kind
    if not narrow:
        w.in_row(8)
    w.search(ui, "gallery.filter", "Find a scene", find)
    if not narrow:
        w.in_row(8)
        _close(ui)
    imgui.dummy(imgui.ImVec2(0, 4))


def _close(ui: Ui) -> None:
    if w.icon_button(theme.CROSS, f"Close ({ui.keys.hint('cancel')})", name="gallery.close"):
        ui.show.discard("gallery")


def _shown(ui: Ui, state: Gallery) -> list[Entry]:
    text = str(ui.memory.get("gallery.filter", ""))
    return [entry for entry in state.shelf.entries if matches(entry, state.kind, text)]


def _cards(ui: Ui, state: Gallery) -> None:
    foot = 46.0 if state.sure is not None else 0.0
    room = imgui.get_content_region_avail()
    flags = imgui.WindowFlags_.always_vertical_scrollbar
    imgui.begin_child("##cards", imgui.ImVec2(room.x, room.y - foot), 0, flags)
    inner = imgui.get_content_region_avail().x - 6
    columns, width = cards.grid(inner, max(_LEAST, inner / _COLUMNS), 14.0)
    left, top = imgui.get_cursor_pos_x(), imgui.get_cursor_pos_y() + 2
    shown = _shown(ui, state)
    high = cards.height(width, cards.Card("", None, title="-", line="-")) + 12
    here = _here(ui)
    visible: set[Entry] = set()
    for number, entry in enumerate(shown):
        row, column = divmod(number, columns)
        imgui.set_cursor_pos(imgui.ImVec2(left + column * (width + 14), top + row * high))
        if imgui.is_rect_visible(imgui.ImVec2(width, high)):
            visible.add(entry)
            _card(ui, state, entry, width, here)
    imgui.set_cursor_pos(imgui.ImVec2(left, top + -(-len(shown) // columns) * high))
    imgui.dummy(imgui.ImVec2(1, 1))
    if not shown:
        _nothing(ui, state)
    _forget(ui, state, state.asked - visible)
    imgui.end_child()


def _nothing(ui: Ui, state: Gallery) -> None:
    read = state.shelf.read
    if not read:
        ui.memory["awaited"] = True
    imgui.text_colored(theme.vec(theme.DIM), "There is no such scene." if read else "Reading scenes\u2026")


def _card(ui: Ui, state: Gallery, entry: Entry, width: float, here: Path | None) -> None:
    _picture(ui, state, entry)
    card = cards.Card(
        ("gallery", entry.key),
        entry.pixels,
        entry.problem,
        entry.title,
        _line(entry),
        here is not None and entry.path == here,
    )
    if cards.draw(ui, entry.path.stem, card, width):
        _choose(ui, state, entry)
    w.tip(_about(entry))


def _line(entry: Entry) -> str:
    """What stands below a scene's title: its file, and what it is made of."""
    if entry.scene is None:
        return entry.path.name
    formula = entry.scene.formula.name or "formula of its own"
    if formula == entry.path.stem:
        return formula
    return f"{entry.path.stem}  \u00b7  {formula.replace('_', ' ')}"


def _about(entry: Entry) -> str:
    text = entry.problem or entry.about
    return text if entry.problem or len(text) <= _ABOUT else f"{text[:_ABOUT].rsplit(' ', 1)[0]}\u2026"


def _picture(ui: Ui, state: Gallery, entry: Entry) -> None:
    """Gets the picture of a scene that is seen: from the disk, or rendered."""
    if entry.pixels is not None or entry.problem:
        return
    state.shelf.look(entry)
    scene = entry.scene
    if not entry.key or scene is None:
        return
    state.asked.add(entry)
    found = ui.studio.thumbnail(_key(entry), lambda: scene, SIZE, SAMPLES)
    if found.pixels is not None:
        entry.pixels = found.pixels
        state.shelf.keep(entry)
    entry.problem = found.problem
    if found.finished:
        _forget(ui, state, {entry})


def _forget(ui: Ui, state: Gallery, entries: set[Entry]) -> None:
    """Gives up pictures that nobody sees any more, or that are there."""
    if entries:
        keys = {_key(entry) for entry in entries}
        ui.studio.forget_thumbnails(lambda key: key in keys)
        state.asked -= entries


def _key(entry: Entry) -> tuple[str, str]:
    return ("gallery", str(entry.path))


def _here(ui: Ui) -> Path | None:
    """The file of the present scene."""
    files: Any = ui.memory.get("files")
    return files.source.path.resolve() if files is not None and files.source.path is not None else None


def _is_asked(ui: Ui) -> bool:
    """Whether a question is open, which comes before the gallery."""
    files: Any = ui.memory.get("files")
    return bool(ui.show & {"open", "save", "close"}) or (files is not None and bool(files.offered))


# Opening


def changed(ui: Ui) -> bool:
    """Whether opening another scene would lose more than a point of view."""
    studio = ui.studio
    return (
        studio.unsaved and studio.document.model_copy(update={"camera": studio.saved.camera}) != studio.saved
    )


def _choose(ui: Ui, state: Gallery, entry: Entry) -> None:
    if changed(ui):
        state.sure = entry
    else:
        _open(ui, entry)


def _open(ui: Ui, entry: Entry) -> None:
    ui.act(f"open:{entry.path}")
    ui.show.discard("gallery")


def _ask(ui: Ui, state: Gallery, entry: Entry) -> None:
    imgui.dummy(imgui.ImVec2(0, 2))
    w.beside(theme.WARN, theme.WARNING)
    w.in_row(8)
    w.beside("The present scene has unsaved changes.")
    w.in_row(14)
    opens = w.button(f"Open {entry.title} and discard them", primary=True)
    w.in_row()
    saves = w.button("Save first", icon=theme.SAVE)
    w.in_row()
    if opens or saves or w.button("Cancel"):
        state.sure = None
    if opens:
        _open(ui, entry)
    elif saves:  # which may ask for a name, below the gallery
        ui.show.discard("gallery")
        ui.act("save")
