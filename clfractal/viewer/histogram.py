"""How often values occur in the grid of a volume scene, counted in a small grid of the same box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.device.cancel import CancelToken
from clfractal.engine.local_executor import LocalExecutor
from clfractal.errors import ClfractalError
from clfractal.scene.model import Scene
from clfractal.scene.parts import Image
from clfractal.scene.volume import VolumeRenderer
from clfractal.viewer.background import Tell

BINS = 96
_RESOLUTION = 64
_MOST_VALUES = 2_000_000

Counts = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Histogram:
    """Shares of voxels in BINS equal ranges of values from `low` to `high`; shape (BINS,), their sum is 1."""

    low: float
    high: float
    shares: Counts


def histogram_of(values: npt.NDArray[np.generic], low: float, high: float) -> Histogram:
    """The histogram of an array of any shape; what is not finite does not count, what is beyond the ends does there."""
    flat = np.asarray(values).reshape(-1)
    flat = flat[:: max(len(flat) // _MOST_VALUES, 1)].astype(np.float64)
    flat = np.clip(flat[np.isfinite(flat)], low, high)
    counts = np.histogram(flat, BINS, (low, high))[0].astype(np.float64)
    return Histogram(low, high, counts / max(counts.sum(), 1.0))


class HistogramTask:
    """A task of a session that finds the histogram of a volume scene's formula (see `background.Task`).

    Attributes:
        found: the histogram, when it is finished.
        problem: why there is none.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.found: Histogram | None = None
        self.problem = ""

    @property
    def finished(self) -> bool:
        """See `background.Task`."""
        return self.found is not None or bool(self.problem)

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Tell) -> None:
        """See `background.Task`."""
        self.found = _filled(self.scene, executor, token, tell)

    def failed(self, error: ClfractalError) -> None:
        """See `background.Task`."""
        self.problem = error.message


def _filled(scene: Scene, executor: LocalExecutor, token: CancelToken, tell: Tell) -> Histogram:
    from clfractal.engine.prepare import prepare
    from clfractal.voxels.fill import fill_grid

    settings = scene.renderer
    assert isinstance(settings, VolumeRenderer)
    # Every value is wanted, also of voxels that nobody would see.
    small = settings.model_copy(
        update={"resolution": _RESOLUTION, "store": "float", "normals": "gradient", "normal_radius": 0}
    )
    scene = scene.model_copy(update={"renderer": small, "image": Image(width=16, height=16), "stereo": None})
    plan = prepare(scene, executor.device, on_start=tell).views[0].plan
    grid = fill_grid(
        scene,
        small,
        executor.device,
        lanes=plan.lanes,
        precision=plan.precision,
        on_compile=tell,
        token=token,
    )
    low, high = small.value_range(scene.formula.iterations)
    return histogram_of(grid.dense(), low, high)
