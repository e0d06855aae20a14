"""Several views in one picture: each is rendered as a picture of its own, and put into its place."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clfractal.device.select import Device, has_float64
from clfractal.files.channels import CHANNELS
from clfractal.pictures.film import Film
from clfractal.pictures.tiled import TiledStore
from clfractal.renderers.lanes import best_lanes, rule_of
from clfractal.renderers.plan import Plan, choose_precision, make_plan
from clfractal.renderers.worker import Shared
from clfractal.scene.model import Scene
from clfractal.work.loop import Progress, ProgressCallback, render_one


def render_views(
    scene: Scene,
    plan: Plan,
    device: Device,
    store: TiledStore,
    progress: ProgressCallback | None = None,
    *,
    on_compile: Callable[[str], None] | None = None,
    shared: Shared | None = None,
) -> Progress:
    """Renders the views of a scene's layout, each with the number type that it needs, and stores the picture's tiles.

    The whole picture is kept in memory meanwhile, and what is unfinished when it ends is begun anew.

    Raises:
        DeviceError, KernelBuildError: see `TileWorker`.
        SceneError: a view wants float64 on a device without it.
    """
    assert scene.layout is not None
    size = (scene.image.width, scene.image.height)
    whole = Film(plan.channels, size, plan.region)
    for name in plan.channels:
        fill = {"A": 1.0, **dict(zip("RGB", scene.layout.background, strict=True))}.get(
            name, CHANNELS[name].fill
        )
        whole[name][:] = fill
    views = scene.views
    total = Progress(store.grid.count, int(np.count_nonzero(store.done)))
    total.tiles_before = total.tiles_done
    shared = shared if shared is not None else Shared()
    pending = store.grid.count - total.tiles_done
    if pending == 0:
        return total
    for number, (view, place) in enumerate(views):
        wanted = plan.samples if plan.samples != scene.renderer.samples else view.renderer.samples
        share = Share(total, progress, number, len(views), pending)
        film = _rendered(view, plan, wanted, device, share, on_compile, shared)
        _paste(film, whole, place.x, place.y)
    for index in np.flatnonzero(~store.done).tolist():
        tile = store.grid.tile(index)
        rows = slice(tile.y - plan.region.y, tile.y - plan.region.y + tile.height)
        columns = slice(tile.x - plan.region.x, tile.x - plan.region.x + tile.width)
        store.put(index, np.stack([whole[name][rows, columns] for name in plan.channels]))
    total.tiles_done = store.grid.count
    return total


class Share:
    """Adds what one view takes to what all take, and tells it on."""

    def __init__(
        self, total: Progress, tell: ProgressCallback | None, number: int, views: int, pending: int
    ) -> None:
        self.total, self.tell = total, tell
        self.number, self.views, self.pending = number, views, pending
        self.before = Progress(1)

    def __call__(self, now: Progress) -> None:
        total, before = self.total, self.before
        for name in ("rays", "iterations", "steps", "bad_distances", "kernel_ms", "build_ms"):
            setattr(total, name, getattr(total, name) + getattr(now, name) - getattr(before, name))
            setattr(before, name, getattr(now, name))
        part = (self.number + now.tiles_done / max(now.tiles, 1)) / self.views
        total.tiles_done = min(total.tiles_before + int(part * self.pending), total.tiles - 1)
        if self.tell is not None:
            self.tell(total)


def _rendered(
    view: Scene,
    plan: Plan,
    samples: int,
    device: Device,
    share: Share,
    on_compile: Callable[[str], None] | None,
    shared: Shared,
) -> Film:
    precision, _ = choose_precision(view, view.renderer.precision, has_float64=has_float64(device.info))
    lanes = best_lanes(device, precision, rule_of(view.chain))
    own = make_plan(
        view,
        precision=precision,
        lanes=plan.lanes if precision == plan.precision else lanes,
        samples=samples,
        channels=plan.channels,
    )
    film = Film(own.channels, (view.image.width, view.image.height), own.region)
    render_one(view, own, device, film, share, on_compile=on_compile, shared=shared)
    return film


def _paste(film: Film, whole: Film, x: int, y: int) -> None:
    """Puts a view whose top left corner lies at (x, y) of the picture into it, as far as it lies in the region."""
    region = whole.region
    left, top = max(x, region.x), max(y, region.y)
    right, bottom = min(x + film.width, region.right), min(y + film.height, region.bottom)
    if left >= right or top >= bottom:
        return
    for name in whole:
        part = film[name][top - y : bottom - y, left - x : right - x]
        whole[name][top - region.y : bottom - region.y, left - region.x : right - region.x] = part
