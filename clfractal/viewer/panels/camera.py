"""The camera: where it is, its lens, and the standard views."""

from __future__ import annotations

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
    width = w.row(ui, "Projection", path="camera.projection", tip="rays from one point, or parallel ones")
    if width is not None:
        words = {"perspective": "Perspective", "orthographic": "Parallel"}
        if w.segments("camera.projection", words, camera.projection, width) is not None:
            ui.act("projection")
    # A hundred points of a drag move the camera by its distance from what it looks at.
    step = 0.01 * length(minus(camera.target, camera.position))
    places = {"step": step}
    if isinstance(camera, PerspectiveCamera):
        w.field(ui, "camera.fov", unit="°")
    else:
        w.field(ui, "camera.height")
    w.fields(ui, "camera", ("position", "target", "up"), position=places, target=places, up={"step": 0.01})
    _views(ui)
    if isinstance(camera, PerspectiveCamera):
        _lens(ui, camera)


def _views(ui: Ui) -> None:
    if w.filtering(ui):
        return
    w.group(ui, "Views")
    indent = 11.0
    wide = (imgui.get_content_region_avail().x - indent - 8) / 3
    for row in zip(*_VIEWS, strict=True):
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + indent)
        for number, side in enumerate(row):
            if number:
                w.in_row(4)
            if w.button(side.capitalize(), width=wide, about=_key(ui, f"view_{side}")):
                ui.act(f"view_{side}")
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + indent)
    if w.button("Frame all", icon=theme.EXPAND, width=wide * 1.5 + 2, about=_key(ui, "frame_all")):
        ui.act("frame_all")
    w.in_row(4)
    if w.button("Level", width=wide * 1.5 + 2, about=_key(ui, "level")):
        ui.act("level")


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
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
        if w.button("Click what shall be sharp", icon=theme.TARGET, width=-1):
            ui.act("focus_pick")


def _first_f_number(camera: PerspectiveCamera) -> float:
    """One whose blur can be seen: the lens is a fiftieth of the focus distance wide."""
    wanted = camera.used_focus_distance / 50
    open_lens = camera.model_copy(update={"f_number": 1.0}).lens_radius * 2
    return float(f"{min(max(open_lens / wanted, 0.01), 1e6):.2g}")


def _key(ui: Ui, action: str) -> str:
    return ui.keys.hint(action)
