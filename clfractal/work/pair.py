"""A stereo picture: the renders of both eyes, and the files that are made of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from clfractal.device.select import Device
from clfractal.optics.view import scene_view
from clfractal.pictures.compose import APART, Composed, Side, composed_channels, eye_regions, picture_size
from clfractal.pictures.outputs import pair_paths, save_views
from clfractal.pictures.tiled import Picture, TiledStore
from clfractal.pictures.tiles import Region, TileGrid
from clfractal.renderers.plan import make_region
from clfractal.scene.model import Scene
from clfractal.scene.stereo import Stereo
from clfractal.work import engine
from clfractal.work.comfort import fitted
from clfractal.work.job import Job, prepare
from clfractal.work.split import Share

# What tells how a pair is shown, and changes neither eye's picture.
_SHOWN = ("mode", "swap", "method", "glasses", "colors")


@dataclass(frozen=True, slots=True)
class Pair:
    """How a stereo scene is rendered.

    Attributes:
        job: the whole picture's; its scene has plane and separation decided.
        eyes: the job of each eye whose picture is needed.
        region: the part of the finished picture to make, pixels.
        shared: what both renders have in common.
        common: what files tell about the whole picture, whichever eye's they show.
    """

    job: Job
    eyes: Mapping[Side, Job]
    region: Region
    shared: engine.Shared
    common: Mapping[str, Any]

    @property
    def stereo(self) -> Stereo:
        """The scene's stereo section."""
        assert self.job.scene.stereo is not None
        return self.job.scene.stereo

    @property
    def tiles(self) -> int:
        """Tiles of both pictures together."""
        return sum(TileGrid(job.plan.region).count for job in self.eyes.values())

    def header(self, side: Side) -> dict[str, Any]:
        """What files tell about one eye's picture: the whole scene, and that eye's camera."""
        view = scene_view(self.eyes[side].scene)
        cameras = {"worldToCamera": view.world_to_camera(), "worldToNDC": view.world_to_ndc()}
        return {**self.common, **cameras, "view": side}

    def identity(self, side: Side) -> dict[str, Any]:
        """What has to be the same for a tile of one eye's picture to have the same bits."""
        whole = self.job.identity()
        stereo = {key: value for key, value in whole["scene"]["stereo"].items() if key not in _SHOWN}
        image = self.eyes[side].scene.image
        scene = {**whole["scene"], "stereo": stereo, "image": image.model_dump()}
        return {**whole, "scene": scene, "eye": side}

    def header_of_both(self, stores: Mapping[Side, Picture]) -> dict[str, Any]:
        """What files tell about a picture made of both: it has no camera of its own, and took the time of two."""
        seconds = sum(store.header.get("seconds", 0.0) for store in stores.values())
        common = {key: value for key, value in self.common.items() if not key.startswith("worldTo")}
        return {**common, "seconds": seconds}


def prepare_pair(
    scene: Scene,
    device: Device,
    *,
    precision: str | None = None,
    samples: int | None = None,
    region: tuple[int, int, int, int] | None = None,
    channels: Sequence[str] | None = None,
    on_start: Callable[[str], None] | None = None,
    on_compile: Callable[[str], None] | None = None,
) -> Pair:
    """As `job.prepare`, of a stereo scene; `region` is a part of the finished picture.

    Raises:
        SceneError: as of `job.prepare`, or `stereo.fit` finds nothing to fit to.
        DeviceError, KernelBuildError: as of `job.prepare`, or of the quick look that `stereo.fit` takes.
    """
    assert scene.stereo is not None
    shared = engine.Shared()
    # First of all, so that what is wrong is told before anything is rendered.
    job = prepare(scene, device, precision=precision, samples=samples, channels=channels, on_start=on_start)
    composed_channels(scene.stereo, job.plan.channels)
    image = (scene.image.width, scene.image.height)
    part = make_region(picture_size(scene.stereo, image), region)
    if scene.stereo.fit is not None:
        found = fitted(scene, device, shared=shared, on_compile=on_compile)
        job = prepare(found, device, precision=precision, samples=samples, channels=channels)
    regions = eye_regions(scene.stereo, image, part)
    eyes: dict[Side, Job] = {
        side: replace(job, scene=job.scene.seen_by(side), plan=replace(job.plan, region=needed))
        for side, needed in regions.items()
        if needed is not None
    }
    return Pair(job, eyes, part, shared, job.header())


def render_eyes(
    pair: Pair,
    stores: Mapping[Side, TiledStore],
    progress: engine.ProgressCallback | None = None,
    *,
    on_compile: Callable[[str], None] | None = None,
) -> engine.Progress:
    """Renders what the stores of the eyes' pictures lack; see `engine.render`."""
    total = engine.Progress(pair.tiles, sum(int(store.done.sum()) for store in stores.values()))
    total.tiles_before = total.tiles_done
    pending = total.tiles - total.tiles_done
    for number, (side, job) in enumerate(pair.eyes.items()):
        share = Share(total, progress, number, len(pair.eyes), pending)
        state = engine.render(
            job.scene, job.plan, job.device, stores[side], share, on_compile=on_compile, shared=pair.shared
        )
        share(state)
        stores[side].header["seconds"] = state.seconds
    total.tiles_done = total.tiles
    return total


def composed(pair: Pair, stores: Mapping[Side, Picture]) -> Composed:
    """Both eyes' pictures in one, as the scene's mode says; not for `pair` and `multi_view`."""
    image = pair.job.scene.image
    alone = pair.stereo.mode in ("left", "right")
    return Composed(
        pair.stereo,
        (image.width, image.height),
        stores.get("left"),
        stores.get("right"),
        pair.region,
        None if alone else pair.header_of_both(stores),
    )


def output_files(stereo: Stereo, path: str | Path) -> list[Path]:
    """The files that are written for an output: two of a pair, and of views in a format that holds but one."""
    if stereo.mode == "pair" or (stereo.mode == "multi_view" and Path(path).suffix.lower() != ".exr"):
        return list(pair_paths(path))
    return [Path(path)]


def save_pair(pair: Pair, stores: Mapping[Side, Picture], paths: Sequence[str | Path]) -> None:
    """Writes the files of a stereo picture, as the scene's `stereo.mode` and `output` want them.

    Raises:
        FileError: a file cannot be written.
    """
    apart = pair.stereo.mode in APART
    whole = None if apart else composed(pair, stores)
    for path in paths:
        files = output_files(pair.stereo, path)
        if whole is not None:
            pair.job.save(whole, files)
        elif len(files) == 2:
            pair.job.save(stores["left"], files[:1])
            pair.job.save(stores["right"], files[1:])
        else:
            save_views(stores["left"], stores["right"], path, half=pair.job.scene.output.half_channels)
