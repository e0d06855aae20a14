"""Where the surface's colour comes from: a quantity and a palette."""

from __future__ import annotations

from typing import Any

from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.quantity import colorings
from clfractal.viewer.panels import maps, palette_editor
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui


def summary(ui: Ui) -> str:
    """For the heading."""
    return ui.studio.scene.coloring.kind.title.lower()


def draw(ui: Ui) -> None:
    """Draws the panel."""
    scene = ui.studio.scene
    keep = {"coloring.along": "normal"} if scene.coloring.along == "reflection" else {}
    w.field(ui, "coloring.by", words={kind.tag: kind.title for kind in colorings()}, keep=keep)
    kind = ui.studio.scene.coloring.kind
    if isinstance(scene.renderer, VolumeRenderer):
        w.hint(ui, "A volume is coloured by its transfer function, or by its material.")
        return
    if kind.of_material:
        w.field(ui, "material.color")
    if kind.hint:
        w.hint(ui, kind.hint)
    if not kind.uses_palette:
        return
    palette_editor.draw(ui, "coloring.palette")
    w.fields(ui, "coloring", ("scale", "offset", "repeat"))
    _own(ui, kind.keys)


def _own(ui: Ui, keys: tuple[str, ...]) -> None:
    """What counts for this quantity alone."""
    step = float(f"{ui.studio.scene.bounds[1] / 100:.3g}")
    of: dict[str, dict[str, Any]] = {
        "along": {"segmented": True},
        "step": {"start": step, "auto": f"{step:.3g}"},
    }
    w.fields(ui, "coloring", [key for key in keys if key not in ("trap", "number")], **of)
    if "number" in keys:
        maps.carried(ui, "coloring.number", ui.studio.scene.coloring.number)
    if "trap" in keys:
        w.group(ui, "Trap")
        fine = {"step": 0.01}
        used = ui.studio.scene.coloring.trap.used_keys
        w.fields(ui, "coloring.trap", used, center=fine, direction=fine)
