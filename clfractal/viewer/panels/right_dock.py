"""The column at the window's right: variations, stills, films and history."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import takewhile

from imgui_bundle import imgui

from clfractal.viewer.panels import menu, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.timeline_area import room_of
from clfractal.viewer.panels.ui import Ui

_PARTS = {"variations": (370.0, 2.0), "stills": (250.0, 0.7), "films": (282.0, 0.7), "history": (230.0, 1.0)}
"""Parts in their order: the least height that they can be used with, points, and their shares of what is left."""
_OVERLAY = 64.0
"""Points at the lower rim that belong to the overlay."""
_WIDEST = 420.0


def width_of(ui: Ui) -> float:
    """Points that the column is wide: more in a wide window, but the picture's middle stays free."""
    return min(max(0.21 * ui.size[0], theme.DOCK_RIGHT), _WIDEST, ui.size[0] - 2 * theme.MARGIN)


def is_open(ui: Ui) -> bool:
    """Whether any of its parts is open."""
    return not ui.show.isdisjoint(_PARTS)


def fit(ui: Ui) -> None:
    """Closes the parts that have been open longest, until the others have room; before they are drawn."""
    order: list[str] = ui.memory.setdefault("right_dock", [])
    shown = [name for name in _PARTS if name in ui.show]
    order[:] = [name for name in order if name in shown] + [name for name in shown if name not in order]
    top, bottom = _span(ui)
    while len(order) > 1:
        needed = sum(_PARTS[name][0] for name in order) + theme.MARGIN * (len(order) - 1)
        if needed <= bottom - top:
            return
        ui.show.discard(order.pop(0))


def place(ui: Ui, part: str) -> tuple[float, float, float, float]:
    """Left, top, width and height of a part that is open, points."""
    top, bottom = _span(ui)
    shown = {name: least_share for name, least_share in _PARTS.items() if name in ui.show}
    left_over = bottom - top - theme.MARGIN * (len(shown) - 1) - sum(least for least, _ in shown.values())
    total = sum(share for _, share in shown.values())
    high = {name: max(least + left_over * share / total, 80.0) for name, (least, share) in shown.items()}
    top += sum(high[name] + theme.MARGIN for name in takewhile(lambda name: name != part, shown))
    return ui.size[0] - theme.MARGIN - width_of(ui), top, width_of(ui), high[part]


def _span(ui: Ui) -> tuple[float, float]:
    """Where the column begins and ends, below the bar of buttons and above the overlay."""
    top = theme.MARGIN + (menu.HEIGHT + theme.MARGIN if "panels" in ui.show else 0.0)
    overlay = _OVERLAY if "overlay" in ui.show else 0.0
    return top, ui.size[1] - theme.MARGIN - overlay - room_of(ui)


@contextmanager
def window(ui: Ui, part: str, title: str, icon: str) -> Iterator[None]:
    """The window of a part that is open, with its title and a button that closes it."""
    left, top, width, height = place(ui, part)
    with theme.window(part, (left, top), (width, height), flags=theme.BACK):
        w.beside(icon, theme.ACCENT)
        w.in_row(7)
        with theme.font("bold"):
            imgui.text(title)
        imgui.same_line(width - 10 - imgui.get_frame_height())
        if w.icon_button(theme.CROSS, "Close", name=f"{part}.close"):
            ui.show.discard(part)
        imgui.dummy(imgui.ImVec2(0, 1))
        yield
