"""Measures the window's device while nobody wants anything else of it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from clfractal.device.cancel import CancelToken
from clfractal.device.structs import Precision
from clfractal.engine.local_executor import LocalExecutor
from clfractal.errors import ClfractalError, Stopped
from clfractal.integrators.lanes import is_measured, march_reports
from clfractal.viewer.studio import Studio
from clfractal.viewer.window_options import Options

REST_SECONDS = 2.0
"""For so long a window has been at rest before its device is measured."""


class Measurement:
    """Finds the fastest lanes of a device for a number type; see `Task`. Whatever else is wanted ends it."""

    def __init__(self, precision: Precision) -> None:
        self.precision: Precision = precision
        self.finished = False
        self.is_known = False

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Callable[[str], None]) -> None:
        """See `Task`."""
        self.finished = True
        with suppress(Stopped):
            march_reports(executor.device, self.precision, on_start=tell, stopped=token)
            self.is_known = True

    def failed(self, error: ClfractalError) -> None:
        """See `Task`: pictures tell what is wrong with a device."""
        self.finished = self.is_known = True


class Measuring:
    """Measures a device for the number types of the pictures that a studio shows.

    What is found is for the next start: a window keeps its lanes, and its pictures their last bits.

    Args:
        options: of the window; one that ends by itself measures nothing.
    """

    def __init__(self, options: Options) -> None:
        self._stays = options.shot is None and options.play is None
        self._known: set[tuple[str, Precision]] = set()
        self._under_way: Measurement | None = None
        self._since = 0.0

    def look(self, studio: Studio, now: float) -> None:
        """Begins a measurement if it is time for one; called every turn, with the time in seconds."""
        session = studio.session
        frame = session.frame
        if not self._stays or frame is None or not session.idle:
            self._since = now
            return
        if now - self._since < REST_SECONDS:
            return
        device = session.device
        task, self._under_way = self._under_way, None
        if task is not None and task.is_known:
            self._known.add((device.info.key, task.precision))
        for precision in {view.plan.precision for view in frame.job.views}:
            key = (device.info.key, precision)
            if key not in self._known and is_measured(device, precision):
                self._known.add(key)
            if key not in self._known:
                self._since = now
                self._under_way = Measurement(precision)
                session.add(self._under_way)
                return
