"""Stops of palettes and transfer functions: dragged, added and removed on a strip or a graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from imgui_bundle import imgui

from clfractal.files.srgb import encode
from clfractal.viewer.panels import theme
from clfractal.viewer.panels.ui import Ui

Stops = list[dict[str, Any]]
MOST = 256
SEGMENTS = 64
"""Pieces that a strip is drawn in."""


def state_of(ui: Ui, key: str, stops: Stops) -> dict[str, Any]:
    """What is remembered from frame to frame: which stop is chosen, and whether it is held."""
    state = ui.kept(key, lambda: {"chosen": 0, "held": False})
    state["chosen"] = min(state["chosen"], len(stops) - 1)
    return state


def dragged(
    ui: Ui,
    path: str,
    stops: Stops,
    state: dict[str, Any],
    *,
    away: Sequence[float],
    reach: float,
    add: Callable[[], tuple[Stops, int]],
    move: Callable[[], tuple[Stops, int]],
    off: bool = False,
) -> Stops:
    """What the pointer makes of the stops at a path, on the item that was drawn last.

    Args:
        state: see `state_of`.
        away: how far each stop is from the pointer, points.
        reach: how near it has to be to be taken.
        add, move: the stops with one more, or the chosen one moved, where the pointer is; and that one's number.
        off: whether the pointer is where a stop that is let go is removed.
    """
    if imgui.is_item_activated():
        near = min(range(len(stops)), key=away.__getitem__)
        if away[near] <= reach:
            state.update(chosen=near, held=True)
        elif imgui.is_mouse_double_clicked(0) and len(stops) < MOST:
            stops, state["chosen"] = add()
            ui.studio.edit({path: stops})
    if imgui.is_item_active() and state["held"] and imgui.is_mouse_dragging(0, 2.0):
        stops, state["chosen"] = move()
        ui.studio.edit({path: stops}, gesture=path)
    if imgui.is_item_deactivated() and state["held"]:
        state["held"] = False
        if off:
            stops = without(stops, state["chosen"])
            ui.studio.edit({path: stops}, gesture=path)
            state["chosen"] = max(state["chosen"] - 1, 0)
        ui.studio.end_gesture()
    return stops


def without(stops: Stops, index: int) -> Stops:
    """The stops but one."""
    return [stop for number, stop in enumerate(stops) if number != index]


def color_at(stops: Stops, value: float, key: str = "color") -> list[float]:
    """The colour between stops, in four digits; `key`: of what else they have."""
    at = [stop["at"] for stop in stops]
    return [float(f"{np.interp(value, at, [s[key][axis] for s in stops]):.4g}") for axis in range(3)]


def draw_strip(
    corner: Sequence[float], width: float, height: float, colors: npt.NDArray[np.floating[Any]]
) -> None:
    """Linear colours, one more than `SEGMENTS`, from left to right."""
    draw, (left, top) = imgui.get_window_draw_list(), corner
    codes = [theme.packed((*map(float, row), 1.0)) for row in encode(np.clip(colors, 0, 1))]
    for number, (code, after) in enumerate(pairwise(codes)):
        low = imgui.ImVec2(left + width * number / SEGMENTS, top)
        high = imgui.ImVec2(left + width * (number + 1) / SEGMENTS + 0.5, top + height)
        draw.add_rect_filled_multi_color(low, high, code, after, after, code)
