"""A picture as it is measured: where each pixel's ray met the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.truth.rays import Floats, Rays, all_pixels, pixel_rays, ray_distances
from clfractal.engine.engine import Engine
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene


@dataclass(frozen=True, slots=True)
class Seen:
    """All pixels of a picture, row by row.

    Attributes:
        framebuffer: with the channel Z, and others that were asked for.
        rays: through the pixels' middles.
        x, y: columns and rows.
        t: distances along the rays to what was hit, scene units; inf where nothing was.
    """

    framebuffer: Framebuffer
    rays: Rays
    x: npt.NDArray[np.intp]
    y: npt.NDArray[np.intp]
    t: Floats


def see(scene: Scene, engine: Engine, *channels: str, precision: str | None = None) -> Seen:
    """Renders a scene with one sample to a pixel.

    Raises:
        DeviceError, KernelBuildError: the device failed.
    """
    framebuffer = engine.render(scene, samples=1, channels=("Z", *channels), precision=precision)
    x, y = all_pixels(framebuffer)
    rays = pixel_rays(scene, x, y)
    return Seen(framebuffer, rays, x, y, ray_distances(scene, rays, framebuffer["Z"].ravel()))
