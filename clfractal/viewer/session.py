"""Renders what a window wants to see, beside the window's thread: coarse while it moves, gathering samples at rest."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.errors import ClfractalError, DeviceError, Stopped
from clfractal.scene.model import Scene
from clfractal.viewer.background import Task
from clfractal.viewer.fitting import Fits
from clfractal.viewer.frame import CanvasPool, Frame
from clfractal.viewer.pacing import Pacing, Schedule
from clfractal.work.canvas import CHANNELS, Canvas, CanvasKernels, CanvasStore
from clfractal.work.job import Job
from clfractal.work.local import LocalExecutor
from clfractal.work.prepare import prepare
from clfractal.work.refine import has_room, pass_ranges
from clfractal.work.run import run

BUDGET_SECONDS = 0.02
"""Limit of the work that is queued on the device: what cannot be told to end, ends after this time."""
SETTLE_SECONDS = 0.15
"""A picture that moves is not refined before nothing has come for so long."""
_HALVED_ABOVE = 0.25
"""Between coarse and whole there are steps if the whole picture takes longer than this, seconds."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """A picture that was asked for.

    Attributes:
        number: of the request.
        scene: with the size of the viewport.
        moving: whether more requests will follow soon.
        region: x, y, width, height of the only part to refine, pixels of each eye's picture; None: all.
    """

    number: int
    scene: Scene
    moving: bool
    region: tuple[int, int, int, int] | None = None


class Session:
    """A thread that renders one scene after the other on one device.

    Args:
        device: with a context of its own, if textures are to be shared.
        pacing: how coarse a moving picture may be.
        woken: called from the thread when there is something new: a frame, a problem, a line of progress.

    Attributes:
        frame: the newest one; None before the first.
        problem: why the newest request could not be rendered; the frame is then the last good one.
        progress: what takes long at the moment (compiling, measuring); empty if nothing does.
    """

    def __init__(self, device: Device, pacing: Pacing, woken: Callable[[], None]) -> None:
        self.device, self.pacing, self.woken = device, pacing, woken
        self.frame: Frame | None = None
        self.problem: ClfractalError | None = None
        self.progress = ""
        self.pool = CanvasPool(device)
        self.paused = False
        self._changed = threading.Condition()
        self._wanted: Wanted | None = None
        self._number = 0
        self._token = CancelToken()
        self._closed = False
        self._tasks: deque[Task] = deque()
        self._frames = 0
        self._busy = False
        self._executor = LocalExecutor(device, budget_seconds=BUDGET_SECONDS, tell=self._tell)
        self._aside = LocalExecutor(device, budget_seconds=BUDGET_SECONDS, tell=self._tell)
        self._aside.kept = self._executor.kept
        self._fits = Fits(device, self._aside)
        self._kernels: CanvasKernels | None = None
        self._gathered: _Gathering | None = None
        self._thread = threading.Thread(target=self._work, name="clfractal-session", daemon=True)

    def start(self) -> None:
        """Begins to work."""
        self._thread.start()

    def request(
        self, scene: Scene, *, moving: bool = False, region: tuple[int, int, int, int] | None = None
    ) -> int:
        """Asks for a picture; what is under way ends at once. Gives the request's number.

        Args:
            scene: its image has the size of the viewport.
            moving: whether more requests will follow soon: then a frame comes at the wanted rate, as coarse as that needs.
            region: the only part that is refined.
        """
        with self._changed:
            self._number += 1
            self._wanted = Wanted(self._number, scene, moving, region)
            self.paused = False
            self._token.cancel()
            self._changed.notify_all()
            return self._number

    @property
    def newest(self) -> int:
        """Number of the newest request."""
        return self._number

    def add(self, task: Task) -> None:
        """Queues work in the background: done when the picture has its first full sample, before it gathers more."""
        with self._changed:
            self._tasks.append(task)
            # A gathering picture goes on afterwards where it was.
            if self.frame is not None and self._wanted is None:
                self._token.cancel()
            self._changed.notify_all()

    def pause(self, paused: bool = True) -> None:
        """Stops gathering samples, or goes on with what was gathered."""
        with self._changed:
            self.paused = paused
            if paused:
                self._token.cancel()
            self._changed.notify_all()

    @property
    def idle(self) -> bool:
        """Whether nothing is under way and nothing is wanted."""
        with self._changed:
            rests = self._gathered is None or self._gathered.finished or self.paused
            return self._wanted is None and not self._busy and not self._tasks and rests

    def close(self, timeout: float | None = 10.0) -> bool:
        """Ends the thread and frees the device's memory; whether it ended in time."""
        with self._changed:
            self._closed = True
            self._token.cancel()
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join(timeout)
        return not self._thread.is_alive()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._busy = False
                self._changed.wait_for(self._has_work)
                self._busy = True
                if self._closed:
                    break
                wanted, self._wanted = self._wanted, None
                token = self._token = CancelToken()
                task = self._tasks[0] if wanted is None and self._tasks else None
            try:
                if wanted is not None:
                    self._begin(wanted, token)
                if task is not None:
                    self._do(task, token)
                elif self._gathered is not None:
                    self._gather(self._gathered, token)
            except Stopped:
                continue
            except ClfractalError as error:
                self._failed(error)
            except Exception as error:  # a mistake of ours must not freeze the window
                self._failed(DeviceError(f"internal error, please report it: {type(error).__name__}: {error}"))
            finally:
                self._say("")
        self._executor.close()
        self._aside.close()

    def _has_work(self) -> bool:
        gathers = self._gathered is not None and not self._gathered.finished and not self.paused
        return self._closed or self._wanted is not None or bool(self._tasks) or gathers

    def _failed(self, error: ClfractalError) -> None:
        self._gathered = None
        self.problem = error
        self.woken()

    def _begin(self, wanted: Wanted, token: CancelToken) -> None:
        """The first, coarse frames of a picture."""
        self._gathered = None
        self._executor.forget()
        scene = self._fits.fitted(wanted.scene, wanted.moving)
        job = prepare(scene, self.device, channels=CHANNELS, on_start=self._tell)
        pixels = sum(view.plan.region.pixels for view in job.views)
        divider = self.pacing.divider(pixels)
        seconds = 0.0
        if divider > 1 or wanted.moving:
            seconds += self._coarse(wanted, job, divider, token, seconds)
        if wanted.moving:
            self._settle(token)
            if scene.stereo is not None and scene is not wanted.scene:
                scene = self._fits.fitted(wanted.scene, False)
                job = prepare(scene, self.device, channels=CHANNELS, on_start=self._tell)
        while divider > 2 and self.pacing.estimate(pixels) > _HALVED_ABOVE:
            divider //= 2
            if divider > 1:
                seconds += self._coarse(wanted, job, divider, token, seconds)
        part = job
        if wanted.region is not None:
            part = prepare(scene, self.device, channels=CHANNELS, region=wanted.region)
            if len(part.views) != len(job.views):
                part = job
        self._gathered = _Gathering(wanted, job, part, seconds)

    def _settle(self, token: CancelToken) -> None:
        end = time.perf_counter() + SETTLE_SECONDS
        while time.perf_counter() < end:
            token.check()
            time.sleep(0.005)

    def _coarse(self, wanted: Wanted, job: Job, divider: int, token: CancelToken, before: float) -> float:
        """Renders and publishes a coarse picture; gives the seconds that it took."""
        coarse = replace(job, views=tuple(view.coarse(divider) for view in job.views))
        canvas = self._canvas(coarse)
        state_seconds = self._run(coarse, canvas, token, None, None)
        self.pacing.learn(canvas.pixels, state_seconds)
        self._publish(wanted, job, coarse, canvas, divider, 1, False, before + state_seconds, state_seconds)
        return state_seconds

    def _gather(self, work: _Gathering, token: CancelToken) -> None:
        """Samples of the whole picture, pass by pass, from where it stands."""
        job, wanted = work.job, work.wanted
        if work.canvas is None:
            work.canvas = self._canvas(job)
            front = self.frame
            if front is not None and len(front.canvas.parts) == len(work.canvas.parts):
                self._writer.enlarge(front.canvas, work.canvas)
                work.prepared = True
            work.ranges = pass_ranges(job.samples) if has_room(job, self._executor) else [(0, job.samples)]
            work.schedule = Schedule(time.perf_counter())
        canvas = work.canvas
        while work.ranges:
            samples = work.ranges[0]
            # A pass that was interrupted is done anew: pixels that have its samples already get no more.
            took = self._run(work.part, canvas, token, samples, lambda seconds: self._grown(work, canvas, seconds))
            work.ranges.pop(0)
            work.seconds += took
            work.samples = samples[1]
            work.prepared = True
            if samples[1] == 1:
                self.pacing.learn(canvas.pixels, took)
            last = not work.ranges
            if last or samples[1] == 1 or work.schedule.due(time.perf_counter()):
                self._publish(wanted, job, job, canvas, 1, work.samples, last, work.seconds, took)
            if last:
                self._executor.forget()
                work.finished = True
            elif self._tasks:
                raise Stopped
        work.finished = True

    def _grown(self, work: _Gathering, canvas: Canvas, seconds: float) -> None:
        """Shows a picture whose pass is under way."""
        if work.prepared and work.schedule.due(time.perf_counter()):
            job = work.job
            self._publish(
                work.wanted, job, job, canvas, 1, work.samples, False, work.seconds + seconds, seconds
            )

    def _run(
        self,
        job: Job,
        canvas: Canvas,
        token: CancelToken,
        samples: tuple[int, int] | None,
        grown: Callable[[float], None] | None,
    ) -> float:
        """One pass onto a canvas; gives its seconds."""
        stores = [CanvasStore(canvas, job, number) for number in range(len(job.views))]
        writer = self._writer
        clips = [view.plan.region for view in job.views]
        self._executor.outlet = lambda view, film, places, tiles: writer.place(
            canvas, view, clips[view], film, places, tiles
        )
        state = run(
            job,
            stores,
            self._executor,
            token=token,
            samples=samples,
            progress=None if grown is None else lambda state: grown(state.seconds),
        )
        with self.device.failures("rendering"):
            self.device.queue.finish()
        return state.seconds

    @property
    def _writer(self) -> CanvasKernels:
        if self._kernels is None:
            self._kernels = CanvasKernels(self.device)
        return self._kernels

    def _canvas(self, job: Job) -> Canvas:
        canvas = self.pool.take(self.frame.canvas if self.frame is not None else None)
        canvas.fit(job.views)
        return canvas

    def _publish(
        self,
        wanted: Wanted,
        job: Job,
        rendered: Job,
        canvas: Canvas,
        divider: int,
        samples: int,
        finished: bool,
        seconds: float,
        frame_seconds: float,
    ) -> None:
        self._frames += 1
        self.frame = Frame(
            self._frames,
            wanted.number,
            wanted.scene,
            job,
            rendered.views,
            canvas,
            divider,
            samples,
            finished,
            seconds,
            frame_seconds,
        )
        self.problem = None
        self.progress = ""
        self.woken()

    def _do(self, task: Task, token: CancelToken) -> None:
        """Some of a task's work; what is unfinished is gone on with later."""
        try:
            task.work(self._aside, token, self._tell)
        finally:
            if task.finished:
                with self._changed:
                    self._tasks.remove(task)
                self.woken()

    def _tell(self, line: str) -> None:
        self._say(line)

    def _say(self, line: str) -> None:
        if line != self.progress:
            self.progress = line
            self.woken()


class _Gathering:
    """A whole picture that gathers samples; `part` is the job of what is refined of it."""

    def __init__(self, wanted: Wanted, job: Job, part: Job, seconds: float) -> None:
        self.wanted, self.job, self.part, self.seconds = wanted, job, part, seconds
        self.canvas: Canvas | None = None
        self.ranges: list[tuple[int, int]] = []
        self.schedule = Schedule(0.0)
        self.samples = 0
        self.prepared = False
        self.finished = False
