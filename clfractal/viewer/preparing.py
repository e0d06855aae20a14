"""What a picture needs before its first ray, made in a thread: programs, grids, measures."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from clfractal.device.cancel import CancelToken
from clfractal.engine.job import Job
from clfractal.errors import ClfractalError, DeviceError, Stopped
from clfractal.integrators.kept import Kept
from clfractal.scene.deeper import camera_told_anew
from clfractal.scene.model import Scene
from clfractal.viewer.frame import Frame
from clfractal.viewer.kept_view import cameras_of, with_cameras


@dataclass(frozen=True, slots=True)
class Wanted:
    """A picture that was asked for.

    Attributes:
        number: of the request.
        scene: with the size of the viewport.
        moving: whether more requests will follow soon.
        region: x, y, width, height of the only part to refine, pixels of each eye's picture; None: all.
        exposed_in: the scene in which an exposure of `auto` is measured; None: `scene`.
    """

    number: int
    scene: Scene
    moving: bool
    region: tuple[int, int, int, int] | None = None
    exposed_in: Scene | None = None


class Preparation:
    """A thread that makes what one picture needs, and ends.

    Args:
        wanted: the picture.
        work: makes what it needs, and gives what has to be kept for it.
        done: called from the thread when it has ended, unless it was cancelled.

    Attributes:
        finished: whether it has ended.
        kept: what `work` gave.
        error: why there is nothing; None if there is.
    """

    def __init__(
        self, wanted: Wanted, work: Callable[[Wanted, CancelToken], Kept], done: Callable[[], None]
    ) -> None:
        self.wanted = wanted
        self.finished = False
        self.kept: Kept | None = None
        self.error: ClfractalError | None = None
        self._work, self._done = work, done
        self._token = CancelToken()
        self._thread = threading.Thread(target=self._run, name="clfractal-preparing", daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """It is not needed any more."""
        self._token.cancel()

    def join(self, timeout: float | None) -> None:
        """Waits for its end; seconds."""
        self._thread.join(timeout)

    def _run(self) -> None:
        try:
            self.kept = self._work(self.wanted, self._token)
        except Stopped:
            return
        except ClfractalError as error:
            self.error = error
        except Exception as error:  # a mistake of ours must not freeze the window
            self.error = internal_error(error)
        self.finished = True
        self._done()


def seen_from(scene: Scene, by: Scene) -> Scene | None:
    """A scene as another one looks at it: by its cameras, in its size, for its screen; None if that is not possible."""
    try:
        cameras = [
            each if each is None else camera_told_anew(each, by.deep, scene.deep)
            for each in cameras_of(by)[: len(cameras_of(scene))]
        ]
        seen = with_cameras(scene, cameras)
        if seen.image == by.image and seen.stereo == by.stereo:
            return seen
        return seen.model_copy(update={"image": by.image, "stereo": by.stereo})
    except ClfractalError:
        return None


def differs_by_view(one: Scene, other: Scene) -> bool:
    """Whether two scenes show the same from different places, or in different sizes."""
    seen = seen_from(one, other)
    return seen is not None and seen == other


def internal_error(error: Exception) -> DeviceError:
    """A mistake of ours, as a line for the user."""
    return DeviceError(f"internal error, please report it: {type(error).__name__}: {error}")


def sharp(scene: Scene) -> Scene:
    """A scene without motion blur, whose noise would hide a coarse picture."""
    return scene.model_copy(update={"animation": None}) if scene.animation is not None else scene


def shows_whole(front: Frame | None, wanted: Wanted) -> bool:
    """Whether a frame is a whole picture of the wanted scene."""
    return (
        front is not None
        and not wanted.moving
        and front.divider == 1
        and not front.carried
        and front.samples > 0
        and front.scene == wanted.scene
    )


def stands(front: Frame | None, job: Job, wanted: Wanted) -> bool:
    """Whether a picture that moved has come to rest: it is shown until the whole one takes its place."""
    if front is None or not front.carried or wanted.moving or wanted.region is not None:
        return False
    return front.job.scene == job.scene
