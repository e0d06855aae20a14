"""Scenes of cut planes, and what NumPy knows of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.cut_plane import renderer_of
from clfractal.scene.model import Scene
from clfractal.scene.rectangle import Placed
from tests.scenes import scene_of

Floats = npt.NDArray[np.float64]
Counts = npt.NDArray[np.int64]

# Of exponents in the smooth count: |z| beyond which it is taken.
SMOOTH_RADIUS = 1000.0


def plane_scene(
    formula: Mapping[str, Any] | str = "hast",
    size: tuple[int, int] = (64, 64),
    *,
    iterations: int = 64,
    plane: Mapping[str, Any] | None = None,
    plane_iterations: int | None = None,
    **renderer: Any,
) -> Scene:
    """A cut plane of a formula: a name of the library, a `formula` section, or a whole formula."""
    section: dict[str, Any] = {"name": formula} if isinstance(formula, str) else dict(formula)
    if "map" in section:
        section = {"inline": section}
    cut = {"type": "cut_plane", "plane": dict(plane or {}), "iterations": plane_iterations}
    return scene_of({"iterations": iterations, **section}, size=size, renderer={**cut, **renderer})


def pixel_points(scene: Scene) -> Floats:
    """The middles of the pixels on the plane, shape (height, width, 3): all of the plane is in the picture."""
    placed: Placed = renderer_of(scene).plane.placed
    width, height = scene.image.width, scene.image.height
    step = max(placed.height / height, placed.width / width)
    across = (np.arange(width) + 0.5 - width / 2) * step
    above = (height / 2 - 0.5 - np.arange(height)) * step
    sideways = across[None, :, None] * np.array(placed.side)
    return np.asarray(np.array(placed.center) + sideways + above[:, None, None] * np.array(placed.up))


def mandelbrot(
    x: npt.NDArray[Any], y: npt.NDArray[Any], iterations: int, radius: float = 4.0
) -> tuple[Counts, npt.NDArray[Any]]:
    """Applications of z -> z^2 + c from z = 0 until |z| > radius, at most `iterations`, and |z| there (the last if never).

    In the number type of the arguments.
    """
    a, b = np.zeros_like(x), np.zeros_like(x)
    count = np.zeros(x.shape, np.int64)
    alive = np.ones(x.shape, bool)
    for _ in range(iterations):
        # Squared alone, so that numbers outside stay small enough.
        a[alive], b[alive] = (
            a[alive] * a[alive] - b[alive] * b[alive] + x[alive],
            2 * a[alive] * b[alive] + y[alive],
        )
        count[alive] += 1
        alive &= a * a + b * b <= radius * radius
    return count, np.hypot(a, b)


def sure(x: npt.NDArray[Any], y: npt.NDArray[Any], iterations: int, nudge: float) -> npt.NDArray[np.bool_]:
    """Points whose count, up to the limit, does not change when they are moved by `nudge` to any side."""
    count, _ = mandelbrot(x, y, iterations)
    same = np.ones(x.shape, bool)
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)):
        same &= mandelbrot(x + dx * nudge, y + dy * nudge, iterations)[0] == count
    return same


def picture_of(framebuffer: Framebuffer) -> npt.NDArray[np.float32]:
    """Colours, shape (height, width, 3)."""
    return np.stack([framebuffer["R"], framebuffer["G"], framebuffer["B"]], axis=-1)
