"""The library of formulas as a list that opens: searched, chosen from, and what choosing one does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from imgui_bundle import imgui, imgui_ctx

from clfractal.errors import ClfractalError
from clfractal.formulas import catalog
from clfractal.viewer import standard_views
from clfractal.viewer.editing import edited
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.studio import Studio


@cache
def titles() -> Mapping[str, str]:
    """The library's formulas: name -> title, by title."""
    found = {name: str(catalog.description(name).get("title", name)) for name in catalog.names()}
    return dict(sorted(found.items(), key=lambda each: each[1].lower()))


def take(studio: Studio, formula: Mapping[str, Any]) -> bool:
    """Shows another formula, and all of it: its camera is a part of the same step of undo. Whether it was valid.

    A camera that tracks of a film move, and those of a layout's views, stay where they are.
    """
    values: dict[str, Any] = {"formula": formula}
    try:
        scene = edited(studio.scene, values)
    except ClfractalError:
        return studio.edit(values)  # which tells what is wrong
    tracks = scene.animation.tracks if scene.animation is not None else {}
    camera = standard_views.frame_all(scene.camera, scene.extent, studio.viewport)
    if not any(name.startswith("camera.") for name in tracks):
        values["camera"] = camera.model_dump(mode="json")
    return studio.edit(values)


def chosen(ui: Ui, popup: str, current: str, *, single: bool) -> str | None:
    """The library, to search in and to choose from, by the pointer or by Up, Down and Enter; the name that was chosen.

    Args:
        single: without chains, and only with as many variables as the scene's formula has.
    """
    imgui.set_next_window_size(imgui.ImVec2(280, 330))
    if not imgui.begin_popup(popup):
        return None
    opened = imgui.is_window_appearing()
    if opened:
        ui.memory["formula.search"] = ""
        imgui.set_keyboard_focus_here()
    before = ui.memory.get("formula.search", "")
    text = w.search(ui, "formula.search", "Find a formula").strip().lower()
    names = [
        name
        for name, title in titles().items()
        if text in f"{name} {title}".lower() and not (single and not _fits(ui, name))
    ]
    if opened or ui.memory["formula.search"] != before:
        # What is searched for begins at the first that is found.
        ui.memory["formula.row"] = names.index(current) if current in names and not text else 0
        moved = True
    else:
        moved = _stepped(ui, len(names))
    found = _listed(ui, names, current, moved)
    if found is not None:
        imgui.close_current_popup()
    imgui.end_popup()
    return found


def _stepped(ui: Ui, count: int) -> bool:
    """Moves to another row of the library by keys; whether one was pressed."""
    key = imgui.Key
    steps = {key.down_arrow: 1, key.up_arrow: -1, key.page_down: 10, key.page_up: -10}
    step = sum(by for key, by in steps.items() if imgui.is_key_pressed(key))
    ui.memory["formula.row"] = min(max(ui.memory.get("formula.row", 0) + step, 0), max(count - 1, 0))
    return step != 0


def _listed(ui: Ui, names: Sequence[str], current: str, moved: bool) -> str | None:
    """Rows of the library, of which one is that of the keys; the name that was chosen."""
    found = None
    with imgui_ctx.begin_child("##formulas", imgui.ImVec2(0, 0)):
        for number, name in enumerate(names):
            corner, wide = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
            if imgui.selectable(f"{titles()[name]}##{name}", name == current)[0]:
                found = name
            w.tip(str(catalog.description(name).get("description", "")).strip())
            if number == ui.memory["formula.row"]:
                low = imgui.ImVec2(corner.x, imgui.get_item_rect_min().y)
                far = imgui.ImVec2(corner.x + wide, imgui.get_item_rect_max().y)
                imgui.get_window_draw_list().add_rect(low, far, theme.packed(theme.ACCENT), 3.0)
                if moved:
                    imgui.set_scroll_here_y()
        if not names:
            imgui.text_colored(theme.vec(theme.FAINT), "No formula has this name")
    enter = imgui.is_key_pressed(imgui.Key.enter) or imgui.is_key_pressed(imgui.Key.keypad_enter)
    return names[ui.memory["formula.row"]] if enter and names else found


def _fits(ui: Ui, name: str) -> bool:
    """Whether a formula of the library can be a member of the scene's chain."""
    return not catalog.is_chain(name) and len(catalog.load(name).variables) == ui.studio.scene.chain.size
