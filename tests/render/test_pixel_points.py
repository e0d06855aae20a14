"""`renderer.points`: several points of a pixel, their coverage, normals and colours, on a ball over a box.

Every point's ray is known, so what the nine find is known too: the pictures are compared with the five normals of
`normals_oracle` over the exact places. Both searches and both patterns meet every normal, though not in all pairs: normals
are made of what was found, however that was.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.render.film import Film
from clfractal.scene.model import Scene
from tests.render import normals_oracle as oracle
from tests.render.programs import compile_all
from tests.render.sequence import hashed, truth
from tests.render.shots import (
    CHANNELS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    SOLIDS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    Floats,
    normals_of,
    points_of,
    rays,
    scene_of,
    shoot,
    stacked,
    to_sphere,
)

Bools = npt.NDArray[np.bool_]

SIDE, DETAIL, COUNT = 48, 0.05, 9
LAMP = np.array([0.48, -0.6, 0.64])  # direction to the light
CAMERAS = {"perspective": PERSPECTIVE, "orthographic": ORTHOGRAPHIC}
# Search, normal and pattern: each is a program of its own.
VARIANTS = [
    ("distance", "one_triangle", "grid"),
    ("distance", "eight_triangles_normal", "grid"),
    ("distance", "least_squares", "stochastic"),
    ("steps", "eight_triangles_shading", "grid"),
    ("steps", "least_squares", "grid"),
    ("steps", "gradient", "stochastic"),
]
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


@pytest.fixture(scope="module", autouse=True)
def _compiled(device: Device) -> None:
    compile_all([*(scene_for(variant, "perspective") for variant in VARIANTS), *hast()], device)


def offsets(pattern: str, seed: int) -> tuple[Floats, Floats]:
    """Places of the points, pixels right and down from the pixel's centre, shape (SIDE, SIDE, COUNT)."""
    if pattern == "grid":
        steps = (np.arange(3) - 1) / 3
        below, across = np.meshgrid(steps, steps, indexing="ij")
        shape = (SIDE, SIDE, COUNT)
        return np.broadcast_to(across.ravel(), shape), np.broadcast_to(below.ravel(), shape)
    # One in each strip, a golden section further along it than the last; strips upright or level, mirrored or not.
    y, x = np.indices((SIDE, SIDE))
    pixel = truth(x, y, np.zeros_like(x), seed, 1)[2][..., None]
    golden, digits, point = 0x9E3779B9, 2**32, np.arange(COUNT, dtype=np.uint64)
    first = hashed(pixel)
    turn = hashed(first)
    within = hashed((pixel + golden * (point + 1)) % digits)
    along = (digits - 1) // COUNT * point + within // COUNT
    along = np.where(turn & 1, digits - 1 - along, along)
    other = (first + golden * point) % digits
    level = (turn >> 1 & 1).astype(bool)
    places = [np.where(level, other, along), np.where(level, along, other)]
    across, below = ((place >> 9) / 2.0**23 + 2.0**-24 - 0.5 for place in places)
    return across, below


@dataclass(frozen=True)
class Shot:
    """A picture, and the rays of all its points: shapes (SIDE, SIDE, COUNT, 3) and (SIDE, SIDE, COUNT)."""

    scene: Scene
    film: Film
    across: Floats
    below: Floats
    origin: Floats
    way: Floats
    footprint: Floats  # at the ball's distance, scene units, (SIDE, SIDE)

    def ball(self) -> tuple[Floats, Bools]:
        """Where each point meets the ball, and the pixels of which all do and that lie away from its rim."""
        t, nearest = to_sphere(self.origin, self.way, SPHERE_CENTER, SPHERE_RADIUS)
        places: Floats = self.origin + np.where(np.isfinite(t), t, 0)[..., None] * self.way
        return places, (nearest < 0.9 * SPHERE_RADIUS).all(axis=-1)

    def meets(self, grown: Floats) -> Bools:
        """Which rays meet the ball or the box if both are larger by `grown`, (SIDE, SIDE)."""
        more = grown[..., None]
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
        right = oracle.unit(side - (side * way).sum(-1, keepdims=True) * way)
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
    """Places (n, count, 3) seen from the first, in pixels' frames (n, 3, 3)."""
    return np.asarray(np.einsum("nab,nkb->nka", frame, places - places[:, :1]))


def degrees(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=-1) / 2, 0, 1))))


every = pytest.mark.parametrize("variant", VARIANTS, ids=" ".join)
both = pytest.mark.parametrize("camera", CAMERAS)


@both
@every
def test_normals_of_a_ball(device: Device, variant: Variant, camera: str) -> None:
    """As over the exact places, and near the truth in the pixel's middle: see the table of errors in stills.md."""
    taken = shot(device, variant, camera)
    places, inner = taken.ball()
    true, frame = taken.middle()
    normals = normals_of(taken.film)
    kind = variant[1]
    if kind == "gradient":
        expected = oracle.unit(points_of(taken.film)[inner] - SPHERE_CENTER)
    else:
        framed = in_frame(frame[inner], places[inner])
        made = {
            "one_triangle": oracle.one_triangle,
            "eight_triangles_normal": oracle.eight_triangles_normal,
            "eight_triangles_shading": oracle.eight_triangles_normal,
            "least_squares": lambda points: oracle.least_squares(points)[0],
        }[kind](framed)
        expected = np.einsum("nab,na->nb", frame[inner], made)
    error, off = degrees(normals[inner], expected), degrees(normals, true)[inner]
    print(kind, variant[0], camera, inner.sum(), "oracle", np.median(error), error.max(), "true", np.median(off), off.max())


@both
@every
def test_normals_of_a_plane(device: Device, variant: Variant, camera: str) -> None:
    taken = shot(device, variant, camera)
    origin, way = taken.origin, taken.way
    on_top = origin - (origin[..., 2:] / way[..., 2:]) * way
    _, nearest = to_sphere(origin, way, SPHERE_CENTER, SPHERE_RADIUS)
    inner = ((np.abs(on_top[..., :2]) < 1.15).all(-1) & (nearest > SPHERE_RADIUS + 0.02)).all(-1)
    off = degrees(normals_of(taken.film), np.array([0.0, 0, 1]))[inner]
    print(variant, camera, inner.sum(), np.median(off), off.max())


@both
@every
def test_coverage_is_the_share_of_the_points(device: Device, variant: Variant, camera: str) -> None:
    taken = shot(device, variant, camera)
    reach = 0.35 * DETAIL * taken.footprint + 1e-5 if variant[0] == "distance" else np.full((SIDE, SIDE), 1e-5)
    fewest, most = taken.meets(-reach if variant[0] == "distance" else -reach - 5e-3), taken.meets(reach)
    a = taken.film["A"] * COUNT
    lo, hi = fewest.sum(-1), most.sum(-1)
    part = (hi > 0) & (lo < 9)
    print(variant, camera, "edge", part.sum(), "uncertain", (hi > lo).sum(), "below", (a < lo - 1e-3).sum(), "above", (a > hi + 1e-3).sum())
    origin, way, _ = rays(taken.scene)


@both
@every
def test_silhouette(device: Device, variant: Variant, camera: str) -> None:
    taken = shot(device, variant, camera)
    places, _ = taken.ball()
    t, _ = to_sphere(taken.origin, taken.way, SPHERE_CENTER, SPHERE_RADIUS)
    on = np.isfinite(t)
    box = taken.meets(np.zeros((SIDE, SIDE))) & ~on
    a = taken.film["A"]
    rim = on.any(-1) & ~on.all(-1) & ~box.any(-1) & (a > 0)
    true = oracle.unit(np.where(on[..., None], places - SPHERE_CENTER, 0).sum(-2)[rim])
    off = degrees(normals_of(taken.film)[rim], true)
    print(variant, camera, rim.sum(), np.median(off), off.max())


@both
@every
def test_colors(device: Device, variant: Variant, camera: str) -> None:
    taken = shot(device, variant, camera)
    places, inner = taken.ball()
    if variant[1] == "gradient":
        normals = (places[inner] - SPHERE_CENTER) / SPHERE_RADIUS
        expected = np.maximum(normals @ LAMP, 0).mean(-1)
    elif variant[1] == "eight_triangles_shading":
        _, frame = taken.middle()
        eight = oracle.eight_triangles(in_frame(frame[inner], places[inner]))
        eight = np.einsum("nab,nka->nkb", frame[inner], eight)
        expected = np.maximum(eight @ LAMP, 0).mean(-1)
        alone = np.maximum(normals_of(taken.film) @ LAMP, 0)[inner]
        print("mean apart", np.abs(alone - expected).max())
    else:
        expected = np.maximum(normals_of(taken.film)[inner] @ LAMP, 0)
    print(variant, camera, np.abs(taken.film["R"][inner] - expected).max())


def hast() -> list[Scene]:
    """With 3 x 3 points; and with one, thrice as wide and high: the same rays."""
    camera = {"position": [1.6, -2.4, 1.4], "target": [-0.2, 0, 0], "fov": 45}
    formula = {"name": "hast", "iterations": 20}
    sides = {1: 96, COUNT: 32}
    return [
        scene_of(formula, camera, (sides[n], sides[n]), lights=[{"shadow": False}], background="transparent",
                 renderer={"points": {"count": n}, "seed": 3})
        for n in (COUNT, 1)
    ]


def test_nine_points_are_a_picture_of_thrice_the_size(device: Device) -> None:
    few, many = (shoot(scene, device) for scene in hast())
    blocks = lambda x: x.reshape(32, 3, 32, 3).astype(float)
    a, b = few["A"], blocks(many["A"]).mean((1, 3))
    print("A", np.abs(a - b).mean(), (a != b.astype(np.float32)).mean(), np.abs(a-b).max(), ((a>0)&(a<1)).sum(), (np.abs(a-b)>0.01).sum())
    for n in "RGB":
        print(n, np.abs(few[n] - blocks(many[n]).mean((1, 3))).mean(), few[n].mean(), np.median(np.abs(few[n] - blocks(many[n]).mean((1, 3)))), np.quantile(np.abs(few[n] - blocks(many[n]).mean((1, 3))),.95))
    mid = stacked(many)[1::3, 1::3]
    hit = (few["A"] > 0) & (mid[..., 3] > 0)
    off = np.linalg.norm(points_of(few) - mid[..., 8:11], axis=-1)[hit]
    print("P", np.median(off), np.quantile(off, .95), off.max())
    print("N", np.median(degrees(normals_of(few), mid[..., 5:8])[hit]))
    print("steps", few["steps"].sum(), many["steps"].sum())
