"""Work beside the picture of a window, on its device: small pictures for panels, and stills of any size."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from clfractal.device.cancel import CancelToken
from clfractal.engine.finish import save_job
from clfractal.engine.job import Job
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare
from clfractal.engine.preview import Preview
from clfractal.engine.run import Progress, run
from clfractal.engine.settle import settled
from clfractal.errors import ClfractalError, Stopped
from clfractal.images.develop import rgb8
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from clfractal.viewer.fitting import Cancellable, measured_exposure, with_exposure
from clfractal.viewer.preparing import internal_error

Pixels = npt.NDArray[np.uint8]
Tell = Callable[[str], None]


class Task(Protocol):
    """Work that is done bit by bit, whenever the window's own picture leaves time."""

    @property
    def finished(self) -> bool:
        """Whether nothing is left to do: it is done, was cancelled, or has failed."""

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Tell) -> None:
        """Goes on with it until nothing is left for the device, or the token is set.

        Raises:
            ClfractalError: it failed; `failed` is called next.
            Stopped: the token was set; it is called again later, perhaps with another device's executor.
        """

    def failed(self, error: ClfractalError) -> None:
        """It cannot be done."""


def do_some(task: Task, executor: LocalExecutor, token: CancelToken, tell: Tell) -> None:
    """Works on a task; a mistake of its is the task's problem.

    Raises:
        Stopped: the token was set, and it is not finished.
    """
    try:
        if not task.finished:
            task.work(executor, token, tell)
    except Stopped:
        if not task.finished:
            raise
    except ClfractalError as error:
        task.failed(error)
    except Exception as error:  # the picture goes on
        task.failed(internal_error(error))


def prepared(
    scene: Scene,
    executor: LocalExecutor,
    token: CancelToken,
    tell: Tell,
    *,
    colors: bool,
    exposed_in: Scene | None = None,
) -> Job:
    """The job of a scene's picture.

    Args:
        colors: with the colour channels alone.
        exposed_in: the scene in which an exposure of `auto` is measured; None: `scene`.
    """
    channels = ("R", "G", "B", "A") if colors else None
    if colors:
        scene = scene.model_copy(update={"output": scene.output.model_copy(update={"denoise": False})})
    preview = Preview(executor.device, Cancellable(executor, token))
    if exposed_in is not None and isinstance(scene.output.exposure, str):
        scene = with_exposure(scene, measured_exposure(exposed_in, preview))
    scene = settled(scene, preview)
    return prepare(scene, executor.device, channels=channels, on_start=tell)


class _Picture:
    """A picture that is rendered bit by bit, whenever the window's own leaves time; see `Task`.

    Attributes:
        problem: why there is none, or empty.
        cancelled: whether it is not needed any more.
    """

    def __init__(self) -> None:
        self.problem = ""
        self.cancelled = False
        self._framebuffers: JobFramebuffers | None = None
        self._token: CancelToken | None = None

    def cancel(self) -> None:
        """It is not needed any more."""
        self.cancelled = True
        token = self._token
        if token is not None:
            token.cancel()

    def _rendered(
        self,
        executor: LocalExecutor,
        token: CancelToken,
        job: Callable[[], Job],
        progress: Callable[[Progress], None] | None = None,
    ) -> JobFramebuffers | None:
        """The whole picture of a job, which is made anew for another device; None if it was cancelled."""
        self._token = token
        if self.cancelled:
            return None
        if self._framebuffers is None or self._framebuffers.job.device != executor.device.info:
            self._framebuffers = JobFramebuffers(job())
        found = self._framebuffers
        run(found.job, found.framebuffers, executor, token=token, progress=progress)
        self._framebuffers = self._token = None
        return found


class Thumbnail(_Picture):
    """A small picture of a scene, 8-bit RGBA.

    Args:
        load: gives the scene, in the session's thread.
        size: width and height, pixels.
        samples: of a pixel.

    Attributes:
        pixels: shape (height, width, 4), when it is finished.
    """

    def __init__(self, load: Callable[[], Scene], size: tuple[int, int], samples: int = 1) -> None:
        super().__init__()
        self._load, self.size, self.samples = load, size, samples
        self.pixels: Pixels | None = None
        self.framebuffer: Framebuffer | None = None

    @property
    def finished(self) -> bool:
        """See `Task`."""
        return self.pixels is not None or bool(self.problem) or self.cancelled

    def failed(self, error: ClfractalError) -> None:
        """See `Task`."""
        self.problem = error.message

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Tell) -> None:
        """See `Task`."""
        found = self._rendered(
            executor, token, lambda: prepared(self._scene(), executor, token, tell, colors=True)
        )
        if found is not None:
            self.framebuffer = found.picture()
            self.pixels = opaque(rgb8(self.framebuffer, found.development))

    def _scene(self) -> Scene:
        scene = self._load()
        renderer = scene.renderer.model_copy(
            update={"samples": self.samples, "noise": None, "min_samples": None}
        )
        image = scene.image.resized(*self.size)
        return scene.model_copy(update={"image": image, "renderer": renderer, "stereo": None})


def opaque(colors: Pixels) -> Pixels:
    """8-bit colours, shape (height, width, 3), with an opaque fourth channel."""
    return np.concatenate([colors, np.full((*colors.shape[:2], 1), 255, np.uint8)], axis=-1)


class Still(_Picture):
    """A picture of any size, rendered in the background and written to files.

    Attributes:
        share: how much of it is done, 0 to 1.
        written: the files, when it is done.
    """

    def __init__(
        self,
        scene: Scene,
        paths: tuple[Path, ...],
        header: dict[str, Any] | None = None,
        *,
        exposed_in: Scene | None = None,
    ) -> None:
        super().__init__()
        self.scene, self.paths, self._exposed_in = scene, paths, exposed_in
        self.share = 0.0
        self.written: tuple[Path, ...] = ()
        self.remaining: float | None = None
        self._header = header or {}
        self._writer: threading.Thread | None = None

    @property
    def finished(self) -> bool:
        """See `Task`."""
        return bool(self.written) or bool(self.problem) or self.cancelled

    def cancel(self) -> None:
        """Ends it; nothing is written, unless its files are being written already."""
        if self._writer is None:
            super().cancel()

    def finish_writing(self) -> None:
        """Waits until its files are complete, if they are being written; a process must not end before."""
        if self._writer is not None:
            self._writer.join()

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Tell) -> None:
        """See `Task`."""
        found = self._rendered(
            executor,
            token,
            lambda: prepared(self.scene, executor, token, tell, colors=False, exposed_in=self._exposed_in),
            self._told,
        )
        if found is not None:
            # The device is free for the next picture meanwhile.
            write, name = partial(self._write, found), "clfractal-still"
            self._writer = threading.Thread(target=write, name=name, daemon=True)
            self._writer.start()

    def failed(self, error: ClfractalError) -> None:
        """See `Task`."""
        self.problem = str(error)

    def _write(self, framebuffers: JobFramebuffers) -> None:
        job, header = framebuffers.job, {**framebuffers.job.header(), **self._header}
        try:
            save_job(job, framebuffers.framebuffers, self.paths, header)
            self.written = self.paths
        except ClfractalError as error:
            self.failed(error)
        except Exception as error:  # a panel shows it
            self.failed(internal_error(error))

    def _told(self, state: Progress) -> None:
        self.share = state.tiles_done / max(state.tiles, 1)
        self.remaining = state.remaining
