"""The cone by its equation, its area and its light in closed form: alone, joined, of glass, as a light."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest

from clfractal.device.select import Device
from tests.elements import solids
from tests.render.emitter_choices import choices, shining
from tests.render.joined_oracle import Floats


def cone(radius: float, top: float, height: float, **placed: Any) -> solids.Known:
    """Its distance: from the section on one side of the axis, a polygon, to the nearest of its three edges."""
    low, high = np.array([radius, -height / 2]), np.array([top, height / 2])
    edges = ((np.array([0.0, -height / 2]), low), (low, high), (high, np.array([0.0, height / 2])))

    def distance(p: Floats) -> Floats:
        at = np.stack([np.hypot(p[..., 0], p[..., 1]), p[..., 2]], axis=-1)
        far = np.full(at.shape[:-1], np.inf)
        for begin, end in edges:
            way = end - begin
            share = np.clip((at - begin) @ way / max(float(way @ way), 1e-300), 0, 1)
            far = np.minimum(far, np.linalg.norm(at - begin - share[..., None] * way, axis=-1))
        slope = (top - radius) / height
        inside = (np.abs(at[..., 1]) < height / 2) & (at[..., 0] < radius + slope * (at[..., 1] + height / 2))
        return np.where(inside, -far, far)

    return solids.Known({"type": "cone", "radius": radius, "top": top, "height": height}, distance, **placed)


def still(known: solids.Known) -> solids.Known:
    """The same in its own space."""
    return replace(known, rotation=[0, 0, 0], position=[0, 0, 0])


KINDS = {
    "tip": cone(0.7, 0.0, 1.4),
    "bucket": cone(0.45, 0.8, 1.0),
    "flat": cone(0.9, 0.3, 0.2),
    "needle": cone(0.4, 0.05, 2.0),
    "straight": cone(0.5, 0.5, 1.2),
    "uneven": cone(0.6, 0.2, 1.2, scale=[1.5, 1.0, 0.8]),
}


def by_equation(known: solids.Known, origin: Floats, direction: Floats) -> Floats:
    """How far rays in its own space go: roots of x^2 + y^2 = r(z)^2 and z = -h/2, h/2 that are on the surface."""
    radius, top, height = (known.values[key] for key in ("radius", "top", "height"))
    slope = (top - radius) / height
    (ox, oy, oz), (dx, dy, dz) = origin.T, direction.T
    at, grows = radius + slope * (oz + height / 2), slope * dz
    a, b, c = dx * dx + dy * dy - grows**2, ox * dx + oy * dy - at * grows, ox * ox + oy * oy - at * at
    found = np.full(len(ox), np.inf)
    with np.errstate(invalid="ignore", divide="ignore"):
        under = np.sqrt(b * b - a * c)
        for t in ((-b - under) / a, (-b + under) / a):
            z = oz + t * dz
            found = np.where((t > 0) & (abs(z) <= height / 2), np.fmin(found, t), found)
        for end, wide in ((-height / 2, radius), (height / 2, top)):
            t = (end - oz) / dz
            found = np.where((t > 0) & (np.hypot(ox + t * dx, oy + t * dy) <= wide), np.fmin(found, t), found)
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_rays_go_as_far_as_its_equation_says(kind: str) -> None:
    """The march that all else is compared with."""
    known = replace(still(KINDS[kind]), scale=[1, 1, 1])
    rng = np.random.default_rng(3)
    origin = rng.normal(size=(4000, 3))
    origin *= 3 / np.linalg.norm(origin, axis=1)[:, None]
    direction = rng.uniform(-0.7, 0.7, (4000, 3)) - origin
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    right, found = by_equation(known, origin, direction), known.met(origin, direction)
    both = np.isfinite(right) & np.isfinite(found)
    assert (np.isfinite(right) != np.isfinite(found)).sum() <= 4
    assert both.sum() > 200
    np.testing.assert_allclose(found[both], right[both], atol=1e-7)


class TestCone(solids.AllChecks):
    KINDS: ClassVar = KINDS
    JOINED: ClassVar = {
        "bucket": KINDS["bucket"],
        "tip": cone(1.0, 0.0, 1.8),
        "uneven": cone(0.8, 0.3, 1.4, scale=[1.5, 1.0, 0.8]),
    }
    GLASS: ClassVar = ("tip", "bucket")
    LAMPS: ClassVar = ("tip", "bucket", "flat", "uneven")
    POINTS: ClassVar = {
        "over": [0.2, 0.1, 5.0],
        "below": [0.3, -0.1, -2.0],
        "beside": [-2.5, 0.4, 0.2],
        "close": [1.05, 0.2, 0.3],
        "far": [20.0, -30.0, 25.0],
    }

    @pytest.mark.parametrize("kind", ["tip", "bucket", "straight"])
    def test_a_ray_from_within_meets_its_wall(self, kind: str, device: Device) -> None:
        solids.check_walls(still(KINDS[kind]), device, [0.05, -0.1, -0.2])


def seen_angle(known: solids.Known, point: Floats) -> tuple[float, float]:
    """The solid angle that a point sees of it, and the irradiance on a plane there that faces its middle."""
    lit = shining(known.written)
    rows = choices(lit, point, "float64", 8, 1 << 14)
    ways, density = rows[:, :3], rows[:, 3]
    toward = (known.position - point) / np.linalg.norm(known.position - point)
    cosine = ways @ toward / np.linalg.norm(ways, axis=1)
    brings = np.where(density > 0, 1 / np.where(density > 0, density, 1), 0)
    return float(brings.mean()), float((brings * cosine).mean())


@pytest.mark.parametrize("away", [0.8, 1.5, 6.0])
@pytest.mark.parametrize("kind", ["tip", "flat"])
def test_on_its_axis_it_shines_as_a_disc(kind: str, away: float) -> None:
    """Its rim is what is seen: pi R^2 / (R^2 + d^2) for radiance 1, d from the lid."""
    known = still(KINDS[kind])
    radius, top, height = (known.values[key] for key in ("radius", "top", "height"))
    # (Where the upper lid does not hide the rim.)
    for z, far in ((height / 2 + away, height + away), (-height / 2 - away, away)):
        assert z < 0 or radius / far > top / away
        _, found = seen_angle(known, np.array([0.0, 0.0, z]))
        assert found == pytest.approx(math.pi * radius**2 / (radius**2 + far**2), rel=5e-3)


@pytest.mark.parametrize("kind", ["tip", "bucket", "straight"])
def test_from_far_its_area_is_four_times_what_is_seen_of_it(kind: str) -> None:
    """Cauchy: the mean over all directions of a convex body's shadow is a fourth of its surface."""
    known = still(KINDS[kind])
    radius, top, height = (known.values[key] for key in ("radius", "top", "height"))
    area = math.pi * (radius**2 + top**2 + (radius + top) * math.hypot(height, radius - top))
    far, mean = 500.0, 0.0
    for cosine, weight in zip(*np.polynomial.legendre.leggauss(12), strict=True):
        point = far * np.array([math.sqrt(1 - cosine**2), 0.0, cosine])
        mean += weight / 2 * seen_angle(known, point)[0] * far**2
    assert mean == pytest.approx(area / 4, rel=1e-2)
