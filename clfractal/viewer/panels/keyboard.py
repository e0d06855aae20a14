"""Panels by the keyboard: Tab goes on, Enter opens and switches, Escape leads back to the picture.

Otherwise Dear ImGui's keys for this are off: arrows, the space bar and Enter are the picture's, also while the pointer is
over a panel.
"""

from __future__ import annotations

from imgui_bundle import imgui

from clfractal.viewer.panels.ui import Ui

_KEY = "keyboard.panels"
_BEGINS = "keyboard.begins"


def enter(ui: Ui) -> None:
    """The keyboard goes to the panels, which are shown for it; it begins with the line to search with."""
    ui.show.add("panels")
    ui.memory[_KEY] = ui.memory[_BEGINS] = True
    imgui.get_io().config_flags |= imgui.ConfigFlags_.nav_enable_keyboard


def leave(ui: Ui) -> None:
    """The keyboard is the picture's again."""
    if ui.memory.pop(_KEY, False):
        imgui.get_io().config_flags &= ~imgui.ConfigFlags_.nav_enable_keyboard
        imgui.set_window_focus(None)


def inside(ui: Ui) -> bool:
    """Whether panels have the keyboard."""
    return bool(ui.memory.get(_KEY)) and "panels" in ui.show


def begin_here(ui: Ui) -> None:
    """The item that is drawn next is the first one, when the keyboard has come to the panels."""
    if ui.memory.pop(_BEGINS, False):
        imgui.set_keyboard_focus_here()


def focus_window(ui: Ui) -> None:
    """The window that is begun next gets the keyboard, when it has come to the panels."""
    if ui.memory.get(_BEGINS):
        imgui.set_next_window_focus()
