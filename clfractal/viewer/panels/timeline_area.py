"""Where the timeline is, and places in it."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import imgui

from clfractal.viewer.panels import theme
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.timeline_view import TimelineView

HEIGHT, _LEAST = 218.0, 124.0
"""Points that the timeline is high where there is room for all of it."""
_PART = 0.36
LEFT = 158.0
"""Points for the names of tracks."""
BAR = 10.0
"""Points at the right that are left to the bar by which many tracks are scrolled."""
_WHEEL = 0.85


def left_of(ui: Ui) -> float:
    """Where the timeline begins, beside the dock; in a narrow window over it, points."""
    beside = theme.MARGIN + theme.DOCK_LEFT + theme.MARGIN
    return beside if ui.size[0] - beside >= 320 else theme.MARGIN


def height_of(ui: Ui) -> float:
    """Points that the timeline is high: less in a low window, most of which is the picture's."""
    return min(HEIGHT, max(_PART * ui.size[1], _LEAST))


def room_of(ui: Ui) -> float:
    """Points at the lower rim that the timeline takes up; 0 while it is not shown."""
    shown = "panels" in ui.show and ui.studio.frame_number is not None and "player" in ui.memory
    return height_of(ui) + theme.MARGIN if shown else 0.0


@dataclass(frozen=True, slots=True)
class Area:
    """The part of the timeline in which frames are across, points."""

    left: float
    width: float
    top: float

    @property
    def right(self) -> float:
        """Its right end."""
        return self.left + self.width

    def x(self, view: TimelineView, frame: float) -> float:
        """Where a frame is."""
        return view.x_of(frame, self.left, self.width)

    def frame(self, view: TimelineView, x: float) -> float:
        """The frame at a place."""
        return view.frame_of(x, self.left, self.width)

    def wheel(self, view: TimelineView) -> None:
        """The wheel over the item that was drawn last shows more or fewer frames; with Shift earlier or later ones."""
        io = imgui.get_io()
        if io.mouse_wheel_h or (io.mouse_wheel and io.key_shift):
            view.pan(-(io.mouse_wheel_h or io.mouse_wheel) * 0.1 * (view.last - view.first))
        elif io.mouse_wheel:
            view.zoom(self.frame(view, io.mouse_pos.x), _WHEEL**io.mouse_wheel)


def diamond(x: float, y: float, *, chosen: bool, hovered: bool = False, size: float = 5.0) -> None:
    """Draws a key."""
    draw = imgui.get_window_draw_list()
    size += 1.0 if hovered else 0.0
    points = [(x, y - size), (x + size, y), (x, y + size), (x - size, y)]
    corners = [imgui.ImVec2(*point) for point in points]
    fill = theme.ACCENT if chosen else theme.TEXT if hovered else theme.DIM
    draw.add_quad_filled(*corners, theme.packed(fill))
    draw.add_quad(*corners, theme.packed(theme.PANEL_SOLID), 1.2)


def box(view: TimelineView) -> None:
    """Draws the box in which keys are chosen while it is dragged."""
    if "box" not in view.held or not imgui.is_mouse_dragging(0, 2.0):
        return
    x, y, _ = view.held["box"]
    mouse, draw = imgui.get_mouse_pos(), imgui.get_window_draw_list()
    draw.add_rect_filled(imgui.ImVec2(x, y), mouse, theme.packed(theme.ACCENT_FAINT))
    draw.add_rect(imgui.ImVec2(x, y), mouse, theme.packed(theme.ACCENT_DIM))
