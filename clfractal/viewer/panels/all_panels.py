"""Draws every panel that is open."""

from __future__ import annotations

from clfractal.viewer.panels.ui import Ui


def draw(ui: Ui) -> None:
    """Draws the panels of one frame, between `imgui.new_frame` and `imgui.render`."""
