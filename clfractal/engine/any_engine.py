"""What every engine can do, wherever its pictures are rendered."""

from __future__ import annotations

import threading
import time
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeAlias

from clfractal.device.cancel import CancelToken
from clfractal.device.forked import use_opencl
from clfractal.engine.job import Job
from clfractal.engine.run import Executor, ProgressCallback, run
from clfractal.errors import ClfractalError, SceneError, Where, arguments
from clfractal.images.denoise import check_installed
from clfractal.scene.load import as_scene
from clfractal.scene.model import Scene

if TYPE_CHECKING:
    from clfractal.engine.job_framebuffers import JobFramebuffers, Took
    from clfractal.engine.preview import Preview
    from clfractal.images.framebuffer import Framebuffer

SceneLike: TypeAlias = Scene | str | Path | Mapping[str, Any]


class Elsewhere(Protocol):
    """What renders outside of this process, such as a `clfractal.Cluster`."""

    def engine(self) -> AnyEngine:
        """An engine whose pictures are decided about, and rendered, there. Closing it leaves the rest as it is."""


class AnyEngine(ABC):
    """Decides about pictures and renders them. Only one thread may use it at a time."""

    executor: Executor

    def __init__(self) -> None:
        self._busy = threading.Lock()
        self._closed = False
        self.previews_built_ms = 0.0
        """Building programs for the previews of the last `prepare`, milliseconds."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Frees what the engine has; it cannot be used afterwards. A second call does nothing."""

    @property
    @abstractmethod
    def preview(self) -> Preview:
        """Previews of a scene."""

    @property
    def look(self) -> Preview:
        """The former name of `preview`."""
        warnings.warn("Engine.look is Engine.preview", DeprecationWarning, stacklevel=2)
        return self.preview

    @property
    def looks_built_ms(self) -> float:
        """The former name of `previews_built_ms`."""
        warnings.warn("Engine.looks_built_ms is Engine.previews_built_ms", DeprecationWarning, stacklevel=2)
        return self.previews_built_ms

    @abstractmethod
    def settled(self, scene: SceneLike) -> Scene:
        """See `Engine.settled`."""

    def prepare(
        self,
        scene: SceneLike,
        *,
        precision: str | None = None,
        samples: int | None = None,
        size: tuple[int, int] | None = None,
        region: tuple[int, int, int, int] | None = None,
        channels: Sequence[str] | None = None,
        quality: str | None = None,
        pictures: int = 1,
    ) -> Job:
        """The job of a scene's picture: see `prepare.prepare`; what it leaves to be measured is measured first.

        Args:
            pictures: how many like it are to be made.

        Raises:
            SceneError, FormulaError: the scene or a setting is wrong, or there is nothing to fit to.
            DeviceError, KernelBuildError: the preview that this takes failed.
            FileError: the picture is to be denoised, and the package for it is not installed.
        """
        asked: dict[str, Any] = {"precision": precision, "samples": samples, "region": region}
        asked |= {"channels": channels, "pictures": pictures}
        loaded = as_scene(scene)
        if size is not None:
            from clfractal.engine.prepare import with_size

            loaded = with_size(loaded, size)
        if quality is not None:
            from clfractal.engine.quality import with_quality

            loaded = with_quality(loaded, quality)
        job = self._prepared(loaded, asked)
        if job.denoises:
            check_installed()
        return job

    @abstractmethod
    def _prepared(self, scene: Scene, asked: Mapping[str, Any]) -> Job:
        """See `prepare`; `asked` are arguments of `prepare.prepare`."""

    def in_order(
        self, scenes: Iterable[Scene], wanted: Callable[[Job], bool], **settings: Any
    ) -> Generator[tuple[Job, bool]]:
        """The job of each scene, and whether it is wanted. An engine may render the wanted ones before they are asked for.

        Args:
            scenes: of a film; taken one by one.
            wanted: told each job once, in order.
            settings: see `prepare`.

        Raises:
            ClfractalError: what `scenes`, `wanted` or `prepare` raise, when it is that scene's turn.
        """
        for scene in scenes:
            job = self.prepare(scene, **settings)
            yield job, wanted(job)

    def render(
        self,
        scene: SceneLike,
        progress: ProgressCallback | None = None,
        *,
        precision: str | None = None,
        samples: int | None = None,
        size: tuple[int, int] | None = None,
        region: tuple[int, int, int, int] | None = None,
        channels: Sequence[str] | None = None,
        quality: str | None = None,
        token: CancelToken | None = None,
    ) -> Framebuffer:
        """Renders a scene into memory; arguments, result and errors as for `clfractal.render`.

        Args:
            token: ends the render when any thread cancels it; `clfractal.Stopped` is then raised.
        """
        start = time.perf_counter()
        arguments.function("progress", progress)
        check_token(token)
        with self._alone():
            job = self.prepare(
                scene,
                precision=precision,
                samples=samples,
                size=size,
                region=region,
                channels=channels,
                quality=quality,
            )
            return self._framebuffer(job, start, progress, token)

    def render_in_order(
        self, scenes: Iterable[Scene], progress: ProgressCallback | None = None, **settings: Any
    ) -> Generator[Framebuffer]:
        """The pictures of scenes, one after the other; an engine may render some before they are asked for.

        Arguments and errors as for `render`.
        """
        arguments.function("progress", progress)
        with closing(self.in_order(scenes, lambda _: True, **settings)) as jobs:
            start = time.perf_counter()
            for job, _ in jobs:
                with self._alone():
                    framebuffer = self._framebuffer(job, start, progress, None)
                yield framebuffer
                start = time.perf_counter()

    def _framebuffer(
        self, job: Job, start: float, progress: ProgressCallback | None, token: CancelToken | None
    ) -> Framebuffer:
        """The picture of a job, in memory; `start` is when the call began, by `time.perf_counter`."""
        if job.stays_apart:
            assert job.scene.stereo is not None
            raise SceneError(
                f"{job.scene.stereo.mode} keeps the two eyes' pictures apart; use render_pair, or another mode",
                Where(path="stereo.mode"),
            )
        framebuffers, took = self._run(job, start, progress, token)
        return framebuffers.picture(took)

    def _run(
        self, job: Job, start: float, progress: ProgressCallback | None, token: CancelToken | None
    ) -> tuple[JobFramebuffers, Took]:
        """Renders a job, and says what the call took."""
        from clfractal.engine.job_framebuffers import JobFramebuffers, Took

        framebuffers = JobFramebuffers(job)
        state = run(job, framebuffers.framebuffers, self.executor, progress=progress, token=token)
        return framebuffers, Took(state, 1e3 * (time.perf_counter() - start), self.previews_built_ms)

    def render_pair(
        self,
        scene: SceneLike,
        progress: ProgressCallback | None = None,
        *,
        precision: str | None = None,
        samples: int | None = None,
        size: tuple[int, int] | None = None,
        channels: Sequence[str] | None = None,
        quality: str | None = None,
        token: CancelToken | None = None,
    ) -> tuple[Framebuffer, Framebuffer]:
        """Renders both eyes' pictures of a stereo scene; arguments, result and errors as for `clfractal.render_pair`."""
        start = time.perf_counter()
        arguments.function("progress", progress)
        check_token(token)
        with self._alone():
            loaded = as_scene(scene)
            if loaded.stereo is None:
                raise SceneError("a pair needs a scene with a stereo section", Where(path="stereo"))
            if loaded.stereo.mode not in ("pair", "split_half", "over_under_half"):
                # The other modes may need only parts of a pair.
                stereo = loaded.stereo.model_copy(update={"mode": "pair"})
                loaded = loaded.model_copy(update={"stereo": stereo})
            job = self.prepare(
                loaded, precision=precision, samples=samples, size=size, channels=channels, quality=quality
            )
            framebuffers, took = self._run(job, start, progress, token)
            eyes = framebuffers.eyes(took)
            return eyes["left"], eyes["right"]

    @contextmanager
    def _alone(self) -> Iterator[None]:
        use_opencl()
        if self._closed:
            raise ClfractalError("this engine is closed")
        if not self._busy.acquire(blocking=False):
            raise ClfractalError(
                "this engine is already in use; give each thread its own engine, or finish the refinement first"
            )
        try:
            yield
        finally:
            self._busy.release()


def check_token(token: Any) -> None:
    """Refuses what is no token."""
    if token is not None and not isinstance(token, CancelToken):
        arguments.refuse("token", "must be a CancelToken", arguments.plain(token))
