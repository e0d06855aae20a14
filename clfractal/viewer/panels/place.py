"""The place of any depth that the scene shows: its exact centre, its magnification, and both as text."""

from __future__ import annotations

from clfractal.scene.deeper import magnified
from clfractal.viewer.deeper_moves import DeeperMoves
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

_AXES = ("x", "y", "z")


def summary(ui: Ui) -> str:
    """For the heading."""
    scene = ui.studio.scene
    return "" if scene.deep is None else f"{magnified(scene):.3g}x"


def draw(ui: Ui) -> None:
    """Draws the panel."""
    if w.optional(ui, "deep", "Magnified", {}, keeps=False):
        for number, axis in enumerate(_AXES):
            _coordinate(ui, f"deep.center.{number}", axis)
        w.field(ui, "deep.magnification")
        _follows(ui)
    if not w.filtering(ui):
        w.in_labels()
        w.act(ui, "copy_place", theme.COPY, "Copy the place and the camera as text", text="Copy")
        w.in_row(4)
        w.act(ui, "paste_place", "", "Go to the place that the clipboard tells", text="Paste")


def _follows(ui: Ui) -> None:
    moves: DeeperMoves | None = ui.memory.get("deeper")
    if moves is None:
        return
    about = (
        "as many more of them as details that small need; a number that is set by hand counts from then on"
    )
    path = "formula.iterations"
    if w.switch(ui, "Iterations follow", moves.orbits.follow, path=path, name="place.follow", tip=about):
        moves.orbits.switch()


def _coordinate(ui: Ui, path: str, axis: str) -> None:
    about = w.value_tip(ui, "deep.center")
    width = w.row(ui, f"Centre {axis}", path=path, tip=about)
    if width is None:
        return
    new = w.text_box(ui, path, w.value(ui, path) or "0", width)
    if new is not None:
        ui.studio.edit({path: new})
    w.problem(ui, path)
