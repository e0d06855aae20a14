"""The volume: its box and grid, what a voxel holds, and the zoom into it."""

from __future__ import annotations

from functools import partial
from operator import itemgetter
from typing import Any

from imgui_bundle import imgui

from clfractal.scene.volume import VolumeRenderer
from clfractal.viewer import zoom_box
from clfractal.viewer.controls import Controls
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

_WORDS: dict[str, dict[str, Any]] = {
    "value": {"label": "Voxels hold"},
    "store": {"words": {"byte": "8 bits", "float": "32 bits"}},
    "fill": {"words": {"octree": "Octree", "brute": "Every voxel"}},
}
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
        sub_points = ("sub_points",) if renderer.value == "coverage" else ()
        w.fields(ui, "renderer", ("value", *sub_points, "store", "fill"), **_WORDS)
    _box(ui, renderer)
    w.group(ui, "Rays")
    light = "anisotropy" if ui.studio.scene.lighting.mode == "path" else "shadows"
    step, apart = {"unit": " voxel"}, {"segmented": True}
    w.fields(ui, "renderer", ("interpolation", "step", light), interpolation=apart, step=step)
    if renderer.transfer.opacity is None:
        level(ui, "renderer.level", *limits(ui))
    else:
        w.field(ui, "renderer.opacity_limit")
    w.group(ui, "Normals")
    w.field(ui, "renderer.normals")
    if renderer.normals == "gradient":
        w.field(ui, "renderer.normal_radius", "Smoothing")
    if renderer.file is None and not w.filtering(ui):
        _zoom(ui, renderer)


def level(ui: Ui, path: str, low: float, high: float) -> None:
    """The value of the surface, of those between two."""
    middle = (low + high) / 2
    w.field(ui, path, usual=(low, high), start=middle, auto=f"{middle:.4g}, the middle")


def limits(ui: Ui) -> tuple[float, float]:
    """The least and the largest value of the grid's voxels."""
    scene = ui.studio.scene
    if scene.given is not None:
        return scene.given.low, scene.given.high
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
        reset=lambda: w.put(ui, path, 512),
    )
    if width is None:
        return
    three = isinstance(renderer.resolution, tuple)
    sides = renderer.resolution if isinstance(renderer.resolution, tuple) else (renderer.resolution,)
    held, dragged = ui.memory.get("resolution", (None, 0))
    width = w.columns(3) if three else width - imgui.get_frame_height() - 4
    for index, side in enumerate(sides):
        if index:
            w.in_row(4)
        shown = dragged if held == index else side
        scale = w.Scale(2, 16_384, (32, 2048), log=True, whole=True)
        mark = theme.AXES[index] if three else None
        change = w.number_box(w.boxes(ui), f"{path}.{index}", float(shown), width, scale, mark=mark)
        if change.value is not None and change.dragging:
            ui.memory["resolution"] = (index, change.value)
        elif change.value is not None or change.ended:
            value = int(change.value if change.value is not None else shown)
            ui.memory.pop("resolution", None)
            w.put(ui, path, [*sides[:index], value, *sides[index + 1 :]] if three else value)
    if not three:
        w.in_row(4)
        if w.icon_button(theme.GRID, "Usual sizes"):
            imgui.open_popup("##sizes")
        now = renderer.resolution if isinstance(renderer.resolution, int) else None
        chosen = w.menu("##sizes", {each: f"{each}" for each in _SIDES}, now)
        if chosen is not None:
            w.put(ui, path, chosen)
    w.problem(ui, path)


def _box(ui: Ui, renderer: VolumeRenderer) -> None:
    center, radius = ui.studio.scene.bounds
    given = renderer.box is not None
    about = "the box that is filled; null: a cube around the formula's bounds"
    reset = partial(w.put, ui, "renderer.box", None)
    if w.switch(ui, "Own box", given, path="renderer.box", tip=about, differs=given, reset=reset):
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
    wide, scale = w.columns(3) if three else width, w.Scale(0, 1e6, open=(True, False))
    make = list if three else itemgetter(0)
    w.numbers(ui, "renderer.box.size", sides, wide, scale, marked=False, make=make)
    w.problem(ui, "renderer.box.size")


def _zoom(ui: Ui, renderer: VolumeRenderer) -> None:
    """The magnification now and after the next zoom, whose cube is moved and scaled in the picture."""
    w.group(ui, "Zoom")
    w.reading(ui, "Magnification", magnified(renderer.magnification))
    box = marked(ui)
    text, about = "Mark a cube", "Then drag it; the wheel scales it"
    if box is not None:
        text, about = "Zoom in", "Fill the grid with what is in the cube"
        after = zoom_box.next_magnification(renderer, box)
        w.reading(ui, "After the next", magnified(after), theme.ACCENT)
        w.reading(ui, "Cube", ", ".join(f"{each:.5g}" for each in box.center), theme.DIM)
    w.in_labels()
    wide = (imgui.get_content_region_avail().x - 4) / 2
    w.act(ui, "zoom_apply", theme.EXPAND, about, text=text, width=wide, primary=box is not None)
    w.in_row(4)
    steps = len(renderer.zoom)
    about = f"Undo the last of {steps} zooms"
    w.act(ui, "zoom_back", theme.COMPRESS, about, text="Step back", width=wide, enabled=steps > 0)
    for index, zoom in enumerate(renderer.zoom):
        place = ", ".join(f"{each:.4g}" for each in zoom.center)
        w.hint(ui, f"{index + 1}.  {zoom.scale:.4g} x  at {place}")
    if steps:
        w.in_labels()
        if w.button("Back to the whole", icon=theme.RESET, width=-1):
            w.put(ui, "renderer.zoom", [])


def marked(ui: Ui) -> zoom_box.ZoomBox | None:
    """The box of the next zoom, if it is shown."""
    controls: Controls | None = ui.memory.get("controls")
    return controls.box if controls is not None and controls.marking else None


def magnified(factor: float) -> str:
    """A magnification in words."""
    return f"{factor:.4g} x" if factor < 1e5 else f"{factor:.3e} x"
