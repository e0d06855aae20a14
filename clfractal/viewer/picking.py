"""What lies under the pointer: found in the depths that came with the shown picture, without asking the device."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clfractal.optics.view import View
from clfractal.pictures.compose import BELOW, BESIDE
from clfractal.renderers.plan import PlannedView
from clfractal.scene.stereo import APART, Stereo
from clfractal.viewer.display import Shown


@dataclass(frozen=True, slots=True, eq=False)
class Pick:
    """A place in the picture.

    Attributes:
        view: the planned view that shows it.
        camera: that view's plane and eye.
        x, y: its place in the view's whole picture, pixels from the top left.
        size: of that picture, pixels.
        depth: along the view axis, scene units; infinite where nothing was hit.
        point: in space, scene units, shape (3,); None where nothing was hit.
    """

    view: PlannedView
    camera: View
    x: float
    y: float
    size: tuple[int, int]
    depth: float
    point: tuple[float, float, float] | None


def in_eye(stereo: Stereo | None, image: tuple[int, int], x: float, y: float) -> tuple[int, float, float]:
    """Which eye's picture (0 or 1) is shown at a place of the window, and the place in that picture, pixels."""
    if stereo is None:
        return 0, x, y
    width, height = image
    beside = stereo.mode in BESIDE or stereo.mode in APART
    second = False
    if beside:
        wide = width // 2 if stereo.mode == "split_half" else width
        second = x >= wide
        x -= wide * second
    elif stereo.mode in BELOW:
        high = height // 2 if stereo.mode == "over_under_half" else height
        second = y >= high
        y -= high * second
    elif stereo.mode == "right":
        return 1, x, y
    elif stereo.mode == "left":
        return 0, x, y
    return int(second != stereo.swap), x, y


def picked(shown: Shown, x: float, y: float) -> Pick | None:
    """What is shown at a place of the window; None outside the picture.

    Args:
        x, y: pixels of the picture as it is shown, from the top left.
    """
    arrangement = shown.frame.arrangement
    stereo = arrangement.fitting(shown.look).stereo
    eye, across, down = in_eye(stereo, arrangement.image, x, y)
    numbers = range(len(arrangement.places))
    for number in reversed(numbers):
        place = arrangement.places[number]
        if arrangement.eyes[number] != eye and len(set(arrangement.eyes)) > 1:
            continue
        column, row = across - place.x, down - place.y
        if not (0 <= column < place.width and 0 <= row < place.height):
            continue
        view, depths = shown.frame.views[number], shown.depths[number]
        region, divider = view.plan.region, view.plan.divider
        at = int(column) // divider - region.x, int(row) // divider - region.y
        depth = np.inf
        if 0 <= at[0] < depths.shape[1] and 0 <= at[1] < depths.shape[0]:
            depth = float(depths[at[1], at[0]])
        camera = view.camera
        image = (view.scene.image.width, view.scene.image.height)
        return Pick(view, camera, column, row, image, depth, _point(camera, column, row, image, depth))
    return None


def _point(
    view: View, x: float, y: float, size: tuple[int, int], depth: float
) -> tuple[float, float, float] | None:
    if not np.isfinite(depth):
        return None
    across, rise = (x / size[0] - 0.5) * view.width, (0.5 - y / size[1]) * view.height
    on_plane = view.center + across * view.side + rise * view.up
    if view.eye is None:
        found = on_plane + (depth - float((on_plane - view.origin) @ view.axis)) * view.axis
    else:
        ray = on_plane - view.eye
        found = view.eye + ray * (depth / float(ray @ view.axis))
    return float(found[0]), float(found[1]), float(found[2])
