"""The picture itself: exposure and tone, size of files, what they hold."""

from __future__ import annotations

from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui


def summary(ui: Ui) -> str:
    """For the heading."""
    image = ui.studio.scene.image
    return f"{image.width} x {image.height}"


def draw(ui: Ui) -> None:
    """Draws the panel."""
    measured = round(ui.studio.exposure, 2)
    w.field(ui, "output.exposure", unit=" stops", start=measured, auto=f"automatic, {measured:+.2f}")
    w.field(ui, "output.tone", words={"agx": "AgX"})
    w.group(ui, "Files")
    w.fields(ui, "image", ("width", "height"), width={"unit": " px"}, height={"unit": " px"})
    own = ui.studio.scene.image.height
    w.field(ui, "image.reference_height", unit=" px", start=own, auto=f"height, {own} px")
    w.field(ui, "output.denoise")
    w.field(ui, "output.png_bits", segmented=True)
    w.field(ui, "output.quality")
