"""The volume: its box and grid, what a voxel holds, and the zoom into it."""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui

from clfractal.scene.volume import VolumeRenderer
from clfractal.viewer import zoom_box
from clfractal.viewer.controls import Controls
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.metadata import plain
from clfractal.viewer.panels.ui import Ui

_SIDES = (64, 128, 192, 256, 384, 512, 768, 1024)


def summary(ui: Ui) -> str:
    """For the heading."""
    resolution = _renderer(ui).resolution
    if isinstance(resolution, tuple):
        return " x ".join(map(str, resolution))
    return f"{resolution}³"


def draw(ui: Ui) -> None:
    """Draws the panel."""
    renderer = _renderer(ui)
    if renderer.file is not None:
        w.field(ui, "renderer.file", "Grid file")
    else:
        _resolution(ui, renderer)
        w.field(ui, "renderer.value", "Voxels hold")
        if renderer.value == "coverage":
            w.field(ui, "renderer.sub_points")
        w.field(ui, "renderer.store", words={"byte": "8 bits", "float": "32 bits"}, segmented=True)
        w.field(ui, "renderer.fill", segmented=True, words={"octree": "Octree", "brute": "Every voxel"})
    _box(ui, renderer)
    w.group(ui, "Rays")
    w.field(ui, "renderer.interpolation", segmented=True)
    w.field(ui, "renderer.step", unit=" voxel")
    if ui.studio.scene.lighting.mode == "path":
        w.field(ui, "renderer.anisotropy")
    else:
        w.field(ui, "renderer.shadows")
    if renderer.transfer.opacity is None:
        low, high = limits(ui)
        w.field(
            ui,
            "renderer.level",
            usual=(low, high),
            start=(low + high) / 2,
            auto=f"{(low + high) / 2:.4g}, the middle",
        )
    else:
        w.field(ui, "renderer.opacity_limit")
    w.group(ui, "Normals")
    w.field(ui, "renderer.normals")
    if renderer.normals == "gradient":
        w.field(ui, "renderer.normal_radius", "Smoothing")
    if renderer.file is None and not w.filtering(ui):
        _zoom(ui, renderer)


def limits(ui: Ui) -> tuple[float, float]:
    """The least and the largest value of the grid's voxels."""
    scene = ui.studio.scene
    given = scene.given
    if given is not None:
        return given.low, given.high
    return _renderer(ui).value_range(scene.formula.iterations)


def _renderer(ui: Ui) -> VolumeRenderer:
    renderer = ui.studio.scene.renderer
    assert isinstance(renderer, VolumeRenderer)
    return renderer


def _resolution(ui: Ui, renderer: VolumeRenderer) -> None:
    """One number for the longest side, dragged only when it is let go: each value fills a grid."""
    path, about = "renderer.resolution", "voxels along the longest side, or along x, y and z"
    width = w.row(
        ui,
        "Resolution",
        path=path,
        tip=about,
        differs=renderer.resolution != 512,
        reset=lambda: _put(ui, path, 512),
    )
    if width is None:
        return
    three = isinstance(renderer.resolution, tuple)
    sides = renderer.resolution if isinstance(renderer.resolution, tuple) else (renderer.resolution,)
    kept = ui.memory.get("resolution")
    if three:
        width = w.columns(3)
    else:
        width -= imgui.get_frame_height() + 4
    for index, side in enumerate(sides):
        if index:
            w.in_row(4)
        shown = kept[1] if kept is not None and kept[0] == index else side
        scale = w.Scale(2, 16_384, (32, 2048), log=True, whole=True)
        mark = theme.AXES[index] if three else None
        change = w.number_box(w.boxes(ui), f"{path}.{index}", float(shown), width, scale, mark=mark)
        if change.value is not None and change.dragging:
            ui.memory["resolution"] = (index, change.value)
        elif change.value is not None or change.ended:
            value = int(change.value if change.value is not None else shown)
            ui.memory.pop("resolution", None)
            new = [*sides[:index], value, *sides[index + 1 :]]
            _put(ui, path, new if three else value)
    if not three:
        w.in_row(4)
        if w.icon_button(theme.GRID, "Usual sizes"):
            imgui.open_popup("##sizes")
        if imgui.begin_popup("##sizes"):
            for each in _SIDES:
                if imgui.selectable(f"{each}", each == renderer.resolution)[0]:
                    _put(ui, path, each)
            imgui.end_popup()
    w.problem(ui, path)


def _box(ui: Ui, renderer: VolumeRenderer) -> None:
    center, radius = ui.studio.scene.bounds
    given = renderer.box is not None
    about = "the box that is filled; null: a cube around the formula's bounds"
    reset = lambda: _put(ui, "renderer.box", None)  # noqa: E731
    width = w.row(ui, "Own box", path="renderer.box", tip=about, differs=given, reset=reset)
    if width is not None and w.toggle("renderer.box", given):
        first = {"center": list(center), "size": float(f"{2 * radius:.5g}")}
        ui.studio.edit({"renderer.box": None if given else first, "renderer.zoom": []})
    w.problem(ui, "renderer.box")
    box = _renderer(ui).box
    if box is None:
        return
    w.field(ui, "renderer.box.center", step=0.005 * radius)
    width = w.row(ui, "Size", path="renderer.box.size", tip="lengths of the sides, scene units")
    if width is None:
        return
    three = isinstance(box.size, tuple)
    sides = box.sides if three else box.sides[:1]
    wide = w.columns(3) if three else width
    for index, side in enumerate(sides):
        if index:
            w.in_row(4)
        change = w.number_box(
            w.boxes(ui), f"renderer.box.size.{index}", side, wide, w.Scale(0, 1e6, open=(True, False))
        )
        w.apply(
            ui,
            "renderer.box.size",
            change,
            lambda new, at=index: [*sides[:at], new, *sides[at + 1 :]] if three else new,  # type: ignore[misc]
        )
    w.problem(ui, "renderer.box.size")


def _zoom(ui: Ui, renderer: VolumeRenderer) -> None:
    """The magnification now and after the next zoom, whose cube is moved and scaled in the picture."""
    w.group(ui, "Zoom")
    w.reading(ui, "Magnification", magnified(renderer.magnification))
    controls: Controls | None = ui.memory.get("controls")
    box = controls.box if controls is not None and controls.marking else None
    marking = box is not None
    if box is not None:
        after = zoom_box.next_magnification(renderer, box)
        w.reading(ui, "After the next", magnified(after), theme.ACCENT)
        w.reading(ui, "Cube", ", ".join(f"{each:.5g}" for each in box.center), theme.DIM)
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
    wide = (imgui.get_content_region_avail().x - 4) / 2
    text = "Zoom in" if marking else "Mark a cube"
    hint = f"({ui.keys.hint('zoom_apply')})"
    about = (
        f"Fill the grid with what is in the cube {hint}"
        if marking
        else f"Then drag it; the wheel scales it {hint}"
    )
    if w.button(text, icon=theme.EXPAND, width=wide, primary=marking, about=about):
        ui.act("zoom_apply")
    w.in_row(4)
    steps = len(renderer.zoom)
    about = f"Undo the last of {steps} zooms ({ui.keys.hint('zoom_back')})"
    if w.button("Step back", icon=theme.COMPRESS, width=wide, enabled=steps > 0, about=about):
        ui.act("zoom_back")
    for index, zoom in enumerate(renderer.zoom):
        place = ", ".join(f"{each:.4g}" for each in zoom.center)
        w.hint(ui, f"{index + 1}.  {zoom.scale:.4g} x  at {place}")
    if steps:
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
        if w.button("Back to the whole", icon=theme.RESET, width=-1):
            _put(ui, "renderer.zoom", [])


def magnified(factor: float) -> str:
    """A magnification in words."""
    return f"{factor:.4g} x" if factor < 1e5 else f"{factor:.3e} x"


def _put(ui: Ui, path: str, value: Any) -> None:
    ui.studio.edit({path: plain(value)})
