"""Lines over the picture: the cube of the next zoom, lights' handles, the region, the centre while flying."""

from __future__ import annotations

import math
from typing import Any

from imgui_bundle import imgui

from clfractal.camera.views import View
from clfractal.errors import ClfractalError
from clfractal.images.tiled import Floats
from clfractal.scene.model import Scene
from clfractal.viewer import handles, overlays, zoom_box
from clfractal.viewer.controls import Controls

_ZOOM, _BOX, _REGION, _LIGHT = (1.0, 0.72, 0.25), (0.55, 0.75, 0.9), (0.35, 0.85, 0.8), (1.0, 0.85, 0.45)

# Edges are drawn in so many pieces, of which some may be hidden; those are so much fainter.
_PIECES, _HIDDEN = 64, 0.4


def draw(
    scene: Scene,
    view: View,
    controls: Controls,
    size: tuple[int, int],
    scale: float,
    *,
    lights: bool,
    depths: Floats | None = None,
) -> None:
    """Draws the marks behind the panels.

    Args:
        view: of the picture that fills the panels' area (one eye's, or all of it).
        size: of that picture, pixels.
        scale: pixels of the picture for a point of the panels.
        depths: of the picture that is shown; parts of the cube behind its surface are faint. None: nothing hides anything.
    """
    canvas = imgui.get_background_draw_list()
    if controls.marking and controls.box is not None:
        try:
            stage = zoom_box.stage_of(scene)
        except ClfractalError:
            controls.marking = False
        else:
            outer = zoom_box.box_edges(stage.shown.center, stage.shown.sides)
            _lines(canvas, view, outer, size, scale, _BOX, 0.45, 1.0, depths)
            _lines(canvas, view, zoom_box.edges(controls.box, stage), size, scale, _ZOOM, 0.95, 2.0, depths)
    if controls.region_start is not None and controls.region_now is not None:
        (x, y), (right, bottom) = controls.region_start, controls.region_now
        first, last = (
            imgui.ImVec2(x / scale, y / scale),
            imgui.ImVec2(right / scale, bottom / scale),
        )
        canvas.add_rect_filled(first, last, _color(_REGION, 0.12))
        canvas.add_rect(first, last, _color(_REGION, 0.95))
    if lights:
        _lights(canvas, scene, view, size, scale)


def _lines(
    canvas: Any,
    view: View,
    segments: Any,
    size: tuple[int, int],
    scale: float,
    color: Any,
    alpha: float,
    thick: float,
    depths: Floats | None,
) -> None:
    pieces = overlays.split(segments, _PIECES)
    lines, ends = overlays.clipped_with_depth(view, pieces, size)
    behind = overlays.hidden(view, lines, ends, depths, size) if depths is not None else [False] * len(lines)
    for (x0, y0, x1, y1), faint in zip(lines, behind, strict=True):
        canvas.add_line(
            imgui.ImVec2(float(x0) / scale, float(y0) / scale),
            imgui.ImVec2(float(x1) / scale, float(y1) / scale),
            _color(color, alpha * _HIDDEN if faint else alpha),
            1.0 if faint else thick,
        )


def _lights(canvas: Any, scene: Scene, view: View, size: tuple[int, int], scale: float) -> None:
    bounds = scene.bounds
    circle = handles.light_circle(view, size, bounds)
    canvas.add_circle(
        imgui.ImVec2(circle.x / scale, circle.y / scale), circle.radius / scale, _color(_LIGHT, 0.35), 96, 1.0
    )
    for number, light in enumerate(scene.lights):
        place = handles.handle_position(light, view, size, bounds)
        if place is None or not all(math.isfinite(each) for each in place):
            continue
        middle = imgui.ImVec2(place[0] / scale, place[1] / scale)
        behind = handles.is_behind(light, view)
        canvas.add_circle_filled(middle, 8.0, _color(light.color, 0.35 if behind else 0.9), 32)
        canvas.add_circle(middle, 8.0, _color(_LIGHT, 0.5 if behind else 1.0), 32, 1.5)
        canvas.add_text(imgui.ImVec2(middle.x + 11, middle.y - 8), _color(_LIGHT, 0.9), f"{number + 1}")


def _color(color: Any, alpha: float) -> int:
    largest = max(1.0, *color)
    return int(imgui.get_color_u32(imgui.ImVec4(*(each / largest for each in color), alpha)))
