"""What panels that order pictures and films are made of: labels, sizes, whole numbers, bars."""

from __future__ import annotations

from collections.abc import Mapping

from imgui_bundle import imgui

from clfractal.scene.parts import MAX_SIDE
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

Size = tuple[int, int]


def label(text: str) -> float:
    """A label, then the place of its widget; the width that this has, points."""
    wide = imgui.get_content_region_avail().x
    start = imgui.get_cursor_pos_x()
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.vec(theme.DIM), text)
    left = 0.27 * wide
    imgui.same_line(start + left)
    return float(wide - left)


def number(ui: Ui, name: str, value: int, width: float, most: int, least: int = 1) -> int | None:
    """A box with a whole number; the new one, if it was changed."""
    # A drag over some hundred points reaches every usual size.
    scale = w.Scale(least, most, None, False, True, "", 1.0, 1.0, (False, False))
    change = w.number_box(w.boxes(ui), name, float(value), width, scale)
    return None if change.value is None else round(change.value)


def size(
    ui: Ui, name: str, presets: Mapping[str, Size | None], chosen: Size | None, usual: Size
) -> Size | None:
    """A size of a list or of two numbers; the new choice.

    Args:
        presets: by their titles; None: `usual`.
        chosen: the present choice.
    """
    used = chosen or usual
    words = {}
    for title, each in presets.items():
        wide, high = each or usual
        words[title] = title if title.startswith("Square") else f"{title}, {wide} x {high}"
    present = next((title for title, each in presets.items() if each == chosen), "free")
    found = w.choose(f"{name}.preset", {**words, "free": "Free"}, present, label("Size"))
    if found is not None:
        chosen = presets.get(found, used)
    label("")
    each_width = (imgui.get_content_region_avail().x - 20) / 2
    width = number(ui, f"{name}.width", used[0], each_width, MAX_SIDE)
    w.in_row(5)
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.vec(theme.FAINT), "x")
    w.in_row(5)
    height = number(ui, f"{name}.height", used[1], each_width, MAX_SIDE)
    return (width or used[0], height or used[1]) if width is not None or height is not None else chosen


def samples(ui: Ui, name: str, chosen: int | None, usual: int, most: int) -> int | None:
    """How many samples a pixel gets; None: as many as the scene says."""
    width = label("Samples")
    found = number(ui, f"{name}.samples", chosen or usual, width - 30, most)
    w.in_row(4)
    about = f"As the scene says: {usual}"
    if w.icon_button(theme.RESET, about, name=f"{name}.samples.reset", enabled=chosen is not None):
        return None
    return chosen if found is None else found


def bar(share: float, width: float) -> None:
    """How much is done, 0 to 1."""
    corner, high = imgui.get_cursor_screen_pos(), 5.0
    draw_list = imgui.get_window_draw_list()
    far = imgui.ImVec2(corner.x + width, corner.y + high)
    draw_list.add_rect_filled(corner, far, theme.packed(theme.FRAME), high / 2)
    if share > 0:
        filled = imgui.ImVec2(corner.x + max(share * width, high), far.y)
        draw_list.add_rect_filled(corner, filled, theme.packed(theme.ACCENT), high / 2)
    imgui.dummy(imgui.ImVec2(width, high))


def time_text(seconds: float) -> str:
    """A time that is left, for people."""
    if seconds < 90:
        return f"{max(round(seconds), 1)} s"
    if seconds < 90 * 60:
        return f"{round(seconds / 60)} min"
    return f"{seconds / 3600:.1f} h"
