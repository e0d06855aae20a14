"""The cube that marks a volume's next zoom, moved and scaled in the picture (thesis, 3.1).

There are two spaces: the formula's, in which a scene's `renderer.zoom` is given, and the picture's, where the zoomed box is
shown in the place of the first one. A box keeps its place in the formula's space, so that it is saved as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import cast

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View
from clfractal.errors import SceneError, Where
from clfractal.scene.checks import used_boxes
from clfractal.scene.model import Scene
from clfractal.scene.volume import Box, VolumeRenderer, Zoom
from clfractal.schema.base import Vector
from clfractal.viewer.pointer import Floats, Size, point_at, project, vector

MOST_ZOOMS = 64
LARGEST_SCALE = 1e15
FIRST_SCALE = 4.0
# The least side of a box: a part of its coordinates that these can still tell apart, and a length, scene units.
_LEAST_SIDE, _LEAST_LENGTH = 1e-14, 1e-200
# Corners of a box as bits of x, y and z, and the pairs of them that differ in one bit.
_CORNERS = np.array([[i >> axis & 1 for axis in range(3)] for i in range(8)], float) - 0.5
_EDGES = np.array([(i, i | 1 << axis) for i in range(8) for axis in range(3) if not i >> axis & 1])


@dataclass(frozen=True, slots=True)
class ZoomBox:
    """The next zoom, in the words of a scene's `renderer.zoom`.

    Attributes:
        center: middle of the smaller box, in the formula's space, scene units.
        scale: sides of the present box, divided by this box's; at least 1.
    """

    center: Vector
    scale: float


@dataclass(frozen=True, slots=True)
class Stage:
    """Where a volume is shown, and what of the formula is shown there.

    Attributes:
        shown: the first box, in the picture's space.
        filled: the last box, in the formula's space.
        magnification: how many times larger it is shown than it is.
    """

    shown: Box
    filled: Box
    magnification: float

    def to_picture(self, point: npt.ArrayLike) -> Floats:
        """Points of the formula's space, shape (..., 3), in the picture's."""
        return (np.asarray(point, float) - self.filled.center) * self.magnification + self.shown.center

    def to_formula(self, point: npt.ArrayLike) -> Floats:
        """Points of the picture's space, shape (..., 3), in the formula's."""
        return (np.asarray(point, float) - self.shown.center) / self.magnification + self.filled.center


def stage_of(scene: Scene) -> Stage:
    """The stage of a volume scene.

    Raises:
        SceneError: the renderer is no volume, or shows a grid from a file, which cannot be zoomed.
    """
    renderer = scene.renderer
    if not isinstance(renderer, VolumeRenderer):
        raise SceneError("must be a volume to be zoomed by a box", Where(path="renderer.type"))
    if renderer.file is not None:
        raise SceneError("is not possible in a grid from a file", Where(path="renderer.zoom"))
    shown, filled = used_boxes(scene, renderer)
    return Stage(shown, filled, renderer.magnification)


def first_box(stage: Stage, scale: float = FIRST_SCALE) -> ZoomBox:
    """A box in the middle of the present one."""
    return within(ZoomBox(stage.filled.center, scale), stage)


def within(box: ZoomBox, stage: Stage) -> ZoomBox:
    """The nearest box that lies inside the present one, as large if it can be."""
    middle, sides = np.array(stage.filled.center), np.array(stage.filled.sides)
    least = max(_LEAST_SIDE * float(np.abs(middle).max()), _LEAST_LENGTH)
    largest = min(LARGEST_SCALE, float(sides.min()) / least)
    scale = max(min(box.scale, largest), 1.0) if isfinite(box.scale) else FIRST_SCALE
    room = 0.5 * (sides - sides / scale)
    wanted = np.array(box.center, float)
    wanted = np.where(np.isfinite(wanted), wanted, middle)
    return ZoomBox(vector(np.clip(wanted, middle - room, middle + room)), scale)


@np.errstate(all="ignore")
def placed_at(box: ZoomBox, stage: Stage, point: npt.ArrayLike) -> ZoomBox:
    """The box, its middle at a point of the picture's space (for example the one under the pointer)."""
    return within(replace(box, center=vector(stage.to_formula(point))), stage)


@np.errstate(all="ignore")
def shifted(box: ZoomBox, stage: Stage, shift: npt.ArrayLike) -> ZoomBox:
    """The box, shifted by a vector of the picture's space."""
    moved = np.array(box.center) + np.asarray(shift, float) / stage.magnification
    return within(replace(box, center=vector(moved)), stage)


def stepped(
    box: ZoomBox, stage: Stage, view: View, *, right: float = 0.0, up: float = 0.0, forward: float = 0.0
) -> ZoomBox:
    """The box, moved along the view's axes by parts of its own longest side, as keys do."""
    side = max(stage.shown.sides) / box.scale
    return shifted(box, stage, side * (right * view.side + up * view.up + forward * view.axis))


@np.errstate(all="ignore")
def dragged(box: ZoomBox, stage: Stage, view: View, size: Size, dx: float, dy: float) -> ZoomBox:
    """The box, whose middle follows a drag by (dx, dy) pixels at its depth."""
    x, y, depth = project(view, stage.to_picture(box.center), size)
    if not (isfinite(x) and isfinite(dx) and isfinite(dy)):
        return box
    return placed_at(box, stage, point_at(view, x + dx, y + dy, size, depth))


def scaled(box: ZoomBox, stage: Stage, factor: float) -> ZoomBox:
    """The box, its sides longer (above 1) or shorter by a factor above 0; it stays inside the present box."""
    if not (isfinite(factor) and factor > 0):
        return box
    scale = min(box.scale / factor, LARGEST_SCALE)
    return within(replace(box, scale=scale), stage)


def edges(box: ZoomBox, stage: Stage) -> Floats:
    """The box's 12 edges in the picture's space: segments, shape (12, 2, 3)."""
    sides = np.array(stage.shown.sides) / box.scale
    return box_edges(stage.to_picture(box.center), sides)


def box_edges(center: npt.ArrayLike, sides: npt.ArrayLike) -> Floats:
    """The 12 edges of a box along the axes: segments, shape (12, 2, 3)."""
    corners = np.asarray(center, float) + _CORNERS * np.asarray(sides, float)
    return cast(Floats, corners[_EDGES])


def applied(renderer: VolumeRenderer, box: ZoomBox) -> tuple[Zoom, ...]:
    """The renderer's zooms and the box as one more, for `renderer.zoom`.

    Past the 64th zoom the last one takes up the new one.

    Raises:
        SceneError: the zooms are used up.
    """
    new = Zoom(center=box.center, scale=box.scale)
    if len(renderer.zoom) < MOST_ZOOMS:
        return (*renderer.zoom, new)
    both = renderer.zoom[-1].scale * box.scale
    if both > LARGEST_SCALE:
        raise SceneError(
            f"has room for {MOST_ZOOMS} zooms, and they are used up", Where(path="renderer.zoom")
        )
    return (*renderer.zoom[:-1], Zoom(center=box.center, scale=both))


def stepped_back(renderer: VolumeRenderer) -> tuple[tuple[Zoom, ...], ZoomBox | None]:
    """The renderer's zooms without the last, and the box that leads there again; None where there was none."""
    if not renderer.zoom:
        return (), None
    last = renderer.zoom[-1]
    return renderer.zoom[:-1], ZoomBox(last.center, last.scale)


def next_magnification(renderer: VolumeRenderer, box: ZoomBox) -> float:
    """How many times larger the first box is than the marked one (`renderer.magnification` tells it of the present)."""
    return renderer.magnification * box.scale
