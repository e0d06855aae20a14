"""Where rays meet objects, written down from their equations in float64."""

from __future__ import annotations

from typing import Any

import numpy as np

from clfractal.elements.shapes.box import BoxObject
from clfractal.elements.shapes.cylinder import CylinderObject
from clfractal.elements.shapes.sphere import SphereObject
from clfractal.geometry.water import wave_set
from clfractal.scene.model import Scene
from clfractal.scene.objects import WaterObject
from clfractal.schema.base import frame_of
from clfractal.schema.shape import Solid
from tests.render.shots import Floats

# A set that no camera of these tests sees, nor any ray.
NOWHERE: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "map": ["x", "y", "z"],
    "add": "none",
    "degree": 1,
    "shape": "sqrt((x - 500)**2 + y*y + z*z) - 0.01",
    "bounds": {"center": [500, 0, 0], "radius": 0.1},
    "bailout": 1000,
}


def rotation_of(degrees: tuple[float, float, float]) -> Floats:
    """About x, then y, then z of space."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


def met(scene: Scene, origin: Floats, direction: Floats) -> tuple[Floats, Floats, Floats]:
    """Of each ray: how far the nearest object is (infinity: none), its normal towards the ray, and its number from 1."""
    best = np.full(origin.shape[:-1], np.inf)
    normal = np.zeros(origin.shape)
    number = np.zeros(origin.shape[:-1])
    for index, each in enumerate(scene.objects.values()):
        if isinstance(each, Solid):
            t, n = _solid(each, origin, direction)
        else:
            t, n = _level(each, origin, direction)
        n = np.where(((n * direction).sum(-1) > 0)[..., None], -n, n)
        nearer = t < best
        best, number = np.where(nearer, t, best), np.where(nearer, index + 1, number)
        normal = np.where(nearer[..., None], n, normal)
    return best, normal, number


def _level(each: Any, origin: Floats, direction: Floats) -> tuple[Floats, Floats]:
    side, up, axis = (np.array(way) for way in frame_of(each.normal))
    if isinstance(each, WaterObject):
        return _water(each, side, up, axis, origin, direction)
    climb = direction @ axis
    with np.errstate(divide="ignore", invalid="ignore"):
        t = ((np.array(each.position) - origin) @ axis) / climb
    return np.where(t > 0, t, np.inf), np.broadcast_to(axis, direction.shape)


def heights(water: WaterObject, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
    """Of places of a plane: the water's height, and its slopes along both sides."""
    waves = wave_set(water)
    phase = u[..., None] * waves.x + v[..., None] * waves.y + waves.phase
    height = (waves.height * (np.cos(phase) + waves.sharp * np.cos(2 * phase))).sum(-1)
    slope = -waves.height * (np.sin(phase) + 2 * waves.sharp * np.sin(2 * phase))
    return height, (slope * waves.x).sum(-1), (slope * waves.y).sum(-1)


def _water(
    water: WaterObject, side: Floats, up: Floats, axis: Floats, origin: Floats, direction: Floats
) -> tuple[Floats, Floats]:
    """By looking at many places of the way through the waves, and halving."""
    reach, middle = wave_set(water).reach, np.array(water.position)
    climb = direction @ axis
    level = (origin - middle) @ axis
    first, last = (-np.sign(climb) * reach - level) / climb, (np.sign(climb) * reach - level) / climb
    begin = np.maximum(first, 0)

    def over(t: Floats) -> tuple[Floats, Floats]:
        place = origin + t[..., None] * direction - middle
        height, along, across = heights(water, place @ side, place @ up)
        n = axis - along[..., None] * side - across[..., None] * up
        return place @ axis - height, n / np.linalg.norm(n, axis=-1, keepdims=True)

    low, high = np.full(begin.shape, np.nan), np.full(begin.shape, np.nan)
    before = begin
    for share in np.linspace(0, 1, 1500)[1:]:
        t = begin + share * (last - begin)
        crossed = np.isnan(high) & (over(t)[0] <= 0)
        low, high = np.where(crossed, before, low), np.where(crossed, t, high)
        before = t
    for _ in range(40):
        half = (low + high) / 2
        under = over(half)[0] <= 0
        low, high = np.where(under, low, half), np.where(under, half, high)
    return np.where(np.isnan(high) | (last < 0), np.inf, high), over(np.nan_to_num(high))[1]


def _solid(each: Solid, origin: Floats, direction: Floats) -> tuple[Floats, Floats]:
    turned = rotation_of(each.rotation)
    half = np.array(each.half_sides) * np.array(each.scale)
    # In the frame of the solid, in scene units: lengths stay as they are.
    o, d = (origin - np.array(each.position)) @ turned, direction @ turned
    with np.errstate(divide="ignore", invalid="ignore"):
        if isinstance(each, SphereObject):
            spans = [_quadric(o, d, 1 / half**2)]
        elif isinstance(each, BoxObject):
            spans = [_slab(o, d, half, axis) for axis in range(3)]
        else:
            assert isinstance(each, CylinderObject)
            spans = [_quadric(o, d, np.array([1, 1, 0]) / half**2), _slab(o, d, half, 2)]
    entry, exit_ = np.max([s[0] for s in spans], axis=0), np.min([s[1] for s in spans], axis=0)
    outside = entry > 0
    t = np.where(outside, entry, exit_)
    t = np.where((entry < exit_) & (t > 0), t, np.inf)
    p = o + np.where(np.isfinite(t), t, 0)[..., None] * d
    if isinstance(each, SphereObject):
        n = p / half**2
    else:
        # The part of the surface is the one whose span begins, or from inside ends, there.
        which = np.where(outside, np.argmax([s[0] for s in spans], 0), np.argmin([s[1] for s in spans], 0))
        n = np.zeros_like(p)
        for part in range(len(spans)):
            here = (which == part)[..., None]
            if isinstance(each, CylinderObject) and part == 0:
                n = np.where(here, p * np.array([1, 1, 0]) / half**2, n)
            else:
                axis = part if isinstance(each, BoxObject) else 2
                n = np.where(here, p * np.eye(3)[axis], n)
    n = n @ turned.T
    return t, n / np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), 1e-12)


def _quadric(o: Floats, d: Floats, q: Floats) -> tuple[Floats, Floats]:
    a, b, c = (q * d * d).sum(-1), (q * o * d).sum(-1), (q * o * o).sum(-1) - 1
    root = np.sqrt(b * b - a * c)
    root = np.where(np.isnan(root), -np.inf, root)
    return (-b - root) / a, (-b + root) / a


def _slab(o: Floats, d: Floats, half: Floats, axis: int) -> tuple[Floats, Floats]:
    a, b = (-half[axis] - o[..., axis]) / d[..., axis], (half[axis] - o[..., axis]) / d[..., axis]
    return np.minimum(a, b), np.maximum(a, b)
