"""The OpenCL device, the number type, and how smoothly the picture moves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from clfractal.device.select import DeviceInfo, devices, shown_size
from clfractal.errors import ClfractalError
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
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
        w.in_labels()
        if w.button("Look again", icon=theme.REFRESH, about="Find devices that were plugged in"):
            ui.memory.pop("devices", None)
    words = {"float32": "32 bit", "float64": "64 bit"}
    w.field(ui, "renderer.precision", "Numbers", segmented=True, words=words)
    w.group(ui, "While something moves")
    _setting(ui, "frame_rate", "Frames a second", w.Scale(1, 240, (5, 120)))
    _flag(ui, "coarse", "May be coarse", f"coarse pictures while moving ({ui.keys.hint('coarse')})")
    if ui.settings.coarse:
        _setting(ui, "coarsest", "Coarsest", w.Scale(1, 64, (1, 32), whole=True, unit=" px"))


def _devices(ui: Ui) -> list[DeviceInfo]:
    """All devices; looked for once, since drivers may take long to answer."""
    try:
        return ui.kept("devices", devices)
    except ClfractalError as error:
        ui.studio.tell(str(error), wrong=True)
        ui.memory["devices"] = []
        return []


def _line(info: DeviceInfo, current: bool) -> bool:
    """One device; whether it was clicked."""
    line = w.Line(f"device{info.index}", current, 38.0)
    kinds = f"{info.platform}\n{info.version}\nDriver {info.driver}"
    w.tip(kinds if current else f"Go on with this device\n{kinds}")
    rim = theme.packed(theme.ACCENT if current else theme.DIM)
    line.draw.add_circle(line.at(17), 6.0, rim, 0, 1.5)
    if current:
        line.draw.add_circle_filled(line.at(17), 3.0, theme.packed(theme.ACCENT))
    line.draw.push_clip_rect(line.corner, line.at(line.wide - 4, line.height), True)
    line.write(31, info.name, y=3)
    parts = [
        info.index,
        info.kind.upper(),
        shown_size(info.memory),
        "64-bit numbers" if info.has_float64 else "32-bit numbers only",
        *(["shares textures"] if info.gl_sharing else []),
    ]
    with theme.font("regular", 12.0):
        line.write(31, "  ·  ".join(parts), theme.DIM, y=20)
    line.draw.pop_clip_rect()
    return line.clicked


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
    new = w.number_box(w.boxes(ui), f"settings.{name}", float(current), width, scale).value
    low, high = default.metadata["least"], default.metadata["most"]
    if new is not None and not low <= new <= high:
        w.boxes(ui).refused = f"must be {low:g} to {high:g}, got {new:g}"
    elif new is not None:
        _change(ui, name, int(new) if scale.whole else new)


def _flag(ui: Ui, name: str, label: str, about: str) -> None:
    current = bool(getattr(ui.settings, name))
    if w.switch(ui, label, current, path=f"settings.{name}", tip=about):
        _change(ui, name, not current)


def _change(ui: Ui, name: str, value: Any) -> None:
    """Settings are no part of the scene: the window takes them over, and writes them when it closes."""
    ui.settings = replace(ui.settings, **{name: value})
    ui.studio.pacing.rate = ui.settings.frame_rate
    ui.studio.pacing.coarsest = ui.settings.used_coarsest
