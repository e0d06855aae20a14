"""What lies under the pointer, found in the depths that came with the shown picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clfractal.camera.views import View
from clfractal.images.modes import eye_at
from clfractal.images.tiled import Floats
from clfractal.integrators.plan import PlannedView
from clfractal.viewer.display import Shown
from clfractal.viewer.pointer import vector


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
        depths: of all that the view shows, in the pixels of its plan; None: unknown.
    """

    view: PlannedView
    camera: View
    x: float
    y: float
    size: tuple[int, int]
    depth: float
    point: tuple[float, float, float] | None
    depths: Floats | None = None


def picked(shown: Shown, x: float, y: float) -> Pick | None:
    """What is shown at a place of the window; None outside the picture.

    Args:
        x, y: pixels of the picture as it is shown, from the top left.
    """
    arrangement = shown.frame.arrangement
    stereo = arrangement.fitting(shown.look).stereo
    eye, across, down = eye_at(stereo, arrangement.image, x, y)
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
        point = None
        if np.isfinite(depth):
            point = vector(camera.points_at([column], [row], image, [depth])[0])
        return Pick(view, camera, column, row, image, depth, point, depths)
    return None
