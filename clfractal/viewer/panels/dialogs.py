"""Questions to the user: a name to save under, a scene to open, what becomes of unsaved changes."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from clfractal.errors import ClfractalError
from clfractal.viewer.number_words import counted
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


@contextmanager
def _question(ui: Ui, title: str, told: str = "") -> Iterator[None]:
    """The window of a question."""
    width = min(_WIDTH, ui.size[0] - 2 * theme.MARGIN)
    canvas = imgui.get_background_draw_list()
    canvas.add_rect_filled(imgui.ImVec2(0, 0), imgui.ImVec2(*ui.size), theme.packed((0.0, 0.0, 0.0, 0.35)))
    place, flags = (ui.size[0] / 2, ui.size[1] * 0.42), imgui.WindowFlags_.always_auto_resize
    with theme.window(
        "dialog", place, (width, 0.0), flags=flags, pivot=(0.5, 0.5), window_padding=(18.0, 16.0)
    ):
        with theme.font("bold", 16.0):
            imgui.text(title)
        if told:
            imgui.dummy(imgui.ImVec2(0, 2))
            buttons.wrapped(told, color=theme.DIM)
        imgui.dummy(imgui.ImVec2(0, 6))
        yield


def _cancelled(ui: Ui, part: str) -> None:
    """The button, or the key, that ends a question without an answer."""
    layout.in_row()
    if buttons.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape):
        ui.show.discard(part)


def _named(ui: Ui, files: Files, part: str, title: str, verb: str, suggestion: Path) -> None:
    """A file name, typed."""
    key = f"dialog {part}"
    state: dict[str, Any] = ui.memory.setdefault(key, {"text": str(suggestion), "problem": "", "new": True})
    with _question(ui, title):
        imgui.set_next_item_width(-1)
        if state.pop("new", False):
            imgui.set_keyboard_focus_here()
        flags = imgui.InputTextFlags_.enter_returns_true
        done, state["text"] = imgui.input_text("##name", state["text"], flags)
        if state["problem"]:
            layout.warn(state["problem"])
        imgui.dummy(imgui.ImVec2(0, 8))
        chosen = buttons.button(verb, primary=True) or done
        layout.in_row()
        ended = buttons.button("Cancel")
        if _done(files, part, state) if chosen else ended:
            del ui.memory[key]
            ui.show.discard(part)


def _done(files: Files, part: str, state: dict[str, Any]) -> bool:
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
    with _question(ui, "Unsaved changes", "The scene differs from its file."):
        if buttons.button("Save", primary=True):
            ui.show.discard("close")
            with ui.studio.telling():
                files.save()
            if not ui.studio.unsaved:
                files.leave()
        layout.in_row()
        if buttons.button("Discard"):
            files.leave()
        _cancelled(ui, "close")


def _replacing(ui: Ui, files: Files, wanted: Path) -> None:
    with _question(ui, "Unsaved changes", f"The scene differs from its file. Open {wanted.name} anyway?"):
        save = buttons.button("Save first", primary=True)
        layout.in_row()
        anyway = buttons.button("Open anyway")
        if save or anyway:
            with ui.studio.telling():
                if save:
                    files.save()
                if anyway or not ui.studio.unsaved:
                    files.open(wanted, sure=anyway)
            ui.show.discard("replace")
        _cancelled(ui, "replace")


def _recovering(ui: Ui, files: Files, offered: Sequence[Recovered]) -> None:
    """All copies of the scene's changes in one question, the newest first."""
    newest, others = offered[0], offered[1:]
    name = newest.path.name if newest.path is not None else "a new scene"
    told = f"A window ended {ago(time.time() - newest.time)} without saving its changes to {name}."
    with _question(ui, "Unsaved changes were kept", told):
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
    if minutes < 120:
        return f"{counted(round(minutes), 'minute')} ago"
    hours = minutes / 60
    return f"{counted(round(hours), 'hour') if hours < 48 else counted(round(hours / 24), 'day')} ago"
