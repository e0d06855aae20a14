"""Draws every panel that is open, in the order in which they lie over each other."""

from __future__ import annotations

from clfractal.viewer.panels import (
    dialogs,
    gallery,
    help,
    history,
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
    overlay.draw(ui)
    scene_dock.draw(ui)
    timeline.draw(ui)
    menu.draw(ui)
    right_dock.fit(ui)
    variations.draw(ui)
    stills.draw(ui)
    history.draw(ui)
    gallery.draw(ui)
    help.draw(ui)
    dialogs.draw(ui)
    messages.draw(ui)
