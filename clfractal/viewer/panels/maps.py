"""What differs from place to place in a material: the palette or the curve of each of its maps."""

from __future__ import annotations

from itertools import pairwise

from imgui_bundle import imgui

from clfractal.schema.mapped import ColorMap, Map, NumberMap
from clfractal.viewer.panels import palette_editor, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

# No name that a material may have.
_NONE, _NEW = "", " "
_MOST_POINTS = 256
_HEIGHT = 54.0


def material(ui: Ui, name: str) -> None:
    """Every field of a material, and what its maps consist of."""
    w.section(ui, f"materials.{name}", of_map=draw)


def choice(ui: Ui, path: str, now: str | None, none: str, color: list[float] | None) -> None:
    """Which of the scene's materials something at a path has; one more can be made.

    Args:
        now: the present one.
        none: the words for none of them.
        color: of one that is made.
    """
    names = ui.studio.scene.materials
    words = {_NONE: none, **{name: name for name in names}, _NEW: "New material"}
    found = w.pick(ui, "Material", words, now or _NONE, path=path, tip=w.value_tip(ui, path), listed=True)
    if found == _NEW:
        made = next(name for name in (f"material {n}" for n in range(1, 1000)) if name not in names)
        ui.studio.edit({f"materials.{made}": {"base": {"color": color}}, path: made})
    elif found is not None:
        w.put(ui, path, None if found == _NONE else found)


def carried(ui: Ui, path: str, now: str | None) -> None:
    """Which of the numbers that the scene's formulas carry is followed at a path."""
    words = {name: name for name in ui.studio.scene.carried}
    known = now or next(iter(words), "")
    found = w.pick(ui, "Number", words, known, path=path, tip=w.value_tip(ui, path), listed=True)
    if found is not None:
        w.put(ui, path, found)


def draw(ui: Ui, path: str, found: Map) -> None:
    """The palette, or the curve, of the map at a path; its trap, or the number that it follows."""
    if "number" in found.own_keys:
        carried(ui, f"{path}.number", found.number)
    if "trap" in found.own_keys:
        w.fields(ui, f"{path}.trap", found.trap.used_keys)
    if isinstance(found, ColorMap) and found.texture is None:
        palette_editor.draw(ui, f"{path}.palette")
    elif isinstance(found, NumberMap):
        _curve(ui, f"{path}.curve", found.curve)


def _curve(ui: Ui, path: str, points: tuple[tuple[float, float], ...]) -> None:
    """The curve as it is, and its points: where each is in the range, and the value there."""
    if w.found(ui, "Curve", path):
        _draw_curve(points)
    for index, (at, value) in enumerate(points):
        # A point stays between its neighbours.
        low = points[index - 1][0] if index else 0.0
        high = points[index + 1][0] if index + 1 < len(points) else 1.0
        where, scale = f"{path}.{index}.0", w.Scale(low, high, (0, 1))
        about = "place in the range, 0 to 1"
        w.number(ui, where, f"Point {index + 1}", at, scale, default=None, tip=about)
        w.number(ui, f"{path}.{index}.1", "Value", value, w.Scale(), default=None, tip="the value there")
    w.problem(ui, path)
    if w.filtering(ui):
        return
    w.in_labels()
    plain = [list(point) for point in points]
    if w.icon_button(theme.PLUS, "Add a point", name=f"{path}.more", enabled=len(points) < _MOST_POINTS):
        ui.studio.edit({path: with_point(plain)})
    w.in_row(4)
    if w.icon_button(theme.TRASH, "Remove the last point", name=f"{path}.less", enabled=len(points) > 2):
        ui.studio.edit({path: plain[:-1]})


def with_point(points: list[list[float]]) -> list[list[float]]:
    """The points with one more, on the curve in the middle of its widest gap."""
    index = max(range(1, len(points)), key=lambda i: points[i][0] - points[i - 1][0])
    middle = [round((a + b) / 2, 6) for a, b in zip(points[index - 1], points[index], strict=True)]
    return [*points[:index], middle, *points[index:]]


def _draw_curve(points: tuple[tuple[float, float], ...]) -> None:
    w.in_labels()
    corner, width = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    imgui.dummy(imgui.ImVec2(width, _HEIGHT))
    draw = imgui.get_window_draw_list()
    far = imgui.ImVec2(corner.x + width, corner.y + _HEIGHT)
    draw.add_rect_filled(corner, far, theme.packed(theme.FRAME), 4.0)
    low, high = min(value for _, value in points), max(value for _, value in points)
    whole = [(0.0, points[0][1]), *points, (1.0, points[-1][1])]
    places = [
        imgui.ImVec2(
            corner.x + 4 + (width - 8) * at,
            corner.y + _HEIGHT - 5 - (_HEIGHT - 10) * ((value - low) / (high - low) if high > low else 0.5),
        )
        for at, value in whole
    ]
    for before, after in pairwise(places):
        draw.add_line(before, after, theme.packed(theme.ACCENT), 1.5)
