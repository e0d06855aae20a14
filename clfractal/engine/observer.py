"""What a picture's stages take on the device: launches are timed by its own events, and summed by stages.

An executor without an observer keeps no events of single stages, and its kernels do not count how long lanes wait in
orbits.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from clfractal.integrators.kernel import Stage, TileKernel
from clfractal.integrators.waves import stage_name


@dataclass(slots=True)
class StageSum:
    """Launches of a stage's kernel, and their milliseconds on the device."""

    launches: int = 0
    ms: float = 0.0


class Observer:
    """Sums what each stage takes, by its name (`stage_name`).

    Attributes:
        state_bytes: what a pixel carries from stage to stage.
        queue_bytes: its rays, and what they have met.
    """

    def __init__(self) -> None:
        self.state_bytes = self.queue_bytes = 0
        self._sums: dict[str, StageSum] = {}
        self._under_way: deque[tuple[str, cl.Event]] = deque()

    def sees(self, kernel: TileKernel) -> None:
        """Takes note of the kernels that are to be launched."""
        needs, width = kernel.wave_needs(), np.dtype(kernel.precision).itemsize
        self.state_bytes = width * needs.state
        self.queue_bytes = width * (needs.ray + needs.met) * needs.turns

    def launched(self, stage: Stage, event: cl.Event) -> None:
        """Takes note of a launch. Events of those that have ended meanwhile are summed, and dropped."""
        while self._under_way and _is_complete(self._under_way[0][1]):
            self._sum_first()
        self._under_way.append((stage_name(stage), event))

    def stages(self) -> dict[str, StageSum]:
        """The sums so far, in the order of the first launches; all launches have ended, as after a picture."""
        while self._under_way:
            self._sum_first()
        return dict(self._sums)

    def forget(self) -> None:
        """Begins anew."""
        self._under_way.clear()
        self._sums = {}

    def _sum_first(self) -> None:
        name, event = self._under_way.popleft()
        found = self._sums.setdefault(name, StageSum())
        found.launches += 1
        found.ms += 1e-6 * float(event.profile.end - event.profile.start)


def _is_complete(event: cl.Event) -> bool:
    return bool(event.command_execution_status == cl.command_execution_status.COMPLETE)
