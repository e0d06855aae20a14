"""Fields of panels, drawn one at a time."""

from __future__ import annotations

from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui
from tests.viewer.panel_harness import Stage, make_ui

SCENE = "scenes/mandelbulb.yaml"


def stage_of(path: str, **options: object) -> Stage:
    """One field at the top of a window."""
    ui, _ = make_ui(SCENE)

    def draw(ui: Ui) -> None:
        w.field(ui, path, **options)  # type: ignore[arg-type]

    return Stage(ui, draw)


# The middle of the first row's box, and of its label, points.
BOX, LABEL, DOT = (220.0, 29.0), (60.0, 29.0), (21.0, 29.0)
