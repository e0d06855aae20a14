"""The timeline below the picture: the film's buttons, a ruler to scrub on, tracks, an inspector."""

from __future__ import annotations

from imgui_bundle import imgui, imgui_ctx

from clfractal.scene.animation import Animation
from clfractal.viewer import timeline_edits as timeline
from clfractal.viewer import timeline_view
from clfractal.viewer.panels import theme, timeline_curves, timeline_inspector, timeline_rows
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.timeline_area import BAR, LEFT, Area, height_of, left_of
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.playing import Player
from clfractal.viewer.timeline_view import TimelineView

_RULER = 21.0
_INSPECTOR = 232.0
# Panels narrower than this, points, have no inspector.
_ROOM = 640.0
# Below this, points, the less usual buttons are left to their keys.
_ALL_BUTTONS = 480.0
_FRAME_BOX = 400.0


def draw(ui: Ui) -> None:
    """Draws the timeline, while a film is shown."""
    animation, player = ui.studio.scene.animation, ui.memory.get("player")
    if "panels" not in ui.show or animation is None or ui.studio.frame_number is None or player is None:
        return
    view = timeline_view.of(ui.memory)
    view.follow(animation)
    left = left_of(ui)
    width = max(ui.size[0] - left - theme.MARGIN, 100.0)
    high = height_of(ui)
    place, no_nav = (left, ui.size[1] - theme.MARGIN - high), imgui.WindowFlags_.no_nav
    flags = theme.BACK | no_nav
    with theme.window("timeline", place, (width, high), flags=flags, window_padding=(8.0, 7.0)):
        _buttons(ui, player, view, animation, width)
        inspected = width >= _ROOM
        inner = width - 16 - (_INSPECTOR + 8 if inspected else 0)
        corner = imgui.get_cursor_screen_pos()
        area = Area(corner.x + LEFT, max(inner - LEFT - BAR, 40.0), corner.y + _RULER)
        _ruler(ui, player, view, animation, area, corner.y)
        with imgui_ctx.begin_child("##tracks", imgui.ImVec2(inner, 0), 0, no_nav):
            if not animation.tracks:
                _empty(ui)
            else:
                (timeline_curves if view.curves else timeline_rows).draw(ui, view, animation, area)
            _playhead(ui, view, area, corner.y)
        _playhead(ui, view, area, corner.y)
        if inspected:
            imgui.set_cursor_screen_pos(imgui.ImVec2(corner.x + inner + 8, corner.y))
            with imgui_ctx.begin_child("##inspector", imgui.ImVec2(0, 0), 0, no_nav):
                timeline_inspector.draw(ui, view, animation)


def _button(ui: Ui, action: str, icon: str, about: str, *, on: bool = False, enabled: bool = True) -> None:
    w.act(ui, action, icon, about, on=on, enabled=enabled)
    w.in_row(2)


def _buttons(ui: Ui, player: Player, view: TimelineView, animation: Animation, width: float) -> None:
    """The line at the top."""
    wide = width >= _ALL_BUTTONS
    if wide:
        _button(ui, "film_first", theme.FIRST, "To the first frame")
        _button(ui, "key_back", theme.KEY_BACK, "To the key before")
    _button(ui, "frame_back", theme.LEFT, "One frame back")
    running = player.playing
    _button(ui, "play", theme.PAUSE if running else theme.PLAY, "Stop" if running else "Play", on=running)
    _button(ui, "frame_forward", theme.RIGHT, "One frame on")
    if wide:
        _button(ui, "key_forward", theme.KEY_NEXT, "To the key after")
        _button(ui, "film_last", theme.LAST, "To the last frame")
        _button(ui, "play_repeat", theme.REPEAT, "Repeat while playing", on=player.repeat)
    frame = ui.studio.frame_number or 0.0
    if width >= _FRAME_BOX:
        _frame_box(ui, player, animation, frame)
    w.in_row(5)
    text = f"of {animation.count}   {timeline.clock(frame, animation.fps)}"
    if player.playing and ui.speed.frames and width > _ROOM:
        text += f"   {min(ui.speed.frames, animation.fps):.0f} of {animation.fps:g}/s"
    buttons = max(width - 8 - 9 * (imgui.get_frame_height() + 2) - 12, 0.0)
    shown = w.clipped(text, buttons - imgui.get_cursor_pos_x() - 6)
    w.beside(shown if shown == text else "", theme.DIM)
    _right_buttons(ui, player, view, buttons)


def _frame_box(ui: Ui, player: Player, animation: Animation, frame: float) -> None:
    w.in_row(6)
    last = animation.count - 1
    scale = w.Scale(0, last, (0, max(last, 1)), whole=frame == round(frame))
    change = w.number_box(w.boxes(ui), "timeline.frame", frame, 54, scale)
    w.tip("The frame that is shown")
    if change.value is not None:
        player.show(change.value, moving=change.dragging)
    if change.ended:
        ui.studio.end_gesture()


def _right_buttons(ui: Ui, player: Player, view: TimelineView, left: float) -> None:
    studio = ui.studio
    count = len(studio.changed())
    imgui.same_line(left)
    _button(ui, "record_flight", theme.RECORD, "Record a flight", on=player.recording)
    _button(
        ui, "auto_keys", theme.MAGIC, "Set keys at once where a track's value changes", on=studio.auto_keys
    )
    told = f"Set keys for what changed at this frame: {count}" if count else "Nothing changed at this frame"
    _button(ui, "set_keys", theme.KEY, told, on=count > 0)
    if w.icon_button(theme.PLUS, "Add a track, with a key at this frame", name="timeline.add"):
        imgui.open_popup("##timeline.add")
    timeline_inspector.add_popup(ui, view)
    w.in_row(6)
    about = "Curves; off: rows of keys"
    if w.icon_button(theme.CURVE, about, name="timeline.curves", on=view.curves):
        view.curves = not view.curves
    w.in_row(2)
    _button(ui, "delete_keys", theme.TRASH, "Delete the chosen keys", enabled=bool(view.selection))
    if w.icon_button(theme.COG, "Length and rate of the film", name="timeline.film"):
        imgui.open_popup("##timeline.film")
    timeline_inspector.film_popup(ui, view)
    w.in_row(2)
    _button(ui, "render_film", theme.DOWNLOAD, "Render the film", on="films" in ui.show)
    _button(ui, "timeline", theme.CROSS, "Close the film: show the scene as it stands")
    imgui.new_line()


def _ruler(ui: Ui, player: Player, view: TimelineView, animation: Animation, area: Area, top: float) -> None:
    """Frames and seconds; a drag scrubs."""
    draw = imgui.get_window_draw_list()
    low, high = imgui.ImVec2(area.left, top), imgui.ImVec2(area.right, top + _RULER - 3)
    draw.add_rect_filled(low, high, theme.packed(theme.HEADER), 4.0)
    draw.push_clip_rect(low, high, True)
    spans = [((0, animation.count - 1), theme.packed(theme.FRAME))]
    if player.span is not None:
        spans.append((player.played(animation), theme.packed(theme.ACCENT, 0.28)))
    for ends, color in spans:
        first, last = (area.x(view, frame) for frame in ends)
        draw.add_rect_filled(imgui.ImVec2(first, low.y), imgui.ImVec2(last, high.y), color, 3.0)
    step = timeline_view.step_of_marks(view.last - view.first, int(area.width / 74))
    with theme.font(size=11.5):
        for frame in timeline_view.marks(view.first, view.last, step):
            at = area.x(view, frame)
            draw.add_line(imgui.ImVec2(at, high.y - 6), imgui.ImVec2(at, high.y), theme.packed(theme.FAINT))
            number = f"{frame:g}"
            if at + 16 > area.right:
                continue
            draw.add_text(imgui.ImVec2(at + 3, low.y + 2), theme.packed(theme.TEXT), number)
            across = at + 6 + imgui.calc_text_size(number).x
            draw.add_text(
                imgui.ImVec2(across, low.y + 2), theme.packed(theme.FAINT), f"{frame / animation.fps:.3g} s"
            )
    draw.pop_clip_rect()
    imgui.set_cursor_screen_pos(low)
    imgui.invisible_button("##ruler", imgui.ImVec2(area.width, _RULER - 3))
    if imgui.is_item_active():
        frame = area.frame(view, imgui.get_mouse_pos().x)
        io = imgui.get_io()
        if imgui.is_item_activated():
            view.held["span"] = frame if io.key_shift else None
        began = view.held.get("span")
        if began is not None:
            player.set_span(began, frame)
        else:
            player.show(frame if io.key_ctrl else float(round(frame)), moving=True)
    if imgui.is_item_deactivated():
        ui.studio.end_gesture()
    if imgui.is_item_hovered():
        area.wheel(view)
        w.tip(
            "Drag to look at other frames, with Ctrl between them; with Shift to choose the part that is played. "
            "The wheel shows more or fewer"
        )
    imgui.set_cursor_screen_pos(imgui.ImVec2(area.left - LEFT, top + _RULER))


def _playhead(ui: Ui, view: TimelineView, area: Area, top: float) -> None:
    x = area.x(view, ui.studio.frame_number or 0.0)
    if not area.left - 1 <= x <= area.right + 1:
        return
    draw = imgui.get_window_draw_list()
    bottom = imgui.get_window_pos().y + height_of(ui) - 7
    color = theme.packed(theme.ACCENT)
    draw.add_triangle_filled(
        imgui.ImVec2(x - 5, top), imgui.ImVec2(x + 5, top), imgui.ImVec2(x, top + 8), color
    )
    draw.add_line(imgui.ImVec2(x, top), imgui.ImVec2(x, bottom), color, 1.5)


def _empty(ui: Ui) -> None:
    keys = ui.keys.hint("set_keys") or "the button with the key"
    flight = ui.keys.hint("record_flight") or "the round button"
    imgui.dummy(imgui.ImVec2(0, 6))
    w.hint(ui, f"Nothing moves yet. Go to a frame, change something, and set keys for it: {keys}.")
    w.hint(ui, f"+ adds a track for any value. {flight} records a flight.")
