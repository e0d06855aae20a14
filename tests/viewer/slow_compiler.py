"""A compiler that takes as long as a test wants."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from clfractal.device import program
from clfractal.errors import Stopped


class Slow:
    """Makes compiling slow, as a driver may be; counts what was begun, and what was finished."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.begun = self.ended = 0
        self._compile: Callable[..., Any] = program._compile

    def __call__(self, *arguments: Any, stopped: Callable[[], bool] | None, **options: Any) -> Any:
        self.begun += 1
        end = time.perf_counter() + self.seconds
        while time.perf_counter() < end:
            if stopped is not None and stopped():
                raise Stopped
            time.sleep(0.005)
        found = self._compile(*arguments, stopped=stopped, **options)
        self.ended += 1
        return found
