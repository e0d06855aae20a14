"""`stereo.fit` in a window: the depth is fitted when the picture rests, and moves along with the viewer until then."""

from __future__ import annotations

import numpy as np

from clfractal.device.select import Device
from clfractal.errors import ClfractalError, SceneError
from clfractal.optics.view import camera_view
from clfractal.scene.model import Scene
from clfractal.scene.stereo import Stereo
from clfractal.work.comfort import Look, fitted
from clfractal.work.local import LocalExecutor


class Fits:
    """Fits stereo scenes, and remembers the last fit."""

    def __init__(self, device: Device, executor: LocalExecutor) -> None:
        self._look = Look(device, executor)
        self._last: tuple[Scene, Scene] | None = None

    def fitted(self, scene: Scene, moving: bool) -> Scene:
        """The scene with `stereo.fit` carried out; as it is if it asks for none, or if there is nothing to fit to.

        While it moves the last fit is used, at the same distance from the camera.
        """
        stereo = scene.stereo
        if stereo is None or stereo.fit is None:
            return scene
        if self._last is not None and self._last[0] == scene:
            return self._last[1]
        if moving and self._last is not None:
            return _carried(self._last[1], scene)
        try:
            found = fitted(scene, self._look)
        except SceneError:
            # Nothing is in sight, for example: the plane stays where the camera's target is.
            return scene.model_copy(update={"stereo": stereo.model_copy(update={"fit": None})})
        self._last = (scene, found)
        return found


def _carried(before: Scene, scene: Scene) -> Scene:
    """A scene with the screen as far from its camera as the fitted one before has it."""
    old, stereo = before.stereo, scene.stereo
    assert old is not None
    assert stereo is not None
    if old.plane is None:
        return _with(scene, stereo, {"fit": None, "separation": old.separation})
    size = (scene.image.width, scene.image.height)
    was, now = camera_view(before.camera, *size), camera_view(scene.camera, *size)
    distance = float((np.array(old.plane.center) - was.origin) @ was.axis)
    center = now.origin + distance * now.axis
    plane = old.plane.model_copy(
        update={
            "center": tuple(center.tolist()),
            "normal": tuple((-now.axis).tolist()),
            "up": tuple(now.up.tolist()),
        }
    )
    return _with(scene, stereo, {"fit": None, "separation": old.separation, "plane": plane})


def _with(scene: Scene, stereo: Stereo, update: dict[str, object]) -> Scene:
    try:
        return scene.model_copy(update={"stereo": stereo.model_copy(update=update)})
    except (ClfractalError, ValueError):
        return scene.model_copy(update={"stereo": stereo.model_copy(update={"fit": None})})
