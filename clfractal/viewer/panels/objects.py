"""Objects beside the set: a list, and all settings of the one that is chosen, with its material."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from clfractal.scene.object_checks import can_show
from clfractal.scene.objects import KINDS, MAX_OBJECTS, FormulaObject, VolumeObject, WaterObject
from clfractal.schema.shape import Joined, ObjectBase
from clfractal.viewer.panels import first, formula, formula_library, maps, theme, transfer, volume
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

_IN_A_ROW = 3
_GRIDS, _MOST_FILES = (".nrrd", ".nhdr", ".npy"), 50
_KINDS: dict[str, str] = {kind.tag: kind.title for kind in KINDS}
_ABOUT = {
    "water": "Add water with waves",
    "formula": "Add the set of another formula",
    "volume": "Add a grid of values from a file, a surface or a cloud",
}


def summary(ui: Ui) -> str:
    """For the heading."""
    count = len(ui.studio.scene.objects)
    return str(count) if count else ""


def draw(ui: Ui) -> None:
    """Draws the panel."""
    objects = ui.studio.scene.objects
    if w.filtering(ui):
        for name in objects:
            _object(ui, name)
        return
    chosen = ui.memory.get("object")
    if chosen not in objects:
        chosen = next(iter(objects), None)
    for name, each in objects.items():
        if _line(name, each, name == chosen):
            chosen = name
    ui.memory["object"] = chosen
    _buttons(ui, chosen)
    w.problem(ui, "objects")
    chosen = ui.memory["object"]
    if chosen in ui.studio.scene.objects:
        _object(ui, chosen)


def _line(name: str, each: ObjectBase, chosen: bool) -> bool:
    """One object of the list; whether it was clicked."""
    line = w.Line(f"object {name}", chosen)
    room = line.wide - imgui.calc_text_size(each.title).x - 8
    line.draw.push_clip_rect(line.corner, line.at(room - 6, line.height), True)
    line.write(11, name)
    line.draw.pop_clip_rect()
    line.write(-8, each.title, theme.DIM)
    return line.clicked


def _buttons(ui: Ui, chosen: str | None) -> None:
    objects = ui.studio.scene.objects
    room = len(objects) < MAX_OBJECTS
    for number, kind in enumerate(_KINDS):
        if number % _IN_A_ROW:
            w.in_row(4)
        else:
            w.in_labels()
        about = _ABOUT.get(kind, f"Add a {kind}")
        possible = room and can_show(ui.studio.scene.renderer.type, kind)
        if w.button(_KINDS[kind], icon=theme.PLUS, enabled=possible, about=about):
            if kind == "volume":
                ui.memory["grid files"] = grid_files(ui.studio.scene.folder)
                imgui.open_popup("##grids")
            else:
                _add(ui, kind, {"type": kind, **first.objects(ui)[kind]})
    files = {str(file): str(file) for file in ui.memory.get("grid files", [])}
    file = w.menu("##grids", files, none="No .nrrd or .npy file lies beside the scene")
    if file is not None:
        _add(ui, "volume", {"type": "volume", "file": file, **first.objects(ui)["volume"]})
    w.in_row(4)
    if w.icon_button(theme.TRASH, "Remove", enabled=chosen is not None):
        left = {name: w.plain(each) for name, each in objects.items() if name != chosen}
        planes = [w.plain(plane) for plane in ui.studio.scene.cut_planes]
        for plane in planes:
            plane["objects"] = [name for name in plane["objects"] if name != chosen]
        ui.studio.edit({"objects": left, "cut_planes": planes})


def _add(ui: Ui, kind: str, values: dict[str, Any]) -> None:
    known = ui.studio.scene.objects
    name = next(name for name in (kind, *(f"{kind} {n}" for n in range(2, 1000))) if name not in known)
    if ui.studio.edit({f"objects.{name}": values}):
        ui.memory["object"] = name


def grid_files(folder: Path) -> list[str]:
    """Files of grids beside a scene, or in the folders beside it, by their names from there."""
    found = [
        path for pattern in ("*", "*/*") for path in folder.glob(pattern) if path.suffix.lower() in _GRIDS
    ]
    return sorted(path.relative_to(folder).as_posix() for path in found if path.is_file())[:_MOST_FILES]


def _object(ui: Ui, name: str) -> None:
    path, each = f"objects.{name}", ui.studio.scene.objects[name]
    if isinstance(each, FormulaObject):
        _formula(ui, name, each)
    if isinstance(each, VolumeObject):
        _volume(ui, path, each)
    if not (isinstance(each, VolumeObject) and each.is_cloud):
        _material(ui, path, each)
    left = {"type", "material", "waves", "formula", "file", "level", "transfer", "anisotropy"}
    if not (isinstance(each, Joined) and each.join == "smooth_union"):
        left.add("smoothness")
    keys = [key for key in type(each).model_fields if key not in left]
    step = 0.01 * ui.studio.scene.bounds[1]
    w.fields(ui, path, keys, position={"step": step}, rotation={"unit": "°"})
    if isinstance(each, WaterObject):
        w.fields(ui, f"{path}.waves", tuple(type(each.waves).model_fields), spread={"unit": "°"})
    if each.material in ui.studio.scene.materials:
        w.group(ui, f"Material {each.material}")
        maps.material(ui, each.material)


def _formula(ui: Ui, name: str, each: FormulaObject) -> None:
    """Which formula it is, from the library; its parameters and iterations."""
    path, chain = f"objects.{name}.formula", ui.studio.scene.joined_chains[name]
    if not w.filtering(ui):
        w.in_labels()
        text = formula_library.titles().get(each.formula.name or "", chain.title or "Own formula")
        if w.button(f"{text}##{path}", width=-1, about="Choose another formula"):
            imgui.open_popup(f"##library {path}")
        found = formula_library.chosen(ui, f"##library {path}", each.formula.name or "", single=False)
        if found is not None:
            ui.studio.edit({path: {"name": found, "iterations": each.formula.iterations}})
            return
    w.problem(ui, path)
    if len(chain.links) == 1:
        formula.parameters(ui, path, chain.first)
    w.field(ui, f"{path}.iterations")


def _volume(ui: Ui, path: str, each: VolumeObject) -> None:
    """Its file, and what its values show."""
    grid = ui.studio.scene.grids[each.file]
    w.field(ui, f"{path}.file", "Grid file")
    values = transfer.Values(path, grid.low, grid.high, lambda: transfer.of_grid(ui, grid, path))
    transfer.of_values(ui, values, ("Surface", "Cloud"))
    if each.is_cloud:
        w.field(ui, f"{path}.anisotropy")
        return
    volume.level(ui, f"{path}.level", grid.low, grid.high)


def _material(ui: Ui, path: str, each: ObjectBase) -> None:
    color = list(ui.studio.scene.material.color)
    maps.choice(ui, f"{path}.material", each.material, "The set's", color)
