"""Renders what a window wants to see, beside the window's thread: coarse while it moves, gathering samples at rest."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.errors import STATUS_BAD_INPUT, ClfractalError, DeviceError, FileError, Stopped
from clfractal.pictures.tiles import Region
from clfractal.renderers.plan import PlannedView
from clfractal.renderers.resources import Borrowing
from clfractal.scene.model import Scene
from clfractal.viewer.background import Task
from clfractal.viewer.fitting import Fits
from clfractal.viewer.frame import CanvasPool, Frame
from clfractal.viewer.pacing import Pacing, Schedule
from clfractal.viewer.resting import clean
from clfractal.work.canvas import CHANNELS, Canvas, CanvasKernels, CanvasStore
from clfractal.work.job import Job
from clfractal.work.local import LocalExecutor
from clfractal.work.prepare import prepare
from clfractal.work.refine import has_room, pass_ranges
from clfractal.work.run import Progress, run
from clfractal.work.show import Arrangement

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
        exposed_in: the scene in which an exposure of `auto` is measured; None: `scene`.
    """

    number: int
    scene: Scene
    moving: bool
    region: tuple[int, int, int, int] | None = None
    exposed_in: Scene | None = None


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
        self._shielded = False
        self._executor = LocalExecutor(device, budget_seconds=BUDGET_SECONDS, tell=self._tell)
        # Looks have another size: they would replace the picture's buffers. They fill the grid that the picture needs.
        self._looking = LocalExecutor(device, budget_seconds=BUDGET_SECONDS, tell=self._tell)
        self._looking.kept = self._executor.kept
        # Many small pictures must not push out the grid that the picture on the screen is made of.
        self._aside = LocalExecutor(device, budget_seconds=BUDGET_SECONDS, tell=self._tell)
        self._aside.kept = Borrowing(self._executor.kept)
        self._fits = Fits(device, self._looking)
        self._kernels: CanvasKernels | None = None
        self._gathered: _Gathering | None = None
        self._current: Wanted | _Gathering | Task | None = None
        self._thread = threading.Thread(target=self._work, name="clfractal-session", daemon=True)

    def start(self) -> None:
        """Begins to work."""
        self._thread.start()

    def request(
        self,
        scene: Scene,
        *,
        moving: bool = False,
        region: tuple[int, int, int, int] | None = None,
        exposed_in: Scene | None = None,
    ) -> int:
        """Asks for a picture; what is under way ends at once. Gives the request's number.

        Args:
            scene: its image has the size of the viewport. Motion blur comes when it rests: what is coarse is sharp.
            moving: whether more requests will follow soon: then a frame comes at the wanted rate, as coarse as that needs.
            region: the only part that is refined.
            exposed_in: the scene in which an exposure of `auto` is measured; None: this one.
        """
        with self._changed:
            self._number += 1
            self._wanted = Wanted(self._number, scene, moving, region, exposed_in)
            self.paused = False
            # A coarse frame of a movement is short, and is finished: if each move of a pointer ended it, none would come.
            if not (moving and self._shielded):
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
            # A picture that gathers samples goes on afterwards where it was.
            if isinstance(self._current, _Gathering) and self._current.samples > 0:
                self._token.cancel()
            self._changed.notify_all()

    def take_tasks(self) -> list[Task]:
        """The tasks that are not done, for another session; of one that is closed."""
        with self._changed:
            tasks = list(self._tasks)
            self._tasks.clear()
            return tasks

    def pause(self, paused: bool = True) -> None:
        """Stops rendering the picture, or goes on with what was gathered. A request goes on, too."""
        with self._changed:
            self.paused = paused
            if paused:
                self._token.cancel()
            self._changed.notify_all()

    @property
    def idle(self) -> bool:
        """Whether nothing is under way and nothing is wanted."""
        with self._changed:
            return not self._busy and not self._tasks and (self.paused or not self._draws())

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
                self._busy = self._shielded = False
                self._current = None
                self._changed.wait_for(lambda: self._closed or self._next() is not None)
                self._busy = True
                if self._closed:
                    break
                token = self._token = CancelToken()
                work = self._current = self._next()
                if work is self._wanted:
                    self._wanted = None
            try:
                if isinstance(work, Wanted):
                    self._begin(work, token)
                elif isinstance(work, _Gathering):
                    self._gather(work, token)
                elif work is not None:
                    self._do(work, token)
            except Stopped:
                continue
            except ClfractalError as error:
                self._failed(error)
            except Exception as error:  # a mistake of ours must not freeze the window
                self._failed(_internal(error))
            finally:
                self._say("")
        for executor in (self._executor, self._looking, self._aside):
            executor.close()

    def _next(self) -> Wanted | _Gathering | Task | None:
        """What comes next: a new picture until it has a sample, then all tasks, then more samples."""
        gathered = self._gathered
        if not self.paused:
            if self._wanted is not None:
                return self._wanted
            if gathered is not None and gathered.samples == 0:
                return gathered
        if self._tasks:
            return self._tasks[0]
        more = gathered is not None and not gathered.finished and not self.paused
        return gathered if more else None

    def _draws(self) -> bool:
        """Whether the picture is not finished."""
        gathered = self._gathered
        return self._wanted is not None or (gathered is not None and not gathered.finished)

    def _failed(self, error: ClfractalError) -> None:
        self._gathered = None
        self._executor.forget()
        self.problem = error
        self.woken()

    def _begin(self, wanted: Wanted, token: CancelToken) -> None:
        """The first, coarse frames of a picture."""
        self._gathered = None
        self._executor.forget()
        with self._changed:
            self._shielded = wanted.moving
        try:
            self._gathered = self._begun(wanted, token)
        except Stopped:
            with self._changed:
                # What was paused, and not replaced by another request, begins again later.
                self._wanted = self._wanted or wanted
            raise

    def _begun(self, wanted: Wanted, token: CancelToken) -> _Gathering:
        scene = self._fits.fitted(wanted.scene, wanted.moving, token, wanted.exposed_in)
        job = self._prepared(_sharp(scene))
        pixels = sum(view.plan.region.pixels for view in job.views)
        divider = self.pacing.divider(pixels)
        seconds = 0.0
        if self._is_shown(wanted):
            divider = 1  # a part of a picture that is there is refined: the rest stays as it is
        elif divider > 1 or wanted.moving or wanted.region is not None:
            seconds += self._coarse(wanted, job, divider, token, seconds)
        if wanted.moving:
            self._settle(token)
            if scene is not wanted.scene:
                scene = self._fits.fitted(wanted.scene, False, token, wanted.exposed_in)
                job = self._prepared(_sharp(scene))
        while divider > 2 and self.pacing.estimate(pixels) > _HALVED_ABOVE:
            divider //= 2
            if divider > 1:
                seconds += self._coarse(wanted, job, divider, token, seconds)
        return _Gathering(wanted, job if scene.animation is None else self._prepared(scene), seconds)

    def _prepared(self, scene: Scene) -> Job:
        if scene.output.denoise:  # stills are, not what moves
            scene = scene.model_copy(update={"output": scene.output.model_copy(update={"denoise": False})})
        return prepare(scene, self.device, channels=CHANNELS, on_start=self._tell)

    def _is_shown(self, wanted: Wanted) -> bool:
        """Whether the newest frame is a whole picture of the wanted scene."""
        front = self.frame
        return (
            front is not None
            and not wanted.moving
            and front.divider == 1
            and front.samples > 0
            and front.scene == wanted.scene
        )

    def _settle(self, token: CancelToken) -> None:
        """Waits until nothing has moved for a while."""
        with self._changed:
            self._shielded = False
            if self._wanted is not None:
                raise Stopped
            self._changed.wait_for(token, SETTLE_SECONDS)
        token.check()

    def _coarse(self, wanted: Wanted, job: Job, divider: int, token: CancelToken, before: float) -> float:
        """Renders and publishes a coarse picture; gives the seconds that it took."""
        coarse = replace(job, views=tuple(view.coarse(divider) for view in job.views))
        canvas = self._canvas(coarse)
        state = self._run(coarse, canvas, token)
        seconds = state.seconds
        self.pacing.learn(canvas.pixels, 1e-3 * state.kernel_ms, seconds)
        self._publish(wanted, job, coarse, canvas, divider, 1, False, before + seconds, seconds)
        return seconds

    def _gather(self, work: _Gathering, token: CancelToken) -> None:
        """Samples of the whole picture, pass by pass, from where it stands."""
        if work.canvas is None:
            work.canvas = self._canvas(work.job)
            front = self.frame
            if front is not None and len(front.canvas.parts) == len(work.canvas.parts):
                self._writer.enlarge(front.canvas, work.canvas)
                work.prepared = True
        if not work.begun:
            work.begin(in_passes=has_room(work.part, self._executor, token))
        while work.ranges:
            try:
                self._pass(work, work.canvas, token)
            except DeviceError as error:
                if error.status != STATUS_BAD_INPUT or not work.in_passes:
                    raise
                # No room after all for what passes keep.
                self._executor.forget()
                self._tell(f"{error.message}; so all samples are made in one pass")
                work.begin(in_passes=False)
            if work.ranges and self._tasks:
                raise Stopped
        self._executor.forget()
        if work.cleans:
            self._clean(work, work.canvas, token)
        work.finished = True

    def _clean(self, work: _Gathering, canvas: Canvas, token: CancelToken) -> None:
        """Takes the noise out of the whole picture, as its scene wants; one that cannot be stays as it is."""
        problem = None
        try:
            clean(work.job.scene, canvas, self._aside, token, self._tell)
        except FileError as error:
            problem = error
        self._publish(work.wanted, work.job, work.job, canvas, 1, work.samples, True, work.seconds, 0.0)
        self.problem = problem

    def _pass(self, work: _Gathering, canvas: Canvas, token: CancelToken) -> None:
        """The next pass; one that was interrupted is done anew: pixels that have its samples already get no more."""
        part, wanted = work.part, work.wanted
        if work.ranges[0][0] > 0 and not self._executor.keeps(len(part.views)):
            work.begin(in_passes=True)  # what was kept went with a drawing that could not be updated
        samples = work.ranges[0]
        state = self._run(part, canvas, token, work, samples)
        work.ranges.pop(0)
        seconds = state.seconds
        work.seconds += seconds
        work.samples = samples[1]
        work.prepared = True
        if samples[1] == 1:
            pixels = sum(view.plan.region.pixels for view in part.views)
            self.pacing.learn(pixels, 1e-3 * state.kernel_ms, seconds)
        if not work.ranges or samples[0] == 0 or work.schedule.due(time.perf_counter()):
            last = not work.ranges and not work.cleans
            self._publish(wanted, work.job, work.job, canvas, 1, work.samples, last, work.seconds, seconds)

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
        work: _Gathering | None = None,
        samples: tuple[int, int] | None = None,
    ) -> Progress:
        """One pass onto a canvas; `work` is shown as it grows."""
        numbers = range(len(job.views)) if work is None else work.numbers
        stores = [CanvasStore(canvas, view, number) for view, number in zip(job.views, numbers, strict=True)]
        writer = self._writer
        self._executor.outlet = lambda view, film, places, tiles: writer.place(
            canvas, numbers[view], job.views[view].plan.region, film, places, tiles
        )
        grown = None if work is None else lambda state: self._grown(work, canvas, state.seconds)
        state = run(job, stores, self._executor, token=token, samples=samples, progress=grown)
        with self.device.failures("rendering"):
            self.device.queue.finish()
        return state

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
            canvas.stamp,
        )
        self.problem = None
        self.progress = ""
        self.woken()

    def _do(self, task: Task, token: CancelToken) -> None:
        """Some of a task's work; what is unfinished is gone on with later."""
        try:
            if not task.finished:
                task.work(self._aside, token, self._tell)
        except Stopped:
            if not task.finished:
                raise
        except ClfractalError as error:
            task.failed(error)
        except Exception as error:  # the picture goes on
            task.failed(_internal(error))
        with self._changed:
            self._tasks.remove(task)
        self.woken()

    def _tell(self, line: str) -> None:
        self._say(line)

    def _say(self, line: str) -> None:
        if line != self.progress:
            self.progress = line
            self.woken()


def _internal(error: Exception) -> DeviceError:
    return DeviceError(f"internal error, please report it: {type(error).__name__}: {error}")


def _sharp(scene: Scene) -> Scene:
    """A scene without motion blur, whose noise would hide a coarse picture."""
    return scene.model_copy(update={"animation": None}) if scene.animation is not None else scene


class _Gathering:
    """A whole picture that gathers samples; `part` is the job of what is refined of it, by the views with `numbers`."""

    def __init__(self, wanted: Wanted, job: Job, seconds: float) -> None:
        self.wanted, self.job, self.seconds = wanted, job, seconds
        self.part, self.numbers = _clipped(job, wanted.region)
        self.canvas: Canvas | None = None
        self.ranges: list[tuple[int, int]] = []
        self.begun = self.in_passes = False
        self.schedule = Schedule(0.0)
        self.samples = 0
        self.prepared = False
        self.finished = False
        self.cleans = wanted.scene.output.denoise and wanted.region is None  # of its noise, at the end

    def begin(self, *, in_passes: bool) -> None:
        """All samples are still to be made, in passes or at once."""
        samples = self.part.samples
        self.begun, self.in_passes = True, in_passes
        self.ranges = pass_ranges(samples) if in_passes else [(0, samples)]
        self.schedule = Schedule(time.perf_counter())


def _clipped(job: Job, region: tuple[int, int, int, int] | None) -> tuple[Job, tuple[int, ...]]:
    """A job's views as far as they lie in a part of each eye's picture, and their numbers; all if nothing lies there."""
    if region is None:
        return job, tuple(range(len(job.views)))
    views: dict[int, PlannedView] = {}
    left, top, right, bottom = region[0], region[1], region[0] + region[2], region[1] + region[3]
    for number, (view, place) in enumerate(zip(job.views, Arrangement.of(job).places, strict=True)):
        whole = view.plan.region
        x, y = max(left - place.x, whole.x), max(top - place.y, whole.y)
        width, height = min(right - place.x, whole.right) - x, min(bottom - place.y, whole.bottom) - y
        if width > 0 and height > 0:
            plan = replace(view.plan, region=Region(x, y, width, height))
            views[number] = replace(view, plan=plan)
    if not views:
        return job, tuple(range(len(job.views)))
    return replace(job, views=tuple(views.values())), tuple(views)
