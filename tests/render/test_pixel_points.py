"""`renderer.points`: several points of a pixel, their coverage, normals and colours, on a ball over a box.

Pictures are compared with the five normals of `normals_oracle` over the exact places. Both searches and both patterns meet
every normal; pairs that are missing here are combinations: normals are made of what was found, however that was.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from clfractal.scene.surface import GRID_NORMALS
from tests.render import normals_oracle as oracle
from tests.render.normals_oracle import unit
from tests.render.point_rays import COUNT, DETAIL, LAMP, Variant, in_frame, made_of, scene_for, shot
from tests.render.programs import compile_all
from tests.render.shots import (
    BALL,
    CAMERAS,
    CHANNELS,
    QUICK_BALL,
    SOLIDS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    degrees,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
)
from tests.scenes import scene_of

# Search, normal and pattern: each is a program of its own.
VARIANTS: list[Variant] = [
    ("distance", "one_triangle", "grid"),
    ("distance", "least_squares", "stochastic"),
    ("steps", "eight_triangles_normal", "grid"),
    ("steps", "eight_triangles_shading", "grid"),
    ("steps", "gradient", "stochastic"),
]


@pytest.fixture(scope="module", autouse=True)
def _compiled(device: Device) -> None:
    compile_all(
        [*(scene_for(variant, "perspective") for variant in VARIANTS), hast(COUNT, 32), hast(1, 32)], device
    )


NORMALS = ("gradient", *GRID_NORMALS, "least_squares")
# The other pairs of search and normal.
COMBINATIONS: list[Variant] = [
    (search, normal, "grid")
    for search in ("distance", "steps")
    for normal in NORMALS
    if all((search, normal) != variant[:2] for variant in VARIANTS)
]
every = pytest.mark.parametrize(
    "variant",
    [*VARIANTS, *(pytest.param(variant, marks=pytest.mark.combination) for variant in COMBINATIONS)],
    ids=" ".join,
)
both = pytest.mark.parametrize("camera", CAMERAS)


@both
@every
def test_normals_of_a_ball(device: Device, variant: Variant, camera: str) -> None:
    """As over the exact places, and near the truth in the pixel's middle: see the table of errors in stills.md."""
    taken, kind = shot(device, variant, camera), variant[1]
    places, inner = taken.ball()
    true, frame = taken.middle()
    assert inner.sum() > 60
    normals = normals_of(taken.framebuffer)[inner]
    off = degrees(normals, true[inner])
    if kind == "gradient":
        # That of the point nearest to the middle: exact, but in another place. (The march lands a little before the hit.)
        most = 2e-3 if variant[0] == "distance" else 1e-3
        assert degrees(normals, unit(points_of(taken.framebuffer)[inner] - SPHERE_CENTER)).max() < most
        assert off.max() < 3
        return
    # The march ends half a hit distance before the surface, on a ball that much larger.
    error = degrees(normals, made_of(kind, frame[inner], places[inner]))
    assert error.max() < (0.2 if variant[0] == "distance" else 1e-3)
    if kind == "one_triangle":
        leaning = np.degrees(taken.footprint[inner] / (12 * SPHERE_RADIUS))
        assert 0.9 < np.median(off / leaning) < 1.6  # longer where the ball slopes
    else:
        # What a pattern without symmetry leans by is chance.
        even = variant[2] == "grid"
        assert np.median(off) < (0.2 if even else 0.8)
        assert off.max() < (0.7 if even else 3)


@both
@every
def test_normals_of_a_plane(device: Device, variant: Variant, camera: str) -> None:
    """The box's top: any three points tell it. Points lie where a scaled distance is a sixth of the hit distance. In
    perspective, where footprints grow with the distance, that is another plane, a hundredth of a degree apart."""
    taken = shot(device, variant, camera)
    origin, way = taken.origin, taken.way
    on_top = origin - (origin[..., 2:] / way[..., 2:]) * way
    _, nearest = to_sphere(origin, way, SPHERE_CENTER, SPHERE_RADIUS)
    inner = ((np.abs(on_top[..., :2]) < 1.15).all(-1) & (nearest > SPHERE_RADIUS + 0.02)).all(-1)
    assert inner.sum() > 600
    off = degrees(normals_of(taken.framebuffer), np.array([0.0, 0, 1]))[inner]
    leaning = np.degrees(DETAIL / 6 / taken.scene.chain.step_scale * rays(taken.scene)[2].max())
    assert off.max() < (leaning if (variant[0], camera) == ("distance", "perspective") else 1e-3)


@both
@every
def test_coverage_is_the_share_of_the_points(device: Device, variant: Variant, camera: str) -> None:
    """Ray by ray: only those that pass the solids within the hit distance (by steps, through less than a step of them)
    may hit or not. The search by steps looks where the middle's ray meets something."""
    taken = shot(device, variant, camera)
    by_distance = variant[0] == "distance"
    fewest = taken.meets(-1e-5 if by_distance else -5e-3).sum(-1)
    most = taken.meets(taken.reach()).sum(-1)
    coverage = taken.framebuffer["A"] * COUNT
    assert np.abs(coverage - np.round(coverage)).max() < 1e-5
    coverage = np.round(coverage)
    if not by_distance:
        middle = coverage > 0
        assert middle[most == COUNT].all()
        fewest = np.where(middle, fewest, 0)
    assert (fewest <= coverage).all()
    if by_distance:
        # A march that is about to land, and passes a rim, may take it for a sheet up to a hit distance beside the ray.
        assert (coverage <= most).mean() > 0.985
        most = taken.meets(3 * taken.reach()).sum(-1)
    assert (coverage <= most).all()
    assert ((coverage > 0) & (coverage < COUNT)).sum() > 40
    if by_distance:
        assert (fewest == taken.meets(taken.reach()).sum(-1)).mean() > 0.97


@both
@every
def test_silhouette(device: Device, variant: Variant, camera: str) -> None:
    """At the ball's rim, before nothing: the normal over the points that are there, or if they are too few or on a line
    that of the one nearest to the middle; for grids near that of the part that was found."""
    taken = shot(device, variant, camera)
    there = taken.framebuffer["A"] > 0
    lengths = np.linalg.norm(normals_of(taken.framebuffer)[there], axis=-1)
    np.testing.assert_allclose(lengths, 1, atol=1e-6)
    assert not normals_of(taken.framebuffer)[~there].any()

    places, _ = taken.ball()
    on_ball = np.isfinite(to_sphere(taken.origin, taken.way, SPHERE_CENTER, SPHERE_RADIUS)[0])
    sure = (taken.meets(-taken.reach()) == taken.meets(taken.reach())).all(-1)
    alone = ~(taken.meets(0) & ~on_ball).any(-1)
    rim = there & sure & alone & on_ball.any(-1) & ~on_ball.all(-1)
    assert rim.sum() >= 4
    places = np.where(on_ball[..., None], places, np.nan)[rim]
    far = np.where(on_ball, taken.across**2 + taken.below**2, np.inf)[rim]
    nearest = np.take_along_axis(places, far.argmin(-1)[:, None, None], axis=1)[:, 0]
    expected = (nearest - SPHERE_CENTER) / SPHERE_RADIUS
    if variant[1] != "gradient":
        made = made_of(variant[1], taken.middle()[1][rim], places)
        expected = np.where(np.isnan(made), expected, made)
    normals = normals_of(taken.framebuffer)[rim]
    # By distance a point may be found beside the ball, where the radius has another direction.
    own = variant[1] == "gradient"
    assert degrees(normals, expected).max() < ((6 if own else 1) if variant[0] == "distance" else 0.01)
    if variant[2] == "grid":
        part = unit(np.nanmean(places - SPHERE_CENTER, axis=1))
        assert degrees(normals, part).max() < 12
        assert np.median(degrees(normals, part)) < 4


@both
@every
def test_colors(device: Device, variant: Variant, camera: str) -> None:
    """The gradient: every point is shaded, and the mean taken; `eight_triangles_shading`: every triangle; else once."""
    taken = shot(device, variant, camera)
    places, inner = taken.ball()
    alone = np.maximum(normals_of(taken.framebuffer)[inner] @ LAMP, 0)
    tolerance = 5e-5
    if variant[1] == "gradient":
        each = (places[inner] - SPHERE_CENTER) / SPHERE_RADIUS
        expected = np.maximum(each @ LAMP, 0).mean(-1)
        assert np.abs(alone - expected).max() > 0.005
    elif variant[1] == "eight_triangles_shading":
        frame = taken.middle()[1][inner]
        eight = oracle.eight_triangles(in_frame(frame, places[inner]))
        expected = np.maximum(np.einsum("nab,nka->nkb", frame, eight) @ LAMP, 0).mean(-1)
        assert np.abs(alone - expected).max() > 1e-3
        # By distance each of eight normals is that of places a part of the cone before the ball.
        tolerance = 3e-3 if variant[0] == "distance" else tolerance
    else:
        expected = alone
    np.testing.assert_allclose(taken.framebuffer["R"][inner], expected, atol=tolerance)


@every
def test_data_channels(device: Device, variant: Variant) -> None:
    """All finite, but Z where nothing is; P lies on the ray of the found point that is nearest to the middle."""
    taken = shot(device, variant, "orthographic")
    framebuffer = taken.framebuffer
    assert np.isfinite(stacked(framebuffer, [name for name in CHANNELS if name != "Z"])).all()
    np.testing.assert_array_equal(np.isfinite(framebuffer["Z"]), framebuffer["A"] > 0)
    whole = framebuffer["A"] == 1
    chosen = (taken.across**2 + taken.below**2).argmin(-1)[..., None, None]
    origin, way = (np.take_along_axis(a, chosen, axis=2)[:, :, 0] for a in (taken.origin, taken.way))
    offset = points_of(framebuffer) - origin
    aside = offset - (offset * way).sum(-1, keepdims=True) * way
    assert np.linalg.norm(aside, axis=-1)[whole].max() < 2e-6


# The unit ball by its own distance, by an orbit's Jacobian and by its scalar rule.
UNIT = {**SOLIDS, "let": {}, "shape": "sqrt(x*x + y*y + z*z) - 1"}


@pytest.mark.parametrize("formula", [UNIT, BALL, QUICK_BALL], ids=["shape", "jacobian", "scalar rule"])
@both
def test_nine_points_on_a_ball_are_as_exact_as_one(
    device: Device, formula: dict[str, Any], camera: str
) -> None:
    """Where the middle's ray meets the unit ball, rims included: the depth is right to a tenth of a pixel and normals to
    0.06 degrees (all but one of a hundred), and the area, beside that of all points' own rays, to a thousandth."""
    scene = scene_of(
        {"inline": formula, "iterations": 30},
        CAMERAS[camera],
        (200, 200),
        background="transparent",
        renderer={"points": {"count": COUNT}},
    )
    framebuffer = shoot(scene, device)
    origin, way, spread = rays(scene)
    t, _ = to_sphere(origin, way, (0, 0, 0), 1)
    met = np.isfinite(t)
    assert met.sum() > 15_000
    assert (framebuffer["A"][met] > 0).all()
    footprint = (spread * (t if camera == "perspective" else 1))[met]
    along = ((points_of(framebuffer) - origin) * way).sum(-1)
    assert np.percentile(np.abs(along - t)[met] / footprint, 99) < 0.1
    true = (origin + np.where(met, t, 0)[..., None] * way)[met]
    assert np.percentile(degrees(normals_of(framebuffer)[met], true), 99) < 0.06
    grid = (np.arange(3) - 1) / 3 + 0.5
    each = [rays(scene, x, y)[:2] for x in grid for y in grid]
    area = np.mean([np.isfinite(to_sphere(*ray, (0, 0, 0), 1)[0]).sum() for ray in each])
    assert abs(framebuffer["A"].sum(dtype=float) / area - 1) < 1e-3


def hast(count: int, side: int) -> Scene:
    camera = {"position": [1.6, -2.4, 1.4], "target": [-0.2, 0, 0], "fov": 45}
    return scene_of(
        {"name": "hast", "iterations": 20},
        camera,
        (side, side),
        background="transparent",
        lights=[],
        renderer={"points": {"count": count}},
    )


def test_nine_points_cost_less_than_nine_rays(device: Device) -> None:
    """3 x 3 points are the rays of a picture thrice as wide and high, but share their way. Their hits are wider than those
    of that picture: a point is proved by the pixel's touch."""
    points, one, many = (shoot(hast(n, side), device) for n, side in ((COUNT, 32), (1, 32), (1, 96)))
    assert points["steps"].sum() < 0.25 * many["steps"].sum()
    share = many["A"].astype(float).reshape(32, 3, 32, 3).mean((1, 3))
    errors = [np.abs(framebuffer["A"] - share).mean() for framebuffer in (points, one)]
    assert errors[0] < 0.052
    assert errors[1] < 0.045  # 0.06 while one ray's hits were as wide as two pixels
    assert share.mean() - 0.005 < points["A"].mean() < share.mean() + 0.055
    assert (points["A"][share == 1] == 1).mean() > 0.99
    middle = stacked(many, ("A", "P.X", "P.Y", "P.Z"))[1::3, 1::3].astype(float)
    apart = np.linalg.norm(points_of(points) - middle[..., 1:], axis=-1)
    footprint = 2 * np.tan(np.radians(22.5)) / 32 * points["Z"]
    both_hit = (middle[..., 0] > 0) & (points["A"] > 0)
    assert np.median((apart / footprint)[both_hit]) < 1
