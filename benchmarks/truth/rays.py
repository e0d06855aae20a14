"""The rays of a scene's pixels, and what a picture says about them, in float64."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import scene_view
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Rays:
    """Rays through the middles of pixels, n of them.

    Attributes:
        origin, direction: shape (n, 3), scene units; directions have length 1.
        footprint, spread: shape (n,): a pixel is footprint + spread * t wide at distance t (as `camera.h`).
        near, far: the part within the scene's bounds, shape (n,); empty (near >= far) where a ray misses them.
    """

    origin: Floats
    direction: Floats
    footprint: Floats
    spread: Floats
    near: Floats
    far: Floats

    def __len__(self) -> int:
        return len(self.near)

    def __getitem__(self, chosen: Any) -> Rays:
        """Some of them, by indices or a mask."""
        fields = (self.origin, self.direction, self.footprint, self.spread, self.near, self.far)
        return Rays(*(field[chosen] for field in fields))

    def at(self, t: Floats) -> Floats:
        """Points at distances: shape (n,) or (n, k) gives (n, 3) or (n, k, 3)."""
        if t.ndim == 1:
            return self.origin + t[:, None] * self.direction
        return self.origin[:, None] + t[..., None] * self.direction[:, None]

    def width(self, t: Floats) -> Floats:
        """A pixel's width at distances: shape (n,) or (n, k), scene units."""
        if t.ndim == 1:
            return self.footprint + self.spread * t
        return self.footprint[:, None] + self.spread[:, None] * t

    def along(self, t: Floats, widths: Floats) -> Floats:
        """Where one gets from distances t, shape (n,), by going some pixel widths, shape (n, k) or (k,): shape (n, k)."""
        widths = np.broadcast_to(widths, (len(self), np.shape(widths)[-1]))
        grown = np.log1p(self.spread)[:, None]
        # Steps of a pixel's width each make a geometric series where pixels grow with the distance.
        wide = np.where(
            grown > 0, np.expm1(widths * grown) / np.maximum(self.spread, 1e-300)[:, None], widths
        )
        return t[:, None] + wide * self.width(t)[:, None]


def pixel_rays(scene: Scene, x: npt.ArrayLike, y: npt.ArrayLike) -> Rays:
    """The rays through the middles of pixels (columns x, rows y, shape (n,)) of a scene without a lens."""
    view = scene_view(scene)
    width, height = scene.image.width, scene.image.height
    across = ((np.asarray(x, float) + 0.5) / width - 0.5) * view.width
    rise = (0.5 - (np.asarray(y, float) + 0.5) / height) * view.height
    on_plane = view.center + across[:, None] * view.side + rise[:, None] * view.up
    pixel = view.pixel_size(height)
    if view.eye is None:
        origin, direction = on_plane, np.tile(view.axis, (len(on_plane), 1))
        footprint, spread = np.full(len(origin), pixel), np.zeros(len(origin))
    else:
        direction = on_plane - view.eye
        inverse = 1 / np.linalg.norm(direction, axis=1)
        direction *= inverse[:, None]
        origin = np.tile(view.eye, (len(direction), 1))
        footprint, spread = np.zeros(len(origin)), pixel * inverse
    center, radius = scene.bounds
    near, far = chord(origin, direction, np.array(center), radius)
    return Rays(origin, direction, footprint, spread, np.maximum(near, 0.0), far)


def chord(origin: Floats, direction: Floats, center: Floats, radius: float) -> tuple[Floats, Floats]:
    """Where rays, shape (n, 3), enter and leave a ball; (0, -1) where they miss it."""
    offset = origin - center
    middle = -np.sum(offset * direction, axis=1)
    nearest = offset + middle[:, None] * direction
    square = radius**2 - np.sum(nearest * nearest, axis=1)
    half = np.sqrt(np.maximum(square, 0.0))
    return np.where(square > 0, middle - half, 0.0), np.where(square > 0, middle + half, -1.0)


def ray_distances(scene: Scene, rays: Rays, depth: npt.ArrayLike) -> Floats:
    """Distances along rays of what lies at depths (channel Z), shape (n,); inf stays inf."""
    view = scene_view(scene)
    start = (rays.origin - view.origin) @ view.axis
    result: Floats = (np.asarray(depth, np.float64) - start) / (rays.direction @ view.axis)
    return result


def all_pixels(framebuffer: Framebuffer) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Columns and rows of all pixels, each of shape (height * width,), row by row."""
    rows, columns = np.indices((framebuffer.height, framebuffer.width))
    return columns.ravel(), rows.ravel()
