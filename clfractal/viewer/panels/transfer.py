"""The transfer function of a volume or an object, edited by dragging points over the histogram."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from imgui_bundle import imgui

from clfractal.scene.given import GivenGrid
from clfractal.scene.sampled import Sampled
from clfractal.scene.volume import VolumeRenderer
from clfractal.viewer.histogram import Histogram, HistogramTask, histogram_of
from clfractal.viewer.panels import theme, volume
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.color_button import shown
from clfractal.viewer.panels.stops import SEGMENTS, Stops, color_at, dragged, draw_strip, state_of, without
from clfractal.viewer.panels.ui import Ui

_HEIGHT, _STRIP, _REACH = 120.0, 16.0, 9.0
_FAR = 60.0


@dataclass(frozen=True, slots=True)
class Values:
    """Values that are shown.

    Attributes:
        section: the path of what has the transfer function and the level.
        low, high: the least and the largest value.
        histogram: how often they occur; None while they are counted.
        problem: why they cannot be counted, or nothing.
    """

    section: str
    low: float
    high: float
    histogram: Callable[[], Histogram | None]
    problem: Callable[[], str] = str

    def path(self, name: str) -> str:
        """The path of the stops of `opacity`, `color` or `emission`."""
        return f"{self.section}.transfer.{name}"

    def switched_off(self, ui: Ui) -> dict[str, Any]:
        """The stops that come back when they are switched on again, by those names."""
        return ui.kept(f"transfer.kept {self.section}", dict[str, Any])

    def switch(self, ui: Ui, name: str, label: str, tip: str) -> tuple[Stops | None, bool]:
        """The switch of some stops: what is there, and whether it was clicked."""
        path, stops = self.path(name), w.plain(w.value(ui, self.path(name)))
        on = stops is not None
        return stops, w.switch(ui, label, on, path=path, tip=tip, differs=on)


def summary(ui: Ui) -> str:
    """For the heading."""
    return "surface" if w.value(ui, "renderer.transfer.opacity") is None else "all values"


def draw(ui: Ui) -> None:
    """Draws the panel of a volume renderer."""
    low, high = volume.limits(ui)

    def problem() -> str:
        task = ui.memory.get("histogram.task")
        return str(task[1].problem or "") if task is not None else ""

    of_values(ui, Values("renderer", low, high, lambda: histogram(ui), problem))


def of_values(ui: Ui, of: Values, words: tuple[str, str] = ("Surface", "All values")) -> None:
    """Draws what values show: the words are those for a surface at one of them, and for all by their opacity."""
    path = of.path("opacity")
    opacity, ways = w.plain(w.value(ui, path)), {False: words[0], True: words[1]}
    about = "a surface at one value, or all values by their opacity"
    found = w.pick(ui, "Show", ways, opacity is not None, path=path, tip=about)
    if found is not None:
        _switch_opacity(ui, of, found)
        return
    if opacity is not None and w.found(ui, "Opacity of values", path):
        _graph(ui, of, opacity, w.plain(w.value(ui, of.path("color"))))
    if opacity is not None or of.section == "renderer":
        about = "colours by value; else the material's colour"
        color, clicked = of.switch(ui, "color", "Own colours", about)
        if clicked:
            _switch_color(ui, of, color is None)
            return
        _strip_of(ui, of, "color", "Colours of values", color)
    if opacity is not None:
        _light(ui, of)


def _strip_of(ui: Ui, of: Values, name: str, label: str, stops: Stops | None) -> None:
    """What is wrong with stops, and their editor if there are any."""
    w.problem(ui, of.path(name))
    if stops is not None and w.found(ui, label, of.path(name)):
        _strip(ui, of.path(name), stops, of.low, of.high)


def _light(ui: Ui, of: Values) -> None:
    """Whether values shine by themselves, which of them, and how brightly."""
    found, clicked = of.switch(ui, "emission", "Shines", "light of their own, by value")
    if not clicked:
        _strip_of(ui, of, "emission", "Light of values", found)
        return
    first = [
        {"at": (of.low + of.high) / 2, "emission": [0.0, 0.0, 0.0]},
        {"at": of.high, "emission": [0.05, 0.015, 0.002]},
    ]
    _switch(ui, of, "emission", found is None, first)


def _switch_opacity(ui: Ui, of: Values, on: bool) -> None:
    low, span, kept = of.low, of.high - of.low, of.switched_off(ui)
    is_object = of.section != "renderer"
    if not on:
        # An object's surface has its material's colour.
        names = ("opacity", "emission", *(("color",) if is_object else ()))
        kept |= {name: w.plain(w.value(ui, of.path(name))) or kept.get(name) for name in names}
        ui.studio.edit({of.path(name): None for name in names})
        return
    first = [
        {"at": low, "opacity": 0.0},
        {"at": low + 0.25 * span, "opacity": 0.0},
        {"at": of.high, "opacity": 0.6},
    ]
    changes = {of.path("opacity"): kept.get("opacity") or first, f"{of.section}.level": None}
    if is_object:  # which has no material of its own then, and needs light along paths
        changes[f"{of.section}.material"] = None
        if ui.studio.scene.lighting.mode != "path":
            changes["lighting"] = {"mode": "path", "bounces": 16}
    ui.studio.edit(changes)


def _switch_color(ui: Ui, of: Values, on: bool) -> None:
    low, high = of.low, of.high
    first = [
        {"at": low, "color": [0.05, 0.1, 0.35]},
        {"at": (low + high) / 2, "color": [0.85, 0.3, 0.06]},
        {"at": high, "color": [1.0, 0.9, 0.6]},
    ]
    _switch(ui, of, "color", on, first)


def _switch(ui: Ui, of: Values, name: str, on: bool, first: Stops) -> None:
    """Switches stops on, to those that were switched off, or the first ones; or off."""
    kept = of.switched_off(ui)
    if not on:
        kept[name] = w.plain(w.value(ui, of.path(name)))
    ui.studio.edit({of.path(name): (kept.get(name) or first) if on else None})


# Opacity


def _graph(ui: Ui, of: Values, stops: Stops, colors: Stops | None) -> None:
    """The graph of opacity over the histogram; its points are dragged, added and removed."""
    low, high = _range(stops, of.low, of.high)
    path, state = of.path("opacity"), state_of(ui, f"transfer.graph {of.section}", stops)
    w.in_labels()
    corner, wide = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    imgui.invisible_button("##graph", imgui.ImVec2(wide, _HEIGHT))
    area = _Area(corner.x + 6, corner.y + 6, wide - 12, _HEIGHT - 12, low, high)
    mouse = imgui.get_mouse_pos()
    places = [area.place(stop["at"], stop["opacity"]) for stop in stops]
    distances = [math.dist((each.x, each.y), (mouse.x, mouse.y)) for each in places]
    at, opacity = area.value(mouse.x), area.opacity(mouse.y)
    stops = dragged(
        ui,
        path,
        stops,
        state,
        away=distances,
        reach=_REACH,
        add=lambda: inserted(stops, at, opacity=opacity),
        move=lambda: (placed(stops, state["chosen"], at, opacity=opacity), state["chosen"]),
        off=not -_FAR < mouse.y - area.y < area.height + _FAR and len(stops) > 1,
    )
    _draw_graph(of, area, stops, colors, state["chosen"])
    if imgui.is_item_hovered() and not imgui.is_item_active():
        w.tip("Drag a point; double click adds one; drag it far off to remove it")
    one = stops[state["chosen"]]
    _place_row(ui, stops, state, area, path)
    place = f"{path}.{state['chosen']}.opacity"
    width = w.row(ui, "Opacity", path=place, tip="over a voxel's side")
    if width is not None:
        change = w.number_box(w.boxes(ui), path, one["opacity"], width, w.Scale(0, 1, (0, 1)))
        w.apply(ui, place, change)


class _Area:
    """Where the graph is, points of the screen, and the values that it goes over."""

    def __init__(self, x: float, y: float, width: float, height: float, low: float, high: float) -> None:
        self.x, self.y, self.width, self.height, self.low, self.high = x, y, width, height, low, high

    def place(self, at: float, opacity: float) -> Any:
        part = (at - self.low) / (self.high - self.low)
        return imgui.ImVec2(self.x + part * self.width, self.y + (1 - opacity) * self.height)

    def value(self, x: float) -> float:
        part = min(max((x - self.x) / self.width, 0.0), 1.0)
        return float(f"{self.low + part * (self.high - self.low):.5g}")

    def opacity(self, y: float) -> float:
        return round(min(max(1 - (y - self.y) / self.height, 0.0), 1.0), 3)


def placed(stops: Stops, index: int, at: float, **values: Any) -> Stops:
    """The stops with one at another place, no farther than its neighbours."""
    least = stops[index - 1]["at"] if index else -1e12
    most = stops[index + 1]["at"] if index + 1 < len(stops) else 1e12
    one = {**stops[index], **values, "at": min(max(at, least), most)}
    return [*stops[:index], one, *stops[index + 1 :]]


def inserted(stops: Stops, at: float, **values: Any) -> tuple[Stops, int]:
    """The stops with one more, and its index."""
    index = sum(stop["at"] <= at for stop in stops)
    return [*stops[:index], {"at": at, **values}, *stops[index:]], index


def _draw_graph(of: Values, area: _Area, stops: Stops, colors: Stops | None, chosen: int) -> None:
    draw = imgui.get_window_draw_list()
    low = imgui.ImVec2(area.x - 6, area.y - 6)
    far = imgui.ImVec2(area.x + area.width + 6, area.y + area.height + 6)
    draw.add_rect_filled(low, far, theme.packed(theme.FRAME), 5.0)
    _draw_histogram(of, area, draw)
    line = [
        imgui.ImVec2(area.x, area.place(stops[0]["at"], stops[0]["opacity"]).y),
        *(area.place(stop["at"], stop["opacity"]) for stop in stops),
        imgui.ImVec2(area.x + area.width, area.place(stops[-1]["at"], stops[-1]["opacity"]).y),
    ]
    floor = area.y + area.height
    for first, second in pairwise(line):
        if second.x > first.x:
            corners = [first, second, imgui.ImVec2(second.x, floor), imgui.ImVec2(first.x, floor)]
            draw.add_convex_poly_filled(corners, theme.packed(theme.ACCENT, 0.16))
    draw.add_polyline(line, theme.packed(theme.ACCENT), 1.8, 0)
    for number, stop in enumerate(stops):
        middle = area.place(stop["at"], stop["opacity"])
        fill = theme.packed(theme.ACCENT if number == chosen else theme.PANEL_SOLID)
        if colors is not None:
            codes, _ = shown(color_at(colors, stop["at"]))
            fill = theme.packed((*codes, 1.0))
        draw.add_circle_filled(middle, 5.0, fill)
        edge = theme.TEXT if number == chosen else theme.ACCENT
        draw.add_circle(middle, 5.0, theme.packed(edge), 0, 1.8)


def _draw_histogram(of: Values, area: _Area, draw: Any) -> None:
    found = of.histogram()
    if found is None:
        text = of.problem() or "counting values…"
        draw.add_text(imgui.ImVec2(area.x + 4, area.y + 2), theme.packed(theme.FAINT), text)
        return
    # Most voxels are outside or inside: by magnitudes the few others are seen too.
    heights = np.log1p(found.shares * 1e5) / np.log1p(1e5)
    step = (found.high - found.low) / len(heights)
    color = theme.packed(theme.SECOND, 0.45)
    for number, height in enumerate(heights):
        if height <= 0:
            continue
        left = area.place(found.low + number * step, float(height))
        right = area.place(found.low + (number + 1) * step, 0.0)
        if right.x < area.x or left.x > area.x + area.width:
            continue
        draw.add_rect_filled(
            imgui.ImVec2(max(left.x, area.x), left.y),
            imgui.ImVec2(min(right.x, area.x + area.width), right.y),
            color,
        )


def histogram(ui: Ui) -> Histogram | None:
    """How often the grid's values occur; None while they are counted."""
    scene = ui.studio.scene
    given = scene.given
    if given is not None:
        return of_grid(ui, given, "renderer")
    renderer = scene.renderer
    assert isinstance(renderer, VolumeRenderer)
    parts = {"box", "zoom", "value", "sub_points", "fill"}
    key = json.dumps(
        [scene.formula.mapping(), renderer.model_dump(mode="json", include=parts - set(Sampled.model_fields))]
    )
    session = ui.studio.session
    known = ui.memory.get("histogram.task")
    # A task that another device was to do is never done.
    lost = known is not None and not known[1].finished and known[2] is not session
    if known is None or lost or (known[0] != key and known[1].finished):
        known = ui.memory["histogram.task"] = (key, HistogramTask(scene), session)
        session.add(known[1])
    return known[1].found


def of_grid(ui: Ui, grid: GivenGrid, section: str) -> Histogram:
    """How often the values of a grid from a file occur; they are counted once."""
    count = partial(histogram_of, grid.values, grid.low, grid.high)
    return ui.kept_for(f"histogram {section}", grid, count)


# Colours


def _strip(ui: Ui, path: str, stops: Stops, low: float, high: float) -> None:
    """The colours of values, or the light that they send out, and their stops."""
    key = path.rpartition(".")[2]
    low, high = _range(stops, low, high)
    state = state_of(ui, f"transfer.strip.{path}", stops)
    w.in_labels()
    corner, wide = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    imgui.invisible_button(f"##{key}", imgui.ImVec2(wide, _STRIP + 14))
    area = _Area(corner.x + 6, corner.y, wide - 12, _STRIP, low, high)
    mouse = imgui.get_mouse_pos()
    distances = [abs(area.place(stop["at"], 0).x - mouse.x) for stop in stops]
    at = area.value(mouse.x)
    stops = dragged(
        ui,
        path,
        stops,
        state,
        away=distances,
        reach=_REACH,
        add=lambda: inserted(stops, at, **{key: color_at(stops, at, key)}),
        move=lambda: (placed(stops, state["chosen"], at), state["chosen"]),
    )
    _draw_strip(area, stops, state["chosen"], key)
    w.field(ui, f"{path}.{state['chosen']}.{key}")
    _place_row(ui, stops, state, area, path)


def _draw_strip(area: _Area, stops: Stops, chosen: int, key: str) -> None:
    """Light is shown by its parts of the brightest: its amount says what a voxel's side adds."""
    draw = imgui.get_window_draw_list()
    values = np.linspace(area.low, area.high, SEGMENTS + 1)
    colors = np.array([color_at(stops, float(each), key) for each in values])
    if key == "emission":
        colors = colors / max(colors.max(), 1e-12)
    draw_strip((area.x, area.y), area.width, _STRIP, colors)
    for number, stop in enumerate(stops):
        x = area.place(stop["at"], 0).x
        own, _ = shown(stop[key])
        edge = theme.packed(theme.ACCENT if number == chosen else theme.TEXT)
        low, high = imgui.ImVec2(x - 5, area.y + _STRIP + 1), imgui.ImVec2(x + 5, area.y + _STRIP + 11)
        draw.add_rect_filled(low, high, theme.packed((*own, 1.0)), 2.0)
        draw.add_rect(low, high, edge, 2.0)


def _place_row(ui: Ui, stops: Stops, state: dict[str, Any], area: _Area, path: str) -> None:
    """The value of the chosen stop as a number, and a button that removes the stop."""
    chosen = state["chosen"]
    width = w.row(ui, "Value", path=f"{path}.{chosen}.at", tip="value of a voxel at this stop")
    if width is None:
        return
    height = imgui.get_frame_height()
    scale = w.Scale(-1e12, 1e12, (area.low, area.high))
    change = w.number_box(w.boxes(ui), f"{path}.at", stops[chosen]["at"], width - height - 4, scale)
    w.apply(ui, path, change, lambda new: placed(stops, chosen, new))
    w.in_row(4)
    if w.icon_button(theme.TRASH, "Remove this stop", name=f"{path}.remove", enabled=len(stops) > 1):
        ui.studio.edit({path: without(stops, chosen)})


def _range(stops: Stops, low: float, high: float) -> tuple[float, float]:
    """The values to show: the grid's, and all stops."""
    at = [stop["at"] for stop in stops]
    low, high = min(low, *at), max(high, *at)
    return (low, high) if high > low else (low - 0.5, high + 0.5)
