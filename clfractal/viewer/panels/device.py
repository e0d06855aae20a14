"""The OpenCL device, the number type, and how smoothly the picture moves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from imgui_bundle import imgui

from clfractal.device.select import DeviceInfo, devices, shown_size
from clfractal.errors import ClfractalError
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.buttons import area
from clfractal.viewer.panels.ui import Ui


def summary(ui: Ui) -> str:
    """For the heading."""
    return ui.studio.session.device.info.name


def draw(ui: Ui) -> None:
    """Draws the panel."""
    if not w.filtering(ui):
        current = ui.studio.session.device.info.index
        for info in _devices(ui):
            if _line(info, info.index == current) and info.index != current:
                ui.act(f"device:{info.index}")
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
        if w.button("Look again", icon=theme.REFRESH, about="Find devices that were plugged in"):
            ui.memory.pop("devices", None)
    w.field(
        ui, "renderer.precision", "Numbers", segmented=True, words={"float32": "32 bit", "float64": "64 bit"}
    )
    w.group(ui, "While something moves")
    _setting(ui, "frame_rate", "Frames a second", w.Scale(1, 240, (5, 120)))
    _flag(ui, "coarse", "May be coarse", f"coarse pictures while moving ({ui.keys.hint('coarse')})")
    if ui.settings.coarse:
        _setting(ui, "coarsest", "Coarsest", w.Scale(1, 64, (1, 32), whole=True, unit=" px"))


def _devices(ui: Ui) -> list[DeviceInfo]:
    """All devices; looked for once, since drivers may take long to answer."""
    found: list[DeviceInfo] | None = ui.memory.get("devices")
    if found is None:
        try:
            found = devices()
        except ClfractalError as error:
            ui.studio.tell(str(error), wrong=True)
            found = []
        ui.memory["devices"] = found
    return found


def _line(info: DeviceInfo, current: bool) -> bool:
    """One device; whether it was clicked."""
    corner, wide = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    height = 38.0
    clicked = area(f"##device{info.index}", (wide, height))
    hovered = imgui.is_item_hovered()
    kinds = f"{info.platform}\n{info.version}\nDriver {info.driver}"
    w.tip(kinds if current else f"Go on with this device\n{kinds}")
    draw = imgui.get_window_draw_list()
    if current or hovered:
        back = theme.ACCENT_FAINT if current else theme.FRAME
        far = imgui.ImVec2(corner.x + wide, corner.y + height)
        draw.add_rect_filled(corner, far, theme.packed(back), 5.0)
    middle = imgui.ImVec2(corner.x + 17, corner.y + height / 2)
    draw.add_circle(middle, 6.0, theme.packed(theme.ACCENT if current else theme.DIM), 0, 1.5)
    if current:
        draw.add_circle_filled(middle, 3.0, theme.packed(theme.ACCENT))
    draw.push_clip_rect(corner, imgui.ImVec2(corner.x + wide - 4, corner.y + height), True)
    draw.add_text(imgui.ImVec2(corner.x + 31, corner.y + 3), theme.packed(theme.TEXT), info.name)
    parts = [
        info.index,
        info.kind.upper(),
        shown_size(info.memory),
        "64-bit numbers" if info.has_float64 else "32-bit numbers only",
        *(["shares textures"] if info.gl_sharing else []),
    ]
    with theme.font("regular", 12.0):
        text = "  ·  ".join(parts)
        draw.add_text(imgui.ImVec2(corner.x + 31, corner.y + 20), theme.packed(theme.DIM), text)
    draw.pop_clip_rect()
    return bool(clicked)


def _setting(ui: Ui, name: str, label: str, scale: w.Scale) -> None:
    """A number of the user's settings."""
    default = type(ui.settings).__dataclass_fields__[name]
    current = getattr(ui.settings, name)
    width = w.row(
        ui,
        label,
        path=f"settings.{name}",
        tip=default.metadata["told"],
        differs=current != default.default,
        reset=lambda: _change(ui, name, default.default),
    )
    if width is None:
        return
    change = w.number_box(w.boxes(ui), f"settings.{name}", float(current), width, scale)
    low, high = scale.low, scale.high
    if change.value is not None and not (low is None or low <= change.value) & (
        high is None or change.value <= high
    ):
        w.boxes(ui).refused = f"must be {low:g} to {high:g}, got {change.value:g}"
    elif change.value is not None:
        _change(ui, name, int(change.value) if scale.whole else change.value)


def _flag(ui: Ui, name: str, label: str, about: str) -> None:
    current = bool(getattr(ui.settings, name))
    width = w.row(ui, label, path=f"settings.{name}", tip=about)
    if width is not None and w.toggle(f"settings.{name}", current):
        _change(ui, name, not current)


def _change(ui: Ui, name: str, value: Any) -> None:
    """Settings are no part of the scene: the window takes them over, and writes them when it closes."""
    ui.settings = replace(ui.settings, **{name: value})
    ui.studio.pacing.rate = ui.settings.frame_rate
    ui.studio.pacing.coarsest = ui.settings.used_coarsest
