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
            (entry, outer), (exit_, inner) = span(each, origin, direction)
            t, n = np.where(entry > 0, entry, exit_), np.where((entry > 0)[..., None], outer, inner)
            t = np.where((entry < exit_) & (t > 0), t, np.inf)
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


def span(each: Solid, origin: Floats, direction: Floats) -> list[tuple[Floats, Floats]]:
    """Where rays enter and leave a solid, and its normals there; they miss it where the first is not less."""
    turned, half = rotation_of(each.rotation), np.array(each.half_sides) * np.array(each.scale)
    # In the frame of the solid, in scene units: lengths stay as they are.
    o, d = (origin - np.array(each.position)) @ turned, direction @ turned
    # Within all of these q x x = 1: a ball, three pairs of planes, or a tube and a pair.
    kinds = {SphereObject: [[1, 1, 1]], BoxObject: np.eye(3), CylinderObject: [[1, 1, 0], [0, 0, 1]]}
    parts = np.array(kinds[type(each)]) / half**2
    with np.errstate(divide="ignore", invalid="ignore"):
        near, far = (np.array(roots) for roots in zip(*(_quadric(o, d, q) for q in parts), strict=True))
    ends = []
    for t, part in ((near.max(0), near.argmax(0)), (far.min(0), far.argmin(0))):
        n = (o + np.where(np.isfinite(t), t, 0)[..., None] * d) * parts[part] @ turned.T
        ends.append((t, n / np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), 1e-12)))
    return ends


def _quadric(o: Floats, d: Floats, q: Floats) -> tuple[Floats, Floats]:
    a, b, c = (q * d * d).sum(-1), (q * o * d).sum(-1), (q * o * o).sum(-1) - 1
    root = np.sqrt(b * b - a * c)
    root = np.where(np.isnan(root), -np.inf, root)
    return (-b - root) / a, (-b + root) / a


def light_of(mode: str) -> dict[str, Any]:
    """Light that surfaces reflect once."""
    return {"lighting": {"mode": mode, **({"bounces": 0} if mode == "path" else {})}}
