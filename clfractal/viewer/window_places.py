"""Where things are in a window: the picture, the panels of each eye, and the pointer between them."""

from __future__ import annotations

from dataclasses import dataclass

from clfractal.images.modes import BELOW, BESIDE
from clfractal.scene.stereo import APART, Stereo

Place = tuple[int, int, int, int]
"""x, y (from the bottom), width, height, framebuffer pixels."""


@dataclass(frozen=True, slots=True)
class Places:
    """The arrangement of one window.

    Attributes:
        framebuffer: width and height, pixels.
        ui: where the panels are drawn: once, or once for each eye.
        ui_size: of the panels' area, framebuffer pixels before they are squeezed.
    """

    framebuffer: tuple[int, int]
    ui: tuple[Place, ...]
    ui_size: tuple[float, float]

    def to_ui(self, x: float, y: float) -> tuple[float, float]:
        """A place of the window (framebuffer pixels from the top left) in the panels' area."""
        height = self.framebuffer[1]
        for left, bottom, wide, high in self.ui:
            top = height - bottom - high
            if left <= x < left + wide and top <= y < top + high:
                return (x - left) * self.ui_size[0] / wide, (y - top) * self.ui_size[1] / high
        return -1.0, -1.0


def places_of(stereo: Stereo | None, framebuffer: tuple[int, int]) -> Places:
    """Where the panels of a window are: at screen depth, so at the same place of both eyes' pictures."""
    width, height = framebuffer
    mode = stereo.mode if stereo is not None else None
    squeezed = 2.0 if mode in ("split_half", "over_under_half") else 1.0
    if mode in BESIDE or mode in APART:
        half = width // 2
        pair: tuple[Place, ...] = ((0, 0, half, height), (half, 0, half, height))
        return Places(framebuffer, pair, (half * squeezed, float(height)))
    if mode in BELOW:
        half = height // 2
        pair = ((0, height - half, width, half), (0, height - 2 * half, width, half))
        return Places(framebuffer, pair, (float(width), half * squeezed))
    return Places(framebuffer, ((0, 0, width, height),), (float(width), float(height)))
