"""Stereo geometry for users with an OpenGL of their own, and parallax: the thesis's section 3.3.1.

There are two units of length: scene units, and the unit of the real screen. `relation` is the number of scene units in one
unit of the screen. Parallax is measured on the screen, from the left eye's picture of a point to the right eye's: it is
negative for points in front of the screen, and the interpupillary distance for infinitely distant points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View, eye_view, middle_view
from clfractal.errors import SceneError, Where
from clfractal.scene.model import Scene
from clfractal.scene.stereo import MIDDLE, Eye, EyeName, Stereo

Floats = npt.NDArray[np.float64]

# The near plane is never nearer to the eye than this part of the view plane's distance.
NEAREST = 1e-3


@dataclass(frozen=True, slots=True)
class Frustum:
    """The arguments of glFrustum, scene units: a pyramid from the eye through a rectangle at distance `near`."""

    left: float
    right: float
    bottom: float
    top: float
    near: float
    far: float

    def matrix(self) -> Floats:
        """The projection as glFrustum makes it (OpenGL 2.1 specification, 2.11.2), 4 x 4, for column vectors."""
        wide, high, deep = self.right - self.left, self.top - self.bottom, self.far - self.near
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[0, 2] = 2 * self.near / wide, (self.right + self.left) / wide
        matrix[1, 1], matrix[1, 2] = 2 * self.near / high, (self.top + self.bottom) / high
        matrix[2, 2], matrix[2, 3] = -(self.far + self.near) / deep, -2 * self.far * self.near / deep
        matrix[3, 2] = -1.0
        return matrix


def frustum(view: View, *, front: float, back: float) -> Frustum:
    """The frustum of a View whose eye may be anywhere in front of its plane (thesis, 3.3.1, the ten steps).

    Args:
        front, back: how far the scene extends in front of and behind the view plane, scene units. `near` is kept above 0.

    Raises:
        SceneError: the eye lies on or behind the view plane, or there is none; `back` leaves nothing to see.
    """
    distance = eye_distance(view)
    near = max(distance - front, NEAREST * distance)
    far = distance + back
    if not far > near:
        raise SceneError(f"must leave some space between near {near:g} and far {far:g}", Where(path="back"))
    assert view.eye is not None
    # Where the plane's middle lies as the eye sees it; what is on the plane is scaled to the near plane.
    to_center = view.center - view.eye
    across, rise = float(to_center @ view.side), float(to_center @ view.up)
    shrink = near / distance
    return Frustum(
        left=(across - view.width / 2) * shrink,
        right=(across + view.width / 2) * shrink,
        bottom=(rise - view.height / 2) * shrink,
        top=(rise + view.height / 2) * shrink,
        near=near,
        far=far,
    )


def attitude(view: View) -> Floats:
    """The matrix that takes points of the scene to the eye's coordinates (thesis, Eq. 11), 4 x 4, for column vectors.

    As OpenGL has it: x to the right, y up, z towards the viewer, the eye in the origin.

    Raises:
        SceneError: the view has no eye.
    """
    eye_distance(view)
    rotation = np.stack([view.side, view.up, -view.axis])
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    matrix[:3, 3] = -rotation @ view.eye
    return matrix


def eye_distance(view: View) -> float:
    """The eye's distance from the view plane, scene units.

    Raises:
        SceneError: it lies on or behind the plane, or at infinity.
    """
    if view.eye is None:
        raise SceneError(
            "stereo needs an eye, and an orthographic view has none", Where(path="camera.projection")
        )
    distance = float((view.center - view.eye) @ view.axis)
    if not distance > 0:
        raise SceneError(
            f"the eye must be in front of the view plane, got a distance of {distance:g}", Where()
        )
    return distance


def eye_views(scene: Scene, eye: Eye = MIDDLE) -> dict[EyeName, View]:
    """The views of a stereo scene: left, right, and the cyclopean eye's between them.

    Args:
        eye: the one that the scene's image belongs to (see `seen_by`): how it is squeezed, and its share of the screen.
    """
    assert scene.stereo is not None
    image = scene.image
    size = (image.width * eye.wide, image.height * eye.high)
    middle = middle_view(scene.stereo, scene.camera, *size, eye.share)
    names: tuple[EyeName, ...] = ("left", "right", "middle")
    return {name: eye_view(middle, scene.stereo, Eye(name)) for name in names}


def relation(stereo: Stereo, middle: View) -> float:
    """Scene units per unit of the real screen."""
    return eye_distance(middle) / stereo.screen_distance


def parallax(stereo: Stereo, views: dict[EyeName, View], points: Floats) -> Floats:
    """Parallax of points of the scene, shape (n, 3), on the screen, in its units: shape (n, 2), horizontal and vertical.

    Points behind an eye have no meaning.
    """
    middle = views["middle"]
    left, right = (
        _on_plane(views[name], points) * (middle.width / views[name].width) for name in ("left", "right")
    )
    return (right - left) / relation(stereo, middle)


def _on_plane(view: View, points: Floats) -> Floats:
    """Where a view shows points on its plane, from the plane's middle, scene units, shape (n, 2)."""
    assert view.eye is not None
    offset = points - view.eye
    depth = offset @ view.axis
    distance = float((view.center - view.eye) @ view.axis)
    frame = np.stack([view.side, view.up], axis=1)
    found: Floats = (offset @ frame) * (distance / depth)[:, None] - (view.center - view.eye) @ frame
    return found


def degrees(stereo: Stereo, screen_parallax: npt.ArrayLike) -> Floats:
    """The angle by which the eyes of the viewer turn away from the screen to see a parallax (screen units).

    The difference of the angles at which their lines of sight meet: negative before the screen, positive behind it.
    """
    eyes, distance = stereo.interpupillary_distance, stereo.screen_distance
    on_screen = 2 * np.arctan(eyes / 2 / distance)
    found: Floats = np.degrees(on_screen - 2 * np.arctan((eyes - np.asarray(screen_parallax)) / 2 / distance))
    return found
