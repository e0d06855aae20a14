"""A track as curves of its numbers over the film, whose keys and handles are dragged in time and value."""

from __future__ import annotations

import math
from dataclasses import dataclass

from imgui_bundle import imgui

from clfractal.scene.animation import Animation
from clfractal.scene.curves import Values
from clfractal.viewer import timeline_edits as timeline
from clfractal.viewer import timeline_view
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.timeline_area import Area, box, diamond
from clfractal.viewer.panels.timeline_inspector import key_menu
from clfractal.viewer.panels.timeline_rows import ROW, label
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.timeline_view import TimelineView

_REACH = 8.0
_LINES = 5
_HINT = (
    "Drag keys in time and value, with Shift in value alone, with Ctrl between frames; a box or Shift and clicks choose"
    " several"
)


@dataclass(frozen=True, slots=True)
class _Frame:
    """Where values are: the least and the largest one at the bottom and at the top, points."""

    top: float
    bottom: float
    low: float
    high: float

    def y(self, value: float) -> float:
        return self.bottom - (value - self.low) / (self.high - self.low) * (self.bottom - self.top)

    def value(self, y: float) -> float:
        return self.low + (self.bottom - y) / (self.bottom - self.top) * (self.high - self.low)


@dataclass(frozen=True, slots=True)
class _Grip:
    """What can be dragged: a key's number, or the handle behind it (1 or 2)."""

    index: int
    component: int
    handle: int
    x: float
    y: float


def draw(ui: Ui, view: TimelineView, animation: Animation, area: Area) -> None:
    """Draws the chosen track, and the names of all."""
    corner = imgui.get_cursor_screen_pos()
    for number, name in enumerate(animation.tracks):
        label(view, animation, name, corner.x, corner.y + ROW * number)
    name = view.track
    if name not in animation.tracks:
        return
    curve = timeline_view.curve_of(ui.studio, name, view.first, view.last)
    keys = animation.tracks[name].keys or ()
    # While a key is dragged, the place of a value stays where it is.
    shown = [key.values for key in keys] + _handle_values(view, animation, name)
    bounds = view.held.get("bounds") or timeline_view.bounds_of(curve, shown)
    top = imgui.get_window_pos().y
    frame = _Frame(top + 4, top + imgui.get_window_height() - 6, *bounds)
    _grid(area, frame)
    _curves(view, area, frame, curve, fixed=not keys)
    grips = _grips(view, animation, name, area, frame)
    over = _pointer(ui, view, animation, area, frame, grips, top)
    _keys(view, grips, name, over)
    box(view)


def _grid(area: Area, frame: _Frame) -> None:
    draw = imgui.get_window_draw_list()
    low, high = imgui.ImVec2(area.left, frame.top - 3), imgui.ImVec2(area.right, frame.bottom + 3)
    draw.add_rect_filled(low, high, theme.packed(theme.HEADER, 0.6), 4.0)
    with theme.font(size=11.0):
        for value in timeline_view.round_values(frame.low, frame.high, _LINES):
            y = frame.y(value)
            draw.add_line(imgui.ImVec2(area.left, y), imgui.ImVec2(area.right, y), theme.packed(theme.LINE))
            text = f"{value:.4g}".replace("-", "\u2212")
            draw.add_text(imgui.ImVec2(area.left + 4, y - 12), theme.packed(theme.DIM), text)


def _curves(
    view: TimelineView, area: Area, frame: _Frame, curve: list[tuple[float, Values]], *, fixed: bool
) -> None:
    if not curve:
        return
    draw, count = imgui.get_window_draw_list(), len(curve[0][1])
    draw.push_clip_rect(
        imgui.ImVec2(area.left, frame.top - 3), imgui.ImVec2(area.right, frame.bottom + 3), True
    )
    for component in range(count):
        places = [imgui.ImVec2(area.x(view, at), frame.y(values[component])) for at, values in curve]
        own = theme.SECOND if count == 1 else theme.AXES[component % 3]
        color = theme.packed(own, 0.6 if fixed else 1.0)
        draw.add_polyline(places, color, 1.6, 0)
        # The values stay what they are before the first key and after the last.
        for end, rim in ((places[0], area.left), (places[-1], area.right)):
            if (rim < end.x) == (rim == area.left):
                draw.add_line(end, imgui.ImVec2(rim, end.y), theme.packed(theme.FAINT), 1.0)
    draw.pop_clip_rect()


def _grips(view: TimelineView, animation: Animation, name: str, area: Area, frame: _Frame) -> list[_Grip]:
    keys = animation.tracks[name].keys or ()
    found = []
    for index, key in enumerate(keys):
        x = area.x(view, animation.frame_of(key))
        for component, number in enumerate(key.values):
            found.append(_Grip(index, component, 0, x, frame.y(number)))
        if index + 1 < len(keys) and (name, index) in view.selection:
            found += _handles(view, animation, name, index, area, frame)
    return found


def _handles(
    view: TimelineView, animation: Animation, name: str, index: int, area: Area, frame: _Frame
) -> list[_Grip]:
    """Those of a Bezier curve: for the number that changes most."""
    track = animation.tracks[name]
    keys = track.keys or ()
    key, after = keys[index], keys[index + 1]
    if (key.interpolation or track.interpolation) != "bezier" or key.handles is None:
        return []
    component = max(range(len(key.values)), key=lambda n: abs(after.values[n] - key.values[n]))
    begin, end = animation.frame_of(key), animation.frame_of(after)
    first, last = key.values[component], after.values[component]
    if first == last:
        return []
    x1, y1, x2, y2 = key.handles
    return [
        _Grip(
            index,
            component,
            number,
            area.x(view, begin + share * (end - begin)),
            frame.y(first + way * (last - first)),
        )
        for number, share, way in ((1, x1, y1), (2, x2, y2))
    ]


def _handle_values(view: TimelineView, animation: Animation, name: str) -> list[Values]:
    """The values at which the handles of the chosen key are."""
    unit = _Frame(0.0, 1.0, 1.0, 0.0)  # in which a value is its own place
    found: list[Values] = []
    for each, index in view.selection:
        if each == name and index + 1 < len(animation.tracks[name].keys or ()):
            found += [(grip.y,) for grip in _handles(view, animation, name, index, Area(0, 1, 0), unit)]
    return found


def _pointer(
    ui: Ui,
    view: TimelineView,
    animation: Animation,
    area: Area,
    frame: _Frame,
    grips: list[_Grip],
    top: float,
) -> _Grip | None:
    """What is under the pointer; and what the pointer does."""
    imgui.set_cursor_screen_pos(imgui.ImVec2(area.left, top))
    imgui.invisible_button("##curves", imgui.ImVec2(area.width, max(frame.bottom + 3 - top, 1)))
    mouse, over, name = imgui.get_mouse_pos(), imgui.is_item_hovered(), view.track
    away = {grip: abs(grip.x - mouse.x) + abs(grip.y - mouse.y) for grip in grips}
    within_reach = [grip for grip in grips if away[grip] <= _REACH]
    near = min(within_reach, key=lambda grip: (away[grip], -grip.handle), default=None)
    if imgui.is_item_activated():
        _press(ui, view, near, frame)
    if imgui.is_item_active() and imgui.is_mouse_dragging(0, 2.0):
        if "grip" in view.held:
            view.held.pop("leaves", None)
            _drag(ui, view, area, frame)
        elif "box" in view.held:
            _choose(view, grips)
    if imgui.is_item_deactivated():
        view.selection -= view.held.get("leaves", timeline.NONE)
        view.held.clear()
        view.end(ui.studio)
    key_menu(ui, view, (name, near.index) if over and near is not None else None)
    if not over:
        return None
    area.wheel(view)
    if near is None:
        w.tip(timeline_view.why_fixed(animation, name) or _HINT)
    return near


def _press(ui: Ui, view: TimelineView, near: _Grip | None, frame: _Frame) -> None:
    """A click chooses a key, with Shift one more or one less; beside keys it begins a box."""
    more, mouse = imgui.get_io().key_shift, imgui.get_mouse_pos()
    view.held.clear()
    if near is None:
        before = view.selection if more else timeline.NONE
        view.held["box"] = (mouse.x, mouse.y, before)
        view.selection = before
        return
    place = (view.track, near.index)
    if place not in view.selection:
        view.selection = view.selection | {place} if more else frozenset({place})
    elif more and not near.handle:
        view.held["leaves"] = frozenset({place})  # unless it is dragged
    view.held |= {"grip": near, "bounds": (frame.low, frame.high)}
    view.begin(ui.studio)


def _choose(view: TimelineView, grips: list[_Grip]) -> None:
    """The keys in the box, and those that were chosen before."""
    x, y, before = view.held["box"]
    mouse = imgui.get_mouse_pos()
    (left, right), (top, bottom) = sorted((x, mouse.x)), sorted((y, mouse.y))
    inside = [each for each in grips if left <= each.x <= right and top <= each.y <= bottom]
    view.selection = before | {(view.track, each.index) for each in inside if not each.handle}


def _drag(ui: Ui, view: TimelineView, area: Area, frame: _Frame) -> None:
    grip: _Grip = view.held["grip"]
    mouse, io, name = imgui.get_mouse_pos(), imgui.get_io(), view.track
    at, value = area.frame(view, mouse.x), frame.value(mouse.y)
    value = float(f"{value:.6g}")

    def moved(old: Animation) -> tuple[Animation, timeline.Selection]:
        place, chosen = (name, grip.index), view.before[1] if view.before is not None else timeline.NONE
        if grip.handle:
            return _with_handle(old, place, grip, at, value), chosen
        new, was = old, timeline.key_of(old, place).values[grip.component]
        for each in chosen:
            if each[0] == name:
                number = timeline.key_of(old, each).values[grip.component] + value - was
                new = timeline.with_number(new, each, grip.component, float(f"{number:.6g}"))
        if io.key_shift:
            return new, chosen
        low, high = _room(new, chosen, timeline.NEAR * 2 if io.key_ctrl else 1.0)
        wanted = (at if io.key_ctrl else round(at)) - new.frame_of(timeline.key_of(new, place))
        step = max(min(wanted, max(high, 0.0)), min(low, 0.0))
        return timeline.moved(new, chosen, lambda time: time + step)

    view.drag(ui.studio, moved)


def _room(animation: Animation, chosen: timeline.Selection, gap: float) -> tuple[float, float]:
    """How many frames keys may go back and on, so that each stays between its neighbours and in the film."""
    low, high = -math.inf, math.inf
    for name, index in chosen:
        keys = animation.tracks[name].keys or ()
        here = animation.frame_of(keys[index])
        if index == 0:
            low = max(low, -here)
        elif (name, index - 1) not in chosen:
            low = max(low, animation.frame_of(keys[index - 1]) + gap - here)
        if index + 1 == len(keys):
            high = min(high, animation.count - 1 - here)
        elif (name, index + 1) not in chosen:
            high = min(high, animation.frame_of(keys[index + 1]) - gap - here)
    return low, high


def _with_handle(old: Animation, place: timeline.KeyAt, grip: _Grip, at: float, value: float) -> Animation:
    keys = old.tracks[place[0]].keys or ()
    key, after = keys[grip.index], keys[grip.index + 1]
    begin, end = old.frame_of(key), old.frame_of(after)
    first, last = key.values[grip.component], after.values[grip.component]
    share, way = (at - begin) / (end - begin), (value - first) / (last - first)
    handles = list(key.handles or (0.42, 0.0, 0.58, 1.0))
    handles[2 * grip.handle - 2 : 2 * grip.handle] = [share, way]
    return timeline.with_handles(old, place, handles)


def _keys(view: TimelineView, grips: list[_Grip], name: str, over: _Grip | None) -> None:
    draw = imgui.get_window_draw_list()
    for grip in grips:
        if grip.handle:
            end = next(
                each
                for each in grips
                if not each.handle
                and each.component == grip.component
                and each.index == grip.index + grip.handle - 1
            )
            place, far = imgui.ImVec2(grip.x, grip.y), imgui.ImVec2(end.x, end.y)
            draw.add_line(place, far, theme.packed(theme.ACCENT, 0.7))
            draw.add_circle_filled(place, 4.0, theme.packed(theme.ACCENT))
        else:
            chosen = (name, grip.index) in view.selection
            diamond(grip.x, grip.y, chosen=chosen, hovered=over == grip, size=4.5)
