"""What panels are laid out with: rows with labels, collapsible headings, buttons, switches and choices."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from imgui_bundle import imgui

from clfractal.viewer.panels import theme
from clfractal.viewer.panels.number_box import Boxes
from clfractal.viewer.panels.ui import Ui

T = TypeVar("T")

GUTTER = 11.0
"""Points left of labels, for the dot of values that are not the default."""
LABELS = 0.42
"""Part of a panel's width that labels take up."""
PROBLEM_SECONDS = 6.0

_NAMES = {
    "fov": "Field of view",
    "f_number": "f-number",
    "png_bits": "PNG bits",
    "min_samples": "Least samples",
    "max_steps": "Most steps",
    "at": "Place",
    "by": "Colour by",
    "center": "Centre",
    "color": "Colour",
    "colors": "Colours",
}


def label_of(name: str) -> str:
    """A field's name as its label."""
    return _NAMES.get(name, name.replace("_", " ").capitalize())


def word(text: str) -> str:
    """A word of the schema (`inverse_square`) as it is shown."""
    return text.replace("_", " ").capitalize()


def boxes(ui: Ui) -> Boxes:
    """The memory of all number boxes."""
    found = ui.memory.get("boxes")
    if found is None:
        found = ui.memory["boxes"] = Boxes()
    return found


# Searching


def filtering(ui: Ui) -> str:
    """What is searched for among the settings, in lower case; empty if nothing is."""
    return str(ui.memory.get("filter", "")).strip().lower()


def search(ui: Ui, key: str, prompt: str, width: float = -1.0) -> str:
    """A line to search with; its text is kept in `ui.memory[key]`."""
    imgui.set_next_item_width(width if width > 0 else imgui.get_content_region_avail().x)
    corner = imgui.get_cursor_screen_pos()
    with theme.measures(frame_padding=(25.0, 4.0)):
        _, text = imgui.input_text_with_hint(f"##{key}", prompt, str(ui.memory.get(key, "")))
    imgui.get_window_draw_list().add_text(
        imgui.ImVec2(corner.x + 8, corner.y + 4), theme.packed(theme.DIM), theme.SEARCH
    )
    if text and imgui.is_item_active() and imgui.is_key_pressed(imgui.Key.escape):
        text = ""
    ui.memory[key] = text
    return text


def _matches(ui: Ui, label: str, path: str) -> bool:
    wanted = filtering(ui)
    if not wanted:
        return True
    heading = ui.memory.get("heading", ("", ""))
    found = all(each in f"{label} {path} {heading[1]}".lower() for each in wanted.split())
    if found:
        ui.memory.setdefault("hits", {})[heading[0]] = True
    return found


# Rows


def row(
    ui: Ui,
    label: str,
    *,
    path: str = "",
    tip: str = "",
    differs: bool = False,
    reset: Callable[[], None] | None = None,
) -> float | None:
    """Draws a label and goes to the place of its widget; the width that this has, points.

    None where the row is hidden because something else is searched for.

    Args:
        path: of the value, for the tooltip and for searching.
        tip: what the value means.
        differs: whether it is not the default; then a dot is shown, which sets it back.
        reset: sets it back.
    """
    if not _matches(ui, label, path):
        return None
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    whole = imgui.get_content_region_avail().x
    wide = max(whole * LABELS - GUTTER, 20.0)
    draw = imgui.get_window_draw_list()
    imgui.push_id(path or label)
    if imgui.invisible_button("##dot", imgui.ImVec2(GUTTER, height)) and differs and reset is not None:
        reset()
    hovered = imgui.is_item_hovered()
    if differs:
        middle = imgui.ImVec2(corner.x + 3.5, corner.y + height / 2)
        draw.add_circle_filled(middle, 3.6 if hovered else 2.6, theme.packed(theme.ACCENT))
        _tooltip("Not the default: click to set it back")
    imgui.same_line(0, 0)
    imgui.invisible_button("##label", imgui.ImVec2(wide, height))
    if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0) and reset is not None:
        reset()
    _describe(label, path, tip, differs)
    imgui.pop_id()
    color = theme.TEXT if imgui.is_item_hovered() else theme.DIM
    text = _clipped(label, wide - 4)
    top = corner.y + (height - imgui.get_font_size()) / 2
    draw.add_text(imgui.ImVec2(corner.x + GUTTER, top), theme.packed(color, imgui.get_style().alpha), text)
    imgui.same_line(0, 0)
    return float(whole - GUTTER - wide)


def columns(count: int, spacing: float = 4.0) -> float:
    """Goes to a new line for several widgets side by side over the whole width; the width of each, points."""
    imgui.new_line()
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + GUTTER)
    return (imgui.get_content_region_avail().x - spacing * (count - 1)) / count


def in_row(spacing: float = 6.0) -> None:
    """The next widget stands beside the last one."""
    imgui.same_line(0, spacing)


def problem(ui: Ui, path: str) -> None:
    """What was wrong with the value that was last tried at a path, for some seconds."""
    text = ui.studio.problems.get(path)
    times = ui.memory.setdefault("problem.times", {})
    if text is None:
        times.pop(path, None)
        return
    now = imgui.get_time()
    known = times.get(path)
    if known is None or known[0] != text:
        known = times[path] = (text, now)
    if now - known[1] > PROBLEM_SECONDS:
        ui.studio.problems.pop(path, None)
        return
    warn(text)


def warn(text: str) -> None:
    """A line that tells what is wrong."""
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + GUTTER)
    with theme.colors(text=theme.WARNING):
        _wrapped(text)


def hint(ui: Ui, text: str) -> None:
    """A line of explanation; hidden while something is searched for."""
    if filtering(ui):
        return
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + GUTTER)
    with theme.colors(text=theme.DIM):
        _wrapped(text)


def group(ui: Ui, title: str) -> None:
    """A small heading within a panel; hidden while something is searched for."""
    if filtering(ui):
        return
    imgui.dummy(imgui.ImVec2(0, 1))
    corner = imgui.get_cursor_screen_pos()
    with theme.font("bold", 12.0):
        text = title.upper()
        size = imgui.calc_text_size(text)
        draw = imgui.get_window_draw_list()
        draw.add_text(imgui.ImVec2(corner.x + GUTTER, corner.y), theme.packed(theme.FAINT), text)
        right = corner.x + imgui.get_content_region_avail().x
        y = corner.y + size.y / 2
        draw.add_line(
            imgui.ImVec2(corner.x + GUTTER + size.x + 8, y), imgui.ImVec2(right, y), theme.packed(theme.LINE)
        )
    imgui.dummy(imgui.ImVec2(0, size.y))


def header(ui: Ui, key: str, title: str, icon: str = "", *, summary: str = "", opened: bool = False) -> bool:
    """A heading that opens and closes what is below it; whether that is open.

    Args:
        key: of the panel, under which it is remembered whether it is open.
        summary: shown at its right, in few words.
        opened: whether it is open at first.
    """
    ui.memory["heading"] = (key, title)
    wanted = filtering(ui)
    if wanted:
        scene = (wanted, ui.studio.scene.renderer.type)
        if ui.memory.get("hits.of") != scene:
            ui.memory["hits.of"], ui.memory["hits"] = scene, {}
            ui.memory["hits.seen"] = set()
        seen = ui.memory["hits.seen"]
        if key in seen and not ui.memory["hits"].get(key):
            return False
        seen.add(key)
    states = ui.memory.setdefault("open", {})
    is_open = bool(states.get(key, opened))
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height() + 3
    wide = imgui.get_content_region_avail().x
    if imgui.invisible_button(f"##{key}.heading", imgui.ImVec2(wide, height)) and not wanted:
        is_open = states[key] = not is_open
    hovered = imgui.is_item_hovered()
    draw = imgui.get_window_draw_list()
    far = imgui.ImVec2(corner.x + wide, corner.y + height)
    draw.add_rect_filled(
        corner, far, theme.packed(theme.FRAME_HOVERED if hovered else theme.HEADER), theme.ROUNDING
    )
    is_open = is_open or bool(wanted)
    y = corner.y + (height - imgui.get_font_size()) / 2
    tint = theme.ACCENT if is_open else theme.DIM
    draw.add_text(imgui.ImVec2(corner.x + 9, y), theme.packed(tint), icon)
    with theme.font("bold"):
        draw.add_text(imgui.ImVec2(corner.x + 31, y), theme.packed(theme.TEXT), title)
        used = 31 + imgui.calc_text_size(title).x
    caret = theme.OPENED if is_open else theme.CLOSED
    draw.add_text(imgui.ImVec2(far.x - 17, y), theme.packed(theme.DIM), caret)
    if summary:
        text = _clipped(summary, wide - used - 34)
        draw.add_text(
            imgui.ImVec2(far.x - 25 - imgui.calc_text_size(text).x, y), theme.packed(theme.FAINT), text
        )
    return is_open


# Buttons and choices


def tip(text: str) -> None:
    """A tooltip of the widget that was drawn last."""
    if text:
        _tooltip(text)


def button(
    text: str, *, icon: str = "", primary: bool = False, width: float = 0.0, about: str = "", enabled: bool = True
) -> bool:
    """A button; whether it was clicked.

    Args:
        primary: whether it is the one that is meant to be used.
        width: points; 0: that of its text, -1: all that is left.
        about: its tooltip.
    """
    shown = f"{icon}  {text}" if icon and text else icon or text
    if width < 0:
        width = imgui.get_content_region_avail().x
    if not enabled:
        imgui.begin_disabled()
    if primary:
        bright = {"button": theme.ACCENT, "button_hovered": (1.0, 0.74, 0.38, 1.0), "button_active": theme.ACCENT}
        with theme.colors(text=theme.PANEL_SOLID, **bright):
            clicked = imgui.button(shown, imgui.ImVec2(width, 0))
    else:
        clicked = imgui.button(shown, imgui.ImVec2(width, 0))
    if not enabled:
        imgui.end_disabled()
    tip(about)
    return bool(clicked)


def icon_button(icon: str, about: str, *, name: str = "", on: bool = False, enabled: bool = True) -> bool:
    """A square button with an icon; whether it was clicked.

    Args:
        about: its tooltip.
        name: unlike that of others in the same place; else the tooltip.
        on: whether it is drawn as switched on.
    """
    height = imgui.get_frame_height()
    if not enabled:
        imgui.begin_disabled()
    with theme.measures(frame_padding=(0.0, 4.0)), theme.colors(
        text=theme.ACCENT if on else theme.TEXT, button=theme.ACCENT_FAINT if on else theme.FRAME
    ):
        clicked = imgui.button(f"{icon}##{name or about}", imgui.ImVec2(height, 0))
    if not enabled:
        imgui.end_disabled()
    tip(about)
    return bool(clicked)


def toggle(name: str, on: bool, about: str = "") -> bool:
    """A switch; whether it was clicked."""
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    wide, high = 28.0, 15.0
    clicked = imgui.invisible_button(f"##{name}", imgui.ImVec2(wide, height))
    hovered = imgui.is_item_hovered()
    draw = imgui.get_window_draw_list()
    top = corner.y + (height - high) / 2
    back = theme.ACCENT if on else theme.FRAME_ACTIVE if hovered else theme.FRAME_HOVERED
    alpha = imgui.get_style().alpha
    draw.add_rect_filled(
        imgui.ImVec2(corner.x, top), imgui.ImVec2(corner.x + wide, top + high), theme.packed(back, alpha), high / 2
    )
    middle = imgui.ImVec2(corner.x + (wide - high / 2 if on else high / 2), top + high / 2)
    knob = theme.PANEL_SOLID if on else theme.TEXT if hovered else theme.DIM
    draw.add_circle_filled(middle, high / 2 - 2.5, theme.packed(knob, alpha))
    tip(about)
    return bool(clicked)


def choose(name: str, words: Mapping[T, str], current: T, width: float) -> T | None:
    """A list of choices that opens; the one that was clicked, if it is another."""
    imgui.set_next_item_width(width)
    found: T | None = None
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    flags = imgui.ComboFlags_.height_large | imgui.ComboFlags_.no_arrow_button
    opened = imgui.begin_combo(f"##{name}", words.get(current, str(current)), flags)
    if not opened:
        caret = imgui.ImVec2(corner.x + width - 16, corner.y + (height - imgui.get_font_size()) / 2)
        alpha = imgui.get_style().alpha
        imgui.get_window_draw_list().add_text(caret, theme.packed(theme.DIM, alpha), theme.OPENED)
    if opened:
        for each, text in words.items():
            clicked, _ = imgui.selectable(f"{text}##{each}", each == current)
            if clicked and each != current:
                found = each
            if each == current:
                imgui.set_item_default_focus()
        imgui.end_combo()
    return found


def segments(name: str, words: Mapping[T, str], current: T, width: float) -> T | None:
    """Choices side by side; the one that was clicked, if it is another."""
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    draw = imgui.get_window_draw_list()
    far = imgui.ImVec2(corner.x + width, corner.y + height)
    draw.add_rect_filled(corner, far, theme.packed(theme.FRAME), 5.0)
    each_width = width / len(words)
    found: T | None = None
    for number, (each, text) in enumerate(words.items()):
        if number:
            imgui.same_line(0, 0)
        if imgui.invisible_button(f"##{name}.{each}", imgui.ImVec2(each_width, height)) and each != current:
            found = each
        left = corner.x + number * each_width
        if each == current:
            draw.add_rect_filled(
                imgui.ImVec2(left + 2, corner.y + 2),
                imgui.ImVec2(left + each_width - 2, far.y - 2),
                theme.packed(theme.ACCENT_DIM),
                4.0,
            )
        color = theme.TEXT if each == current or imgui.is_item_hovered() else theme.DIM
        shown = _clipped(text, each_width - 6)
        size = imgui.calc_text_size(shown)
        place = imgui.ImVec2(left + (each_width - size.x) / 2, corner.y + (height - size.y) / 2)
        draw.add_text(place, theme.packed(color), shown)
    return found


def text_box(ui: Ui, name: str, text: str, width: float, prompt: str = "") -> str | None:
    """A line of text; the new one when Enter was pressed or the line was left, if it is another."""
    kept = ui.memory.get("text_box")
    shown = kept[1] if kept is not None and kept[0] == name else text
    imgui.set_next_item_width(width)
    _, new = imgui.input_text_with_hint(f"##{name}", prompt, shown)
    if imgui.is_item_active():
        ui.memory["text_box"] = (name, new)
    elif kept is not None and kept[0] == name:
        ui.memory.pop("text_box", None)
    if imgui.is_item_deactivated_after_edit() and new != text:
        return str(new)
    return None


# Text


def _describe(label: str, path: str, text: str, differs: bool) -> None:
    if not imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip) or not imgui.begin_tooltip():
        return
    imgui.push_text_wrap_pos(280)
    with theme.font("bold"):
        imgui.text_unformatted(label)
    if text:
        # In files a value is null; here it is switched off.
        imgui.text_unformatted((text[:1].upper() + text[1:]).replace("null:", "off:"))
    if path:
        with theme.colors(text=theme.FAINT), theme.font("fixed", 12.5):
            imgui.text_unformatted(path)
    if differs:
        with theme.colors(text=theme.ACCENT):
            imgui.text_unformatted("Double click: back to the default")
    imgui.pop_text_wrap_pos()
    imgui.end_tooltip()


def _tooltip(text: str) -> None:
    if imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled) and (
        imgui.begin_tooltip()
    ):
        imgui.push_text_wrap_pos(280)
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def _wrapped(text: str) -> None:
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()


def _clipped(text: str, width: float) -> str:
    """The text, cut with an ellipsis where it is wider than `width` points."""
    if imgui.calc_text_size(text).x <= width:
        return text
    while text and imgui.calc_text_size(f"{text}\u2026").x > width:
        text = text[:-1]
    return f"{text.rstrip()}\u2026" if text else ""


def spacer(height: float) -> None:
    """Empty room, points."""
    imgui.dummy(imgui.ImVec2(0, height))


