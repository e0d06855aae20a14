"""Stereo: the mode, the real screen and its viewer, and the parallax under the pointer."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from clfractal.camera.views import View
from clfractal.engine.comfort import Comfort
from clfractal.errors import ClfractalError
from clfractal.scene.model import Scene
from clfractal.scene.parts import OrthographicCamera
from clfractal.scene.stereo import EyeName, Stereo
from clfractal.schema.base import length, minus
from clfractal.stereo import eyes as geometry
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

MODES = {
    "split": "Side by side",
    "split_half": "Side by side, half width",
    "over_under": "Top and bottom",
    "over_under_half": "Top and bottom, half height",
    "anaglyph": "Anaglyph",
    "anaglyph_chessboard": "Anaglyph chessboard",
    "rows": "Rows",
    "columns": "Columns",
    "checkerboard": "Checkerboard",
    "left": "Left eye",
    "right": "Right eye",
    "pair": "Two files",
    "multi_view": "One EXR, two views",
}
_OPTIONS: dict[str, dict[str, Any]] = {
    "mode": {"words": MODES},
    "swap": {"label": "Swap eyes"},
    "screen_width": {"label": "Screen width", "unit": " cm", "factor": 100.0},
    "screen_distance": {"label": "Distance", "unit": " cm", "factor": 100.0},
    "interpupillary_distance": {"label": "Between the eyes", "unit": " mm", "factor": 1000.0},
    "separation": {"unit": " x"},
}


def summary(ui: Ui) -> str:
    """For the heading."""
    stereo = ui.studio.scene.stereo
    return MODES[stereo.mode] if stereo is not None else "off"


def draw(ui: Ui) -> None:
    """Draws the panel."""
    if not _switch(ui):
        return
    stereo = ui.studio.scene.stereo
    assert stereo is not None
    glasses = ("glasses", "method") if stereo.mode == "anaglyph" else ()
    w.fields(ui, "stereo", ("mode", *glasses), **_OPTIONS)
    if stereo.mode == "anaglyph_chessboard":
        _filters(ui, stereo)
    w.fields(ui, "stereo", ("swap",), **_OPTIONS)
    w.group(ui, "Screen and viewer")
    w.fields(ui, "stereo", ("screen_width", "screen_distance", "interpupillary_distance"), **_OPTIONS)
    w.group(ui, "Depth")
    w.fields(ui, "stereo", ("separation", "convergence"), **_OPTIONS)
    _fit(ui, stereo)
    _plane(ui, stereo)
    if not w.filtering(ui):
        _range(ui)
        _parallax(ui)


def _switch(ui: Ui) -> bool:
    scene = ui.studio.scene
    on = scene.stereo is not None
    about, reset = "a pair of pictures for two eyes", partial(w.put, ui, "stereo", None)
    if w.switch(ui, "Stereo", on, path="stereo", tip=about, differs=on, reset=reset):
        if on:
            ui.memory["stereo.kept"] = ui.studio.value("stereo")
            reset()
        elif isinstance(scene.camera, OrthographicCamera) and scene.layout is None:
            ui.studio.tell("stereo needs a perspective camera", wrong=True)
        else:
            w.put(ui, "stereo", ui.memory.get("stereo.kept", {"mode": "anaglyph"}))
    w.problem(ui, "stereo")
    return ui.studio.scene.stereo is not None


def _filters(ui: Ui, stereo: Stereo) -> None:
    """The colours of the two filters, which a path in the scene leads to one by one."""
    for index, label in enumerate(("Left filter", "Right filter")):
        width = w.row(ui, label, path=f"stereo.colors.{index}", tip="linear Rec. 709")
        if width is not None:
            w.color_button(ui, f"stereo.colors.{index}", stereo.colors[index], width)


def _fit(ui: Ui, stereo: Stereo) -> None:
    about = "plane and separation are chosen so that all of the depth is comfortable"
    width = w.row(ui, "Fit the depth", path="stereo.fit", tip=about, differs=stereo.fit is not None)
    if width is not None:
        text = "Fitted: switch off" if stereo.fit else "Fit now"
        w.act(ui, "fit_stereo", theme.MAGIC, about, text=text, width=width)
    w.field(ui, "stereo.budget", unit="°")


def _plane(ui: Ui, stereo: Stereo) -> None:
    camera = ui.studio.scene.camera
    towards = minus(camera.position, camera.target)
    distance = length(towards)
    start = {
        "center": list(camera.target),
        "normal": [each / distance for each in towards],
        "up": list(camera.up),
        "width": float(f"{distance * stereo.screen_width / stereo.screen_distance:.5g}"),
    }
    about = "the plane in space that lies on the screen; else it goes through the camera's target"
    if w.optional(ui, "stereo.plane", "Own screen plane", start, tip=about, keeps=False):
        step, names = {"step": 0.01}, ("center", "normal", "up", "width", "height")
        center = {"step": w.value(ui, "stereo.plane.width") / 1000}
        w.fields(ui, "stereo.plane", names, center=center, normal=step, up=step)


def range_text(comfort: Comfort) -> str:
    """The range of a picture's parallax, degrees, and whether that strains the eyes."""
    ends = f"{comfort.nearest_degrees:+.2f} to {comfort.farthest_degrees:+.2f}°".replace("-", "\u2212")
    return f"{ends}, too much" if comfort.warning() else ends


def _range(ui: Ui) -> None:
    """The parallax of the whole picture, and what helps if it is too much."""
    if ui.comfort is None:
        return
    w.group(ui, "Whole picture")
    warning = ui.comfort.warning()
    w.reading(ui, "Parallax", range_text(ui.comfort), theme.WARNING if warning else theme.TEXT)
    if warning:
        w.hint(ui, f"{warning[0].upper()}{warning[1:]}.")


def _parallax(ui: Ui) -> None:
    """The parallax of what the pointer is on; on the screen, and as an angle."""
    w.group(ui, "Under the pointer")
    found = under_pointer(ui)
    if found is None:
        w.hint(ui, "Point at the object to see its parallax.")
        return
    distance, angle = found
    where = "in front of" if distance < 0 else "behind"
    text = f"{1000 * distance:+.1f} mm, {angle:+.2f}°".replace("-", "\u2212")
    stereo = ui.studio.scene.stereo
    assert stereo is not None
    too_much = abs(angle) > stereo.budget
    w.reading(ui, "Parallax", text, theme.WARNING if too_much else theme.TEXT)
    w.hint(ui, f"{where} the screen{', beyond the budget' if too_much else ''}")


def under_pointer(ui: Ui) -> tuple[float, float] | None:
    """Horizontal parallax of the point under the pointer: on the screen (metres), and as an angle (degrees).

    None without stereo, or where nothing is.
    """
    scene, pick = ui.studio.shown_scene, ui.pick
    if scene.stereo is None or pick is None or pick.point is None:
        return None
    seen_by = (scene.camera, scene.stereo, scene.image)
    views = ui.kept_for("stereo.views", seen_by, lambda: _eye_views(scene))
    if views is None:
        return None
    point = np.array([pick.point])
    on_screen = float(geometry.parallax(scene.stereo, views, point)[0, 0])
    return on_screen, float(geometry.degrees(scene.stereo, on_screen))


def _eye_views(scene: Scene) -> dict[EyeName, View] | None:
    try:
        return geometry.eye_views(scene)
    except ClfractalError:
        return None
