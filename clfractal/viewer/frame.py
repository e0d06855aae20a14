"""What the renderer of a window gives to its display: a canvas and what is known of it."""

from __future__ import annotations

import threading
from dataclasses import dataclass, fields
from typing import Any

from clfractal.device.select import Device
from clfractal.engine.canvas import Canvas
from clfractal.engine.job import Job
from clfractal.engine.show import Arrangement, smoothing_of
from clfractal.integrators.plan import PlannedView
from clfractal.scene.model import Scene


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """How far a picture is.

    Attributes:
        views: as rendered (coarse ones, while it is coarse).
        divider: pixels, in each direction, that one of the canvas stands for.
        samples: that every pixel has.
        finished: whether it has the bits of the shell's picture.
        carried: whether most pixels come from the frame before, see `clfractal.engine.carry`.
        seconds: that rendering took so far, without compiling.
        frame_seconds: that the last pass took.
        smoothing: how strongly the noise of each view is smoothed when it is shown, see `clfractal.engine.show`.
    """

    views: tuple[PlannedView, ...]
    divider: int
    samples: int
    finished: bool
    carried: bool
    seconds: float
    frame_seconds: float
    smoothing: tuple[float, ...]

    @classmethod
    def coarse(
        cls, views: tuple[PlannedView, ...], carried: bool, seconds: float, frame_seconds: float
    ) -> Growth:
        """That of a coarse or moving picture, which has one sample for each of its own pixels."""
        smoothing = (smoothing_of(1),) * len(views)
        return Growth(views, views[0].plan.divider, 1, False, carried, seconds, frame_seconds, smoothing)


@dataclass(frozen=True, slots=True, eq=False)
class Frame(Growth):
    """A picture on the device, coarse or whole, perhaps still growing.

    Attributes:
        number: rises from frame to frame.
        request: number of the request that it answers.
        scene: as it was rendered, with the size of the viewport.
        job: all that was decided of it; its views are those of the whole picture.
        canvas: where it is.
        stamp: the canvas's, while it holds this frame.
    """

    number: int
    request: int
    scene: Scene
    job: Job
    canvas: Canvas
    stamp: int

    @classmethod
    def of(cls, number: int, request: int, scene: Scene, job: Job, canvas: Canvas, growth: Growth) -> Frame:
        """The frame of what is on a canvas now."""
        grown: dict[str, Any] = {each.name: getattr(growth, each.name) for each in fields(growth)}
        return cls(
            **grown, number=number, request=request, scene=scene, job=job, canvas=canvas, stamp=canvas.stamp
        )

    @property
    def is_draft(self) -> bool:
        """Whether it is shaded cheaply, because the scene moves whose light goes along paths."""
        return self.job.scene.lighting != self.scene.lighting

    @property
    def arrangement(self) -> Arrangement:
        """Where its views lie."""
        return Arrangement.of(self.job)


class CanvasPool:
    """Canvases of one device: one is shown, one is drawn on, and the display may still read a third."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._lock = threading.Lock()
        self._canvases: list[Canvas] = []
        self._held: dict[int, int] = {}

    def take(self, *busy: Canvas | None) -> Canvas:
        """A canvas that nobody reads, and that is none of `busy`; frames that were on it are gone."""
        with self._lock:
            for canvas in self._canvases:
                if canvas not in busy and not self._held.get(id(canvas)):
                    break
            else:
                canvas = Canvas(self.device)
                self._canvases.append(canvas)
            canvas.stamp += 1
            return canvas

    def hold(self, frame: Frame) -> bool:
        """Keeps a frame's canvas from being drawn on anew; False if that has happened, and there is a newer frame."""
        canvas = frame.canvas
        with self._lock:
            if canvas.stamp != frame.stamp:
                return False
            self._held[id(canvas)] = self._held.get(id(canvas), 0) + 1
            return True

    def release(self, canvas: Canvas) -> None:
        """Takes one `hold` back."""
        with self._lock:
            self._held[id(canvas)] -= 1
