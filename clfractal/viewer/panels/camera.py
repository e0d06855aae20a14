"""The camera: where it is, its lens, and the standard views."""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui

from clfractal.scene.parts import PerspectiveCamera
from clfractal.schema.base import length, minus
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

_VIEWS = (("front", "back"), ("right", "left"), ("top", "bottom"))


def summary(ui: Ui) -> str:
    """For the heading."""
    camera = ui.studio.scene.camera
    return f"{camera.fov:.3g}°" if isinstance(camera, PerspectiveCamera) else "orthographic"


def draw(ui: Ui) -> None:
    """Draws the panel."""
    camera = ui.studio.scene.camera
    words = {"perspective": "Perspective", "orthographic": "Parallel"}
    about, path = "rays from one point, or parallel ones", "camera.projection"
    if w.pick(ui, "Projection", words, camera.projection, path=path, tip=about) is not None:
        ui.act("projection")
    # A hundred points of a drag move the camera by its distance from what it looks at.
    places = {"step": 0.01 * length(minus(camera.target, camera.position))}
    size = "fov" if isinstance(camera, PerspectiveCamera) else "height"
    options: dict[str, Any] = {
        "fov": {"unit": "°"},
        "position": places,
        "target": places,
        "up": {"step": 0.01},
    }
    w.fields(ui, "camera", (size, "position", "target", "up"), **options)
    _views(ui)
    if isinstance(camera, PerspectiveCamera):
        _lens(ui, camera)


def _views(ui: Ui) -> None:
    if w.filtering(ui):
        return
    w.group(ui, "Views")
    wide = (imgui.get_content_region_avail().x - 11.0 - 8) / 3
    for row in zip(*_VIEWS, strict=True):
        w.in_labels()
        for number, side in enumerate(row):
            if number:
                w.in_row(4)
            w.act(ui, f"view_{side}", "", "", text=side.capitalize(), width=wide)
    w.in_labels()
    w.act(ui, "frame_all", theme.EXPAND, "", text="Frame all", width=wide * 1.5 + 2)
    w.in_row(4)
    w.act(ui, "level", "", "", text="Level", width=wide * 1.5 + 2)


def _lens(ui: Ui, camera: PerspectiveCamera) -> None:
    w.group(ui, "Depth of field")
    w.field(ui, "camera.f_number", start=_first_f_number(camera), auto="pinhole, all is sharp")
    w.field(
        ui,
        "camera.focus_distance",
        start=camera.used_focus_distance,
        auto="measured" if camera.measured_focus else f"target, {camera.used_focus_distance:.4g}",
        keep={"camera.focus": None, "camera.focus_on": None},
    )
    if camera.focus_distance is None:
        w.field(ui, "camera.focus", auto="off")
        if camera.measured_focus is not None:
            w.field(ui, "camera.focus_on", start=camera.measured_focus, auto="the middle")
    w.field(ui, "camera.sensor_height")
    if not w.filtering(ui):
        w.in_labels()
        if w.button("Click what shall be sharp", icon=theme.TARGET, width=-1):
            ui.act("focus_pick")


def _first_f_number(camera: PerspectiveCamera) -> float:
    """One whose blur can be seen: the lens is a fiftieth of the focus distance wide."""
    wanted = camera.used_focus_distance / 50
    open_lens = camera.model_copy(update={"f_number": 1.0}).lens_radius * 2
    return float(f"{min(max(open_lens / wanted, 0.01), 1e6):.2g}")
