"""Probing: what lies at a pixel of a job's picture, whichever view and eye shows it."""

from __future__ import annotations

from dataclasses import dataclass

from clfractal.device.select import by_key
from clfractal.engine.job import Identity, Job, Paste, StereoPair
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.preview import Preview
from clfractal.errors import SceneError, Where, arguments
from clfractal.images.compose import Side
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.modes import eye_at
from clfractal.images.probe import CHANNELS, Probe, probe_of
from clfractal.images.tiles import Region


@dataclass(frozen=True, slots=True)
class Place:
    """Where a pixel of the finished picture comes from: the job's view with this number, a pixel of it, and the eye."""

    view: int
    x: int
    y: int
    eye: Side | None


def place_at(job: Job, x: int, y: int, side: Side | None = None) -> Place | None:
    """The place that a pixel of a job's picture comes from; None between the views of a layout.

    Args:
        side: the eye whose own picture is meant; None: the finished picture. Of pictures that stay apart it is then the
            left one.
    """
    made = job.composition
    if isinstance(made, StereoPair):
        if side is None and job.stays_apart:
            side = "left"
        if side is None:
            number, across, down = eye_at(made.stereo, made.image, x, y)
            side, x, y = ("right" if number else "left"), int(across), int(down)
        part: Identity | Paste = made.eyes[side]
    else:
        part = made
    if isinstance(part, Identity):
        return Place(part.view, x, y, side)
    for number, place in reversed(list(zip(part.views, part.places, strict=True))):
        if place.x <= x < place.x + place.width and place.y <= y < place.y + place.height:
            return Place(number, x - place.x, y - place.y, side)
    return None


def probed(job: Job, x: int, y: int, preview: Preview, side: Side | None = None) -> Probe:
    """What lies at a pixel of a job's picture, by one ray through its middle.

    Raises:
        SceneError: the pixel is between the views of a layout.
        DeviceError, KernelBuildError: as of a render.
    """
    place = _shown_place(job, x, y, side)
    view = job.views[place.view]
    values = preview.pixel(job, view, place.x, place.y)
    return probe_of(values, view.camera, x=x, y=y, view=_number(job, place), eye=place.eye)


def checked_pixel(x: object, y: object, region: Region) -> tuple[int, int]:
    """A pixel, if it lies in a region.

    Raises:
        SceneError: it does not, or is no whole number.
    """
    return (
        arguments.whole("x", x, region.x, region.right - 1),
        arguments.whole("y", y, region.y, region.bottom - 1),
    )


@dataclass(frozen=True, slots=True)
class FramebufferProber:
    """Answers `Framebuffer.probe`: from the framebuffer's channels if they are enough, else by a ray on the
    framebuffer's device.

    Attributes:
        job: what the framebuffer shows.
        side: the eye, if the framebuffer is one eye's picture.
    """

    job: Job
    side: Side | None = None

    def __call__(self, framebuffer: Framebuffer, x: int, y: int) -> Probe:
        """What lies at a pixel; see `Framebuffer.probe`."""
        column, row = checked_pixel(x, y, framebuffer.region)
        if not set(CHANNELS) <= set(framebuffer.channels):
            device = by_key(self.job.device.index, self.job.device.key)
            return probed(self.job, column, row, Preview(device, LocalExecutor(device)), self.side)
        place = _shown_place(self.job, column, row, self.side)
        at = row - framebuffer.region.y, column - framebuffer.region.x
        values = {name: float(framebuffer[name][at]) for name in CHANNELS}
        camera = self.job.views[place.view].camera
        return probe_of(values, camera, x=column, y=row, view=_number(self.job, place), eye=place.eye)


def _shown_place(job: Job, x: int, y: int, side: Side | None) -> Place:
    place = place_at(job, x, y, side)
    if place is None:
        raise SceneError(f"the pixel {x},{y} lies between the views of the layout", Where())
    return place


def _number(job: Job, place: Place) -> int | None:
    return None if job.scene.layout is None else job.views[place.view].number
