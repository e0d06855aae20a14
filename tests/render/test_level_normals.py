"""Gradient normals are those of the surface that is shown: the level set of |z| at the limit of applications."""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device, has_float64
from clfractal.device.structs import Precision
from clfractal.formulas.catalog import load_chain
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.lanes import best_lanes
from clfractal.integrators.points import distances
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject
from clfractal.schema.shape import turned_axes
from tests.render.levels import BESIDE, CAMERA, UNEVEN, Floats, degrees, sizes, slopes
from tests.render.shots import normals_of, points_of, shoot
from tests.scenes import scene_of
from tests.variants import one_of

FINE: dict[str, Any] = {"type": "surface", "detail": 0.02}
SEARCHES: dict[str, dict[str, Any]] = {"distance": {}, "steps": {"search": "steps", "step": 0.004}}


def finest(device: Device) -> Precision:
    return "float64" if has_float64(device.info) else "float32"


def hits(framebuffer: Framebuffer, least: int = 60) -> tuple[Floats, Floats]:
    """Places and normals of pixels that are covered as a whole; more than so many have to be."""
    whole = np.isfinite(framebuffer["Z"]) & (framebuffer["A"] > 0.999)
    assert whole.sum() > least
    return points_of(framebuffer)[whole], normals_of(framebuffer)[whole]


def off(scene: Scene, places: Floats, normals: Floats, nearly: float = 1.002) -> Floats:
    """Angles to the slope of |z| at the limit, of hits on the surface itself: others have met a thread beside them."""
    limit, bailout = scene.formula.iterations, scene.chain.bailout
    size = sizes(scene.chain, places, limit)
    on_it = (size[:-1] <= scene.chain.distance_bailout).all(axis=0)
    on_it &= np.abs(size[-1] / bailout - 1) < nearly - 1
    assert on_it.sum() > 20
    return degrees(normals[on_it], slopes(scene.chain, places[on_it], limit))


@pytest.mark.parametrize(
    ("name", "iterations"),
    [*itertools.product(UNEVEN, [3, 5, 8]), ("mandelbulb", 3), ("quaternion_julia", 8)],
)
def test_normals_are_the_slope_of_the_last_z(device: Device, name: str, iterations: int) -> None:
    """Of all hits where they lie, but of a surface that no pixel shows as it is: after eight applications a pixel of the
    whole Riemann sphere holds many sheets, and the normal at a place between them is of none: see the next test."""
    scene = scene_of({"name": name, "iterations": iterations}, CAMERA, (144, 108), renderer=FINE)
    places, normals = hits(shoot(scene, device, finest(device), lanes=4))
    assert np.median(off(scene, places, normals)) < 0.1
    if (name, iterations) == ("riemann_sphere", 8):
        return
    angles = degrees(normals, slopes(scene.chain, places, iterations))
    assert np.isfinite(angles).mean() > 0.95
    assert np.nanmedian(angles) < 0.1
    if iterations == 3:
        assert np.percentile(angles, 90) < 0.1


def test_what_is_dust_from_afar_has_these_normals_from_near(device: Device) -> None:
    """In pixels that are hundreds of times smaller most of those sheets are smooth."""
    formula = {"name": "riemann_sphere", "iterations": 8}
    whole = scene_of(formula, CAMERA, (144, 108), renderer=FINE)
    targets, _ = hits(shoot(whole, device, finest(device), lanes=4))
    found = []
    for target in targets[len(targets) // 20 :: len(targets) // 10]:
        camera = {"position": list(whole.camera.position), "target": target.tolist(), "fov": 45 / 400}
        near = scene_of(formula, camera, (24, 24), renderer=FINE)
        places, normals = hits(shoot(near, device, finest(device), lanes=4), least=0)
        found.append(degrees(normals, slopes(whole.chain, places, 8)))
    angles = np.concatenate(found)
    assert len(angles) > 3000
    assert np.isfinite(angles).mean() > 0.99
    assert np.nanmedian(angles) < 0.1
    assert (angles < 0.1).mean() > 0.65


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize(("points", "lanes"), one_of((9, None), (9, 4), (1, 1), (1, 8), (9, 1)))
def test_each_search_lanes_and_points(device: Device, search: str, points: int, lanes: int | None) -> None:
    renderer = {**FINE, **SEARCHES[search], "points": {"count": points, "pattern": "grid"}}
    scene = scene_of({"name": "hast", "iterations": 4}, CAMERA, (64, 48), renderer=renderer)
    places, normals = hits(shoot(scene, device, lanes=lanes))
    assert np.median(off(scene, places, normals)) < 0.1


@pytest.mark.parametrize(
    "formula",
    one_of(
        {"name": "mandelbulb", "iterations": 3},
        {"chain": [{"name": "hast"}, {"name": "makin_brot"}], "iterations": 4},
        {"name": "cosine_mandelbulb", "iterations": 3},
    ),
    ids=["rule", "chain", "cosine"],
)
def test_formulas_with_a_rule_of_their_own_and_chains(device: Device, formula: dict[str, Any]) -> None:
    scene = scene_of(formula, CAMERA, (64, 48), renderer=FINE)
    places, normals = hits(shoot(scene, device, finest(device), lanes=4))
    assert np.median(off(scene, places, normals)) < 0.1


def test_the_potential_has_the_slope_of_a_later_z(device: Device) -> None:
    """The smoother normals: of the z that has left the larger radius."""
    renderer = {**FINE, "normal": "potential"}
    scene = scene_of({"name": "hast", "iterations": 5}, CAMERA, (96, 72), renderer=renderer)
    places, normals = hits(shoot(scene, device, finest(device), lanes=4))
    assert np.median(off(scene, places, normals)) > 3
    size = sizes(scene.chain, places, 9)
    last = 1 + (size > scene.chain.distance_bailout).argmax(axis=0)
    assert (last > 5).mean() > 0.9
    for applications in np.unique(last):
        some = last == applications
        angles = degrees(normals[some], slopes(scene.chain, places[some], applications))
        assert np.median(angles) < 0.1


@lru_cache
def joined_framebuffer(device: Device, normal: str) -> tuple[Scene, Framebuffer]:
    ball = {"type": "sphere", "position": [-1.1, -0.5, 0], "radius": 0.5, "join": "cut"}
    renderer = {**FINE, "normal": normal}
    objects = {"ball": ball, "other": BESIDE}
    scene = scene_of({"name": "hast", "iterations": 4}, CAMERA, (96, 72), objects=objects, renderer=renderer)
    return scene, shoot(scene, device, finest(device), lanes=4)


def test_each_of_several_solids_has_its_own_level(device: Device) -> None:
    scene, framebuffer = joined_framebuffer(device, "gradient")
    other = scene.objects["other"]
    places, normals = hits(framebuffer)
    assert isinstance(other, FormulaObject)
    axes = np.array(turned_axes(other.rotation))
    own = (places - np.array(other.position)) @ axes.T / other.scale
    chain = scene.joined_chains["other"]
    with np.errstate(all="ignore"):
        of_other = np.abs(sizes(chain, own, 4)[-1] / chain.bailout - 1) < 0.01
        of_first = np.abs(sizes(scene.chain, places, 4)[-1] / scene.chain.bailout - 1) < 0.01
    of_first &= ~of_other
    assert of_other.sum() > 100
    assert of_first.sum() > 100
    assert np.median(off(scene, places[of_first], normals[of_first])) < 0.1
    assert np.median(degrees(normals[of_other], slopes(chain, own[of_other], 4) @ axes)) < 0.1


# --- where the bounds cut the set ---

CUT = {"center": [-0.3, -0.1, 0.05], "radius": 0.45}


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize(("points", "normal"), one_of((1, "gradient"), (9, "gradient"), (9, "least_squares")))
def test_what_the_bounds_cut_has_their_normal(device: Device, search: str, points: int, normal: str) -> None:
    renderer = {
        "type": "surface",
        "bounds": CUT,
        "points": {"count": points, "pattern": "grid"},
        "normal": normal,
        **SEARCHES[search],
    }
    camera = {"position": [1.7, -2.9, 1.4], "target": CUT["center"], "fov": 17}
    scene = scene_of({"name": "hast", "iterations": 40}, camera, (96, 96), renderer=renderer)
    places, normals = hits(shoot(scene, device, finest(device), lanes=4))
    arm = (places - np.array(CUT["center"])) / CUT["radius"]
    away = np.linalg.norm(arm, axis=-1)
    inside = sizes(scene.chain, places, 40)
    cut = (away > 1 - 1e-5) & (inside <= scene.chain.bailout).all(axis=0)
    assert cut.sum() > 500
    angles = degrees(normals[cut], arm[cut])
    assert np.median(angles) < 0.05
    if normal == "gradient":
        assert np.percentile(away, 99) < 1 + 1e-4
        assert np.percentile(angles, 95) < 0.1


def test_what_a_formulas_own_ball_cuts_has_its_normal(device: Device) -> None:
    """After one application |z| is below the bailout in a ball far larger than its own, alone or joined to another."""
    for objects in ({}, {"ball": {"type": "sphere", "position": [9, 0, 0], "radius": 0.5, "join": "union"}}):
        scene = scene_of({"name": "hast", "iterations": 1}, CAMERA, (48, 48), objects=objects, renderer=FINE)
        places, normals = hits(shoot(scene, device, finest(device), lanes=4))
        arm = places - np.array(scene.chain.center)
        of_it = np.linalg.norm(arm, axis=-1) < 1.1 * scene.chain.radius
        assert of_it.sum() > 100
        assert degrees(normals[of_it], arm[of_it]).max() < 0.1


# Coloured as the scenes of the library that show them, whose programs have the same text; and their degrees.
CASES: dict[str, tuple[dict[str, Any], str, int]] = {
    "mandelbulb": ({"name": "mandelbulb", "iterations": 4}, "iterations", 8),
    "hast": ({"name": "hast", "iterations": 8}, "solid", 2),
    "quaternion_julia": ({"name": "quaternion_julia", "iterations": 8}, "solid", 2),
}
NEAR = {"position": [1.3, -2.6, 1.6], "target": [0, 0, 0], "fov": 45}
# How far before its hit light is computed at most, cones (`detail` times footprints), and places tried on that way.
FARTHEST, PLACES = 12.0, 193
# The cone, footprints: narrow, or counts change much between the places where they are computed and the hits.
DETAIL = 0.02


@pytest.mark.parametrize("name", CASES)
def test_counts(device: Device, name: str) -> None:
    """n - log(log|z| / log R) / log d at the first n where |z| exceeds R, 1000 or less for high degrees d: that of a place
    on the pixel's ray, at the hit or before it, where the cone came near the solid."""
    formula, by, degree = CASES[name]
    scene = scene_of(formula, NEAR, (96, 72), lights=[], coloring={"by": by}, renderer={"detail": DETAIL})
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] > 0
    assert hit.sum() > 800
    points, counts = (each[hit][::3] for each in (points_of(framebuffer), framebuffer["iterations"]))
    to_eye = np.asarray(NEAR["position"]) - points
    distance = np.linalg.norm(to_eye, axis=-1, keepdims=True)
    cone = DETAIL * 2 * np.tan(np.radians(22.5)) / 72 * distance
    limit, difference = scene.chain.distance_bailout, np.full(len(points), np.inf)
    for way in np.linspace(0, FARTHEST, PLACES):
        size = sizes(scene.chain, points + way * cone * to_eye / distance, 40)
        first = (size > limit).argmax(axis=0)
        with np.errstate(all="ignore"):
            left = np.log(np.log(size[first, np.arange(len(points))]) / np.log(limit)) / np.log(degree)
        difference = np.fmin(difference, np.abs(counts - (first + 1 - np.clip(left, 0, 1))))
    assert np.median(difference) < 0.02
    assert np.quantile(difference, 0.95) < 0.2


def test_smooth_counts_have_no_jumps(device: Device) -> None:
    """Along a line out of the Mandelbulb the smooth count falls steadily, through every whole number."""
    line = np.linspace(2.0, 0.4, 8001)[:, None] * np.array([[0.48, 0.6, 0.64]])
    lanes = best_lanes(device, "float32")
    smooth = distances(load_chain("mandelbulb"), line, 60, device=device, lanes=lanes).smooth
    outer = smooth[: int((smooth > 5).argmax())]
    assert outer.max() - outer.min() > 3
    assert np.abs(np.diff(outer)).max() < 0.1
