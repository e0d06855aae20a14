"""Previews of a scene before it is rendered: small pictures with depth, and single pixels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View, scene_view
from clfractal.device.select import Device
from clfractal.engine.job import Identity, Job
from clfractal.engine.prepare import prepare
from clfractal.engine.run import Executor, run
from clfractal.files.channels import RAY_CHANNELS
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.tiles import Region
from clfractal.integrators.plan import PlannedView
from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera
from clfractal.scene.stereo import MIDDLE, Eye

Floats = npt.NDArray[np.float64]

# Largest width of a preview, pixels.
_SIDE = 320
_CHANNELS = ("R", "G", "B", "A", "Z")
# A lens that is open by so little blurs nothing, and needs no other program than the picture's.
_CLOSED = 1e6


class Preview:
    """Previews of a scene, by an executor on a device."""

    def __init__(self, device: Device, executor: Executor) -> None:
        self.device, self.executor = device, executor

    def framebuffer(self, scene: Scene, eye: Eye = MIDDLE) -> Framebuffer:
        """What an eye sees of a scene with one view: a small picture with R, G, B, A and Z, one sample per pixel.

        Raises:
            DeviceError, KernelBuildError: as of a render.
        """
        return self._rendered(*self._planned(_small(scene), eye))

    def points(self, scene: Scene, eye: Eye = MIDDLE) -> Floats:
        """The same as points: shape (n, 3), scene units.

        Raises:
            DeviceError, KernelBuildError: as of a render.
        """
        framebuffer = self.framebuffer(scene, eye)
        return points_of_depth(scene_view(_small(scene), eye), framebuffer["Z"], framebuffer.display)

    def depth(self, scene: Scene, place: tuple[float, float], eye: Eye = MIDDLE) -> float | None:
        """The depth of what lies nearest to a place of the picture, along the view axis, scene units; None if it is empty.

        The place itself is looked at as finely as the picture shows it. If nothing lies there, the nearest place of a
        preview counts.

        Args:
            place: parts of the width and the height, from the top left.

        Raises:
            DeviceError, KernelBuildError: as of a render.
        """
        job, view = self._planned(scene, eye)
        size = view.size
        x, y = (min(int(part * side), side - 1) for part, side in zip(place, size, strict=True))
        exact = self.pixel(job, view, x, y)["Z"]
        if 0 < exact < np.inf:
            return exact
        small = self.framebuffer(scene, eye)
        rows, columns = np.nonzero(np.isfinite(small["Z"]) & (small["Z"] > 0))
        if not len(rows):
            return None
        across = (columns + 0.5) / small.width - place[0]
        down = (rows + 0.5) / small.height - place[1]
        nearest = np.argmin((across * size[0]) ** 2 + (down * size[1]) ** 2)
        return float(small["Z"][rows[nearest], columns[nearest]])

    def pixel(self, job: Job, view: PlannedView, x: int, y: int) -> Mapping[str, float]:
        """Every channel of one pixel of a job's view: one ray through its middle.

        Raises:
            DeviceError, KernelBuildError: as of a render.
        """
        plan = replace(view.plan, samples=1, region=Region(x, y, 1, 1), channels=RAY_CHANNELS, divider=1)
        closed = replace(view, scene=_with_closed_lens(view.scene), plan=plan)
        framebuffer = self._rendered(job, closed)
        return {name: float(framebuffer[name][0, 0]) for name in framebuffer}

    def _planned(self, scene: Scene, eye: Eye) -> tuple[Job, PlannedView]:
        """The view of any eye, with a job for it."""
        closed = _with_closed_lens(scene)
        alone: dict[str, Any] = {"output": scene.output.model_copy(update={"denoise": False})}
        if scene.stereo is not None:
            alone["stereo"] = scene.stereo.model_copy(update={"mode": "left", "fit": None})
        job = prepare(closed.model_copy(update=alone), self.device, samples=1, channels=_CHANNELS)
        return job, replace(job.views[0], scene=closed, eye=eye)

    def _rendered(self, job: Job, view: PlannedView) -> Framebuffer:
        framebuffer = Framebuffer(view.plan.channels, view.size, view.plan.region)
        run(replace(job, views=(view,), composition=Identity(0)), [framebuffer], self.executor)
        return framebuffer


def points_of_depth(
    view: View, depth: npt.NDArray[np.float32], size: tuple[int, int], origin: tuple[int, int] = (0, 0)
) -> Floats:
    """The points that a picture's pixels show, shape (n, 3), scene units.

    Args:
        depth: channel Z of some of its pixels, shape (rows, columns), scene units.
        size: width and height of the whole picture, pixels.
        origin: x and y of the first of them.
    """
    # (An eye inside the solid sees points at its own place.)
    rows, columns = np.nonzero(np.isfinite(depth) & (depth > 0))
    return view.points_at(origin[0] + columns + 0.5, origin[1] + rows + 0.5, size, depth[rows, columns])


def _small(scene: Scene) -> Scene:
    scale = min(1.0, _SIDE / max(scene.image.width, scene.image.height))
    width, height = (max(round(side * scale), 1) for side in (scene.image.width, scene.image.height))
    return scene.model_copy(update={"image": scene.image.resized(width, height)})


def _with_closed_lens(scene: Scene) -> Scene:
    camera = scene.camera
    if not isinstance(camera, PerspectiveCamera) or camera.lens_radius == 0:
        return scene
    return scene.model_copy(update={"camera": camera.model_copy(update={"f_number": _CLOSED})})
