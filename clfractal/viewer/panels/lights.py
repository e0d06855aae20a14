"""Lights: a list, and all settings of the one that is chosen."""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui

from clfractal.scene.light_paths import PathLighting
from clfractal.scene.lighting import MAX_ASKED, MAX_LIGHTS
from clfractal.schema.kinds import members
from clfractal.schema.light import LightBase, SmallLight
from clfractal.schema.trap import Trap
from clfractal.viewer.panels import first, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.color_button import shown
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
    if w.filtering(ui):
        for index in range(len(lights)):
            _light(ui, index)
        return
    chosen = w.listed(ui, "light", len(lights), lambda index, on: _line(index, lights[index], on))
    _buttons(ui)
    w.problem(ui, "lights")
    if lights and chosen < len(ui.studio.scene.lights):
        _light(ui, chosen)
    if not lights:
        w.hint(ui, "No light: only an environment lights the scene.")


def _line(index: int, light: Any, chosen: bool) -> bool:
    """One light of the list; whether it was clicked."""
    line, (codes, _) = w.Line(f"light{index}", chosen), shown(light.used_color)
    line.draw.add_circle_filled(line.at(17), 6.0, theme.packed((*codes, 1.0)))
    line.draw.add_circle(line.at(17), 6.0, theme.packed((1, 1, 1, 0.25)))
    line.write(31, f"{KINDS[light.tag]} {index + 1}")
    line.write(-8, f"{light.intensity:.3g}", theme.DIM)
    return line.clicked


def _buttons(ui: Ui) -> None:
    lights = [w.plain(light) for light in ui.studio.scene.lights]
    along_paths = isinstance(ui.studio.scene.lighting, PathLighting)
    room = len(lights) < (MAX_LIGHTS if along_paths else MAX_ASKED)
    w.in_labels()
    if w.button("Add a light", icon=theme.PLUS, enabled=room, about="Add a light where it is seen"):
        imgui.open_popup("##lights")
    kind = w.menu("##lights", {kind: f"{title}: light {_ABOUT[kind]}" for kind, title in KINDS.items()})
    if kind is not None:
        _add(ui, kind, lights)
    w.copy_and_remove(ui, "lights", lights, "light", room)
    w.in_row(4)
    w.act(ui, "lights", theme.ARROWS, "Drag lights in the picture", on="lights" in ui.show)


def _add(ui: Ui, kind: str, lights: list[Any]) -> None:
    """Adds a light of a kind, and shows where it is."""
    if w.set_entries(ui, "lights", [*lights, first.light(ui, kind)], "light", len(lights)) and kind != "set":
        ui.show.add("lights")


def _light(ui: Ui, index: int) -> None:
    path, light = f"lights.{index}", ui.studio.scene.lights[index]
    about = ", ".join(f"{title}: {_ABOUT[kind]}" for kind, title in KINDS.items())
    found = w.pick(ui, "Type", KINDS, light.tag, path=f"{path}.type", tip=about)
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
