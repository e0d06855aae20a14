"""Questions to the user: a name to save under, a scene to open, what becomes of unsaved changes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from clfractal.errors import ClfractalError
from clfractal.viewer.panels import buttons, layout, theme
from clfractal.viewer.panels.ui import Ui

if TYPE_CHECKING:
    from clfractal.viewer.autosave import Recovered
    from clfractal.viewer.files import Files

_WIDTH = 460.0
# Older copies of unsaved changes that are listed.
_MOST_OLDER = 3


def draw(ui: Ui) -> None:
    """Draws the question that is open; at most one."""
    files: Files | None = ui.memory.get("files")
    if files is None:
        return
    for part in ("save", "open"):
        if part not in ui.show:
            ui.memory.pop(f"dialog {part}", None)  # closed by a key: it begins anew
    if "close" in ui.show:
        _closing(ui, files)
    elif "replace" in ui.show and files.wanted is not None:
        _replacing(ui, files, files.wanted)
    elif "save" in ui.show:
        _named(ui, files, "save", "Save the scene as", "Save", files.suggestion)
    elif "open" in ui.show:
        _named(ui, files, "open", "Open a scene", "Open", files.source.path or Path.cwd())
    elif files.offered:
        _recovering(ui, files, files.offered)


def _begin(ui: Ui, title: str, told: str = "") -> None:
    width = min(_WIDTH, ui.size[0] - 2 * theme.MARGIN)
    canvas = imgui.get_background_draw_list()
    canvas.add_rect_filled(imgui.ImVec2(0, 0), imgui.ImVec2(*ui.size), theme.packed((0.0, 0.0, 0.0, 0.35)))
    imgui.set_next_window_pos(
        imgui.ImVec2(ui.size[0] / 2, ui.size[1] * 0.42), imgui.Cond_.always, imgui.ImVec2(0.5, 0.5)
    )
    imgui.set_next_window_size(imgui.ImVec2(width, 0))
    flags = (
        imgui.WindowFlags_.no_title_bar
        | imgui.WindowFlags_.no_resize
        | imgui.WindowFlags_.no_move
        | imgui.WindowFlags_.no_saved_settings
        | imgui.WindowFlags_.always_auto_resize
    )
    with theme.measures(window_padding=(18.0, 16.0)):
        imgui.begin("##dialog", None, flags)
    with theme.font("bold", 16.0):
        imgui.text(title)
    if told:
        imgui.dummy(imgui.ImVec2(0, 2))
        imgui.push_text_wrap_pos(0.0)
        imgui.text_colored(theme.vec(theme.DIM), told)
        imgui.pop_text_wrap_pos()
    imgui.dummy(imgui.ImVec2(0, 6))


def _named(ui: Ui, files: Files, part: str, title: str, verb: str, suggestion: Path) -> None:
    """A file name, typed."""
    key = f"dialog {part}"
    state: dict[str, Any] = ui.memory.setdefault(key, {"text": str(suggestion), "problem": "", "new": True})
    _begin(ui, title)
    imgui.set_next_item_width(-1)
    if state["new"]:
        imgui.set_keyboard_focus_here()
        state["new"] = False
    done, text = imgui.input_text("##name", state["text"], imgui.InputTextFlags_.enter_returns_true)
    state["text"] = text
    if state["problem"]:
        layout.warn(state["problem"])
    imgui.dummy(imgui.ImVec2(0, 8))
    chosen = buttons.button(verb, primary=True) or done
    layout.in_row()
    ended = buttons.button("Cancel")
    if chosen:
        ended = _done(ui, files, part, state)
    if ended:
        del ui.memory[key]
        ui.show.discard(part)
    imgui.end()


def _done(ui: Ui, files: Files, part: str, state: dict[str, Any]) -> bool:
    """Saves or opens; whether that worked."""
    path = Path(state["text"].strip()).expanduser()
    try:
        if part == "open":
            files.open(path)
        else:
            if path.suffix == "":
                path = path.with_suffix(".yaml")
            own = files.source.path
            same = own is not None and own.exists() and path.exists() and path.samefile(own)
            if path.exists() and not same and state.get("sure") != str(path):
                state["sure"] = str(path)
                state["problem"] = f"{path.name} is there already; once more replaces it"
                return False
            files.save_as(path)
    except ClfractalError as error:
        state["problem"] = str(error)
        return False
    return True


def _closing(ui: Ui, files: Files) -> None:
    _begin(ui, "Unsaved changes", "The scene differs from its file.")
    if buttons.button("Save", primary=True):
        ui.show.discard("close")
        _save_and_leave(ui, files)
    layout.in_row()
    if buttons.button("Discard"):
        files.leave()
    layout.in_row()
    if buttons.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape):
        ui.show.discard("close")
    imgui.end()


def _replacing(ui: Ui, files: Files, wanted: Path) -> None:
    _begin(ui, "Unsaved changes", f"The scene differs from its file. Open {wanted.name} anyway?")
    try:
        if buttons.button("Save first", primary=True):
            files.save()
            ui.show.discard("replace")
            if not ui.studio.unsaved:
                files.open(wanted)
        layout.in_row()
        if buttons.button("Open anyway"):
            ui.show.discard("replace")
            files.open(wanted, sure=True)
    except ClfractalError as error:
        ui.studio.tell(str(error), wrong=True)
        ui.show.discard("replace")
    layout.in_row()
    if buttons.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape):
        ui.show.discard("replace")
    imgui.end()


def _save_and_leave(ui: Ui, files: Files) -> None:
    try:
        files.save()
    except ClfractalError as error:
        ui.studio.tell(str(error), wrong=True)
    if not ui.studio.unsaved:
        files.leave()


def _recovering(ui: Ui, files: Files, offered: Sequence[Recovered]) -> None:
    """All copies of the scene's changes in one question, the newest first."""
    newest, others = offered[0], offered[1:]
    name = newest.path.name if newest.path is not None else "a new scene"
    _begin(
        ui,
        "Unsaved changes were kept",
        f"A window ended {ago(time.time() - newest.time)} without saving its changes to {name}.",
    )
    if buttons.button("Go on with them", primary=True):
        _recover(ui, files, newest)
    layout.in_row()
    if buttons.button("Discard"):
        files.discard(newest)
    layout.in_row()
    if buttons.button("Later"):
        files.put_off()
    if others:
        imgui.dummy(imgui.ImVec2(0, 8))
        imgui.text_colored(theme.vec(theme.DIM), "Older ones:")
    for number, each in enumerate(others[:_MOST_OLDER]):
        if buttons.button(f"{ago(time.time() - each.time)}##{number}"):
            _recover(ui, files, each)
        layout.in_row()
    if others and buttons.button("Discard all"):
        for each in list(offered):
            files.discard(each)
    imgui.end()


def _recover(ui: Ui, files: Files, found: Recovered) -> None:
    try:
        files.recover(found)
    except ClfractalError as error:
        ui.studio.tell(str(error), wrong=True)
        files.discard(found)


def ago(seconds: float) -> str:
    """How long ago something was, in words."""
    minutes = max(seconds, 0.0) / 60
    if minutes < 1:
        return "less than a minute ago"
    number, unit = (
        (minutes, "minute")
        if minutes < 120
        else (minutes / 60, "hour")
        if minutes < 2880
        else (minutes / 1440, "day")
    )
    return f"{number:.0f} {unit}{'' if round(number) == 1 else 's'} ago"
