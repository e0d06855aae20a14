"""`stereo.fit` in a window: the depth is fitted when the picture rests, and moves along with the viewer until then."""

from __future__ import annotations

from collections.abc import Generator, Iterable

import numpy as np

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.errors import ClfractalError, SceneError
from clfractal.optics.view import camera_view
from clfractal.scene.model import Scene
from clfractal.scene.stereo import Stereo
from clfractal.work.comfort import Look, fitted
from clfractal.work.job import Job
from clfractal.work.local import LocalExecutor
from clfractal.work.run import Executor, Result, WorkItem


class Cancellable:
    """An executor whose work a token ends, for callers that know of none."""

    def __init__(self, executor: Executor, token: CancelToken) -> None:
        self._executor, self._token = executor, token

    def execute(
        self, job: Job, items: Iterable[WorkItem], token: CancelToken | None = None
    ) -> Generator[Result]:
        """See `Executor`."""
        return self._executor.execute(job, items, self._token)


class Fits:
    """Fits stereo scenes, and remembers the last fit."""

    def __init__(self, device: Device, executor: LocalExecutor) -> None:
        self._device, self._executor = device, executor
        self._last: tuple[Scene, Scene] | None = None

    def fitted(self, scene: Scene, moving: bool, token: CancelToken) -> Scene:
        """The scene with `stereo.fit` carried out; as it is if it asks for none, or if there is nothing to fit to.

        While it moves the last fit is used, at the same distance from the camera.

        Raises:
            DeviceError, KernelBuildError: as of a render.
            Stopped: the token was set.
        """
        stereo = scene.stereo
        if stereo is None or stereo.fit is None:
            return scene
        if self._last is not None and self._last[0] == scene:
            return self._last[1]
        if moving and self._last is not None:
            return _carried(self._last[1], scene)
        try:
            found = fitted(scene, Look(self._device, Cancellable(self._executor, token)))
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
