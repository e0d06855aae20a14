"""Draws every panel that is open, in the order in which they lie over each other."""

from __future__ import annotations

from imgui_bundle import imgui

from clfractal.viewer.panels import (
    dialogs,
    films,
    gallery,
    help,
    history,
    layout,
    menu,
    messages,
    overlay,
    right_dock,
    scene_dock,
    stills,
    timeline,
    variations,
)
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.preparing import internal_error


def draw(ui: Ui) -> None:
    """Draws the panels of one frame, between `imgui.new_frame` and `imgui.render`."""
    if ui.memory.pop(CLOSE_MENU, False):
        imgui.internal.close_popup_to_level(0, True)
    overlay.draw(ui)
    scene_dock.draw(ui)
    timeline.draw(ui)
    menu.draw(ui)
    right_dock.fit(ui)
    variations.draw(ui)
    stills.draw(ui)
    films.draw(ui)
    history.draw(ui)
    gallery.draw(ui)
    help.draw(ui)
    dialogs.draw(ui)
    messages.draw(ui)
    boxes = layout.boxes(ui)
    if boxes.refused:  # by a box whose panel has no place for it
        ui.studio.tell(boxes.refused, wrong=True)
        boxes.refused = ""


def draw_safely(ui: Ui) -> None:
    """The same; a mistake in a panel costs that frame's panels, never the window, and is told once."""
    before = imgui.internal.ErrorRecoveryState()
    imgui.internal.error_recovery_store_state(before)
    try:
        draw(ui)
    except Exception as error:
        io = imgui.get_io()
        asserts, io.config_error_recovery_enable_assert = io.config_error_recovery_enable_assert, False
        logs, io.config_error_recovery_enable_debug_log = io.config_error_recovery_enable_debug_log, False
        imgui.internal.error_recovery_try_to_recover_state(before)
        io.config_error_recovery_enable_assert = asserts
        io.config_error_recovery_enable_debug_log = logs
        line = internal_error(_mistake(error)).message
        if not any(message.text.startswith(line[:60]) for message in ui.studio.messages[-5:]):
            ui.studio.tell(line, wrong=True)


def _mistake(error: Exception) -> Exception:
    """What came first: blocks that were open complain that Dear ImGui has not closed what is in them."""
    while "IM_ASSERT" in str(error) and isinstance(error.__context__, Exception):
        error = error.__context__
    return error


CLOSE_MENU = "menu.close"
"""In `Ui.memory`: the menu, list or colour picker that is open is to be closed."""


def menu_is_open() -> bool:
    """Whether a menu, a list or a colour picker is open over the panels."""
    return bool(imgui.is_popup_open("", imgui.PopupFlags_.any_popup))
