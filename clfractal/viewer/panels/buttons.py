"""Buttons, switches, choices and lines of text, as all panels have them; they know nothing of scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from imgui_bundle import imgui, imgui_ctx

from clfractal.viewer.panels import theme
from clfractal.viewer.panels.ui import Ui

T = TypeVar("T")

_AROUND = 6.0
"""Points around the words of segments."""
_PRIMARY: dict[str, theme.Rgba] = {
    "text": theme.PANEL_SOLID,
    "button": theme.ACCENT,
    "button_hovered": (1.0, 0.74, 0.38, 1.0),
    "button_active": theme.ACCENT,
}


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
    imgui.begin_disabled(not enabled)
    with theme.colors(**(_PRIMARY if primary else {})):
        clicked = imgui.button(shown, imgui.ImVec2(width, 0))
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
    imgui.begin_disabled(not enabled)
    with (
        theme.measures(frame_padding=(0.0, 4.0)),
        theme.colors(
            text=theme.ACCENT if on else theme.TEXT, button=theme.ACCENT_FAINT if on else theme.FRAME
        ),
    ):
        clicked = imgui.button(f"{icon}##{name or about}", imgui.ImVec2(height, 0))
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
        color = theme.packed(theme.DIM, imgui.get_style().alpha)
        imgui.get_window_draw_list().add_text(caret, color, theme.OPENED)
        return None
    for each, text in words.items():
        if imgui.selectable(f"{text}##{each}", each == current)[0] and each != current:
            found = each
        if each == current:
            imgui.set_item_default_focus()
    imgui.end_combo()
    return found


def menu(name: str, words: Mapping[T, str], current: T | None = None, none: str = "") -> T | None:
    """A list that `imgui.open_popup` opens; the choice that was clicked.

    Args:
        none: said where there is no choice.
    """
    found: T | None = None
    if imgui.begin_popup(name):
        if not words:
            imgui.text(none)
        for each, text in words.items():
            if imgui.selectable(f"{text}##{each}", each == current)[0]:
                found = each
        imgui.end_popup()
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
    rows = range(1, len(widths) + 1)
    fit = (n for n in rows if max(widths) + _AROUND <= width / -(-len(widths) // n))
    return next(fit, len(widths))


def text_box(ui: Ui, name: str, text: str, width: float, prompt: str = "") -> str | None:
    """A line of text; the new one when Enter was pressed or the line was left, if it is another."""
    kept, typed = ui.memory.get("text_box", ("", ""))
    imgui.set_next_item_width(width)
    _, new = imgui.input_text_with_hint(f"##{name}", prompt, typed if kept == name else text)
    if imgui.is_item_active():
        ui.memory["text_box"] = (name, new)
    elif kept == name:
        del ui.memory["text_box"]
    return str(new) if imgui.is_item_deactivated_after_edit() and new != text else None


def tip(text: str) -> None:
    """A tooltip of the widget that was drawn last, also if it is switched off."""
    flags = imgui.HoveredFlags_.for_tooltip | imgui.HoveredFlags_.allow_when_disabled
    if text and imgui.is_item_hovered(flags) and imgui.begin_tooltip():
        wrapped(text, 280)
        imgui.end_tooltip()


def wrapped(text: str, right: float = 0.0, color: theme.Rgba = theme.TEXT) -> None:
    """A text in as many lines as it needs; they end at `right` points of the window, 0: where that ends."""
    with theme.colors(text=color), imgui_ctx.push_text_wrap_pos(right):
        imgui.text_unformatted(text)


def beside(text: str, color: theme.Rgba = theme.TEXT) -> None:
    """A text at the height of the words of widgets that it stands beside."""
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.vec(color), text)


class Line:
    """A line of a list, drawn by hand over all of the width that is left.

    Attributes:
        clicked, hovered: by the pointer.
        draw: the list that it is drawn with.
    """

    def __init__(self, name: str, chosen: bool | None, height: float = 0.0) -> None:
        """Begins it.

        Args:
            chosen: whether it is marked; None: whoever draws it gives it its background.
            height: points; 0: that of a widget.
        """
        self.corner, self.height = imgui.get_cursor_screen_pos(), height or imgui.get_frame_height()
        self.wide = imgui.get_content_region_avail().x
        self.clicked = area(f"##{name}", (self.wide, self.height))
        self.hovered = imgui.is_item_hovered()
        self.draw = imgui.get_window_draw_list()
        if chosen or (self.hovered and chosen is not None):
            back = theme.ACCENT_FAINT if chosen else theme.FRAME
            self.draw.add_rect_filled(self.corner, self.at(self.wide, self.height), theme.packed(back), 5.0)

    def at(self, x: float, y: float | None = None) -> imgui.ImVec2:
        """A place in it, points from its corner; `y`: else its middle."""
        return imgui.ImVec2(self.corner.x + x, self.corner.y + (self.height / 2 if y is None else y))

    def write(self, x: float, text: str, color: theme.Rgba = theme.TEXT, y: float | None = None) -> None:
        """Writes a text: from a place on, or if that is negative up to so many points before the right end."""
        left = x if x >= 0 else self.wide + x - imgui.calc_text_size(text).x
        top = (self.height - imgui.get_font_size()) / 2 if y is None else y
        self.draw.add_text(self.at(left, top), theme.packed(color), text)


def clipped(text: str, width: float) -> str:
    """The text, cut with an ellipsis where it is wider than `width` points."""
    if imgui.calc_text_size(text).x <= width:
        return text
    while text and imgui.calc_text_size(f"{text}\u2026").x > width:
        text = text[:-1]
    return f"{text.rstrip()}\u2026" if text else ""
