"""Things that are dragged or clicked in the picture: lights, and what the lens makes sharp.

A directional light is shown on a ball around the scene's middle, where its light comes from: a circle in the picture
stands for the ball, its front for light from the viewer's side, its back for light from behind. A point light is shown
where it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, isfinite, sqrt
from typing import cast

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View
from clfractal.elements.lights.directional import DirectionalLight
from clfractal.scene.parts import AnyCamera, PerspectiveCamera
from clfractal.scene.stance import LARGEST
from clfractal.schema.light import LightBase as Light
from clfractal.viewer.pointer import Floats, Size, point_at, project

Bounds = tuple[npt.ArrayLike, float]

# Radius of the circle, parts of the picture's smaller side.
_SMALLEST, _LARGEST_CIRCLE = 0.15, 0.42


@dataclass(frozen=True, slots=True)
class Circle:
    """The circle in the picture that stands for the ball of directional lights; pixels."""

    x: float
    y: float
    radius: float


@np.errstate(all="ignore")
def light_circle(view: View, size: Size, bounds: Bounds) -> Circle:
    """The outline of a ball (middle and radius, scene units), kept in the picture and neither tiny nor larger than it.

    Where the eye is inside the ball or looks away from it, the circle is in the middle of the picture.
    """
    smaller = min(size)
    middle, radius = np.asarray(bounds[0], float), bounds[1]
    x, y, depth = project(view, middle, size)
    pixel = view.height / size[1]
    if view.eye is not None:
        # What is at the ball's middle is smaller on the plane by this.
        pixel *= depth / float((view.center - view.eye) @ view.axis)
    outside = depth > radius if view.eye is not None else True
    if not (outside and isfinite(x) and isfinite(y) and isfinite(pixel) and pixel > 0):
        return Circle(size[0] / 2, size[1] / 2, _LARGEST_CIRCLE * smaller)
    wide = min(max(radius / pixel, _SMALLEST * smaller), _LARGEST_CIRCLE * smaller)
    return Circle(min(max(x, wide), size[0] - wide), min(max(y, wide), size[1] - wide), wide)


@np.errstate(all="ignore")
def handle_position(light: Light, view: View, size: Size, bounds: Bounds) -> tuple[float, float] | None:
    """Where a light is shown, x and y in pixels; None for a point light that is not in front of the eye,
    and for lights on the set.

    A point light may be outside the picture.
    """
    if light.stands_at is not None:
        x, y, depth = project(view, light.stands_at, size)
        return (x, y) if isfinite(x) and isfinite(y) and depth > 0 else None
    if not isinstance(light, DirectionalLight):
        return None
    circle, source = light_circle(view, size, bounds), _source(light)
    return (
        circle.x + circle.radius * float(source @ view.side),
        circle.y - circle.radius * float(source @ view.up),
    )


def is_behind(light: Light, view: View) -> bool:
    """Whether a directional light comes from behind what is seen, so that its handle is at the ball's back."""
    return isinstance(light, DirectionalLight) and float(_source(light) @ view.axis) > 0


@np.errstate(all="ignore")
def dragged(
    light: Light, view: View, size: Size, x: float, y: float, bounds: Bounds, *, behind: bool = False
) -> Light:
    """The light, its handle dragged to (x, y), pixels; unchanged where no light can be.

    A directional light comes from the ball's front, or its back if `behind`; beside the circle, from its rim. A point light
    moves in the plane at its depth; one that is not in front of the eye comes to the depth of the ball's middle.
    """
    if not (isfinite(x) and isfinite(y)):
        return light
    if light.stands_at is not None:
        depth = project(view, light.stands_at, size)[2]
        if handle_position(light, view, size, bounds) is None:
            depth = _middle_depth(view, bounds)
        return _placed(light, point_at(view, x, y, size, depth))
    if not isinstance(light, DirectionalLight):
        return light
    circle = light_circle(view, size, bounds)
    across, rise = (x - circle.x) / circle.radius, (circle.y - y) / circle.radius
    away = hypot(across, rise)
    if not isfinite(away):
        return light
    if away > 1:
        across, rise, away = across / away, rise / away, 1.0
    ahead = sqrt(max(1 - away * away, 0.0)) * (1 if behind else -1)
    source = across * view.side + rise * view.up + ahead * view.axis
    # Its length means nothing, but it is the scene's.
    direction = -source * float(np.linalg.norm(light.direction))
    return light.model_copy(update={"direction": tuple(direction.tolist())})


def focus_at(camera: AnyCamera, depth: float) -> AnyCamera:
    """The camera, focused on the depth of a clicked pixel; unchanged where nothing is, or if its rays are parallel.

    A camera without an `f_number` is a pinhole and shows all sharp.
    """
    if not isinstance(camera, PerspectiveCamera) or not 0 < depth <= LARGEST:
        return camera
    return camera.model_copy(update={"focus": None, "focus_on": None, "focus_distance": float(depth)})


def _source(light: DirectionalLight) -> Floats:
    """The direction towards the light, of length 1."""
    direction = np.array(light.direction)
    return cast(Floats, -direction / np.linalg.norm(direction))


def _placed(light: Light, position: Floats) -> Light:
    if not np.all(np.abs(position) <= LARGEST):
        return light
    return light.model_copy(update={"position": tuple(position.tolist())})


def _middle_depth(view: View, bounds: Bounds) -> float:
    """Depth of the ball's middle, or of the view's plane if it is not in front of the eye."""
    depth = float((np.asarray(bounds[0], float) - view.origin) @ view.axis)
    if depth > 0:
        return depth
    plane = float((view.center - view.origin) @ view.axis)
    return plane if plane > 0 else float(bounds[1])
