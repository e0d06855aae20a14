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


CLOSE_MENU = "menu.close"
"""In `Ui.memory`: the menu, list or colour picker that is open is to be closed."""


def menu_is_open() -> bool:
    """Whether a menu, a list or a colour picker is open over the panels."""
    return bool(imgui.is_popup_open("", imgui.PopupFlags_.any_popup))
