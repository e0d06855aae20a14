"""The engine: one device and an executor that keeps its programs and data from picture to picture."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from functools import partial
from typing import TYPE_CHECKING

from clfractal import arguments
from clfractal.device.cancel import CancelToken
from clfractal.device.forked import is_lost
from clfractal.device.launch import BUDGET_SECONDS
from clfractal.device.select import Device, choose
from clfractal.scene.load import as_scene
from clfractal.scene.model import Scene
from clfractal.work.any_engine import AnyEngine, Elsewhere, SceneLike, check_token
from clfractal.work.job import Job
from clfractal.work.local import LocalExecutor
from clfractal.work.prepare import prepare
from clfractal.work.settle import is_settled, settled

if TYPE_CHECKING:
    from clfractal.pictures.film import Film
    from clfractal.pictures.probe import Probe
    from clfractal.work.look import Look
    from clfractal.work.refine import Refinement


class Engine(AnyEngine):
    """Renders scenes on one device, and keeps unchanged data from one to the next: programs, buffers, grids, maps.

        with clfractal.Engine() as engine:
            for angle in range(60):
                film = engine.render(turned(scene, angle))

    Only one thread may use it at a time; a second one gets an error.

    Args:
        device: `cpu`, `gpu`, `PLATFORM:DEVICE`, or part of a name; None: CLFRACTAL_DEVICE, else the best. Or a `Device`.
        budget_seconds: limit of the work that is queued on the device: a cancelled render ends after about this time.
        tell: called with a message if something has to be compiled or measured first, or does not fit.

    Raises:
        SceneError: another argument is wrong.
        DeviceError: no device, or an unknown one.
    """

    executor: LocalExecutor

    def __init__(
        self,
        device: str | Device | None = None,
        *,
        budget_seconds: float = BUDGET_SECONDS,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        budget_seconds = arguments.number("budget_seconds", budget_seconds, 1e-4, 60)
        arguments.function("tell", tell)
        self.device = device if isinstance(device, Device) else choose(device)
        self.tell = tell
        self.executor = LocalExecutor(self.device, budget_seconds=budget_seconds, tell=tell)
        # A separate executor for looks: their size differs, so they would replace a picture's buffers.
        self._looking = LocalExecutor(self.device, budget_seconds=budget_seconds, tell=tell)
        self._looking.kept = self.executor.kept
        super().__init__()

    def close(self) -> None:
        """Frees the device's memory; the engine cannot be used afterwards. A second call does nothing."""
        if is_lost():  # a forked process leaves what belongs to its parent
            self._closed = True
        if self._closed:
            return
        with self._alone():
            self.executor.close()
            self._looking.close()
            self._closed = True

    @property
    def look(self) -> Look:
        """Quick looks at a scene, on the engine's device."""
        from clfractal.work.look import Look

        return Look(self.device, self._looking)

    def settled(self, scene: SceneLike) -> Scene:
        """The scene with numbers in the place of `stereo.fit`, `camera.focus`, `focus_on` and `output.exposure: auto`.

        Each picture of a scene measures them anew; frames of a film that are made from a settled scene have the same ones.

        Raises:
            SceneError, FormulaError: the scene is wrong, or there is nothing to fit to.
            DeviceError, KernelBuildError: as of a render.
        """
        with self._alone():
            return settled(as_scene(scene), self.look)

    def prepare(
        self,
        scene: SceneLike,
        *,
        precision: str | None = None,
        samples: int | None = None,
        region: tuple[int, int, int, int] | None = None,
        channels: Sequence[str] | None = None,
        quality: str | None = None,
    ) -> Job:
        """The job of a scene's picture: see `prepare.prepare`; what it leaves to be measured is measured first.

        Raises:
            SceneError, FormulaError: the scene or a setting is wrong, or there is nothing to fit to.
            DeviceError, KernelBuildError: the quick look that this takes failed.
        """
        built_before = self.device.loaded.building.milliseconds
        loaded = as_scene(scene)
        if quality is not None:
            from clfractal.work.quality import with_quality

            loaded = with_quality(loaded, quality)
        decide = partial(
            prepare,
            device=self.device,
            precision=precision,
            samples=samples,
            region=region,
            channels=channels,
            on_start=self.tell,
        )
        # Made first, so that mistakes are reported before anything is rendered.
        job = decide(loaded)
        if not is_settled(loaded):
            job = decide(settled(loaded, self.look))
        self.looks_built_ms = self.device.loaded.building.milliseconds - built_before
        return job

    def probe(self, scene: SceneLike, x: int, y: int, *, precision: str | None = None) -> Probe:
        """What lies at a pixel of a scene's picture; arguments, result and errors as for `clfractal.probe`."""
        from clfractal.work.probing import checked_pixel, probed

        with self._alone():
            job = self.prepare(scene, precision=precision)
            return probed(job, *checked_pixel(x, y, job.region), self.look)

    def refine(
        self,
        scene: SceneLike,
        *,
        precision: str | None = None,
        samples: int | None = None,
        region: tuple[int, int, int, int] | None = None,
        channels: Sequence[str] | None = None,
        quality: str | None = None,
        token: CancelToken | None = None,
    ) -> Refinement:
        """Films of a scene from coarse to finished: every 8th, 4th and 2nd pixel, then all with more and more samples.

        Each film has the full size. The last one has the same bits as `render`. Between passes the device keeps some
        70 bytes per pixel (twice that in float64); if they do not fit, all samples are made in one pass. In a
        notebook the result is shown, and redrawn with every pass.

        Arguments and errors as for `render`.
        """
        from clfractal.work.refine import Refinement, refined

        check_token(token)

        def films() -> Generator[Film]:
            with self._alone():
                job = self.prepare(
                    scene,
                    precision=precision,
                    samples=samples,
                    region=region,
                    channels=channels,
                    quality=quality,
                )
                yield from refined(job, self.executor, token, looks_built_ms=self.looks_built_ms)

        return Refinement(films())


def engine_on(device: str | None, executor: Elsewhere | None) -> AnyEngine:
    """The engine of a device of this process, or of an executor that has its own devices.

    Raises:
        SceneError: both are given, or the executor is none.
        DeviceError: no device, or an unknown one.
    """
    if executor is None:
        return Engine(device)
    if not callable(getattr(executor, "engine", None)) or isinstance(executor, type):
        arguments.refuse("executor", "must be a clfractal.Cluster", arguments.plain(executor))
    if device is not None:
        arguments.refuse("device", "belongs to the cluster, as Cluster(address, device=...)", device)
    return executor.engine()
