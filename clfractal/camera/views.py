"""The View: a plane in space and an eye, from which every ray of a picture follows.

Space is right-handed, z up, in scene units. The plane faces the viewer; an eye at infinity makes an orthographic view.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.layout import Place
from clfractal.scene.model import Scene
from clfractal.scene.parts import OrthographicCamera, PerspectiveCamera
from clfractal.scene.rectangle import Placed
from clfractal.scene.stereo import MIDDLE, Eye, EyeName, Stereo

Vector = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A rectangle in space, seen from an eye.

    Attributes:
        center: the plane's middle, shape (3,), scene units.
        side, up: unit vectors to the picture's right and top; with `axis` they are perpendicular to each other.
        axis: unit vector from the viewer to the plane, the view direction.
        width, height: of the plane, scene units.
        eye: shape (3,), or None for an eye at infinity (orthographic).
        lens_radius: half the lens's diameter, scene units; 0 for a pinhole.
        focus_distance: of the plane that is sharp, from the eye along `axis`, scene units.
        origin: the point from which depth (channel Z) is measured along `axis`: the eye, or the orthographic camera.
    """

    center: Vector
    side: Vector
    up: Vector
    axis: Vector
    width: float
    height: float
    eye: Vector | None
    origin: Vector
    lens_radius: float = 0.0
    focus_distance: float = 1.0

    def pixel_size(self, image_height: float) -> float:
        """Height of a pixel on the plane, scene units."""
        return self.height / image_height

    def points_at(
        self, x: npt.ArrayLike, y: npt.ArrayLike, size: tuple[int, int], depth: npt.ArrayLike
    ) -> Vector:
        """The points that places of the picture show, scene units, shape (n, 3).

        Args:
            x, y: the places, shape (n,), pixels from the top left corner; a pixel's middle is half a pixel farther.
            size: width and height of the whole picture, pixels.
            depth: of the points along the view axis (channel Z), shape (n,), finite, scene units.
        """
        across = (np.asarray(x, float) / size[0] - 0.5) * self.width
        rise = (0.5 - np.asarray(y, float) / size[1]) * self.height
        on_plane = self.center + across[:, None] * self.side + rise[:, None] * self.up
        along = np.asarray(depth, float)
        if self.eye is None:
            behind = along - (on_plane - self.origin) @ self.axis
            return on_plane + behind[:, None] * self.axis
        rays = on_plane - self.eye
        return self.eye + rays * (along / (rays @ self.axis))[:, None]

    def world_to_camera(self) -> Vector:
        """4 x 4, for row vectors, as OpenEXR's standard attribute is defined: left-handed camera space with the origin
        at the camera, x to the picture's right, y up, z along the view direction (so z is depth)."""
        rotation = np.stack([self.side, self.up, self.axis], axis=1)
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        matrix[3, :3] = -self.origin @ rotation
        return matrix

    def world_to_ndc(self) -> Vector:
        """4 x 4, for row vectors, as OpenEXR's standard attribute is defined: after division by w, x and y go from
        (0, 0), the upper left corner of the whole picture, to (1, 1), the lower right one. w is the depth seen from an
        eye, else 1; z, which the standard discards, is the depth over w."""
        projection = np.zeros((4, 4))
        shift = (self.center - self.origin) @ np.stack([self.side, self.up], axis=1)
        left, top = 0.5 - shift[0] / self.width, 0.5 + shift[1] / self.height
        projection[2, 2] = 1.0
        if self.eye is None:
            projection[0, 0], projection[1, 1] = 1 / self.width, -1 / self.height
            projection[3, :2] = left, top
            projection[3, 3] = 1.0
        else:
            distance = float((self.center - self.eye) @ self.axis)
            # A point at camera (x, y, d) meets the plane at x * distance / d; w = d.
            projection[0, 0], projection[1, 1] = distance / self.width, -distance / self.height
            projection[2, :2] = left, top
            projection[2, 3] = 1.0
        return self.world_to_camera() @ projection


def camera_view(camera: PerspectiveCamera | OrthographicCamera, width: int, height: int) -> View:
    """The view of a scene's camera for a picture of `width` x `height` pixels.

    A perspective camera's plane lies through its target and is as large as the camera sees there; an orthographic
    camera's plane lies at its position.
    """
    position, target = np.array(camera.position, float), np.array(camera.target, float)
    axis = target - position
    distance = float(np.linalg.norm(axis))
    axis /= distance
    side = np.cross(axis, np.array(camera.up, float))
    side /= np.linalg.norm(side)
    up = np.cross(side, axis)
    lens_radius, focus_distance = 0.0, distance
    if isinstance(camera, PerspectiveCamera):
        lens_radius = camera.lens_radius
        focus_distance = camera.focus_distance if camera.focus_distance is not None else distance
        plane_height = 2.0 * distance * float(np.tan(np.radians(camera.fov) / 2))
        center, eye = target, position
    else:
        plane_height, center, eye = camera.height, position, None
    plane_width = plane_height * width / height
    return View(center, side, up, axis, plane_width, plane_height, eye, position, lens_radius, focus_distance)


def plane_view(plane: Placed, width: int, height: int) -> View:
    """A plane as it lies in space, seen from straight above: an orthographic view whose depth is 0 on the plane.

    All of the plane is in the picture: one that is narrower or wider than the picture has more of space beside it.
    """
    center, side, up, normal = (
        np.array(vector, float) for vector in (plane.center, plane.side, plane.up, plane.normal)
    )
    shown = max(plane.height, plane.width * height / width)
    return View(center, side, up, -normal, shown * width / height, shown, None, center)


def middle_view(
    stereo: Stereo,
    camera: PerspectiveCamera | OrthographicCamera,
    width: int,
    height: int,
    share: float = 1.0,
) -> View:
    """What the cyclopean eye of a viewer sees, who sits `stereo.screen_distance` before the middle of the screen.

    Its plane lies on the screen: the one through the camera's target, as large as the camera sees there, or
    `stereo.plane`. The scale of the scene follows from its width (thesis, 3.3.1), and so does where the eye is:
    screen_distance before the plane's middle, in that scale.

    Args:
        width, height: of the picture, pixels (square ones on the screen).
        share: the part of the screen's width that the picture takes up.
    """
    lens_radius, focus_distance = 0.0, None
    if isinstance(camera, PerspectiveCamera):
        lens_radius, focus_distance = camera.lens_radius, camera.focus_distance
    if stereo.plane is None:
        mono = camera_view(camera, width, height)
        center, side, up, axis = mono.center, mono.side, mono.up, mono.axis
        plane_width, plane_height = mono.width, mono.height
    else:
        plane = stereo.plane
        center, normal = np.array(plane.center, float), np.array(plane.normal, float)
        axis = -normal / np.linalg.norm(normal)
        side = np.cross(axis, np.array(plane.up, float))
        side /= np.linalg.norm(side)
        up = np.cross(side, axis)
        plane_width = plane.width
        plane_height = plane.height if plane.height is not None else plane.width * height / width
    distance = stereo.screen_distance * plane_width / (stereo.screen_width * share)
    eye = center - distance * axis
    focus = focus_distance if focus_distance is not None else distance
    return View(center, side, up, axis, plane_width, plane_height, eye, eye, lens_radius, focus)


def eye_view(middle: View, stereo: Stereo, eye: Eye) -> View:
    """What one of the viewer's eyes sees, from what the cyclopean one does.

    `off_axis`: both look at the same rectangle, each from its own side, so that it has no parallax. `parallel`: each
    looks straight on at its own rectangle, so that the infinitely far has none. `toe_in`: each turns to the
    rectangle's middle, which gives points beside it a vertical parallax.
    """
    if eye.name == "middle" or middle.eye is None:
        return middle
    distance = float((middle.center - middle.eye) @ middle.axis)
    relation = distance / stereo.screen_distance
    half = relation * stereo.interpupillary_distance * stereo.separation / 2
    offset = (half if eye.name == "right" else -half) * middle.side
    place = middle.eye + offset
    if stereo.convergence == "off_axis":
        return replace(middle, eye=place, origin=place)
    if stereo.convergence == "parallel":
        return replace(middle, eye=place, origin=place, center=middle.center + offset)
    axis = middle.center - place
    farther = float(np.linalg.norm(axis))
    axis /= farther
    side = np.cross(axis, middle.up)
    side /= np.linalg.norm(side)
    grown = farther / distance
    return replace(
        middle,
        eye=place,
        origin=place,
        axis=axis,
        side=side,
        up=np.cross(side, axis),
        width=middle.width * grown,
        height=middle.height * grown,
        focus_distance=middle.focus_distance * grown,
    )


def scene_view(scene: Scene, eye: Eye = MIDDLE) -> View:
    """What a scene's picture shows: the plane of the cut-plane renderer, else what its camera or an eye sees.

    Args:
        eye: whose picture it is, of a stereo scene (see `seen_by`).
    """
    width, height = scene.image.width * eye.wide, scene.image.height * eye.high
    if isinstance(scene.renderer, CutPlaneRenderer):
        # A flat picture: it lies on the screen for both eyes.
        return plane_view(scene.renderer.plane.placed, width, height)
    if scene.stereo is None:
        return camera_view(scene.camera, width, height)
    return eye_view(middle_view(scene.stereo, scene.camera, width, height, eye.share), scene.stereo, eye)


def seen_by(scene: Scene, name: EyeName) -> tuple[Scene, Eye]:
    """A stereo scene as one eye sees it, and that eye: the scene's image is the eye's own (half as large if squeezed)."""
    assert scene.stereo is not None
    wide, high = scene.stereo.squeeze
    eye = Eye(name, wide, high)
    if (wide, high) == (1, 1):
        return scene, eye
    # Squeezed pixels are taller: the eye's whole picture has the reference of the scene's, in its own pixels.
    image = scene.image.part(scene.image.width // wide, scene.image.height // high)
    return scene.model_copy(update={"image": image}), eye


def shown_views(scene: Scene, eye: Eye = MIDDLE) -> list[tuple[Scene, Eye, Place]]:
    """The views of a scene's picture as an eye sees them, and where each stands; without a layout there is one.

    Raises:
        SceneError: there is no room for a view.
    """
    if scene.layout is None:
        return [(scene, eye, Place(0, 0, scene.image.width, scene.image.height))]
    # Each takes up a part of the screen.
    return [
        (view, replace(eye, share=eye.share * place.width / scene.image.width), place)
        for view, place in scene.views
    ]
