"""Lines for the user that come and go at the top: what was saved, what was not possible."""

from __future__ import annotations

import time

from imgui_bundle import imgui

from clfractal.viewer.panels import theme
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.studio import MESSAGE_SECONDS

_SHOWN = 4
_WIDTH = 380.0


def visible(ui: Ui, now: float) -> list[tuple[str, bool, float]]:
    """The messages of the last seconds: text, whether something went wrong, and how opaque it is."""
    found: list[tuple[str, bool, float]] = []
    for message in ui.studio.messages:
        # What went wrong is longer to read.
        left = MESSAGE_SECONDS * (2 if message.wrong else 1) - (now - message.time)
        if left > 0:
            if found and found[-1][0] == message.text:
                found.pop()
            found.append((message.text, message.wrong, min(left / 0.5, 1.0)))
    return found[-_SHOWN:]


def draw(ui: Ui) -> None:
    """Draws them at the top of the picture's middle, where no dock is; the newest is the uppermost."""
    canvas = imgui.get_foreground_draw_list()
    width = min(_WIDTH, ui.size[0] - 2 * theme.MARGIN)
    dock = theme.DOCK_LEFT + theme.MARGIN if "panels" in ui.show else 0.0
    left = max((ui.size[0] - width) / 2, min(dock + theme.MARGIN, ui.size[0] - width - theme.MARGIN))
    top = 2 * theme.MARGIN
    shown = visible(ui, time.perf_counter())
    if shown:
        ui.memory["awaited"] = True  # they have to go, though nothing else may happen
    for text, wrong, alpha in reversed(shown):
        size = imgui.calc_text_size(text, False, width - 34)
        bottom = top + size.y + 16
        canvas.add_rect_filled(
            imgui.ImVec2(left, top),
            imgui.ImVec2(left + width, bottom),
            theme.packed(theme.PANEL_SOLID, round(alpha, 2)),
            theme.ROUNDING,
        )
        color = theme.WARNING if wrong else theme.SECOND
        canvas.add_rect_filled(
            imgui.ImVec2(left, top + 4),
            imgui.ImVec2(left + 3, bottom - 4),
            theme.packed(color, round(alpha, 2)),
            2.0,
        )
        canvas.add_text(
            imgui.get_font(),
            imgui.get_font_size(),
            imgui.ImVec2(left + 16, top + 8),
            theme.packed(theme.TEXT, round(alpha, 2)),
            text,
            width - 34,
        )
        top = bottom + 6
