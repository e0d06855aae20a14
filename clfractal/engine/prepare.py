"""Makes all decisions about a picture, in one place for the shell, Python and every kind of picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

from clfractal.camera.views import seen_by, shown_views
from clfractal.device.select import Device, has_float64
from clfractal.engine.job import Composition, Identity, Job, Paste, StereoPair
from clfractal.errors import SceneError, Where, arguments
from clfractal.files.channels import ALBEDO, NOISY, NORMAL, check_channels
from clfractal.images.compose import Side, composed_channels, eye_regions
from clfractal.images.modes import picture_size
from clfractal.images.tiles import Region
from clfractal.integrators.lanes import best_lanes, rule_of
from clfractal.integrators.plan import Plan, PlannedView, PrecisionChoice, choose_precision, make_region
from clfractal.integrators.records import bounces
from clfractal.integrators.shutter import shutter_of
from clfractal.scene.checks import check_layers, check_parts
from clfractal.scene.layout import Place
from clfractal.scene.model import Scene
from clfractal.scene.parts import MAX_PIXELS, MAX_SIDE
from clfractal.scene.stereo import MIDDLE, Eye
from clfractal.scene.surface import SurfaceRenderer

MAX_SAMPLES = 65_536
MEASURED_FIRST_SECONDS = 30.0
"""A device that is not measured yet is measured before pictures that probably take so long, and not before others."""
_SAMPLES_A_SECOND = 1e6  # of a compute unit, about: half to twice as many by direct light
PRECISIONS = ("auto", "float32", "float64")


def prepare(
    scene: Scene,
    device: Device,
    *,
    precision: str | None = None,
    samples: int | None = None,
    region: tuple[int, int, int, int] | None = None,
    channels: Sequence[str] | None = None,
    pictures: int = 1,
    measures: bool | None = None,
    on_start: Callable[[str], None] | None = None,
) -> Job:
    """The job of a scene's picture; arguments that are None take the value of the scene, or of each of its views.

    Errors name the argument; the shell turns that into its option.
    This measures nothing (`stereo.fit` and the like); see `settle.settled`.

    Args:
        region: x, y, width, height of the part of the finished picture to make, pixels.
        pictures: how many like it are to be made, as frames of a film.
        measures: whether the device is measured before this picture, if it is not known yet; None: where that pays. It
            takes some seconds, once.
        on_start: called with a message if the device is measured or tried first.

    Raises:
        SceneError: the region is not inside the picture, an unknown precision or channel, a wrong number of
            samples, float64 on a device without it.
        DeviceError: no kernel works on the device.
    """
    if precision is not None:
        precision = arguments.word("precision", precision, PRECISIONS)
    if samples is not None:
        samples = arguments.whole("samples", samples, 1, MAX_SAMPLES)
    if region is not None:
        x, y, width, height = arguments.numbers("region", region, 4, "x, y, width, height in pixels")
        region = (x, y, width, height)
    names, where = scene.output.channels, "output.channels"
    if channels is not None:
        where = "channels"
        names = check_channels(arguments.words("channels", channels), Where(path=where))
    # One number type for both eyes, chosen for the view of the eye between them.
    chosen = [
        choose_precision(
            view,
            cast(PrecisionChoice, precision or view.renderer.precision),
            has_float64=has_float64(device.info),
            eye=eye,
        )
        for view, eye, _ in shown_views(scene)
    ]
    views: list[PlannedView] = []

    def part(seen: Scene, eye: Eye, wanted: Region) -> Identity | Paste:
        """Adds the views of one eye's picture, as far as they lie in a region of it."""
        numbers, places = [], []
        for number, (view, own_eye, place) in enumerate(shown_views(seen, eye)):
            needed = _within(wanted, place)
            if needed is None:
                continue
            check_layers(view, names, where)
            taken = samples if samples is not None else view.renderer.samples
            plan = Plan(chosen[number][0], 1, taken, needed, _rendered(view, names))
            numbers.append(len(views))
            places.append(place)
            planned = PlannedView(view, plan, own_eye, number)
            side = eye.name if scene.stereo is not None else None
            views.append(planned.exposed(shutter_of(scene, side, number)))
        if seen.layout is None:
            return Identity(numbers[0])
        size = (seen.image.width, seen.image.height)
        return Paste(tuple(numbers), tuple(places), size, wanted, seen.layout.background)

    image, stereo = (scene.image.width, scene.image.height), scene.stereo
    composition: Composition
    if stereo is None:
        composition = part(scene, MIDDLE, make_region(image, region))
    else:
        composed_channels(stereo, names)
        whole = make_region(picture_size(stereo, image), region)
        eyes: Mapping[Side, Identity | Paste] = {
            side: part(*seen_by(scene, side), needed)
            for side, needed in eye_regions(stereo, image, whole).items()
            if needed is not None
        }
        composition = StereoPair(stereo, eyes, image, whole)
    if measures is None:
        measures = pays_to_measure(views, device, pictures)
    found = tuple(with_lanes(views, device, measures=measures, on_start=on_start))
    remark = next((remark for _, remark in chosen if remark), "")
    return Job(scene, found, composition, names, device.info, remark)


def with_size(scene: Scene, size: Any) -> Scene:
    """The scene at another size; it shows what its own size shows (see `Image.resized`).

    Args:
        size: width and height of the picture, pixels.

    Raises:
        SceneError: the size is none, too large, or one that the scene's stereo mode or layout cannot have.
    """
    width, height = arguments.numbers("size", size, 2, "width and height in pixels")
    if not (min(width, height) >= 1 and max(width, height) <= MAX_SIDE and width * height <= MAX_PIXELS):
        limits = f"must be from 1 to {MAX_SIDE} pixels a side, and {MAX_PIXELS:,} in all"
        raise SceneError(f"{limits}; got {width} x {height}", Where(path="size"))
    found = scene.model_copy(update={"image": scene.image.resized(width, height)})
    try:
        check_parts(found)
    except SceneError as error:
        if error.where.path and error.where.path.startswith("image"):
            raise SceneError(error.message, Where(path="size")) from error
        raise
    return found


def with_lanes(
    views: Sequence[PlannedView],
    device: Device,
    *,
    measures: bool,
    on_start: Callable[[str], None] | None = None,
) -> list[PlannedView]:
    """Views with the lanes of a device.

    Raises:
        DeviceError, FileError: as `best_lanes`.
    """
    lanes = lanes_of(views, device, measures=measures, on_start=on_start)
    return [
        replace(view, plan=replace(view.plan, lanes=count)) for view, count in zip(views, lanes, strict=True)
    ]


def lanes_of(
    views: Sequence[PlannedView],
    device: Device,
    *,
    measures: bool,
    on_start: Callable[[str], None] | None = None,
) -> tuple[int, ...]:
    """The lanes that a device has for each view; arguments and errors as for `best_lanes`."""
    return tuple(
        best_lanes(
            device, view.plan.precision, rule_of(view.scene.chain), measures=measures, on_start=on_start
        )
        for view in views
    )


def pays_to_measure(views: Sequence[PlannedView], device: Device, pictures: int = 1) -> bool:
    """Whether a device that is not measured yet is measured before a job: the job probably takes much longer."""
    taken = sum(
        view.plan.region.pixels * view.plan.samples * (1 + bounces(view.scene))
        for view in views
        if isinstance(view.scene.renderer, SurfaceRenderer)
    )
    seconds = pictures * taken / (_SAMPLES_A_SECOND * max(device.info.compute_units, 1))
    return seconds >= MEASURED_FIRST_SECONDS


def _rendered(view: Scene, names: tuple[str, ...]) -> tuple[str, ...]:
    """The channels that rays are sent for: those asked for, and what denoising needs."""
    found = [name for name in names if name not in NOISY]
    if view.output.denoise and {"R", "G", "B"} <= set(names):
        of_surfaces = (*ALBEDO, *NORMAL) if isinstance(view.renderer, SurfaceRenderer) else ()
        found += [name for name in ("A", *of_surfaces) if name not in found]
    return tuple(found)


def _within(region: Region, place: Place) -> Region | None:
    """The part of a view that lies in a region of the picture, in the view's own pixels; None if it is none."""
    left, top = max(place.x, region.x), max(place.y, region.y)
    right, bottom = min(place.x + place.width, region.right), min(place.y + place.height, region.bottom)
    if left >= right or top >= bottom:
        return None
    return Region(left - place.x, top - place.y, right - left, bottom - top)
