"""Measures what a user feels: frames a second while something moves."""

from __future__ import annotations

import time
from collections import deque

import numpy as np

from clfractal.scene.deep import Deep
from clfractal.scene.deeper import magnification_of
from clfractal.viewer.display import Shown
from clfractal.viewer.panels.ui import Speed

_WINDOW_SECONDS = 1.0


class Meter:
    """Takes note of frames that arrive, and of swaps."""

    def __init__(self) -> None:
        self._arrived: deque[float] = deque()
        self._depth: tuple[Shown | None, float] = (None, float("inf"))
        self._shown: Shown | None = None

    def shown(self, shown: Shown | None, now: float) -> None:
        """A frame has arrived and is drawn next."""
        if shown is not None:
            if self._shown is None or self._shown.frame is not shown.frame:
                self._arrived.append(now)
            self._shown = shown

    def swapped(self, now: float) -> None:
        """What was drawn is on the screen."""
        while self._arrived and now - self._arrived[0] > _WINDOW_SECONDS:
            self._arrived.popleft()

    @property
    def speed(self) -> Speed:
        """The newest figures."""
        times = self._arrived
        moving = len(times) > 2 and time.perf_counter() - times[-1] < 0.5 and times[-1] > times[0]
        return Speed((len(times) - 1) / (times[-1] - times[0]) if moving else 0.0)

    def nearest(self, shown: Shown | None, deep: Deep | None) -> float:
        """Depth of the nearest surface in the picture, scene units; infinite if none is in sight.

        Args:
            deep: the place that the scene shows now; the picture may be of another.
        """
        if shown is None:
            return float("inf")
        if self._depth[0] is not shown:
            nearest = float("inf")
            for depths in shown.depths:
                # Every fourth pixel is enough, and does not take a frame's time.
                some = depths[::4, ::4] if depths.size > 100_000 else depths
                finite = some[np.isfinite(some) & (some > 0)]
                if finite.size:
                    nearest = min(nearest, float(finite.min()))
            self._depth = (shown, nearest)
        own = shown.frame.views[0].scene.deep
        return self._depth[1] * magnification_of(deep) / magnification_of(own)
