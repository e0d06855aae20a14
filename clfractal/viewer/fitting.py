"""What a window measures before a picture that rests; while it moves the last measures go along."""

from __future__ import annotations

from collections.abc import Generator, Iterable

import numpy as np

from clfractal.camera.views import camera_view
from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.engine.job import Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.preview import Preview
from clfractal.engine.run import Executor, Result, WorkItem
from clfractal.engine.settle import is_settled, settled
from clfractal.errors import ClfractalError, SceneError
from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera
from clfractal.scene.stereo import Stereo


class Cancellable:
    """An executor whose work a token ends, for callers that know of none."""

    def __init__(self, executor: Executor, token: CancelToken) -> None:
        self._executor, self._token = executor, token

    def execute(
        self, job: Job, items: Iterable[WorkItem], token: CancelToken | None = None
    ) -> Generator[Result]:
        """See `Executor`."""
        return self._executor.execute(job, items, self._token)


def measured_exposure(scene: Scene, preview: Preview) -> float:
    """The exposure of a scene with `auto`, stops.

    Raises:
        DeviceError, KernelBuildError: as of a render.
        Stopped: the preview was ended.
    """
    try:
        return settled(scene, preview).output.stops
    except SceneError:
        return settled(_unfitted(scene), preview).output.stops


def with_exposure(scene: Scene, stops: float) -> Scene:
    """The scene with an exposure, stops."""
    return scene.model_copy(update={"output": scene.output.model_copy(update={"exposure": stops})})


def _unfitted(scene: Scene) -> Scene:
    """A scene without `stereo.fit`, in which nothing is in sight, for example: the plane stays at the camera's target."""
    assert scene.stereo is not None
    return scene.model_copy(update={"stereo": scene.stereo.model_copy(update={"fit": None})})


class Fits:
    """Settles scenes (see `settle.settled`), and remembers the last one."""

    def __init__(self, device: Device, executor: LocalExecutor) -> None:
        self._device, self._executor = device, executor
        self._last: tuple[Scene, Scene] | None = None
        self._exposed: tuple[Scene, float] | None = None

    def fitted(
        self,
        scene: Scene,
        moving: bool,
        token: CancelToken,
        exposed_in: Scene | None = None,
        executor: LocalExecutor | None = None,
    ) -> Scene:
        """The scene with all that is to be measured; as it is if that is nothing. Where nothing is in sight, defaults.

        While it moves the last measures are used, at the same distances from the camera.

        Args:
            exposed_in: the scene in which an exposure of `auto` is measured; None: `scene`.
            executor: for previews, in the place of the usual one: another thread has its own.

        Raises:
            DeviceError, KernelBuildError: as of a render.
            Stopped: the token was set.
            NotReady: a preview needs what is not there, and the executor does not wait.
        """
        preview = Preview(self._device, Cancellable(executor or self._executor, token))
        if exposed_in is not None and isinstance(scene.output.exposure, str):
            known = self._exposed
            if known is None or not (moving or known[0] is exposed_in or known[0] == exposed_in):
                known = self._exposed = (exposed_in, measured_exposure(exposed_in, preview))
            scene = with_exposure(scene, known[1])
        if is_settled(scene):
            return scene
        if self._last is not None and self._last[0] == scene:
            return self._last[1]
        if moving and self._last is not None:
            return _carried(self._last[1], scene)
        try:
            found = settled(scene, preview)
        except SceneError:
            return settled(_unfitted(scene), preview)
        self._last = (scene, found)
        return found


def _carried(before: Scene, scene: Scene) -> Scene:
    """A scene with the measures of the settled one before: exposure, what is sharp, and how far the screen is."""
    output = scene.output
    if isinstance(output.exposure, str):
        output = output.model_copy(update={"exposure": before.output.stops})
    camera, old = scene.camera, before.camera
    if isinstance(camera, PerspectiveCamera) and camera.measured_focus is not None:
        distance = old.focus_distance if isinstance(old, PerspectiveCamera) else None
        camera = camera.model_copy(update={"focus": None, "focus_on": None, "focus_distance": distance})
    scene = scene.model_copy(update={"output": output, "camera": camera})
    if scene.stereo is None or scene.stereo.fit is None or before.stereo is None:
        return scene
    return _carried_screen(before, scene)


def _carried_screen(before: Scene, scene: Scene) -> Scene:
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
