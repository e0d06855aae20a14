"""A compiler that takes as long as a test wants."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from clfractal.device import program
from clfractal.errors import Stopped


class Slow:
    """Makes compiling slow, as a driver may be; counts what was begun, finished, and stopped.

    Attributes:
        seconds: that it takes at least; what is being compiled goes on as soon as a test makes them less.
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self.begun = self.ended = self.stopped = 0
        self._compile: Callable[..., Any] = program._compile

    def __call__(self, *arguments: Any, stopped: Callable[[], bool] | None, **options: Any) -> Any:
        self.begun += 1
        begin = time.perf_counter()
        while time.perf_counter() < begin + self.seconds:
            if stopped is not None and stopped():
                self.stopped += 1
                raise Stopped
            time.sleep(0.005)
        found = self._compile(*arguments, stopped=stopped, **options)
        self.ended += 1
        return found
