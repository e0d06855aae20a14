"""Questions to the user: a name to save under, a scene to open, what becomes of unsaved changes."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from clfractal.errors import ClfractalError
from clfractal.viewer.panels import buttons, layout, theme
from clfractal.viewer.panels.ui import Ui

if TYPE_CHECKING:
    from clfractal.viewer.files import Files

_WIDTH = 460.0


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
    elif files.recovered:
        _recovering(ui, files)


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


def _recovering(ui: Ui, files: Files) -> None:
    found = files.recovered[0]
    name = found.path.name if found.path is not None else "a new scene"
    minutes = max(time.time() - found.time, 0.0) / 60
    ago = f"{minutes:.0f} minutes" if minutes < 120 else f"{minutes / 60:.0f} hours"
    _begin(
        ui,
        "Unsaved changes were kept",
        f"A window ended {ago} ago without saving its changes to {name}.",
    )
    if buttons.button("Go on with them", primary=True):
        try:
            files.recover(found)
        except ClfractalError as error:
            ui.studio.tell(str(error), wrong=True)
            files.discard(found)
    layout.in_row()
    if buttons.button("Discard"):
        files.discard(found)
    imgui.end()
