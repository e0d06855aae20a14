"""A button that shows a linear colour, and opens a picker that shows it as a screen does, in sRGB."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from imgui_bundle import imgui

from clfractal.files.srgb import decode, encode
from clfractal.viewer.panels import theme
from clfractal.viewer.panels.buttons import area, tip
from clfractal.viewer.panels.ui import Ui

Color = tuple[float, float, float]


def shown(linear: Sequence[float]) -> tuple[Color, float]:
    """A linear colour as sRGB codes within 0..1, and the factor by which it is brighter than those, at least 1."""
    gain = max(1.0, *linear)
    red, green, blue = encode(np.asarray(linear, dtype=np.float64) / gain)
    return (float(red), float(green), float(blue)), float(gain)


def linear(codes: Sequence[float], gain: float = 1.0) -> list[float]:
    """The linear colour of sRGB codes within 0..1, times a factor; rounded to 6 digits, as a person would write it."""
    found = decode(np.clip(np.asarray(codes, dtype=np.float64), 0.0, 1.0)) * gain
    return [float(f"{each:.6g}") for each in found]


def hexadecimal(codes: Sequence[float]) -> str:
    """sRGB codes as `#rrggbb`."""
    return "#" + "".join(f"{round(255 * min(max(each, 0.0), 1.0)):02x}" for each in codes)


def color_button(ui: Ui, path: str, color: Sequence[float], width: float, *, height: float = 0.0) -> bool:
    """Shows the colour at a path, and edits it; whether its picker is open.

    Args:
        color: linear Rec. 709.
        width, height: points; height 0: that of a line.
    """
    codes, gain = shown(color)
    corner, height = imgui.get_cursor_screen_pos(), height or imgui.get_frame_height()
    name = f"##{path}.picker"
    if area(f"##{path}.swatch", (width, height)):
        imgui.open_popup(name)
        ui.memory["picker"] = (path, codes)
    draw = imgui.get_window_draw_list()
    far = imgui.ImVec2(corner.x + width, corner.y + height)
    draw.add_rect_filled(corner, far, theme.packed((*codes, 1.0)), 5.0)
    edge = theme.ACCENT if imgui.is_item_hovered() else (1.0, 1.0, 1.0, 0.16)
    draw.add_rect(corner, far, theme.packed(edge), 5.0)
    brighter = f", {gain:.3g} times as bright" if gain > 1 else ""
    tip(f"{hexadecimal(codes)}{brighter}\nlinear {', '.join(f'{each:.4g}' for each in color)}")
    opened = bool(imgui.begin_popup(name))
    if opened:
        _pick(ui, path, codes, gain)
        imgui.end_popup()
    return opened


def _pick(ui: Ui, path: str, codes: Color, gain: float) -> None:
    """The picker; while it is used, its own codes are kept: those of a grey or black forget their hue."""
    known = ui.memory.get("picker")
    if (
        known is not None
        and known[0] == path
        and np.allclose(linear(known[1], gain), linear(codes, gain), atol=1e-5)
    ):
        codes = known[1]
    flags = (
        imgui.ColorEditFlags_.no_side_preview
        | imgui.ColorEditFlags_.no_small_preview
        | imgui.ColorEditFlags_.display_rgb
        | imgui.ColorEditFlags_.display_hsv
        | imgui.ColorEditFlags_.display_hex
        | imgui.ColorEditFlags_.picker_hue_bar
        | imgui.ColorEditFlags_.input_rgb
        | imgui.ColorEditFlags_.no_label
    )
    imgui.set_next_item_width(210)
    changed, new = imgui.color_picker3(f"##{path}.pick", list(codes), flags)
    if changed:
        ui.memory["picker"] = (path, (new[0], new[1], new[2]))
        ui.studio.edit({path: linear(new, gain)}, gesture=path)
    if imgui.is_item_deactivated_after_edit():
        ui.studio.end_gesture()
