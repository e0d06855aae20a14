"""Tracks as rows with their keys: chosen, dragged in time, stretched, deleted."""

from __future__ import annotations

from imgui_bundle import imgui

from clfractal.scene.animation import Animation
from clfractal.viewer import timeline_edits as timeline
from clfractal.viewer import timeline_view
from clfractal.viewer.film_place import value_of
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.timeline_area import LEFT, Area, box, diamond
from clfractal.viewer.panels.timeline_inspector import key_menu
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.timeline_edits import KeyAt
from clfractal.viewer.timeline_view import TimelineView

ROW = 22.0
"""Points that a row is high."""
_REACH = 7.0
_LEAST_FACTOR = 0.02
_HINT = "Drag keys; Alt and drag stretches them about the frame that is shown; double click adds one"


def draw(ui: Ui, view: TimelineView, animation: Animation, area: Area) -> None:
    """Draws all rows, and does what the pointer does with their keys."""
    corner = imgui.get_cursor_screen_pos()
    names = list(animation.tracks)
    high = max(ROW * len(names), imgui.get_content_region_avail().y - 1)
    hovered = _pointer(ui, view, animation, area, names, corner.y, high)
    for number, name in enumerate(names):
        top = corner.y + ROW * number
        label(view, animation, name, corner.x, top)
        _row(view, animation, area, name, top, hovered)
    box(view)
    imgui.set_cursor_screen_pos(imgui.ImVec2(corner.x, corner.y + high))
    imgui.dummy(imgui.ImVec2(1, 0))


def label(view: TimelineView, animation: Animation, name: str, left: float, top: float) -> None:
    """The name of a track, which chooses it."""
    imgui.set_cursor_screen_pos(imgui.ImVec2(left, top))
    if imgui.invisible_button(f"##track.{name}", imgui.ImVec2(LEFT - 6, ROW - 1)):
        view.track = name
        view.selection = timeline.NONE
    over = imgui.is_item_hovered()
    draw, on = imgui.get_window_draw_list(), view.track == name
    if on or over:
        draw.add_rect_filled(
            imgui.ImVec2(left, top),
            imgui.ImVec2(left + LEFT - 6, top + ROW - 1),
            theme.packed(theme.ACCENT_FAINT if on else theme.FRAME),
            4.0,
        )
    fixed = timeline_view.why_fixed(animation, name)
    color = theme.ACCENT if on else theme.TEXT if over else theme.DIM
    shown = w.clipped(short(name), LEFT - 34 if fixed else LEFT - 16)
    draw.add_text(imgui.ImVec2(left + 6, top + 3), theme.packed(color), shown)
    if fixed:
        icon = theme.CODE if animation.tracks[name].expression is not None else theme.LIST
        draw.add_text(imgui.ImVec2(left + LEFT - 26, top + 4), theme.packed(theme.FAINT), icon)
    w.tip(f"{name}\n{fixed}" if fixed else name)


def short(name: str) -> str:
    """A track's name in few words: its last keys."""
    parts = [part for part in name.split(".") if part not in ("parameters", "formula")]
    return " ".join(parts[-3:]).replace("_", " ")


def _row(
    view: TimelineView, animation: Animation, area: Area, name: str, top: float, hovered: KeyAt | None
) -> None:
    draw, middle = imgui.get_window_draw_list(), top + ROW / 2
    low, high = imgui.ImVec2(area.left, top), imgui.ImVec2(area.right, top + ROW - 1)
    draw.add_rect_filled(low, high, theme.packed(theme.HEADER, 0.8 if view.track == name else 0.5), 3.0)
    draw.push_clip_rect(imgui.ImVec2(low.x, low.y), imgui.ImVec2(high.x, high.y), True)
    track = animation.tracks[name]
    places = [area.x(view, animation.frame_of(key)) for key in track.keys or ()]
    if track.keys is None:
        ends = [area.x(view, frame) for frame in (0, animation.count - 1)]
        draw.add_line(
            imgui.ImVec2(ends[0], middle), imgui.ImVec2(ends[1], middle), theme.packed(theme.SECOND, 0.6), 2
        )
    for index in range(len(places) - 1):
        rests = (track.keys or ())[index].values == (track.keys or ())[index + 1].values
        color = theme.packed(theme.FRAME_HOVERED if rests else theme.SECOND, 0.9 if rests else 0.45)
        draw.add_line(imgui.ImVec2(places[index], middle), imgui.ImVec2(places[index + 1], middle), color, 2)
    for index, x in enumerate(places):
        diamond(x, middle, chosen=(name, index) in view.selection, hovered=hovered == (name, index))
    draw.pop_clip_rect()


def _pointer(
    ui: Ui, view: TimelineView, animation: Animation, area: Area, names: list[str], top: float, high: float
) -> KeyAt | None:
    """The key under the pointer; and what the pointer does."""
    imgui.set_cursor_screen_pos(imgui.ImVec2(area.left, top))
    imgui.set_next_item_allow_overlap()
    imgui.invisible_button("##keys", imgui.ImVec2(area.width, high))
    io, mouse = imgui.get_io(), imgui.get_mouse_pos()
    over = imgui.is_item_hovered()
    row = int((mouse.y - top) // ROW)
    name = names[row] if 0 <= row < len(names) and mouse.y >= top else ""
    found = _near(view, animation, area, name, mouse.x) if name and (over or imgui.is_item_active()) else None
    if imgui.is_item_activated():
        if io.mouse_double_clicked[0] and name and found is None:
            _add(ui, view, animation, name, float(round(area.frame(view, mouse.x))))
        else:
            _press(ui, view, found, name, (mouse.x, mouse.y), area.frame(view, mouse.x))
    if imgui.is_item_active() and imgui.is_mouse_dragging(0, 2.0):
        _drag(ui, view, animation, area, names, top)
    if imgui.is_item_deactivated():
        view.held.clear()
        view.end(ui.studio)
    key_menu(ui, view, found if over else None)
    if over and (io.key_ctrl or io.mouse_wheel_h):
        area.wheel(view)
    if over and found is None and name:
        w.tip(timeline_view.why_fixed(animation, name) or _HINT)
    return found if over else None


def _near(view: TimelineView, animation: Animation, area: Area, name: str, x: float) -> KeyAt | None:
    places = [abs(area.x(view, animation.frame_of(key)) - x) for key in animation.tracks[name].keys or ()]
    index = min(range(len(places)), key=places.__getitem__, default=-1)
    return (name, index) if index >= 0 and places[index] <= _REACH else None


def _press(
    ui: Ui, view: TimelineView, found: KeyAt | None, name: str, place: tuple[float, float], frame: float
) -> None:
    more = imgui.get_io().key_shift
    view.held.clear()
    if found is None:
        view.selection = view.selection if more else timeline.NONE
        view.held["box"] = (*place, view.selection)
        view.track = name or view.track
        return
    if more:
        view.selection = view.selection ^ {found}
    elif found not in view.selection:
        view.selection = frozenset({found})
    view.track = found[0]
    if found in view.selection:
        view.held["from"] = frame
        view.begin(ui.studio)


def _drag(ui: Ui, view: TimelineView, animation: Animation, area: Area, names: list[str], top: float) -> None:
    io, mouse = imgui.get_io(), imgui.get_mouse_pos()
    frame = area.frame(view, mouse.x)
    whole = not io.key_ctrl
    if "box" in view.held:
        x, y, before = view.held["box"]
        first, last = sorted((area.frame(view, x), frame))
        low, high = sorted((y - top, mouse.y - top))
        # A box that is thinner than a row chooses in the row that it is in.
        rows = [name for row, name in enumerate(names) if low <= ROW * (row + 1) and ROW * row <= high]
        view.selection = before | timeline.keys_between(animation, first, last, rows)
    elif view.before is not None:
        selection, start = view.before[1], view.held["from"]
        pivot = ui.studio.frame_number or 0.0
        if io.key_alt and abs(start - pivot) > 0.5:
            factor = max((frame - pivot) / (start - pivot), _LEAST_FACTOR)
            view.drag(ui.studio, lambda old: timeline.stretched(old, selection, pivot, factor, whole=whole))
        else:
            step = round(frame - start) if whole else frame - start
            view.drag(ui.studio, lambda old: timeline.shifted(old, selection, step, whole=whole))


def _add(ui: Ui, view: TimelineView, animation: Animation, name: str, frame: float) -> None:
    """A key where the track has its value anyway."""
    if timeline_view.why_fixed(animation, name):
        return
    curve = timeline_view.curve_of(ui.studio, name, frame, frame + 1)
    value = curve[0][1] if curve else value_of(ui.studio.scene, tuple(name.split(".")))
    given = value if not isinstance(value, tuple) or len(value) > 1 else value[0]
    if view.change(ui.studio, lambda old: timeline.with_key(old, name, frame, given)):
        new = ui.studio.scene.animation
        found = timeline.key_at(new, name, frame) if new is not None else None
        view.selection = frozenset({found}) if found is not None else timeline.NONE
        view.track = name
