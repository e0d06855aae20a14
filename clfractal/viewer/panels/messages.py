"""Lines for the user that come and go at the top: what was saved, what was not possible."""

from __future__ import annotations

import time
from typing import Any

from imgui_bundle import imgui

from clfractal.viewer.panels import theme
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.studio import MESSAGE_SECONDS

Box = tuple[float, float, float, float]

_SHOWN = 4
_WIDTH = 380.0
_GAP = 6.0
# Windows that are never covered; menus are not, either.
_DIALOGS = ("##dialog", "##help")


def visible(ui: Ui, now: float) -> list[tuple[str, bool, float]]:
    """The messages of the last seconds: text, whether something went wrong, and how opaque it is."""
    found: list[tuple[str, bool, float]] = []
    for message in ui.studio.messages:
        # What went wrong is longer to read.
        left = MESSAGE_SECONDS * (2 if message.wrong else 1) - (now - message.time)
        if left > 0 and message.holds():
            if found and found[-1][0] == message.text:
                found.pop()
            found.append((message.text, message.wrong, min(left / 0.5, 1.0)))
    return found[-_SHOWN:]


def draw(ui: Ui) -> None:
    """Draws them at the top of the picture's middle, where no dock and no question is; the newest is the uppermost."""
    width = min(_WIDTH, ui.size[0] - 2 * theme.MARGIN)
    dock = theme.DOCK_LEFT + theme.MARGIN if "panels" in ui.show else 0.0
    left = max((ui.size[0] - width) / 2, min(dock + theme.MARGIN, ui.size[0] - width - theme.MARGIN))
    top = 2 * theme.MARGIN
    shown = visible(ui, time.perf_counter())
    if shown:
        ui.memory["awaited"] = True  # they have to go, though nothing else may happen
    taken = _questions() if shown else []
    for text, wrong, alpha in reversed(shown):
        high = imgui.calc_text_size(text, False, width - 34).y + 16
        free = free_top(top, high, (left, left + width), taken)
        # Where there is no room beside a question, they lie below it.
        fits = free + high <= ui.size[1]
        canvas = imgui.get_foreground_draw_list() if fits else imgui.get_background_draw_list()
        top = free if fits else top
        _line(canvas, text, wrong, alpha, (left, top, left + width, top + high))
        top += high + _GAP


def free_top(top: float, high: float, across: tuple[float, float], taken: list[Box]) -> float:
    """The least place from `top` on where something so high lies over none of the boxes that are taken, points."""
    for left, above, right, below in sorted(taken, key=lambda box: box[1]):
        beside = right <= across[0] or left >= across[1]
        if not beside and above < top + high + _GAP and below > top - _GAP:
            top = below + _GAP
    return top


def _questions() -> list[Box]:
    """Where dialogs and menus are: left, top, right, bottom, points."""
    found: list[Box] = []
    for window in imgui.get_current_context().windows:
        of_menu = int(window.flags) & int(imgui.WindowFlags_.popup)
        if window.active and (window.name in _DIALOGS or of_menu):
            corner, size = window.pos, window.size
            found.append((corner.x, corner.y, corner.x + size.x, corner.y + size.y))
    return found


def _line(canvas: Any, text: str, wrong: bool, alpha: float, box: Box) -> None:
    left, top, right, bottom = box
    opaque = round(alpha, 2)
    canvas.add_rect_filled(
        imgui.ImVec2(left, top),
        imgui.ImVec2(right, bottom),
        theme.packed(theme.PANEL_SOLID, opaque),
        theme.ROUNDING,
    )
    color = theme.WARNING if wrong else theme.SECOND
    canvas.add_rect_filled(
        imgui.ImVec2(left, top + 4), imgui.ImVec2(left + 3, bottom - 4), theme.packed(color, opaque), 2.0
    )
    canvas.add_text(
        imgui.get_font(),
        imgui.get_font_size(),
        imgui.ImVec2(left + 16, top + 8),
        theme.packed(theme.TEXT, opaque),
        text,
        right - left - 34,
    )
