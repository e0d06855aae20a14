"""Buttons, switches, choices and lines of text, as all panels have them; they know nothing of scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from imgui_bundle import imgui

from clfractal.viewer.panels import theme
from clfractal.viewer.panels.ui import Ui

T = TypeVar("T")

_AROUND = 6.0
"""Points around the words of segments."""


def button(
    text: str,
    *,
    icon: str = "",
    primary: bool = False,
    width: float = 0.0,
    about: str = "",
    enabled: bool = True,
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
        bright = {
            "button": theme.ACCENT,
            "button_hovered": (1.0, 0.74, 0.38, 1.0),
            "button_active": theme.ACCENT,
        }
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
    with (
        theme.measures(frame_padding=(0.0, 4.0)),
        theme.colors(
            text=theme.ACCENT if on else theme.TEXT, button=theme.ACCENT_FAINT if on else theme.FRAME
        ),
    ):
        clicked = imgui.button(f"{icon}##{name or about}", imgui.ImVec2(height, 0))
    if not enabled:
        imgui.end_disabled()
    tip(about)
    return bool(clicked)


def area(name: str, size: tuple[float, float]) -> bool:
    """A place without a look of its own, for widgets that are drawn by hand: the pointer and the keyboard reach it; whether
    it was clicked.
    """
    return bool(imgui.invisible_button(name, imgui.ImVec2(*size), imgui.ButtonFlags_.enable_nav))


def toggle(name: str, on: bool, about: str = "") -> bool:
    """A switch; whether it was clicked."""
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    wide, high = 28.0, 15.0
    clicked = area(f"##{name}", (wide, height))
    hovered = imgui.is_item_hovered()
    draw = imgui.get_window_draw_list()
    top = corner.y + (height - high) / 2
    back = theme.ACCENT if on else theme.FRAME_ACTIVE if hovered else theme.FRAME_HOVERED
    alpha = imgui.get_style().alpha
    draw.add_rect_filled(
        imgui.ImVec2(corner.x, top),
        imgui.ImVec2(corner.x + wide, top + high),
        theme.packed(back, alpha),
        high / 2,
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
    """Choices side by side, in as many rows as all their words need; the one that was clicked, if it is another."""
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    rows = rows_of([imgui.calc_text_size(text).x for text in words.values()], width)
    in_row = -(-len(words) // rows)
    each_width = width / in_row
    draw = imgui.get_window_draw_list()
    far = imgui.ImVec2(corner.x + width, corner.y + rows * height)
    draw.add_rect_filled(corner, far, theme.packed(theme.FRAME), 5.0)
    found: T | None = None
    imgui.begin_group()
    for number, (each, text) in enumerate(words.items()):
        row, column = divmod(number, in_row)
        left, top = corner.x + column * each_width, corner.y + row * height
        imgui.set_cursor_screen_pos(imgui.ImVec2(left, top))
        if area(f"##{name}.{each}", (each_width, height)) and each != current:
            found = each
        if each == current:
            draw.add_rect_filled(
                imgui.ImVec2(left + 2, top + 2),
                imgui.ImVec2(left + each_width - 2, top + height - 2),
                theme.packed(theme.ACCENT_DIM),
                4.0,
            )
        color = theme.TEXT if each == current or imgui.is_item_hovered() else theme.DIM
        shown = clipped(text, each_width - _AROUND)
        size = imgui.calc_text_size(shown)
        place = imgui.ImVec2(left + (each_width - size.x) / 2, top + (height - size.y) / 2)
        draw.add_text(place, theme.packed(color), shown)
    imgui.end_group()
    return found


def rows_of(widths: Sequence[float], width: float) -> int:
    """The fewest rows in which words, that are so many points wide, stand whole in fields of equal width."""
    for rows in range(1, len(widths) + 1):
        in_row = -(-len(widths) // rows)
        if max(widths) + _AROUND <= width / in_row:
            return rows
    return len(widths)


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


def tip(text: str) -> None:
    """A tooltip of the widget that was drawn last."""
    if text:
        hover(text)


def hover(text: str) -> None:
    """A tooltip of the widget that was drawn last, also if it is switched off."""
    if imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled) and (
        imgui.begin_tooltip()
    ):
        imgui.push_text_wrap_pos(280)
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def clipped(text: str, width: float) -> str:
    """The text, cut with an ellipsis where it is wider than `width` points."""
    if imgui.calc_text_size(text).x <= width:
        return text
    while text and imgui.calc_text_size(f"{text}\u2026").x > width:
        text = text[:-1]
    return f"{text.rstrip()}\u2026" if text else ""
