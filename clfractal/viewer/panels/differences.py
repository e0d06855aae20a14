"""What of the scene differs from the defaults, at a glance, each with a button that sets it back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from imgui_bundle import imgui

from clfractal.scene.model import Scene
from clfractal.schema.base import Section
from clfractal.viewer.editing import plain
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.metadata import metas
from clfractal.viewer.panels.ui import Ui

# What a scene is about rather than how it is set.
_LEFT_OUT = ("version", "bookmarks", "layout")
# Sections that are lists or null by default are shown as a whole; these as well.
_MOST_WORDS = 26


@dataclass(frozen=True, slots=True)
class Difference:
    """A value that is not its default: its path, and both, plain."""

    path: str
    value: Any
    default: Any


def differences(scene: Scene) -> list[Difference]:
    """All values that are not the defaults of their sections, in the schema's order; without the formula's own."""
    found: list[Difference] = []
    for name, meta in metas(Scene).items():
        if name in _LEFT_OUT:
            continue
        value = getattr(scene, name)
        if name == "lights":
            if len(value) != 1:
                found.append(Difference(name, plain(value), meta.default))
            for index, light in enumerate(value):
                found += _of_section(f"lights.{index}", light)
        elif isinstance(value, Section):
            if meta.optional:
                found.append(Difference(name, plain(value), None))
            found += _of_section(name, value)
        elif plain(value) != meta.default and not (name == "background" and value == {}):
            found.append(Difference(name, plain(value), meta.default))
    return found


def _of_section(path: str, section: Section) -> Iterator[Difference]:
    for name, meta in metas(type(section)).items():
        if meta.kind == "choice" and len(meta.choices) == 1:
            continue  # the word that chooses the class
        if path == "formula" and name in ("name", "file", "inline", "chain"):
            continue
        value = getattr(section, name)
        if isinstance(value, Section) and not meta.optional:
            yield from _of_section(f"{path}.{name}", value)
        elif (meta.default is not None or meta.optional) and plain(value) != meta.default:
            yield Difference(f"{path}.{name}", plain(value), meta.default)


def summary(ui: Ui) -> str:
    """For the heading."""
    return str(len(_cached(ui)))


def draw(ui: Ui) -> None:
    """Draws the panel."""
    found = _cached(ui)
    if not found:
        w.hint(ui, "Everything is at its default.")
        return
    last = ""
    for each in found:
        section, _, name = each.path.partition(".")
        if section != last and not w.filtering(ui):
            w.group(ui, w.label_of(section))
            last = section
        _line(ui, each, name or section)


def _cached(ui: Ui) -> list[Difference]:
    scene = ui.studio.scene
    return ui.kept_for("differences", scene, lambda: differences(scene))


def _line(ui: Ui, each: Difference, name: str) -> None:
    *before, last = name.split(".")
    label = " · ".join([*(each.replace("_", " ") for each in before), w.label_of(last)])
    about, reset = f"{words(each.value, 200)}\ndefault: {words(each.default, 200)}", partial(_reset, ui, each)
    label = label[:1].upper() + label[1:]
    width = w.row(ui, label, path=each.path, tip=about, differs=True, reset=reset)
    if width is None:
        return
    height = imgui.get_frame_height()
    corner = imgui.get_cursor_screen_pos()
    room = width - height - 4
    imgui.dummy(imgui.ImVec2(room, height))
    text = words(each.value, _MOST_WORDS)
    draw = imgui.get_window_draw_list()
    draw.push_clip_rect(corner, imgui.ImVec2(corner.x + room, corner.y + height), True)
    y = corner.y + (height - imgui.get_font_size()) / 2
    draw.add_text(imgui.ImVec2(corner.x, y), theme.packed(theme.TEXT), text)
    draw.pop_clip_rect()
    w.in_row(4)
    if w.icon_button(theme.RESET, f"Back to {words(each.default, 60)}", name=f"reset.{each.path}"):
        reset()


def _reset(ui: Ui, each: Difference) -> None:
    if not ui.studio.edit({each.path: each.default}):
        ui.studio.tell(ui.studio.problems.get(each.path, "not possible"), wrong=True)


def words(value: Any, most: int) -> str:
    """A plain value in few words."""
    if value is None or isinstance(value, bool):
        text = "none" if value is None else "yes" if value else "no"
    elif isinstance(value, (int, float)):
        text = (f"{value:.5g}" if isinstance(value, float) else str(value)).replace("-", "\u2212")
    elif isinstance(value, str):
        text = value
    elif isinstance(value, list) and all(isinstance(each, (int, float)) for each in value):
        text = ", ".join(f"{each:.4g}" for each in value).replace("-", "\u2212")
    elif isinstance(value, dict):
        text = ", ".join(f"{key} {words(each, 20)}" for key, each in value.items() if each is not None)
    elif isinstance(value, list) and value and all(isinstance(each, str) for each in value):
        text = " ".join(value)
    else:
        text = f"{len(value)} entries"
    return text if len(text) <= most else f"{text[: most - 1]}…"
