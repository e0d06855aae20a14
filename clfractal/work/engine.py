"""Rendering a scene: one view, or several that share a picture."""

from __future__ import annotations

from collections.abc import Callable

from clfractal.device.select import Device
from clfractal.pictures.tiled import TiledStore
from clfractal.renderers.plan import Plan
from clfractal.renderers.worker import Shared as Shared
from clfractal.scene.model import Scene
from clfractal.work.loop import Progress as Progress
from clfractal.work.loop import ProgressCallback as ProgressCallback
from clfractal.work.loop import render_one
from clfractal.work.loop import render_tile as render_tile
from clfractal.work.split import render_views


def render(
    scene: Scene,
    plan: Plan,
    device: Device,
    store: TiledStore,
    progress: ProgressCallback | None = None,
    *,
    on_compile: Callable[[str], None] | None = None,
    shared: Shared | None = None,
) -> Progress:
    """Renders every tile that `store` lacks.

    `progress` is called after each batch. An exception in it, or a KeyboardInterrupt, ends the render between two
    tiles; what is finished is in the store. `on_compile` is told a line if the program has to be compiled first.
    `shared` keeps what further renders of the same picture need again.

    Raises:
        DeviceError, KernelBuildError: see `TileWorker`.
    """
    way = render_one if scene.layout is None else render_views
    return way(scene, plan, device, store, progress, on_compile=on_compile, shared=shared)
