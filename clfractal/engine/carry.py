"""Pictures of a camera that moves: a part is rendered, the rest is carried over from the picture before."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.camera.views import View
from clfractal.device import program
from clfractal.device.compiler import Argument, Warm
from clfractal.device.groups import fitting
from clfractal.device.select import Device
from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Field, Struct
from clfractal.device.watched import Watched
from clfractal.elements.lights.directional import DirectionalLight
from clfractal.engine.canvas import PIXEL_GROUP, Canvas, whole_groups
from clfractal.engine.job import Job
from clfractal.integrators.plan import PlannedView
from clfractal.integrators.records import bounces
from clfractal.integrators.waves import has_lens
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.lighting import Light
from clfractal.scene.model import Scene
from clfractal.scene.surface import SurfaceRenderer

PHASES = ((0, 0), (1, 1), (1, 0), (0, 1))
"""Which pixel of every 2 x 2 is rendered, from frame to frame."""
RENDERED = 1 / len(PHASES)
"""The part of a moving picture's pixels that is rendered."""
OLDEST = 6
"""For so many frames, at most, a pixel shows what was rendered once."""
_CHANNELS = {"R", "G", "B", "A", "Z"}
_ONE_SURFACE = 12.0
"""Neighbours are of one surface if their depths differ by no more, pixels."""

CARRY = Struct(
    "Carry",
    [
        Field("there", "float", 12, "rows: a pixel of the picture in the one before, see `seen_in`"),
        Field("back", "float", 12, "the other way"),
        Field("finer", "float", 0, "pixels of the picture before for one of the picture"),
        Field("step", "float", 0, "depths of one surface differ by less, for each unit of depth"),
        Field("perspective", "int", 0, "1: rays leave the eye; 0: rays are parallel"),
        Field("phase_x", "int", 0, "the first column that is rendered, and then every second one"),
        Field("phase_y", "int", 0, "the same of rows"),
        Field("fresh_offset", "int", 0, "first rendered pixel in its canvas"),
        Field("fresh_width", "int"),
        Field("fresh_height", "int"),
        Field("old_offset", "int", 0, "the same of the picture before"),
        Field("old_width", "int"),
        Field("old_height", "int"),
        Field("old_is_carried", "int", 0, "1: its pixels have ages"),
        Field("offset", "int", 0, "the same of the picture"),
        Field("width", "int"),
        Field("height", "int"),
        Field("oldest", "int", 0, "frames that a pixel may be carried over"),
    ],
)


def can_carry(old: Job, job: Job) -> bool:
    """Whether a job's pictures look at what an older job's do, from elsewhere, and nothing in them hangs on the eye but
    highlights, fog and glow: neither mirrors, nor lenses, nor planes that show what is behind them."""
    return len(old.views) == len(job.views) and all(
        _can_follow(before, view) for before, view in zip(old.views, job.views, strict=True)
    )


def _can_follow(old: PlannedView, view: PlannedView) -> bool:
    scene, region = view.scene, view.plan.region
    plain = isinstance(scene.renderer, SurfaceRenderer) and not isinstance(scene.lighting, PathLighting)
    if not plain or has_lens(scene) or has_lens(old.scene) or bounces(scene) > 0 or scene.cut_planes:
        return False
    # The points of a pixel would lie as far apart as those of a pixel of twice its size.
    if scene.surface.used_points.count > 1:
        return False
    if old.shutter is not None or view.shutter is not None:
        return False
    if type(old.scene.camera) is not type(scene.camera) or not set(view.plan.channels) >= _CHANNELS:
        return False
    whole = (region.x, region.y) == (0, 0) and region == old.plan.region
    return whole and _looked_at(old.scene, scene) == scene


def _looked_at(scene: Scene, by: Scene) -> Scene:
    """A scene with the view of another, and what does not concern its pixels."""
    names = ("camera", "stereo", "output", "animation", "bookmarks")
    update: dict[str, object] = {name: getattr(by, name) for name in names}
    if scene.lights != by.lights and len(scene.lights) == len(by.lights):
        update["lights"] = tuple(
            one.model_copy(update={"direction": other.direction})
            if _goes_along(one, scene) and _goes_along(other, by)
            else one
            for one, other in zip(scene.lights, by.lights, strict=True)
        )
    return scene.model_copy(update=update)


def _goes_along(light: Light, scene: Scene) -> TypeGuard[DirectionalLight]:
    """Whether a light shines where the camera looks: what it lights changes as slowly as highlights move."""
    return isinstance(light, DirectionalLight) and light.direction == scene.camera.ahead


def program_text() -> FlatText:
    """The whole text of the program."""
    return flatten("images/carry.cl", generated={"carry_structs.h": CARRY.c_text("float32")}, defines={})


class Carrier:
    """Makes moving pictures on one device.

    Raises:
        DeviceError, KernelBuildError: its program cannot be built.
    """

    def __init__(self, device: Device, stopped: Callable[[], bool] | None = None) -> None:
        self.device = device
        text = program_text()
        warm = Warm("carry", PIXEL_GROUP, PIXEL_GROUP, (Argument("buffer", 1 << 16),) * 9)
        built = program.build(
            device,
            text.text,
            flags=program.math_flags("float32"),
            sources=text.sources,
            warm=[warm],
            stopped=stopped,
        )
        self._kernel = built.kernel("carry")
        self._records: list[Watched] = []
        self._ages: list[Any] = []
        self._room = 0
        self._turn = 0
        # The canvas whose ages are known, and its stamp then.
        self._made: tuple[Canvas, int] | None = None
        self.fresh = Canvas(device)

    def begin(self, job: Job, divider: int) -> Job:
        """The job of the pixels that are rendered next, of a picture with so coarse pixels: onto `fresh`."""
        self._turn = (self._turn + 1) % len(PHASES)
        sparse = replace(job, views=tuple(view.sparse(divider, PHASES[self._turn]) for view in job.views))
        self.fresh.fit(sparse.views)
        return sparse

    def carry(
        self, old: Sequence[PlannedView], old_canvas: Canvas, views: Sequence[PlannedView], canvas: Canvas
    ) -> None:
        """Fills a canvas from the pixels that were rendered and from the picture before; in the device's queue.

        Args:
            old: views of the picture before, as they are on its canvas.
            views: those of the picture.
        """
        known = self._made == (old_canvas, old_canvas.stamp)
        if canvas.pixels > self._room:
            self._ages, self._room = [], 0
            self._ages = [self.device.buffer(canvas.pixels, "a picture on the screen") for _ in range(2)]
            known, self._room = False, canvas.pixels
        while len(self._records) < len(views):
            self._records.append(Watched(self.device, np.zeros(1, CARRY.dtype("float32"))))
        ages, old_ages = self._ages
        with self.device.failures("carrying a picture over"):
            for number, (before_view, view) in enumerate(zip(old, views, strict=True)):
                record = self._record(number, (before_view, old_canvas), (view, canvas), known=known)
                sent = self._records[number]
                sent.put(self.device.queue, record)
                buffers = (self.fresh.colors, self.fresh.depths, old_canvas.colors, old_canvas.depths)
                self._kernel.set_args(*buffers, old_ages, canvas.colors, canvas.depths, ages, sent.buffer)
                region = canvas.parts[number].region
                size = whole_groups((region.width, region.height), PIXEL_GROUP)
                group = fitting(self.device, self._kernel, PIXEL_GROUP)
                cl.enqueue_nd_range_kernel(self.device.queue, self._kernel, size, group)
            self.device.queue.finish()
        self._ages = [old_ages, ages]
        self._made = (canvas, canvas.stamp)

    def ages(self, number: int) -> npt.NDArray[np.uint8]:
        """How many frames ago each pixel of a view was rendered, of the picture that was made last."""
        assert self._made is not None
        part = self._made[0].parts[number]
        found = np.empty((part.region.height, part.region.width), np.uint8)
        cl.enqueue_copy(self.device.queue, found, self._ages[1], src_offset=part.offset)
        return found

    def _record(
        self, number: int, old: tuple[PlannedView, Canvas], new: tuple[PlannedView, Canvas], *, known: bool
    ) -> npt.NDArray[np.void]:
        (before, old_canvas), (view, canvas) = old, new
        there, back = places(view, before)
        was, part, fresh = old_canvas.parts[number], canvas.parts[number], self.fresh.parts[number]
        camera = view.camera
        away = float((camera.center - camera.eye) @ camera.axis) if camera.eye is not None else 1.0
        values = {
            "there": there[:3].ravel(),
            "back": back[:3].ravel(),
            "finer": part.divider / was.divider,
            "step": _ONE_SURFACE * part.divider * camera.height / view.scene.image.height / away,
            "perspective": int(camera.eye is not None),
            "phase_x": PHASES[self._turn][0],
            "phase_y": PHASES[self._turn][1],
            "fresh_offset": fresh.offset,
            "fresh_width": fresh.region.width,
            "fresh_height": fresh.region.height,
            "old_offset": was.offset,
            "old_width": was.region.width,
            "old_height": was.region.height,
            "old_is_carried": int(known),
            "offset": part.offset,
            "width": part.region.width,
            "height": part.region.height,
            "oldest": OLDEST,
        }
        return CARRY.array("float32", [values])


def places(view: PlannedView, other: PlannedView) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Where pixels of a view lie in another one, and the other way: 4 x 4, for columns (x w, y w, depth, 1); w is the
    depth, or 1 where rays are parallel."""
    here, there = _to_space(view), _to_space(other)
    return np.linalg.inv(there) @ here, np.linalg.inv(here) @ there


def _to_space(view: PlannedView) -> npt.NDArray[np.float64]:
    """The same from a view's pixels to scene units."""
    camera: View = view.camera
    divider, image = view.plan.divider, view.scene.image
    first = view.plan.first
    right = camera.side * (camera.width / image.width)
    down = camera.up * (-camera.height / image.height)
    corner = camera.center + (first[0] - image.width / 2) * right + (first[1] - image.height / 2) * down
    found = np.eye(4)
    if camera.eye is None:
        columns = (divider * right, divider * down, camera.axis)
        found[:3, 3] = corner - ((corner - camera.origin) @ camera.axis) * camera.axis
    else:
        away = (camera.center - camera.eye) @ camera.axis
        columns = (divider * right / away, divider * down / away, (corner - camera.eye) / away)
        found[:3, 3] = camera.eye
    for number, column in enumerate(columns):
        found[:3, number] = column
    return found
