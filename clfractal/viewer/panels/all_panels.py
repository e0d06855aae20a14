"""Draws every panel that is open, in the order in which they lie over each other."""

from __future__ import annotations

from clfractal.viewer.panels import dialogs, help, messages, overlay, scene_dock
from clfractal.viewer.panels.ui import Ui


def draw(ui: Ui) -> None:
    """Draws the panels of one frame, between `imgui.new_frame` and `imgui.render`."""
    overlay.draw(ui)
    scene_dock.draw(ui)
    help.draw(ui)
    dialogs.draw(ui)
    messages.draw(ui)
