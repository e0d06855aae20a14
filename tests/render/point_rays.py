"""Scenes of a ball over a box with several points to the pixel, and the rays of those points.

Every point's ray is known, so what they find is known too: where it meets the ball, and the normals that the oracle makes
of these places.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from clfractal.device.select import Device
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from tests.render import normals_oracle as oracle
from tests.render.normals_oracle import unit
from tests.render.sequence import stochastic_points
from tests.render.shots import (
    CAMERAS,
    SOLIDS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    Floats,
    rays,
    shoot,
    to_sphere,
)
from tests.scenes import scene_of

Bools = npt.NDArray[np.bool_]

SIDE, DETAIL, COUNT = 48, 0.05, 9
LAMP = np.array([0.48, -0.6, 0.64])  # direction to the light
Variant = tuple[str, str, str]


def scene_for(variant: Variant, camera: str, seed: int = 0) -> Scene:
    search, normal, pattern = variant
    return scene_of(
        SOLIDS,
        CAMERAS[camera],
        (SIDE, SIDE),
        background="transparent",
        lights=[{"direction": (-LAMP).tolist(), "shadow": False}],
        material={"color": [1, 1, 1], "ambient": 0, "diffuse": 1, "specular": 0},
        renderer={
            "search": search,
            "step": 0.004,
            "normal": normal,
            "points": {"pattern": pattern, "count": COUNT},
            "detail": DETAIL,
            "seed": seed,
        },
    )


def offsets(pattern: str, seed: int) -> tuple[Floats, Floats]:
    """Places of the points, pixels right and down from the pixel's centre, shape (SIDE, SIDE, COUNT)."""
    if pattern == "grid":
        steps = (np.arange(3) - 1) / 3
        below, across = np.meshgrid(steps, steps, indexing="ij")
        shape = (SIDE, SIDE, COUNT)
        return np.broadcast_to(across.ravel(), shape), np.broadcast_to(below.ravel(), shape)
    y, x = np.indices((SIDE, SIDE))
    return stochastic_points(x, y, COUNT, seed)


@dataclass(frozen=True)
class Shot:
    """A picture, and the rays of all its points: shapes (SIDE, SIDE, COUNT, 3) and (SIDE, SIDE, COUNT)."""

    scene: Scene
    framebuffer: Framebuffer
    across: Floats
    below: Floats
    origin: Floats
    way: Floats
    footprint: Floats  # at the ball's distance, scene units, (SIDE, SIDE)

    def ball(self) -> tuple[Floats, Bools]:
        """Where each point meets the ball, and the pixels of which all do and that lie away from its rim."""
        t, nearest = to_sphere(self.origin, self.way, SPHERE_CENTER, SPHERE_RADIUS)
        places: Floats = self.origin + np.where(np.isfinite(t), t, 0)[..., None] * self.way
        return places, np.asarray((nearest < 0.9 * SPHERE_RADIUS).all(axis=-1))

    def reach(self) -> Floats:
        """More than the distance of a hit and what is lost by rounding, scene units, (SIDE, SIDE)."""
        by_distance = self.scene.surface.search == "distance"
        return 1e-5 + self.footprint * (0.5 * DETAIL if by_distance else 0)

    def meets(self, grown: float | Floats) -> Bools:
        """Which rays meet the ball or the box if both are larger by `grown`, (SIDE, SIDE)."""
        more = np.broadcast_to(grown, (SIDE, SIDE))[..., None]
        nearest = to_sphere(self.origin, self.way, SPHERE_CENTER, 1.0)[1]
        high = np.array([1.2, 1.2, 0.0]) + more[..., None]
        low = np.array([-1.2, -1.2, -0.5]) - more[..., None]
        ends = np.sort([(low - self.origin) / self.way, (high - self.origin) / self.way], axis=0)
        return np.asarray((nearest < SPHERE_RADIUS + more) | (ends[0].max(-1) < ends[1].min(-1)))

    def middle(self) -> tuple[Floats, Floats]:
        """The true normal on the ball where the middle's ray meets it, and the pixel's frame (rows right, up, toward)."""
        origin, way, _ = rays(self.scene)
        t, _ = to_sphere(origin, way, SPHERE_CENTER, SPHERE_RADIUS)
        normal = (origin + np.where(np.isfinite(t), t, 0)[..., None] * way - SPHERE_CENTER) / SPHERE_RADIUS
        camera = self.scene.camera
        side = np.cross(np.subtract(camera.target, camera.position), camera.up)
        right = unit(side - (side * way).sum(-1, keepdims=True) * way)
        return normal, np.stack([right, np.cross(-way, right), -way], axis=-2)


@lru_cache
def shot(device: Device, variant: Variant, camera: str, seed: int = 0) -> Shot:
    scene = scene_for(variant, camera, seed)
    across, below = offsets(variant[2], seed)
    each = [rays(scene, 0.5 + across[..., n], 0.5 + below[..., n]) for n in range(COUNT)]
    origin, way = (np.stack([ray[i] for ray in each], axis=2) for i in (0, 1))
    spread = rays(scene)[2]
    distance = np.linalg.norm(SPHERE_CENTER - np.array(scene.camera.position))
    footprint = spread * (distance if camera == "perspective" else 1)
    return Shot(scene, shoot(scene, device), across, below, origin, way, footprint)


def in_frame(frame: Floats, places: Floats) -> Floats:
    """Places (n, count, 3) seen from their mean, in pixels' frames (n, 3, 3)."""
    return np.asarray(np.einsum("nab,nkb->nka", frame, places - np.nanmean(places, axis=1, keepdims=True)))


def made_of(kind: str, frame: Floats, places: Floats) -> Floats:
    """The normals (n, 3) of a kind over places (n, COUNT, 3), NaN where missing, in pixels' frames (n, 3, 3)."""
    framed = in_frame(frame, places)
    if kind == "one_triangle":
        made = oracle.one_triangle(framed)
    elif kind == "least_squares":
        made, _ = oracle.least_squares(framed)
    else:
        made = oracle.eight_triangles_normal(framed)
    return np.asarray(np.einsum("nab,na->nb", frame, made))
