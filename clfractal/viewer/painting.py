"""A session's executors, and what renders a job's views onto a canvas while they grow."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.engine.canvas import Canvas, CanvasKernels, CanvasStore
from clfractal.engine.carry import Carrier, can_carry
from clfractal.engine.job import Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import Progress, run
from clfractal.errors import ClfractalError, DeviceError
from clfractal.integrators.kept import Borrowing, Kept
from clfractal.integrators.plan import PlannedView
from clfractal.viewer.frame import CanvasPool, Frame
from clfractal.viewer.pacing import Pacing

BUDGET_SECONDS = 0.02
"""Limit of the work that is queued on the device: what cannot be told to end, ends after this time."""


class Executors:
    """A session's executors on one device.

    Args:
        tell: given lines about what takes long.

    Attributes:
        picture: makes the picture.
        looking: measures. Looks have another size and would replace the picture's buffers; they fill its grid.
        aside: for tasks. Many small pictures must not push out the grid that the picture on the screen is made of.
    """

    def __init__(self, device: Device, tell: Callable[[str], None]) -> None:
        self.device, self._tell = device, tell
        self.picture = LocalExecutor(device, budget_seconds=BUDGET_SECONDS, tell=tell)
        self.looking = self.another(self.picture.kept)
        self.aside = self.another(Borrowing(self.picture.kept))

    def another(self, kept: Kept) -> LocalExecutor:
        """One more, with these data."""
        made = LocalExecutor(self.device, budget_seconds=BUDGET_SECONDS, tell=self._tell)
        made.kept = kept
        return made

    @contextmanager
    def waiting(self, waits: bool) -> Iterator[None]:
        """Whether the picture waits for what has to be built or filled first; else there is `NotReady`."""
        self.picture.waits = self.looking.waits = waits
        try:
            yield
        finally:
            self.picture.waits = self.looking.waits = True

    def close(self) -> None:
        """Frees their memory."""
        for executor in (self.picture, self.looking, self.aside):
            executor.close()


@dataclass(frozen=True, slots=True)
class Moved:
    """A coarse or moving picture: its views, where it is, and the seconds that it took; `carried`: see `Growth`."""

    views: tuple[PlannedView, ...]
    canvas: Canvas
    carried: bool
    seconds: float


class Painter:
    """Canvases of a device, and what draws on them.

    Args:
        pool: where canvases come from.
        executor: renders.
    """

    def __init__(self, device: Device, pool: CanvasPool, executor: LocalExecutor) -> None:
        self.device, self.pool, self.executor = device, pool, executor
        self._kernels: CanvasKernels | None = None
        self._carrier: Carrier | None = None
        self._foreseen = False

    def foreseen(self, moving: Callable[[], Job]) -> CarryProgram | None:
        """The task that gets ready what carries pixels over, once, for the first picture that can move so.

        Args:
            moving: gives the job of the picture while it moves.
        """
        if self._foreseen or not can_carry(job := moving(), job):
            return None
        self._foreseen = True
        return CarryProgram(self)

    def prepare(self, token: CancelToken) -> None:
        """Builds what carries pixels over."""
        self._carrier = Carrier(self.device, stopped=token)

    def carries(self, front: Frame | None, job: Job) -> bool:
        """Whether a job's picture can take pixels from the frame that is shown, because only the camera moved."""
        if self._carrier is None or front is None or front.samples == 0:
            return False
        return front.canvas.stamp == front.stamp and can_carry(front.job, job)

    def moved(
        self,
        job: Job,
        divider: int,
        front: Frame | None,
        token: CancelToken,
        pacing: Pacing,
        *,
        carries: bool,
    ) -> Moved:
        """A picture of so coarse pixels on a canvas, and what it took, which its pacing learns.

        Args:
            carries: see `carries`; then only a part of the pixels is rendered.
        """
        whole = job.coarse(divider)
        if carries and self._carrier is not None and front is not None:
            try:
                return self._carried(self._carrier, job, whole, divider, front, token, pacing)
            except DeviceError:
                # No room for it, probably: pictures move as they do without.
                self._carrier = None
                self.executor.forget()
        canvas = self.canvas(whole, front)
        state = self.run(whole, canvas, token)
        pacing.learn(canvas.pixels, 1e-3 * state.kernel_ms, state.seconds)
        return Moved(whole.views, canvas, False, state.seconds)

    def _carried(
        self,
        carrier: Carrier,
        job: Job,
        whole: Job,
        divider: int,
        front: Frame,
        token: CancelToken,
        pacing: Pacing,
    ) -> Moved:
        part = carrier.begin(job, divider)
        state = self.run(part, carrier.fresh, token)
        canvas = self.canvas(whole, front)
        start = time.perf_counter()
        carrier.carry(front.views, front.canvas, whole.views, canvas)
        carrying = time.perf_counter() - start
        pacing.learn_carrying(canvas.pixels, carrying)
        pacing.learn(carrier.fresh.pixels, 1e-3 * state.kernel_ms, state.seconds)
        return Moved(whole.views, canvas, True, state.seconds + carrying)

    def canvas(self, job: Job, front: Frame | None) -> Canvas:
        """A canvas for a job's views; not the one of the frame that is shown."""
        canvas = self.pool.take(front.canvas if front is not None else None)
        canvas.fit(job.views)
        return canvas

    def enlarged(self, front: Frame | None, canvas: Canvas) -> bool:
        """Fills a canvas with the frame that is shown, until it has a picture of its own; whether that was possible."""
        if front is None or len(front.canvas.parts) != len(canvas.parts):
            return False
        self._writer.enlarge(front.canvas, canvas)
        return True

    def run(
        self,
        job: Job,
        canvas: Canvas,
        token: CancelToken,
        *,
        numbers: Sequence[int] | None = None,
        samples: tuple[int, int] | None = None,
        grown: Callable[[Progress], None] | None = None,
    ) -> Progress:
        """One pass onto a canvas.

        Args:
            numbers: of the canvas's parts that the job's views belong to; None: all.
            samples: see `WorkItem`; None: all.
            grown: called after each launch.

        Raises:
            DeviceError, KernelBuildError, NotReady, Stopped: as of the executor.
        """
        numbers = range(len(job.views)) if numbers is None else numbers
        stores = [CanvasStore(canvas, view, number) for view, number in zip(job.views, numbers, strict=True)]
        writer = self._writer
        self.executor.outlet = lambda view, framebuffer, places, tiles: writer.place(
            canvas, numbers[view], job.views[view].plan.region, framebuffer, places, tiles
        )
        state = run(job, stores, self.executor, token=token, samples=samples, progress=grown)
        with self.device.failures("rendering"):
            self.device.queue.finish()
        return state

    @property
    def _writer(self) -> CanvasKernels:
        if self._kernels is None:
            self._kernels = CanvasKernels(self.device)
        return self._kernels


class CarryProgram:
    """Compiles what carries pixels over in the background, so that no move waits for it; see `Task`."""

    finished = False

    def __init__(self, painter: Painter) -> None:
        self._painter = painter

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Callable[[str], None]) -> None:
        """See `Task`."""
        # (A painter of another device, to which the window's tasks have moved, asks for its own.)
        if executor.device is self._painter.device:
            self._painter.prepare(token)
        self.finished = True

    def failed(self, error: ClfractalError) -> None:
        """Pictures move as coarse as they are without."""
        self.finished = True
