"""Which part of the scene a place of the picture belongs to, as views of a layout have their own cameras."""

from __future__ import annotations

from dataclasses import dataclass

from clfractal.camera.views import View, scene_view
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.deeper import magnification_of, told_anew
from clfractal.scene.model import Scene
from clfractal.scene.parts import OrthographicCamera, PerspectiveCamera
from clfractal.scene.rectangle import Plane
from clfractal.scene.stereo import MIDDLE
from clfractal.viewer.picking import Pick
from clfractal.viewer.pointer import vector
from clfractal.viewer.sight import sight_in


@dataclass(frozen=True, slots=True, eq=False)
class Aim:
    """What a pointer moves.

    Attributes:
        camera_path: where the camera is written in the scene.
        plane_path: where the plane is, if the view shows one; else empty.
        scene: of the view, as rendered.
        x, y: the pointer's place in the view's picture, pixels.
        size: of that picture, pixels.
        depth: under the pointer; infinite where nothing is.
        point: in space, under the pointer; None where nothing is.
        view: what the eye between both eyes sees.
        pivot: what orbits turn about: the point under the pointer, else what is at the picture's middle.
    """

    camera_path: str
    plane_path: str
    scene: Scene
    x: float
    y: float
    size: tuple[int, int]
    depth: float
    point: tuple[float, float, float] | None
    view: View
    pivot: tuple[float, float, float]

    @property
    def camera(self) -> PerspectiveCamera | OrthographicCamera:
        """The camera that the view has."""
        return self.scene.camera

    @property
    def plane(self) -> Plane | None:
        """The plane that the view shows, if it shows one."""
        renderer = self.scene.renderer
        return renderer.plane if isinstance(renderer, CutPlaneRenderer) else None


def aimed(scene: Scene, pick: Pick) -> Aim:
    """What lies under a pick, in the present scene (which may be newer than the picture)."""
    number, shown = pick.view.number, pick.view.scene
    camera_path, plane_path, seen = "camera", "", scene
    if scene.layout is not None and number < len(scene.layout.views):
        own = scene.layout.views[number]
        seen = scene.views[number][0]
        if own.camera is not None:
            camera_path = f"layout.views.{number}.camera"
        if isinstance(seen.renderer, CutPlaneRenderer):
            plane_path = (
                f"layout.views.{number}.renderer.plane" if own.renderer is not None else "renderer.plane"
            )
    elif isinstance(scene.renderer, CutPlaneRenderer):
        plane_path = "renderer.plane"
    seen = seen.model_copy(update={"image": shown.image})
    # The picture may be of another place, from before the scene went deeper.
    depth = pick.depth * magnification_of(seen.deep) / magnification_of(shown.deep)
    point = None if pick.point is None else told_anew(pick.point, shown.deep, seen.deep)
    squeezed = (pick.view.eye.wide, pick.view.eye.high)
    middle = scene_view(seen, MIDDLE if seen.stereo is None else pick.view.eye.__class__("middle", *squeezed))
    return Aim(
        camera_path,
        plane_path,
        seen,
        pick.x,
        pick.y,
        pick.size,
        depth,
        point,
        middle,
        told_anew(_pivot(seen, pick), shown.deep, seen.deep) if point is None else point,
    )


def _pivot(scene: Scene, pick: Pick) -> tuple[float, float, float]:
    """Of the picture's own place."""
    if pick.depths is None or isinstance(scene.renderer, CutPlaneRenderer):
        return told_anew(scene.camera.target, scene.deep, pick.view.scene.deep)
    return vector(sight_in(scene, pick.view, pick.depths).pivot())
