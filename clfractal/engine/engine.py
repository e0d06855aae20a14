"""The engine: a device, or several, with programs and data that stay from picture to picture."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from clfractal.device.cancel import CancelToken
from clfractal.device.choice import choose_all
from clfractal.device.forked import is_lost
from clfractal.device.launch import BUDGET_SECONDS
from clfractal.device.select import Device, choose, has_float64
from clfractal.engine.any_engine import AnyEngine, Elsewhere, SceneLike, check_token
from clfractal.engine.job import Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare
from clfractal.engine.settle import is_settled, settled
from clfractal.errors import (
    STATUS_BAD_INPUT,
    STATUS_DEVICE_FAILED,
    DeviceError,
    KernelBuildError,
    Where,
    arguments,
)
from clfractal.scene.load import as_scene
from clfractal.scene.model import Scene

if TYPE_CHECKING:
    from clfractal.engine.preview import Preview
    from clfractal.engine.refine import Refinement
    from clfractal.engine.several import SeveralExecutor
    from clfractal.images.framebuffer import Framebuffer
    from clfractal.images.probe import Probe

T = TypeVar("T")


class Engine(AnyEngine):
    """Renders scenes on a device or several, and keeps unchanged data from one to the next: programs, buffers, grids, maps.

        with clfractal.Engine() as engine:
            for angle in range(60):
                framebuffer = engine.render(turned(scene, angle))

    Only one thread may use it at a time; a second one gets an error.

    Args:
        device: `cpu`, `gpu`, `PLATFORM:DEVICE`, or part of a name; `cpu/2+2` for parts of a device, with so many compute
            units each; `all`; or a list of names. None: CLFRACTAL_DEVICE, else the best. Or a `Device`, or several. Each
            of several devices renders tiles as it has room.
        budget_seconds: limit of the work that is queued on the device: a cancelled render ends after about this time.
        tell: called with a message if something has to be compiled or measured first, or does not fit.

    Raises:
        SceneError: another argument is wrong.
        DeviceError: no device, or an unknown one.
    """

    def __init__(
        self,
        device: str | Device | Sequence[str | Device] | None = None,
        *,
        budget_seconds: float = BUDGET_SECONDS,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        budget_seconds = arguments.number("budget_seconds", budget_seconds, 1e-4, 60)
        arguments.function("tell", tell)
        self.tell = tell
        devices = _devices(device)
        self.executor: LocalExecutor | SeveralExecutor
        if len(devices) == 1:
            self.executor = LocalExecutor(devices[0], budget_seconds=budget_seconds, tell=tell)
        else:
            from clfractal.engine.several import SeveralExecutor

            self.executor = SeveralExecutor.on(devices, budget_seconds=budget_seconds, tell=tell)
        # Separate executors for previews: their size differs, so they would replace a picture's buffers.
        self._previewing: dict[int, LocalExecutor] = {}
        self._budget_seconds = budget_seconds
        super().__init__()

    def close(self) -> None:
        """Frees the device's memory; the engine cannot be used afterwards. A second call does nothing."""
        if is_lost():  # a forked process leaves what belongs to its parent
            self._closed = True
        if self._closed:
            return
        with self._alone():
            self.executor.close()
            own = self.executor
            for executor in [own] if isinstance(own, LocalExecutor) else own.answering:
                if id(executor) in self._previewing:
                    self._previewing[id(executor)].close()
            self._closed = True

    @property
    def device(self) -> Device:
        """The device that decisions are made for: of several that work the first with float64, else the first."""
        return self._first.device

    @property
    def preview(self) -> Preview:
        """Previews of a scene, on the engine's device."""
        from clfractal.engine.preview import Preview

        first = self._first
        executor = self._previewing.get(id(first))
        if executor is None:
            executor = LocalExecutor(first.device, budget_seconds=self._budget_seconds, tell=self.tell)
            executor.kept = first.kept
            self._previewing[id(first)] = executor
        return Preview(first.device, executor)

    @property
    def _first(self) -> LocalExecutor:
        if isinstance(self.executor, LocalExecutor):
            return self.executor
        working = self.executor.working or self.executor.executors
        return next((each for each in working if has_float64(each.device.info)), working[0])

    def settled(self, scene: SceneLike) -> Scene:
        """The scene with numbers in the place of `stereo.fit`, `camera.focus`, `focus_on` and `output.exposure: auto`.

        Each picture of a scene measures them anew; frames of a film that are made from a settled scene have the same ones.

        Raises:
            SceneError, FormulaError: the scene is wrong, or there is nothing to fit to.
            DeviceError, KernelBuildError: as of a render.
        """
        with self._alone():
            loaded = as_scene(scene)
            return self._by_any_device(lambda: settled(loaded, self.preview))

    def _prepared(self, scene: Scene, asked: Mapping[str, Any]) -> Job:
        """For the engine's device, and for the others of several."""

        def decided() -> Job:
            device = self.device
            built_before = device.loaded.building.milliseconds
            # Made first, so that mistakes are reported before anything is rendered.
            job = prepare(scene, device, on_start=self.tell, **asked)
            if not is_settled(scene):
                job = prepare(settled(scene, self.preview), device, on_start=self.tell, **asked)
            self.previews_built_ms = device.loaded.building.milliseconds - built_before
            return job if isinstance(self.executor, LocalExecutor) else self.executor.shared(job, device)

        return self._by_any_device(decided)

    def _by_any_device(self, work: Callable[[], T]) -> T:
        """What `work` gives on the engine's device; of several the next one tries if it fails.

        Raises:
            DeviceError: no device is left.
        """
        while True:
            device = self.device
            try:
                return work()
            except (DeviceError, KernelBuildError) as error:
                several = self.executor
                if (
                    isinstance(several, LocalExecutor)
                    or error.status != STATUS_DEVICE_FAILED
                    or not several.working
                ):
                    raise
                several.leave_out(device, error)

    def probe(self, scene: SceneLike, x: int, y: int, *, precision: str | None = None) -> Probe:
        """What lies at a pixel of a scene's picture; arguments, result and errors as for `clfractal.probe`."""
        from clfractal.engine.probing import checked_pixel, probed

        with self._alone():
            job = self.prepare(scene, precision=precision)
            return probed(job, *checked_pixel(x, y, job.region), self.preview)

    def refine(
        self,
        scene: SceneLike,
        *,
        precision: str | None = None,
        samples: int | None = None,
        size: tuple[int, int] | None = None,
        region: tuple[int, int, int, int] | None = None,
        channels: Sequence[str] | None = None,
        quality: str | None = None,
        token: CancelToken | None = None,
    ) -> Refinement:
        """Framebuffers of a scene from coarse to finished: every 8th, 4th and 2nd pixel, then all with more and more
        samples.

        Each framebuffer has the full size. The last one has the same bits as `render`. Between passes the device keeps some
        70 bytes per pixel (twice that in float64); if they do not fit, all samples are made in one pass. In a
        notebook the result is shown, and redrawn with every pass.

        Arguments and errors as for `render`.
        """
        from clfractal.engine.refine import Refinement, refined

        check_token(token)

        def framebuffers() -> Generator[Framebuffer]:
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
                yield from refined(job, self.executor, token, previews_built_ms=self.previews_built_ms)

        return Refinement(framebuffers())


def engine_on(device: str | Sequence[str] | None, executor: Elsewhere | None) -> AnyEngine:
    """The engine of devices of this process, or of an executor that has its own devices.

    Raises:
        SceneError: both are given, or the executor is none.
        DeviceError: no device, or an unknown one.
    """
    if executor is None:
        return Engine(device)
    if not callable(getattr(executor, "engine", None)) or isinstance(executor, type):
        arguments.refuse("executor", "must be a clfractal.Cluster", arguments.plain(executor))
    if device is not None:
        arguments.refuse(
            "device", "belongs to the cluster, as Cluster(address, device=...)", arguments.plain(device)
        )
    return executor.engine()


def _devices(named: str | Device | Sequence[str | Device] | None) -> tuple[Device, ...]:
    """The devices that an argument names.

    Raises:
        DeviceError: there is none, it is unknown or named twice, or the list is empty.
    """
    if isinstance(named, Device):
        return (named,)
    if named is None or isinstance(named, str):
        return choose_all(() if named is None else (named,))
    if not isinstance(named, Sequence):
        return (choose(named),)  # which refuses it
    chosen = tuple(each for each in named if isinstance(each, Device))
    names = [each for each in named if isinstance(each, str)]
    if not named or len(named) not in (len(chosen), len(names)):
        message = "must be names of devices, such as 0:0, and at least one"
        raise DeviceError(message, Where(path="device"), status=STATUS_BAD_INPUT)
    return chosen or choose_all(names)
