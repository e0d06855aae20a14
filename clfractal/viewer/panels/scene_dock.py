"""The dock at the window's left: every setting of the scene, in panels that open and close."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from imgui_bundle import imgui, imgui_ctx

from clfractal.scene.volume import VolumeRenderer
from clfractal.viewer.panels import (
    camera,
    coloring,
    cut_planes,
    device,
    differences,
    elsewhere,
    formula,
    formula_editor,
    history,
    keyboard,
    lights,
    material,
    objects,
    picture,
    place,
    renderer,
    stereo,
    theme,
    transfer,
    volume,
)
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui


@dataclass(frozen=True, slots=True)
class _Panel:
    """A panel of the dock: its heading, what draws it, a summary at the heading's right, whether it is open at first."""

    key: str
    title: str
    icon: str
    draw: Callable[[Ui], None]
    summary: Callable[[Ui], str] = lambda ui: ""
    opened: bool = False
    shown: Callable[[Ui], bool] = lambda ui: True


def _is_volume(ui: Ui) -> bool:
    return isinstance(ui.studio.scene.renderer, VolumeRenderer)


_PANELS = (
    _Panel("formula", "Formula", theme.MAGIC, formula.draw, formula.summary, opened=True),
    _Panel("renderer", "Renderer", theme.CUBE, renderer.draw, renderer.summary, opened=True),
    _Panel("volume", "Volume", theme.CUBES, volume.draw, volume.summary, opened=True, shown=_is_volume),
    _Panel("transfer", "Transfer function", theme.SLIDERS, transfer.draw, transfer.summary, shown=_is_volume),
    _Panel("coloring", "Colouring", theme.PALETTE, coloring.draw, coloring.summary),
    _Panel("material", "Material", theme.BRUSH, material.draw),
    _Panel("objects", "Objects", theme.CUBES, objects.draw, objects.summary),
    _Panel("lights", "Lights", theme.LIGHT, lights.draw, lights.summary),
    _Panel("surroundings", "Surroundings", theme.CLOUD, material.draw_surroundings, material.summary),
    _Panel("camera", "Camera", theme.CAMERA, camera.draw, camera.summary),
    _Panel("place", "Place", theme.SEARCH, place.draw, place.summary),
    _Panel("cut_planes", "Cut planes", theme.SCISSORS, cut_planes.draw, cut_planes.summary),
    _Panel("stereo", "Stereo", theme.EYE, stereo.draw, stereo.summary),
    _Panel("picture", "Picture", theme.PICTURE, picture.draw, picture.summary),
    _Panel("device", "Device", theme.CHIP, device.draw, device.summary),
    _Panel("differences", "Changed settings", theme.PENCIL, differences.draw, differences.summary),
)

KEYS = tuple(panel.key for panel in _PANELS)
"""Names of the panels, in their order."""


def draw(ui: Ui) -> None:
    """Draws the dock, if panels are shown, and the formula editor, if it is open."""
    if "panels" in ui.show:
        _dock(ui)
    formula_editor.draw(ui)


def _dock(ui: Ui) -> None:
    width, high = min(theme.DOCK_LEFT, ui.size[0] - 2 * theme.MARGIN), ui.size[1] - 2 * theme.MARGIN
    flags = theme.BACK & ~imgui.WindowFlags_.no_focus_on_appearing
    keyboard.focus_window(ui)
    with theme.window("scene", (theme.MARGIN, theme.MARGIN), (width, high), flags=flags):
        history.buttons(ui, "scene")
        w.in_row()
        keyboard.begin_here(ui)
        w.search(ui, "filter", "Find a setting")
        # A gutter at the right, so that the scroll bar never covers or moves a widget.
        flattened, bar = imgui.ChildFlags_.nav_flattened, imgui.WindowFlags_.always_vertical_scrollbar
        imgui.begin_child("##panels", imgui.ImVec2(0, 0), flattened, bar)
        ui.memory["filter.drawn"] = set()
        for panel in filter(lambda panel: panel.shown(ui), _PANELS):
            if w.header(
                ui, panel.key, panel.title, panel.icon, summary=panel.summary(ui), opened=panel.opened
            ):
                with imgui_ctx.push_id(panel.key):
                    panel.draw(ui)
                imgui.dummy(imgui.ImVec2(0, 3))
        ui.memory["filter.whole"] = False
        elsewhere.draw(ui)
        imgui.end_child()
