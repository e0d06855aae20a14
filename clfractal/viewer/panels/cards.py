"""Small pictures to choose from: a card with a picture, and grids of them."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from imgui_bundle import imgui

from clfractal.viewer.panels import theme
from clfractal.viewer.panels.buttons import area, clipped
from clfractal.viewer.panels.ui import Ui

GAP = 10.0


@dataclass(frozen=True, slots=True)
class Card:
    """What a card shows.

    Attributes:
        key: of the picture's texture.
        pixels: shape (height, width, 4); None: it is waited for.
        problem: why there is no picture, or empty.
        title, line: below the picture; empty: nothing.
        chosen: whether it stands for what the window shows.
    """

    key: Hashable
    pixels: npt.NDArray[np.uint8] | None
    problem: str = ""
    title: str = ""
    line: str = ""
    chosen: bool = False


def grid(width: float, least: float, gap: float = GAP) -> tuple[int, float]:
    """How many columns of at least `least` points fit into a width, and how wide each of them is."""
    count = max(int((width + gap) // (least + gap)), 1)
    return count, (width - gap * (count - 1)) / count


def height(width: float, card: Card | None = None) -> float:
    """Points that a card of a width is high."""
    high = width * 9 / 16
    if card is not None and card.title:
        high += 23.0 + (15.0 if card.line else 0.0)
    return high


def draw(ui: Ui, name: str, card: Card, width: float) -> bool:
    """Draws a card at the cursor; whether it was clicked. It is the last item, for tooltips and double clicks."""
    corner, picture = imgui.get_cursor_screen_pos(), width * 9 / 16
    clicked = area(f"##{name}", (width, height(width, card)))
    hovered = imgui.is_item_hovered()
    draw_list = imgui.get_window_draw_list()
    far = imgui.ImVec2(corner.x + width, corner.y + picture)
    draw_list.add_rect_filled(corner, far, theme.packed(theme.FRAME), theme.ROUNDING)
    middle = imgui.ImVec2((corner.x + far.x) / 2, (corner.y + far.y) / 2)
    if card.pixels is not None:
        texture = ui.textures.get(card.key, card.pixels)
        zero, one = imgui.ImVec2(0, 0), imgui.ImVec2(1, 1)
        draw_list.add_image_rounded(texture, corner, far, zero, one, 0xFFFFFFFF, theme.ROUNDING)
    elif card.problem:
        size = imgui.calc_text_size(theme.WARN)
        place = imgui.ImVec2(middle.x - size.x / 2, middle.y - size.y / 2)
        draw_list.add_text(place, theme.packed(theme.WARNING), theme.WARN)
    else:
        spinner(ui, middle.x, middle.y)
    _rim(corner, far, card.chosen, hovered)
    if card.title:
        _words(card, corner.x, far.y + 5, width, hovered)
    return bool(clicked)


def spinner(ui: Ui, x: float, y: float, radius: float = 9.0) -> None:
    """Something that turns while a picture is waited for; the window goes on drawing meanwhile."""
    ui.memory["awaited"] = True
    draw_list = imgui.get_window_draw_list()
    middle = imgui.ImVec2(x, y)
    draw_list.add_circle(middle, radius, theme.packed(theme.LINE), 32, 2.0)
    start = (imgui.get_time() * 4.5) % (2 * math.pi)
    draw_list.path_arc_to(middle, radius, start, start + 1.7, 16)
    draw_list.path_stroke(theme.packed(theme.ACCENT, 0.85), 2.0)


def _rim(corner: imgui.ImVec2, far: imgui.ImVec2, chosen: bool, hovered: bool) -> None:
    draw_list = imgui.get_window_draw_list()
    color, thick = (theme.packed(theme.TEXT, 0.75), 1.5) if hovered else (theme.packed(theme.LINE), 1.0)
    if chosen:
        color, thick = theme.packed(theme.ACCENT), 2.0
    draw_list.add_rect(corner, far, color, theme.ROUNDING, thick)
    if not chosen:
        return
    mark = imgui.ImVec2(far.x - 14, corner.y + 14)
    draw_list.add_circle_filled(mark, 8.5, theme.packed(theme.ACCENT))
    with theme.font(size=11.0):
        size = imgui.calc_text_size(theme.CHECK)
        place = imgui.ImVec2(mark.x - size.x / 2, mark.y - size.y / 2)
        draw_list.add_text(place, theme.packed(theme.PANEL_SOLID), theme.CHECK)


def _words(card: Card, x: float, y: float, width: float, hovered: bool) -> None:
    draw_list = imgui.get_window_draw_list()
    color = theme.ACCENT if card.chosen else theme.TEXT
    draw_list.add_text(imgui.ImVec2(x + 2, y), theme.packed(color), clipped(card.title, width - 4))
    if card.line:
        with theme.font(size=12.0):
            place = imgui.ImVec2(x + 2, y + 17)
            draw_list.add_text(place, theme.packed(theme.FAINT), clipped(card.line, width - 4))
