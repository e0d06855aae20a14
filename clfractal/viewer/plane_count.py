"""What a cut plane's own picture shows under the pointer: the point of space, and its count."""

from __future__ import annotations

from typing import Any

from clfractal.device.cancel import CancelToken
from clfractal.engine.local_executor import LocalExecutor
from clfractal.errors import ClfractalError
from clfractal.integrators import points
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.viewer.background import Tell
from clfractal.viewer.picking import Pick
from clfractal.viewer.pointer import ray_at, vector
from clfractal.viewer.studio import Studio

Point = tuple[float, float, float]


class Counted:
    """Counts the applications to one point, on the window's device, by the picture's number type.

    Attributes:
        key: what was asked for.
        text: the count, or that the point is inside; empty until it is known, and where it cannot be counted.
    """

    def __init__(self, key: Any, pick: Pick, point: Point, iterations: int) -> None:
        self.key, self.text, self.finished = key, "", False
        self._view, self._point, self._iterations = pick.view, point, iterations

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Tell) -> None:
        """See `Task`."""
        scene, plan = self._view.scene, self._view.plan
        counts, inside = points.escape(
            scene.chain,
            [self._point],
            self._iterations,
            device=executor.device,
            lanes=plan.lanes,
            precision=plan.precision,
            bailout=scene.formula.bailout,
            token=token,
        )
        self.text = f"{int(counts[0])}{', inside' if inside[0] else ''}"
        self.finished = True

    def failed(self, error: ClfractalError) -> None:
        """See `Task`."""
        self.finished = True


class PlaneCount:
    """Counts what the pointer rests on, one point at a time: a new one is begun when the one before is known."""

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._task: Counted | None = None

    def at(self, pick: Pick, point: Point) -> str:
        """The count at a point of the plane; empty until it is known. Ask again until then."""
        renderer = pick.view.scene.renderer
        assert isinstance(renderer, CutPlaneRenderer)
        iterations = (
            renderer.iterations if renderer.iterations is not None else pick.view.scene.formula.iterations
        )
        key = (pick.view.scene.formula, point, iterations)
        task = self._task
        if task is not None and task.key == key:
            return task.text
        if task is None or task.finished:
            self._task = Counted(key, pick, point, iterations)
            self._studio.session.add(self._task)
        return ""


def point_on_plane(pick: Pick) -> Point | None:
    """The point of space that a cut plane's own picture shows; None where the view shows something else."""
    if not isinstance(pick.view.scene.renderer, CutPlaneRenderer):
        return None
    return vector(ray_at(pick.camera, pick.x, pick.y, pick.size)[0])
