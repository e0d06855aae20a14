"""Renders what a window wants to see, in a thread: coarse while it moves, in more samples at rest."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.engine.canvas import CHANNELS, Canvas
from clfractal.engine.job import Job
from clfractal.engine.prepare import prepare
from clfractal.engine.refine import has_room
from clfractal.engine.run import Progress
from clfractal.errors import STATUS_BAD_INPUT, ClfractalError, DeviceError, NotReady, Stopped
from clfractal.integrators.kept import Borrowing, Kept
from clfractal.scene.model import Scene
from clfractal.viewer.background import Task, do_some
from clfractal.viewer.drafts import Drafts
from clfractal.viewer.fitting import Fits
from clfractal.viewer.frame import CanvasPool, Frame, Growth
from clfractal.viewer.gathering import Gathering
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.painting import Executors, Painter
from clfractal.viewer.preparing import (
    Preparation,
    Wanted,
    differs_by_view,
    internal_error,
    seen_from,
    sharp,
    shows_whole,
    stands,
)
from clfractal.viewer.resting import cleaned

SETTLE_SECONDS = 0.15
"""A picture that moves is not refined before nothing has come for so long."""
TRIED_AGAIN = 0.1
"""While something is prepared, a newer picture that may need nothing is tried after so many seconds."""
_HALVED_ABOVE = 0.25
"""Between coarse and whole there are steps if the whole picture takes longer than this, seconds."""


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
        self._executors = Executors(device, self._tell)
        self._executor = self._executors.picture
        self._fits = Fits(device, self._executors.looking)
        self._painter = Painter(device, self.pool, self._executor)
        self._gathered: Gathering | None = None
        self._current: Wanted | Gathering | Task | Preparation | None = None
        # What is being prepared; the request that is known to need more, when one was tried last; what was shown last.
        self._preparation: Preparation | None = None
        self._tried: Wanted | None = None
        self._tried_at = 0.0
        self._seen: Wanted | None = None
        self._begins: Wanted | None = None  # the one whose first frames were begun last
        self._drafts = Drafts(pacing)
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
        follows: bool = False,
    ) -> int:
        """Asks for a picture; samples that are gathered end at once. Gives the request's number.

        What a picture needs before its first ray may take seconds (compiling, a grid). Once begun for a movement, it is
        finished and shown, and then the newest request is taken. Meanwhile the old picture follows the camera.

        Args:
            scene: its image has the size of the viewport. Motion blur comes when it rests: what is coarse is sharp.
            moving: whether more requests will follow soon: then a frame comes at the wanted rate, as coarse as that needs.
            region: the only part that is refined.
            exposed_in: the scene in which an exposure of `auto` is measured; None: this one.
            follows: whether it ends a movement. A request that neither moves nor follows ends a preparation, too,
                unless it only looks at the same scene from elsewhere.
        """
        follows = follows or moving
        with self._changed:
            self._number += 1
            self._wanted = Wanted(self._number, scene, moving, region, exposed_in)
            self.paused = False
            begun = self._preparation
            if begun is not None and not follows and not differs_by_view(begun.wanted.scene, scene):
                self._drop_preparation()
            # A coarse frame of a movement is short, and is finished: if each move of a pointer ended it, none would come.
            if not (follows and self._shielded):
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
            if isinstance(self._current, Gathering) and self._current.samples > 0:
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
            if paused and self._preparation is not None:
                self._wanted = self._wanted or self._preparation.wanted
                self._drop_preparation()
            self._changed.notify_all()

    @property
    def idle(self) -> bool:
        """Whether nothing is under way and nothing is wanted."""
        with self._changed:
            gathered = self._gathered
            draws = self._wanted is not None or (gathered is not None and not gathered.finished)
            waits = self._busy or self._tasks or self._preparation is not None
            return not waits and (self.paused or not draws)

    def close(self, timeout: float | None = 10.0) -> bool:
        """Ends the thread and frees the device's memory; whether it ended in time."""
        with self._changed:
            self._closed = True
            self._token.cancel()
            preparation = self._preparation
            if preparation is not None:
                preparation.cancel()
            self._changed.notify_all()
        if preparation is not None:
            preparation.join(timeout)
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
                # From here on: a move that came before the picture is begun would end one that was prepared.
                begins = work.wanted if isinstance(work, Preparation) else work
                self._shielded = isinstance(begins, Wanted) and begins.moving
            try:
                if isinstance(work, Preparation):
                    self._arrived(work, token)
                elif isinstance(work, Wanted):
                    self._begin(work, token)
                elif isinstance(work, Gathering):
                    self._gather(work, token)
                elif work is not None:
                    self._do(work, token)
            except Stopped:
                continue
            except ClfractalError as error:
                self._failed(error)
            except Exception as error:  # a mistake of ours must not freeze the window
                self._failed(internal_error(error))
            finally:
                if self._preparation is None:
                    self._tell("")
        self._executors.close()

    def _next(self) -> Wanted | Gathering | Task | Preparation | None:
        """What comes next: a new picture until it has a sample, then all tasks, then more samples.

        While something is prepared, only the old picture: as the newest request looks at it, with one sample.
        """
        gathered, preparation = self._gathered, self._preparation
        if not self.paused:
            if preparation is not None and preparation.finished:
                return preparation
            if self._wanted is not None and (preparation is None or self._wanted is not self._tried):
                return self._wanted
            if gathered is not None and gathered.samples == 0:
                return gathered
        if preparation is not None:
            return None
        if self._tasks:
            return self._tasks[0]
        more = gathered is not None and not gathered.finished and not self.paused
        return gathered if more else None

    def _failed(self, error: ClfractalError) -> None:
        self._gathered = None
        self._executor.forget()
        self.problem = error
        self.woken()

    def _begin(self, wanted: Wanted, token: CancelToken) -> None:
        """The first frames of a picture; if it needs what takes long, that is begun, and the old picture goes on."""
        before = self._gathered
        late = self._preparation is not None and time.perf_counter() - self._tried_at < TRIED_AGAIN
        if not late:
            self._tried_at = time.perf_counter()
            try:
                self._show(wanted, token, waits=False)
            except NotReady:
                self._gathered = before.again() if before is not None else None
            else:
                return
        with self._changed:
            # (At rest a movement's end may need more than the movement did.)
            if self._begins is not None and self._begins.number == wanted.number:
                wanted = self._begins
            newest = self._wanted or wanted
            if self.paused or self._closed:
                self._wanted = newest
                return
            if self._preparation is None:
                self._wanted = None
                self._preparation = Preparation(newest, self._make_ready, self._is_ready)
            elif newest is wanted:
                self._wanted = self._tried = wanted
        self._follow(newest, token)

    def _show(self, wanted: Wanted, token: CancelToken, *, waits: bool) -> None:
        """The first frames of a picture. One that is stopped begins again later, unless another request replaced it.

        Raises:
            NotReady: it needs what is not there, and is not to be waited for.
        """
        try:
            with self._executors.waiting(waits):
                self._begun(wanted, token)
        except Stopped:
            with self._changed:
                self._wanted = self._wanted or wanted
            raise

    def _follow(self, newest: Wanted, token: CancelToken) -> None:
        """The old picture as a request looks at it whose own picture is not there yet."""
        old, before = self._seen, self._gathered
        seen = seen_from(old.scene, newest.scene) if old is not None else None
        if old is None or seen is None or seen == old.scene:
            return None
        followed = replace(old, scene=seen, moving=True, region=None)
        with self._executors.waiting(False):
            for plain in (False, True):
                # Its draft may not have been prepared; or the picture itself is no longer there.
                with suppress(NotReady):
                    return self._begun(followed, token, old=True, plain=plain)
        self._gathered = before
        return None

    def _make_ready(self, wanted: Wanted, token: CancelToken) -> Kept:
        """Programs, grids and measures of a picture; in the preparation's thread."""
        kept = Borrowing(self._executor.kept)
        making, looking = self._executors.another(kept), self._executors.another(kept)
        scene = self._fits.fitted(wanted.scene, wanted.moving, token, wanted.exposed_in, looking)
        job = self._prepared(sharp(self._drafts.shaded(scene, wanted.moving)))
        making.make_ready(job.coarse(2), token)
        return kept

    def _is_ready(self) -> None:
        """Called by a preparation that has ended."""
        with self._changed:
            if not self._shielded:
                self._token.cancel()
            self._changed.notify_all()

    def _arrived(self, done: Preparation, token: CancelToken) -> None:
        """Shows what was prepared, as the newest request looks at it; then that is taken."""
        with self._changed:
            self._preparation = self._tried = None
            wanted, newest = done.wanted, self._wanted
            if newest is not None:
                seen = seen_from(wanted.scene, newest.scene)
                if seen is not None and seen == newest.scene:
                    wanted, self._wanted = newest, None
                elif seen is not None:
                    wanted = replace(wanted, scene=seen, moving=True, region=None)
        if done.error is not None:
            raise done.error
        if done.kept is not None:
            self._executor.kept.adopt(done.kept)
        self._show(wanted, token, waits=True)

    def _begun(self, wanted: Wanted, token: CancelToken, *, old: bool = False, plain: bool = False) -> None:
        """The coarse frames of a picture, and what is gathered next.

        Args:
            old: while another one is prepared.
            plain: not as a draft.
        """
        self._gathered, self._begins = None, wanted
        self._executor.forget()
        with self._changed:
            newest, self._shielded = self._wanted, wanted.moving
        scene = self._fits.fitted(wanted.scene, wanted.moving, token, wanted.exposed_in)
        shaded = self._drafts.shaded(scene, wanted.moving and not plain)
        pacing = self._drafts.pacing(shaded is not scene)
        job = self._prepared(sharp(shaded))
        pixels = sum(view.plan.region.pixels for view in job.views)
        carries = wanted.moving and self._painter.carries(self.frame, job)
        divider = pacing.divider(pixels, carries=carries)
        seconds = 0.0
        # A part of a picture that is there is refined: the rest stays as it is.
        shown = shows_whole(self.frame, wanted)
        if self.frame is not None and stands(self.frame, job, wanted):
            divider = self.frame.divider
        elif not shown and (divider > 1 or wanted.moving or wanted.region is not None):
            seconds += self._coarse(wanted, job, divider, token, seconds, pacing, carries=carries)
        else:
            divider = 1
            self._executor.make_ready(job, token)
        if not old:
            self._drop_preparation()  # of an older request
        if wanted.moving:
            self._settle(token, newest)
            if scene is not wanted.scene or shaded is not scene:
                self._begun(replace(wanted, moving=False), token, old=old)
                return
        while divider > 2 and pacing.estimate(pixels) > _HALVED_ABOVE:
            divider //= 2
            if divider > 1:
                seconds += self._coarse(wanted, job, divider, token, seconds, pacing)
        self._gathered = Gathering(wanted, job if scene.animation is None else self._prepared(scene), seconds)

    def _drop_preparation(self) -> None:
        with self._changed:
            if self._preparation is not None:
                self._preparation.cancel()
            self._preparation = self._tried = None

    def _prepared(self, scene: Scene) -> Job:
        if scene.output.denoise:  # stills are, not what moves
            scene = scene.model_copy(update={"output": scene.output.model_copy(update={"denoise": False})})
        return prepare(scene, self.device, channels=CHANNELS, on_start=self._tell)

    def _settle(self, token: CancelToken, newest: Wanted | None) -> None:
        """Waits until nothing has moved for a while; `newest`: the request that waited when the picture was begun."""
        with self._changed:
            self._shielded = False
            if self._wanted is not newest or self._is_over():
                raise Stopped
            self._changed.wait_for(token, SETTLE_SECONDS)
        token.check()

    def _is_over(self) -> bool:
        """Whether a preparation has ended, whose picture is to be shown."""
        return self._preparation is not None and self._preparation.finished

    def _coarse(
        self,
        wanted: Wanted,
        job: Job,
        divider: int,
        token: CancelToken,
        before: float,
        pacing: Pacing,
        *,
        carries: bool = False,
    ) -> float:
        """Renders and publishes a coarse or moving picture; gives the seconds that it took."""
        made = self._painter.moved(job, divider, self.frame, token, pacing, carries=carries)
        growth = Growth.coarse(made.views, made.carried, before + made.seconds, made.seconds)
        self._publish(wanted, job, made.canvas, growth)
        return made.seconds

    def _gather(self, work: Gathering, token: CancelToken) -> None:
        """Samples of the whole picture, pass by pass, from where it stands."""
        if work.canvas is None:
            work.canvas = self._painter.canvas(work.job, self.frame)
            work.prepared = self._painter.enlarged(self.frame, work.canvas)
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
            if work.ranges and (self._tasks or self._preparation is not None):
                raise Stopped
        self._executor.forget()
        if work.cleans:
            problem = cleaned(work.job.scene, work.canvas, self._executors.aside, token, self._tell)
            self._publish(work.wanted, work.job, work.canvas, work.growth(finished=True))
            self.problem = problem
        work.finished = True

    def _pass(self, work: Gathering, canvas: Canvas, token: CancelToken) -> None:
        """The next pass; one that was interrupted is done anew: pixels that have its samples already get no more."""
        part = work.part
        if work.ranges[0][0] > 0 and not self._executor.keeps(len(part.views)):
            work.begin(in_passes=True)  # what was kept went with a drawing that could not be updated
        samples = work.ranges[0]
        grown = partial(self._grown, work, canvas)
        state = self._painter.run(part, canvas, token, numbers=work.numbers, samples=samples, grown=grown)
        work.ranges.pop(0)
        work.seconds += state.seconds
        work.samples, work.prepared = samples[1], True
        if samples[0] == 0:
            scene = work.wanted.scene
            moving = partial(self._drafts.moving, scene, work.job, self._prepared)
            carry, draft = self._painter.foreseen(moving), self._drafts.foreseen(scene, self._prepared)
            for foreseen in (carry, draft):
                if foreseen is not None:
                    self.add(foreseen)
        if samples[1] == 1:
            pixels = sum(view.plan.region.pixels for view in part.views)
            self.pacing.learn(pixels, 1e-3 * state.kernel_ms, state.seconds)
        if not work.ranges or samples[0] == 0 or work.schedule.due(time.perf_counter()):
            last = not work.ranges and not work.cleans
            self._publish(work.wanted, work.job, canvas, work.growth(state.seconds, finished=last))

    def _grown(self, work: Gathering, canvas: Canvas, state: Progress) -> None:
        """Shows a picture whose pass is under way."""
        if work.prepared and work.schedule.due(time.perf_counter()):
            self._publish(work.wanted, work.job, canvas, work.growth(state.seconds, more=state.seconds))

    def _publish(self, wanted: Wanted, job: Job, canvas: Canvas, growth: Growth) -> None:
        """Shows what is on a canvas."""
        self._frames += 1
        self.frame = Frame.of(self._frames, wanted.number, wanted.scene, job, canvas, growth)
        self._seen = wanted
        self.problem = None
        if self._preparation is None:
            self.progress = ""
        self.woken()

    def _do(self, task: Task, token: CancelToken) -> None:
        """Some of a task's work; what is unfinished is gone on with later."""
        do_some(task, self._executors.aside, token, self._tell)
        with self._changed:
            self._tasks.remove(task)
        self.woken()

    def _tell(self, line: str) -> None:
        if line != self.progress:
            self.progress = line
            self.woken()
