"""Where the surface's colour comes from: a quantity and a palette."""

from __future__ import annotations

from clfractal.scene.volume import VolumeRenderer
from clfractal.viewer.panels import palette_editor
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

_QUANTITIES = {
    "solid": "One colour",
    "normal": "Normal",
    "iterations": "Iterations",
    "residual": "Roughness (residual)",
    "thickness": "Thickness",
    "layer_distance": "Distance to a layer",
    "trap": "Orbit trap",
}


def summary(ui: Ui) -> str:
    """For the heading."""
    return _QUANTITIES[ui.studio.scene.coloring.by].lower()


def draw(ui: Ui) -> None:
    """Draws the panel."""
    scene = ui.studio.scene
    keep = {"coloring.along": "normal"} if scene.coloring.along == "reflection" else {}
    w.field(ui, "coloring.by", words=_QUANTITIES, keep=keep)
    coloring = ui.studio.scene.coloring
    if isinstance(scene.renderer, VolumeRenderer):
        w.hint(ui, "A volume is coloured by its transfer function, or by its material.")
        return
    if coloring.by == "solid":
        w.field(ui, "material.color")
        return
    if coloring.by == "normal":
        w.hint(ui, "The normal's x, y and z as red, green and blue.")
        return
    palette_editor.draw(ui, "coloring.palette")
    w.fields(ui, "coloring", ("scale", "offset", "repeat"))
    radius = ui.studio.scene.bounds[1]
    if coloring.by in ("thickness", "layer_distance"):
        w.field(ui, "coloring.along", segmented=True)
        w.field(ui, "coloring.step", start=float(f"{radius / 100:.3g}"), auto=f"{radius / 100:.3g}")
    if coloring.by == "layer_distance":
        w.field(ui, "coloring.layer")
    if coloring.by == "trap":
        _trap(ui)


def _trap(ui: Ui) -> None:
    w.group(ui, "Trap")
    fine = {"step": 0.01}
    used = ui.studio.scene.coloring.trap.used_keys
    w.fields(ui, "coloring.trap", used, center=fine, direction=fine)
