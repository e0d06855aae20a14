"""Which renderer draws a scene."""

from __future__ import annotations

from collections.abc import Callable

from clfractal.device.select import Device
from clfractal.renderers.cut_plane import CutPlaneWorker
from clfractal.renderers.plan import Plan
from clfractal.renderers.surface import SurfaceWorker
from clfractal.renderers.volume import VolumeWorker
from clfractal.renderers.worker import Shared, TileWorker
from clfractal.scene.model import Scene

WORKERS: dict[str, type[TileWorker]] = {
    "surface": SurfaceWorker,
    "cut_plane": CutPlaneWorker,
    "volume": VolumeWorker,
}


def make_worker(
    scene: Scene,
    plan: Plan,
    device: Device,
    *,
    capacity: int,
    on_compile: Callable[[str], None] | None = None,
    shared: Shared | None = None,
) -> TileWorker:
    """The worker of the scene's renderer; see `TileWorker`."""
    kind = WORKERS[scene.renderer.type]
    return kind(scene, plan, device, capacity=capacity, on_compile=on_compile, shared=shared)
