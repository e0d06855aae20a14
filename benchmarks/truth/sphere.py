"""The unit sphere, whose picture is known exactly: its area, depth and normals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.truth.picture import see
from benchmarks.truth.rays import chord
from benchmarks.truth.subjects import bare
from clfractal.engine.engine import Engine

MOST_AREA, MOST_DEPTH, MOST_NORMAL = 0.002, 0.1, 0.05
"""Targets: the area's relative error; at 99 % of the hits depth in pixel widths, and normals in degrees."""
PART = 99.0

# A Julia set of the constant 0: squared 30 times, what stays below 4 has a length below 1 + 1.3e-9.
_FORMULA = {"name": "quaternion_julia", "julia": [0, 0, 0, 0], "iterations": 30}
_CAMERAS = {
    "orthographic": {"projection": "orthographic", "position": [0.3, -3, 0.4], "height": 2.4},
    "perspective": {"position": [0.3, -3, 0.4], "fov": 45},
}
SIZES = (300, 480, 1200)


@dataclass(frozen=True, slots=True)
class Sphere:
    """One picture of the sphere.

    Attributes:
        name: camera and size.
        area: hits beside the rays through pixels' middles that meet the sphere, minus 1.
        depth: error along the ray at 99 % of these rays, pixel widths; a ray that missed has an infinite one.
        normal: error of gradient normals there, degrees.
    """

    name: str
    area: float
    depth: float
    normal: float

    @property
    def met(self) -> bool:
        """Whether the three targets are met."""
        return abs(self.area) <= MOST_AREA and self.depth <= MOST_DEPTH and self.normal <= MOST_NORMAL


def measure_spheres(engine: Engine, overrides: Sequence[str] = ()) -> Iterator[Sphere]:
    """The sphere by each camera in each size."""
    for camera in _CAMERAS:
        for side in SIZES:
            yield measure_sphere(camera, side, engine, overrides)


def measure_sphere(camera: str, side: int, engine: Engine, overrides: Sequence[str] = ()) -> Sphere:
    """The sphere by an orthographic or a perspective camera, as a picture of `side` x `side` pixels."""
    scene = bare({"formula": _FORMULA, "camera": _CAMERAS[camera]}, side, overrides)
    seen = see(scene, engine, "N.X", "N.Y", "N.Z")
    near, far = chord(seen.rays.origin, seen.rays.direction, np.zeros(3), 1.0)
    meets = near < far
    rays, exact, t = seen.rays[meets], near[meets], seen.t[meets]
    hit = np.isfinite(t)
    depth = np.full(len(t), np.inf)
    depth[hit] = np.abs(t[hit] - exact[hit]) / rays.width(exact)[hit]
    normals = np.stack(
        [seen.framebuffer[axis].ravel()[meets] for axis in ("N.X", "N.Y", "N.Z")], axis=1
    ).astype(float)
    cross = np.linalg.norm(np.cross(normals, rays.at(exact)), axis=1)
    angle = np.degrees(np.arctan2(cross, np.sum(normals * rays.at(exact), axis=1)))
    return Sphere(
        f"{camera} {side}",
        float(np.isfinite(seen.t).sum() / meets.sum() - 1),
        float(np.percentile(depth, PART)),
        float(np.percentile(angle[hit], PART)),
    )
