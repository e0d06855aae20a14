"""The plan: all that a renderer decides before it touches a device, as plain data that can travel."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from clfractal.camera.views import View, scene_view
from clfractal.device.structs import Precision
from clfractal.errors import SceneError, Where
from clfractal.files.channels import check_channels
from clfractal.geometry.fineness import Fineness
from clfractal.images.tiles import Region
from clfractal.integrators.shutter import Shutter
from clfractal.scene.checks import used_boxes
from clfractal.scene.model import Scene
from clfractal.scene.stereo import MIDDLE, Eye
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer

PrecisionChoice = Literal["auto", "float32", "float64"]

# float32 is given up where a pixel is less than this many of its steps wide: distances are differences of coordinates,
# and hits, normals and shadow starts work at fractions of a pixel.
FLOAT32_STEPS_PER_PIXEL = 64.0
# Orbits of a place shown magnified: below this, what is seen is made of rounding.
DEEP_STEPS_PER_PIXEL = 16.0
# Normals that are made from the places of a pixel's points want these this much finer: a place that is off by a 512th of
# the way to the next turns the normal by a tenth of a degree.
PLACES_PER_POINT = 8.0


@dataclass(frozen=True, slots=True)
class Plan:
    """How a scene is rendered.

    Attributes:
        precision: the number type of every ray.
        lanes: rays a work-item carries.
        samples: rays per pixel.
        region: the part of the picture to render, in pixels.
        channels: what the framebuffer holds, in order.
        divider: n for a coarse picture, which has every nth pixel of the picture in each direction; the region is counted
            in these.
        offset: to the right and down, pixels of the picture by which those of a coarse one are moved.
        moving: whether the view moves while the picture is taken.
        eye_body: the number of the body of the set that the eye is in, see `eye_body`.
    """

    precision: Precision
    lanes: int
    samples: int
    region: Region
    channels: tuple[str, ...]
    divider: int = 1
    moving: bool = False
    offset: tuple[float, float] = (0.0, 0.0)
    eye_body: int = 0

    @property
    def first(self) -> tuple[float, float]:
        """The place of its pixel (0, 0) in the picture, pixels from the corner."""
        middle = (self.divider + (self.divider > 1)) / 2
        return middle + self.offset[0], middle + self.offset[1]


@dataclass(frozen=True, slots=True)
class PlannedView:
    """One view of a picture and how it is rendered.

    Attributes:
        scene: what is seen; its `image` has the view's own size, and it has no layout.
        plan: how it is rendered.
        eye: whose view it is, of a stereo scene.
        number: which of the layout's views it is.
        shutter: when it is taken, if anything moves meanwhile.
        poses: the view at equal steps of that time, from its beginning to its end, if it moves.
        changing: whether each sample has a scene of its own: see `at_sample`.
    """

    scene: Scene
    plan: Plan
    eye: Eye = MIDDLE
    number: int = 0
    shutter: Shutter | None = None
    poses: tuple[View, ...] = ()
    changing: bool = False

    def exposed(self, shutter: Shutter | None) -> PlannedView:
        """The same view, taken while a shutter is open.

        Raises:
            SceneError, FormulaError: a value is out of its range meanwhile; at its track.
        """
        if shutter is None:
            return self
        moving, changing = shutter.moves_view(), shutter.moves_others(self.plan.samples)
        if not (moving or changing):
            return self
        poses = shutter.poses(shutter.opens, shutter.closes) if moving else ()
        plan = replace(self.plan, moving=moving)
        return replace(self, plan=plan, shutter=shutter, poses=poses, changing=changing)

    def at_sample(self, sample: int) -> PlannedView:
        """The view as one of its samples sees it: the scene in the middle of the sample's part of the time.

        Raises:
            SceneError, FormulaError: a value is out of its range then; at its track.
        """
        if self.shutter is None or not self.changing:
            return self
        start, end = self.shutter.part(sample, self.plan.samples)
        scene, eye = self.shutter.seen((start + end) / 2)
        poses = self.shutter.poses(start, end) if self.plan.moving else ()
        return replace(self, scene=scene, eye=eye, poses=poses)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the view's whole picture, in the plan's pixels."""
        image, coarse = self.scene.image, self.plan.divider
        return -(-image.width // coarse), -(-image.height // coarse)

    @property
    def camera(self) -> View:
        """Its plane and eye in space."""
        return scene_view(self.scene, self.eye)

    def coarse(self, divider: int) -> PlannedView:
        """The same view with fewer pixels, each with one sample: one for `divider` x `divider` of the picture's."""
        region = self.plan.region
        left, top = region.x // divider, region.y // divider
        small = Region(left, top, -(-region.right // divider) - left, -(-region.bottom // divider) - top)
        return replace(self, plan=replace(self.plan, samples=1, region=small, divider=divider))

    def sparse(self, divider: int, phase: tuple[int, int]) -> PlannedView:
        """Every second pixel of the coarse view in each direction, from column and row `phase` on: 0 or 1."""
        half = self.coarse(2 * divider)
        to = self.coarse(divider).plan.first
        at = half.plan.first
        offset = (to[0] + divider * phase[0] - at[0], to[1] + divider * phase[1] - at[1])
        return replace(half, plan=replace(half.plan, offset=offset))


def finest_steps(scene: Scene, view: View) -> float:
    """Width of the narrowest pixel footprint that the picture may show, in float32 steps of the coordinates there."""
    found, radius = scene.bounds
    center = np.array(found)
    footprint = view.pixel_size(max(scene.image.height, scene.image.reference))
    # (Objects are met by their equations: those that stand beside a formula do not count either.)
    if view.eye is not None and scene.has_set:
        plane = float((view.center - view.eye) @ view.axis)
        # Inside the bounds the surface may be anywhere; what the camera is aimed at sets the scale.
        nearest = float(np.linalg.norm(center - view.eye)) - radius
        footprint *= min(nearest, plane) / plane if nearest > 0 else 1.0
    magnitude = max(float(np.abs(view.center).max()), float(np.abs(view.origin).max()), 1e-30)
    unit = magnitude * float(np.finfo(np.float32).eps)
    renderer = scene.renderer
    if isinstance(renderer, VolumeRenderer):
        return _finest_voxels(scene, renderer, footprint)
    if not isinstance(renderer, SurfaceRenderer):
        # A point of a plane is rounded at its own coordinates, and its orbit at the size of the set.
        reach = np.abs(view.side) * view.width / 2 + np.abs(view.up) * view.height / 2
        farthest = float((np.abs(view.center) + reach).max())
        return footprint / (max(farthest, radius) * float(np.finfo(np.float32).eps))
    # The points of a pixel lie closer, and normals that are made from their places need them exact.
    footprint /= math.sqrt(renderer.used_points.count)
    if renderer.normal_of_points or scene.coloring.kind.known == "with_points":
        footprint /= PLACES_PER_POINT
    finer = max(scene.image.height / scene.image.reference, 1.0)
    return Fineness.of(scene).detail * finer * footprint / unit


def _finest_voxels(scene: Scene, renderer: VolumeRenderer, footprint: float) -> float:
    """Of a volume it is the voxels that are evaluated; their coordinates are found in float64, and rounded once.

    Cut planes are evaluated where pixels of this footprint meet them.
    """
    if renderer.file is not None:
        return math.inf
    _, box = used_boxes(scene, renderer)
    sides = np.array(box.sides)
    resolution = renderer.resolution if isinstance(renderer.resolution, tuple) else (renderer.resolution,) * 3
    voxel = float(
        (sides / np.array(resolution)).min()
        if isinstance(renderer.resolution, tuple)
        else sides.max() / resolution[0]
    )
    magnitude = max(float((np.abs(np.array(box.center)) + sides / 2).max()), 1e-30)
    finest = min(voxel, footprint / renderer.magnification) if scene.cut_planes else voxel
    return finest / (magnitude * float(np.finfo(np.float32).eps))


def choose_precision(
    scene: Scene, wanted: PrecisionChoice, *, has_float64: bool, eye: Eye = MIDDLE
) -> tuple[Precision, str]:
    """The number type for a scene, and a remark for the user (empty if there is nothing to remark).

    Raises:
        SceneError: float64 is asked for on a device without it.
    """
    if wanted == "float64" and not has_float64:
        raise SceneError("the device has no float64; use float32", Where(path="precision"))
    if scene.deep is not None:
        if wanted == "float32" or not has_float64:
            cause = "the device has none" if wanted != "float32" else "got float32"
            raise SceneError(f"deep needs float64, and {cause}", Where(path="precision"))
        return "float64", _of_deep(scene)
    if wanted != "auto":
        return wanted, ""
    view = scene_view(scene, eye)
    if finest_steps(scene, view) >= FLOAT32_STEPS_PER_PIXEL:
        return "float32", ""
    if has_float64:
        return "float64", ""
    return "float32", "pixels are finer than float32 resolves here, and the device has no float64"


def _of_deep(scene: Scene) -> str:
    """The remark on a place at which orbits are not told apart."""
    from clfractal.formulas.deep import steps_per_pixel  # which asks for many digits

    if steps_per_pixel(scene.chain) >= DEEP_STEPS_PER_PIXEL:
        return ""
    return (
        "deep.center lies on a fold of the formula, or its orbit near a critical point: float64 does not tell orbits around"
        " it apart at this magnification; another centre nearby may do"
    )


def make_region(size: tuple[int, int], region: tuple[int, int, int, int] | None) -> Region:
    """The region `x, y, width, height` of a picture of `size`, or all of it; pixels.

    Raises:
        SceneError: it is empty or does not lie inside the picture.
    """
    width, height = size
    if region is None:
        return Region(0, 0, width, height)
    x, y, w, h = region
    if w < 1 or h < 1 or x < 0 or y < 0 or x + w > width or y + h > height:
        got = ",".join(str(value) for value in region)
        raise SceneError(
            f"must lie inside the picture of {width} x {height} pixels, got {got}", Where(path="region")
        )
    return Region(x, y, w, h)


def make_plan(
    scene: Scene,
    *,
    precision: Precision,
    lanes: int,
    samples: int | None = None,
    region: tuple[int, int, int, int] | None = None,
    channels: tuple[str, ...] | None = None,
) -> Plan:
    """A plan for a scene; what is None is taken from the scene."""
    return Plan(
        precision,
        lanes,
        samples if samples is not None else scene.renderer.samples,
        make_region((scene.image.width, scene.image.height), region),
        check_channels(channels if channels is not None else scene.output.channels),
    )
