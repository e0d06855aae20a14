"""Lights: a list, and all settings of the one that is chosen."""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui

from clfractal.scene.lighting import MAX_LIGHTS
from clfractal.schema.kinds import members
from clfractal.schema.light import LightBase, SmallLight
from clfractal.schema.trap import Trap
from clfractal.viewer.panels import first, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.buttons import area
from clfractal.viewer.panels.color_button import shown
from clfractal.viewer.panels.metadata import plain
from clfractal.viewer.panels.ui import Ui

_LIGHTS = [kind for kind in members("lights") if issubclass(kind, LightBase)]
KINDS = {kind.tag: kind.title for kind in _LIGHTS}
"""Kinds of lights, as they are called."""
_ABOUT = {kind.tag: kind.about for kind in _LIGHTS}


def summary(ui: Ui) -> str:
    """For the heading."""
    return str(len(ui.studio.scene.lights))


def draw(ui: Ui) -> None:
    """Draws the panel."""
    lights = ui.studio.scene.lights
    chosen = min(int(ui.memory.get("light", 0)), max(len(lights) - 1, 0))
    if w.filtering(ui):
        for index in range(len(lights)):
            _light(ui, index)
        return
    for index, light in enumerate(lights):
        if _line(index, light, index == chosen):
            chosen = index
    ui.memory["light"] = chosen
    _buttons(ui, chosen)
    w.problem(ui, "lights")
    if lights and chosen < len(ui.studio.scene.lights):
        _light(ui, chosen)
    if not lights:
        w.hint(ui, "No light: only an environment lights the scene.")


def _line(index: int, light: Any, chosen: bool) -> bool:
    """One light of the list; whether it was clicked."""
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    wide = imgui.get_content_region_avail().x
    clicked = area(f"##light{index}", (wide, height))
    draw = imgui.get_window_draw_list()
    if chosen or imgui.is_item_hovered():
        back = theme.ACCENT_FAINT if chosen else theme.FRAME
        far = imgui.ImVec2(corner.x + wide, corner.y + height)
        draw.add_rect_filled(corner, far, theme.packed(back), 5.0)
    codes, _ = shown(light.used_color)
    middle = imgui.ImVec2(corner.x + 17, corner.y + height / 2)
    draw.add_circle_filled(middle, 6.0, theme.packed((*codes, 1.0)))
    draw.add_circle(middle, 6.0, theme.packed((1, 1, 1, 0.25)))
    y = corner.y + (height - imgui.get_font_size()) / 2
    name = KINDS[light.tag]
    draw.add_text(imgui.ImVec2(corner.x + 31, y), theme.packed(theme.TEXT), f"{name} {index + 1}")
    text = f"{light.intensity:.3g}"
    place = imgui.ImVec2(corner.x + wide - imgui.calc_text_size(text).x - 8, y)
    draw.add_text(place, theme.packed(theme.DIM), text)
    return bool(clicked)


def _buttons(ui: Ui, chosen: int) -> None:
    lights = [plain(light) for light in ui.studio.scene.lights]
    room = len(lights) < MAX_LIGHTS
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
    if w.button("Add a light", icon=theme.PLUS, enabled=room, about="Add a light where it is seen"):
        imgui.open_popup("##lights")
    kind = _kinds_popup()
    if kind is not None:
        _add(ui, kind, lights)
    w.in_row(4)
    if w.icon_button(theme.COPY, "Duplicate", enabled=bool(lights) and room):
        _set(ui, [*lights, lights[chosen]], len(lights))
    w.in_row(4)
    if w.icon_button(theme.TRASH, "Remove", enabled=bool(lights)):
        _set(ui, [*lights[:chosen], *lights[chosen + 1 :]], max(chosen - 1, 0))
    w.in_row(4)
    on = "lights" in ui.show
    if w.icon_button(theme.ARROWS, f"Drag lights in the picture ({ui.keys.hint('lights')})", on=on):
        ui.act("lights")


def _kinds_popup() -> str | None:
    """The kind of light that is chosen of the list, once it is."""
    found = None
    if imgui.begin_popup("##lights"):
        for kind, title in KINDS.items():
            if imgui.selectable(f"{title}: light {_ABOUT[kind]}##{kind}", False)[0]:
                found = kind
        imgui.end_popup()
    return found


def _add(ui: Ui, kind: str, lights: list[Any]) -> None:
    """Adds a light of a kind, and shows where it is."""
    if _set(ui, [*lights, first.light(ui, kind)], len(lights)) and kind != "set":
        ui.show.add("lights")


def _set(ui: Ui, lights: list[Any], chosen: int) -> bool:
    done = ui.studio.edit({"lights": lights})
    if done:
        ui.memory["light"] = chosen
    return done


def _light(ui: Ui, index: int) -> None:
    path, light = f"lights.{index}", ui.studio.scene.lights[index]
    about = ", ".join(f"{title}: {_ABOUT[kind]}" for kind, title in KINDS.items())
    width = w.row(ui, "Type", path=f"{path}.type", tip=about)
    if width is not None:
        found = w.segments(f"{path}.type", KINDS, light.tag, width)
        if found is not None:
            ui.studio.edit({path: first.light(ui, found, light)})
            return
        w.problem(ui, path)
    w.fields(ui, path, ("color", "temperature", "intensity"))
    radius = ui.studio.scene.bounds[1]
    options = {"position": {"step": 0.01 * radius}, **light.controls(radius)}
    for name in type(light).model_fields:
        if name in SmallLight.model_fields or name in ("type", *light.beside):
            continue
        value = getattr(light, name)
        if isinstance(value, Trap):
            w.fields(ui, f"{path}.{name}", value.used_keys)
        else:
            w.field(ui, f"{path}.{name}", **options.get(name, {}))
    w.field(ui, f"{path}.shadow")
    if light.shadow:
        if isinstance(light, SmallLight):
            w.field(ui, f"{path}.angular_size", "Softness", unit="°")
        if light.has_size:
            w.field(ui, f"{path}.rays", start=8, auto="8")
