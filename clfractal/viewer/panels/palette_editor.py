"""Palettes: chosen by name from gradient strips, or edited as stops on a strip."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from imgui_bundle import imgui, imgui_ctx

from clfractal.errors import ClfractalError
from clfractal.files.srgb import encode
from clfractal.scene.palette import named_table, names
from clfractal.scene.palettes import PALETTES
from clfractal.schema.stops import Stop
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.color_button import shown
from clfractal.viewer.panels.stops import MOST, SEGMENTS, color_at, dragged, draw_strip, state_of, without
from clfractal.viewer.panels.ui import Ui

_FAMILIAR = (
    "viridis",
    "magma",
    "inferno",
    "plasma",
    "cividis",
    "turbo",
    "twilight",
    "colorbrewer:RdBu",
    "gray",
    "cubehelix",
)
_STRIP, _HANDLE = 24.0, 7.0
_FAR = 34.0
"""A stop that is dragged so far from its strip is removed."""
_FIRST_STOPS = 9
_MOST_FOUND = 40


def draw(ui: Ui, path: str) -> None:
    """Draws the palette at a path: its strip, the list to choose from, and the editor of its stops."""
    palette = w.value(ui, path)
    name = palette if isinstance(palette, str) else f"{len(palette)} own stops"
    width = w.row(ui, "Palette", path=path, tip="a palette's name, or stops of its own")
    if width is None:
        return
    if w.button(f"{name}##{path}", width=width - 28, about="Choose another palette"):
        imgui.open_popup(f"##{path}.list")
    w.in_row(4)
    if isinstance(palette, str):
        if w.icon_button(theme.PENCIL, "Edit its colours", name=f"{path}.edit"):
            ui.studio.edit({path: stops_of(palette)})
    elif w.icon_button(theme.EXCHANGE, "Reverse", name=f"{path}.reverse"):
        ui.studio.edit({path: reversed_stops(w.plain(palette))})
    _list(ui, path)
    palette = w.value(ui, path)
    w.in_labels()
    wide = imgui.get_content_region_avail().x
    if isinstance(palette, str):
        strip(ui, palette, wide, 14.0)
        _reverse_named(ui, path, palette)
    else:
        _editor(ui, path, w.plain(palette), wide)
    w.problem(ui, path)


def strip(ui: Ui, palette: str | Sequence[Stop], width: float, height: float) -> None:
    """A palette as a strip of colours; nothing where no palette has the name."""
    key, pixels = _pixels(palette if isinstance(palette, str) else tuple(palette))
    corner = imgui.get_cursor_screen_pos()
    imgui.dummy(imgui.ImVec2(width, height))
    far = imgui.ImVec2(corner.x + width, corner.y + height)
    zero, one = imgui.ImVec2(0, 0), imgui.ImVec2(1, 1)
    imgui.get_window_draw_list().add_image_rounded(
        ui.textures.get(key, pixels), corner, far, zero, one, 0xFFFFFFFF, 4.0
    )


def stops_of(palette: str) -> list[dict[str, Any]]:
    """Stops that come near to a palette by name, as plain data.

    Raises:
        SceneError: there is none of that name.
    """
    table = named_table(palette).astype(float)
    own = PALETTES.get(palette.removesuffix("_r"))
    count = len(own.colors.split()) + own.periodic if own is not None else _FIRST_STOPS
    places = np.linspace(0, 1, max(count, 2))
    colors = [np.interp(places, np.linspace(0, 1, len(table)), table[:, axis]) for axis in range(3)]
    return [
        {"at": round(float(at), 4), "color": [float(f"{each:.4g}") for each in color]}
        for at, *color in zip(places, *colors, strict=True)
    ]


def reversed_stops(stops: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The stops from the other end."""
    return [{**stop, "at": round(1 - stop["at"], 9)} for stop in reversed(stops)]


def distributed(stops: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The stops at equal distances from 0 to 1."""
    last = max(len(stops) - 1, 1)
    return [{**stop, "at": round(index / last, 6)} for index, stop in enumerate(stops)]


def moved(stops: list[dict[str, Any]], index: int, at: float) -> tuple[list[dict[str, Any]], int]:
    """The stops with one at another place, in order again, and that one's new index."""
    one = {**stops[index], "at": round(min(max(at, 0.0), 1.0), 4)}
    others = without(stops, index)
    place = sum(
        stop["at"] < one["at"] or (stop["at"] == one["at"] and n < index) for n, stop in enumerate(others)
    )
    return [*others[:place], one, *others[place:]], place


def added(stops: list[dict[str, Any]], at: float) -> tuple[list[dict[str, Any]], int]:
    """The stops with one more, in the colour that the palette has there, and its index."""
    place = sum(stop["at"] <= at for stop in stops)
    return [*stops[:place], {"at": round(at, 4), "color": color_at(stops, at)}, *stops[place:]], place


@lru_cache(maxsize=400)
def _pixels(palette: str | tuple[Stop, ...]) -> tuple[Hashable, npt.NDArray[np.uint8]]:
    """A key for a palette's texture, and its pixels, shape (1, 256, 4)."""
    try:
        table = named_table(palette)
    except ClfractalError:
        table = np.zeros((256, 3), np.float32)
    codes = np.rint(255 * encode(np.clip(table.astype(np.float64), 0, 1))).astype(np.uint8)
    pixels = np.concatenate([codes, np.full((len(codes), 1), 255, np.uint8)], axis=1)[None]
    return ("palette", palette if isinstance(palette, str) else tuple(map(str, palette))), pixels


@lru_cache(maxsize=1)
def _known() -> list[str]:
    """Names of all palettes, our own first; in full where a short name belongs to several."""
    full = [name for name in names() if ":" in name and not name.endswith("_r")]
    often = Counter(name.split(":")[-1].lower() for name in full)
    short = {name if often[name.split(":")[-1].lower()] > 1 else name.split(":")[-1] for name in full}
    return [*PALETTES, *sorted(short - set(PALETTES), key=str.lower)]


def _reverse_named(ui: Ui, path: str, palette: str) -> None:
    on, place = palette.endswith("_r"), f"{path}.reversed"
    if w.switch(ui, "Reversed", on, path=place, tip="from its other end"):
        w.put(ui, path, palette.removesuffix("_r") if on else f"{palette}_r")


def _list(ui: Ui, path: str) -> None:
    """The palettes to choose from, with a line to search in all that are known."""
    imgui.set_next_window_size(imgui.ImVec2(280, 380))
    if not imgui.begin_popup(f"##{path}.list"):
        return
    text = w.search(ui, "palette.search", "Find among all palettes").strip().lower()
    found = [each for each in _known() if text in each.lower()][:_MOST_FOUND]
    with imgui_ctx.begin_child("##palettes", imgui.ImVec2(0, 0)):
        for name in found if text else (*PALETTES, *_FAMILIAR):
            line = w.Line(name, None, 26)
            if line.clicked:
                ui.studio.edit({path: name})
                imgui.close_current_popup()
            if line.hovered:
                color = theme.packed(theme.FRAME_HOVERED)
                line.draw.add_rect_filled(line.corner, line.at(line.wide, 26), color, 5.0)
            after = imgui.get_cursor_screen_pos()
            line.write(6, name.split(":")[-1])
            imgui.set_cursor_screen_pos(line.at(96, 6))
            strip(ui, name, line.wide - 102, 14)
            imgui.set_cursor_screen_pos(after)
            imgui.dummy(imgui.ImVec2(0, 0))
    imgui.end_popup()


def _editor(ui: Ui, path: str, stops: list[dict[str, Any]], width: float) -> None:
    """A strip with a handle for each stop."""
    state = state_of(ui, f"{path}.editor", stops)
    stops = _strip_events(ui, path, stops, width, state)
    chosen = state["chosen"]
    w.group(ui, f"Stop {chosen + 1} of {len(stops)}")
    w.field(ui, f"{path}.{chosen}.color")
    wide = w.row(ui, "Place", path=f"{path}.{chosen}.at", tip="place in the palette, 0 to 1")
    if wide is not None:
        change = w.number_box(w.boxes(ui), f"{path}.at", stops[chosen]["at"], wide, w.Scale(0, 1, (0, 1)))
        if change.value is not None:
            new, state["chosen"] = moved(stops, chosen, change.value)
            ui.studio.edit({path: new}, path if change.dragging else None)
        if change.ended:
            ui.studio.end_gesture()
    if w.filtering(ui):
        return
    w.in_labels()
    if w.button("Distribute", about="All stops at equal distances"):
        ui.studio.edit({path: distributed(stops)})
    w.in_row(4)
    about = "Add a stop beside this one (or double click the strip)"
    if w.icon_button(theme.PLUS, about, enabled=len(stops) < MOST):
        other = stops[chosen + 1] if chosen + 1 < len(stops) else stops[chosen - 1]
        new, state["chosen"] = added(stops, (stops[chosen]["at"] + other["at"]) / 2)
        ui.studio.edit({path: new})
    w.in_row(4)
    if w.icon_button(theme.TRASH, "Remove this stop (or drag it off the strip)", enabled=len(stops) > 2):
        ui.studio.edit({path: without(stops, chosen)})


def _strip_events(
    ui: Ui, path: str, stops: list[dict[str, Any]], width: float, state: dict[str, Any]
) -> list[dict[str, Any]]:
    corner = imgui.get_cursor_screen_pos()
    left, inner = corner.x + _HANDLE, width - 2 * _HANDLE
    imgui.invisible_button(f"##{path}.strip", imgui.ImVec2(width, _STRIP + 14))
    mouse, hovered = imgui.get_mouse_pos(), imgui.is_item_hovered()
    at = min(max((mouse.x - left) / inner, 0.0), 1.0)
    off = abs(mouse.y - corner.y - _STRIP / 2) > _FAR and len(stops) > 2
    stops = dragged(
        ui,
        path,
        stops,
        state,
        away=[abs(stop["at"] - at) * inner for stop in stops],
        reach=_HANDLE + 2,
        add=lambda: added(stops, at),
        move=lambda: moved(stops, state["chosen"], at),
        off=off,
    )
    _draw_strip(stops, (left, corner.y), inner, state["chosen"], state["held"] and off)
    if hovered and not state["held"]:
        w.tip("Drag a stop; double click to add one; drag it off the strip to remove it")
    return stops


def _draw_strip(
    stops: list[dict[str, Any]], corner: tuple[float, float], width: float, chosen: int, leaving: bool
) -> None:
    draw, (left, top) = imgui.get_window_draw_list(), corner
    places, at = np.linspace(0, 1, SEGMENTS + 1), [stop["at"] for stop in stops]
    table = np.stack([np.interp(places, at, [s["color"][axis] for s in stops]) for axis in range(3)], axis=1)
    draw_strip(corner, width, _STRIP, table)
    order = [*(n for n in range(len(stops)) if n != chosen), chosen]
    for number in order:
        if number == chosen and leaving:
            continue
        x = left + width * stops[number]["at"]
        codes_of, _ = shown(stops[number]["color"])
        edge = theme.ACCENT if number == chosen else theme.TEXT
        points = [(x, top + _STRIP - 4), (x + _HANDLE, top + _STRIP + 4), (x - _HANDLE, top + _STRIP + 4)]
        low, high = imgui.ImVec2(x - 6, top + _STRIP + 3), imgui.ImVec2(x + 6, top + _STRIP + 13)
        draw.add_triangle_filled(*(imgui.ImVec2(*each) for each in points), theme.packed(edge))
        draw.add_rect_filled(low, high, theme.packed((*codes_of, 1.0)), 2.0)
        draw.add_rect(low, high, theme.packed(edge), 2.0)
