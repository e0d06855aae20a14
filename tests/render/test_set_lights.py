"""Lights on the set: their places, the grid's probabilities, and pictures against the same balls as lights of their own."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.formulas import reference
from clfractal.scene import places
from clfractal.scene.model import Scene
from clfractal.schema.trap import Trap
from clfractal.shading.kind_numbers import TRAPS
from clfractal.shading.set_lights import BALL_NUMBERS, SetLights, packed, probabilities, set_lights_of
from tests.render.bits import alike_by_lanes
from tests.render.shots import PERSPECTIVE, QUICK_BALL, Floats, rays, shoot, stacked
from tests.render.traps import TRAP, TRAP_FORMULAS, trap_by_numpy, trap_scene
from tests.scenes import scene_of
from tests.variants import one_of

pytestmark = pytest.mark.light

SIDE = 32
BLACK = {"color": [0, 0, 0], "ambient": 0, "diffuse": 0, "specular": 0}
DARK = {"top": [0, 0, 0], "bottom": [0, 0, 0]}
GREY = {"color": [0.8, 0.6, 0.4], "ambient": 0.05, "diffuse": 0.9, "specular": 0.3}
PATHS = {
    "lighting": {"mode": "path", "bounces": 2},
    "materials": {"silk": {"base": {"color": [0.8, 0.6, 0.4]}, "specular": {"roughness": 0.3}}},
    "material": {"name": "silk"},
}
FEW = {"count": 40, "radius": 0.08, "height": 0.35, "color": [1.0, 0.7, 0.4], "intensity": 5.0}


def lit(on_set: dict[str, Any], samples: int, **sections: Any) -> Scene:
    trap = {"shape": "plane", "direction": [0, 0, 1]}
    light = {"type": "set", "trap": trap, "threshold": 3.9, **on_set}
    sections = {"lights": [light], "material": GREY, "background": DARK, **sections}
    # Hits are found within a small part of a pixel, so that rays begin near the surface.
    renderer = {"samples": samples, "detail": 0.1}
    return scene_of(QUICK_BALL, PERSPECTIVE, (SIDE, SIDE), renderer=renderer, **sections)


def balls_of(scene: Scene) -> tuple[SetLights, Floats]:
    found = set_lights_of(scene)
    assert found is not None
    return found, found.data[: BALL_NUMBERS * found.count].reshape(-1, BALL_NUMBERS)


@pytest.mark.parametrize("name", TRAP_FORMULAS)
def test_traps_are_those_of_colours(name: str) -> None:
    scene = trap_scene(name)
    points = np.random.default_rng(3).uniform(-0.9, 0.9, (64, 3))
    expected = trap_by_numpy(scene, points)
    for shape, wanted in zip(TRAPS, expected, strict=True):
        trap = Trap.model_validate({**TRAP, "shape": shape}, strict=False)
        found = places.trap_distances(scene.chain, points, scene.formula.iterations, trap)
        np.testing.assert_allclose(found, wanted, rtol=1e-10)


@pytest.mark.parametrize(
    ("formula", "trap", "threshold"),
    [
        ({"name": "menger_sponge", "iterations": 4}, {"shape": "plane", "center": [0, 0, 0.3]}, 0.1),
        ({"name": "mandelbulb", "iterations": 8}, {"shape": "axis"}, 0.4),
    ],
)
def test_places_lie_on_the_set_near_the_trap(
    formula: dict[str, Any], trap: dict[str, Any], threshold: float
) -> None:
    def made(seed: int) -> tuple[Scene, places.Places]:
        light = {"type": "set", "trap": trap, "threshold": threshold, "count": 300, "seed": seed}
        scene = scene_of(formula, PERSPECTIVE, lights=[light])
        return scene, places.places_of(scene, 0)

    scene, found = made(1)
    assert len(found.surface) == 300
    away, gradient = reference.distance(scene.chain, found.surface, scene.formula.iterations)
    assert (away > 0).all()
    assert (away <= places.TOLERANCE * scene.bounds[1]).all()
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1, rtol=1e-9)
    assert (np.einsum("ni,ni->n", gradient, found.normal) > 0).all()
    shape = Trap.model_validate(trap, strict=False)
    near = places.trap_distances(scene.chain, found.surface, scene.formula.iterations, shape)
    assert (near < threshold).all()
    np.testing.assert_array_equal(near, found.trap)
    # The same again, and other places by another seed.
    places.near_trap.cache_clear()
    places._spread_places.cache_clear()
    np.testing.assert_array_equal(made(1)[1].surface, found.surface)
    assert not np.array_equal(made(2)[1].surface, found.surface)


def test_places_are_spread_out() -> None:
    points = np.random.default_rng(0).uniform(size=(4000, 3))
    chosen = points[places.spread_out(points, 100, 0.0)]
    apart = np.linalg.norm(chosen[:, None] - chosen, axis=2) + np.eye(100)
    # Random ones would come as near as 0.02.
    assert apart.min() > 0.17
    kept = points[places.spread_out(points, 4000, 0.3)]
    assert (np.linalg.norm(kept[:, None] - kept, axis=2) + np.eye(len(kept))).min() >= 0.3
    assert np.linalg.norm(points[:, None] - kept, axis=2).min(axis=1).max() <= 0.3


def random_balls(count: int) -> tuple[Floats, Floats]:
    random = np.random.default_rng(5)
    balls = np.zeros((count, BALL_NUMBERS))
    balls[:, :3] = random.uniform(-1, 1, (count, 3))
    balls[:, 3] = random.uniform(0.005, 0.05, count)
    balls[:, 4:7] = random.uniform(0, 2, (count, 3))
    normals = random.normal(size=(count, 3))
    return balls, normals / np.linalg.norm(normals, axis=1)[:, None]


def test_probabilities_add_up_to_one_and_know_distance_and_side() -> None:
    balls, normals = random_balls(500)
    where = np.random.default_rng(6).uniform(-1, 1, (50, 3))
    rows = probabilities(balls, normals, where, 0.05)
    each = np.diff(rows[:, :-1], axis=1, prepend=0)
    np.testing.assert_allclose(each.sum(axis=1), 1)
    assert each.min() > 0.0199 / 500
    assert (rows[:, -1] > 0).all()
    # A ball twice as far has a quarter; one that looks away has much less.
    balls[:, 3], balls[:, 4:7] = 0.01, 1.0
    pair, up = balls[:3].copy(), np.tile([0.0, 0.0, 1.0], (3, 1))
    pair[:, :3] = [[0, 0, -1], [0, 0, -2], [0, 0, 1]]
    (row,) = probabilities(pair, up, np.zeros((1, 3)), 1e-3)
    near, far, behind = np.diff(row[:-1], prepend=0) - 0.02 / 3
    assert near / far == pytest.approx(4, rel=1e-3)
    assert near / behind == pytest.approx(20, rel=1e-3)


def test_every_ball_is_listed_where_it_is() -> None:
    balls, normals = random_balls(700)
    found = packed(balls, normals, 1)
    begin = 700 * BALL_NUMBERS + found.cells**3 * 701
    starts = found.data[begin : begin + found.lists**3 + 1].astype(int)
    members = found.data[begin + found.lists**3 + 1 :].astype(int)
    assert starts[-1] == len(members)
    random = np.random.default_rng(7)
    way = random.normal(size=(700, 3))
    on_ball = balls[:, :3] + balls[:, 3:4] * way / np.linalg.norm(way, axis=1)[:, None]
    x, y, z = ((on_ball - found.corner) / found.edge * found.lists).astype(int).T
    for ball, cell in enumerate((z * found.lists + y) * found.lists + x):
        assert ball in members[starts[cell] : starts[cell + 1]]


def as_spheres(scene: Scene) -> list[dict[str, Any]]:
    """The same balls as lights of their own."""
    return [
        {
            "type": "sphere",
            "position": row[:3].tolist(),
            "radius": row[3],
            "color": row[4:7].tolist(),
            "rays": 1,
        }
        for row in balls_of(scene)[1]
    ]


@pytest.mark.parametrize(
    ("shadow", "mode"), one_of((True, PATHS), (False, {}), (True, {}), (False, PATHS)), ids=repr
)
def test_the_choice_is_without_bias(device: Device, mode: dict[str, Any], shadow: bool) -> None:
    """The mean of many choices is the sum over all balls, each as a light of its own."""
    scene = lit({**FEW, "shadow": shadow, "rays": 2}, 1024, **mode)
    spheres = [{**each, "shadow": shadow} for each in as_spheres(scene)]
    many = lit({}, 256, **{**mode, "lights": spheres})
    one = stacked(shoot(scene, device), ("R", "G", "B")).astype(float)
    sum_of_all = stacked(shoot(many, device), ("R", "G", "B")).astype(float)
    # (Where balls are seen their rims hide the rest.)
    dark = sum_of_all.max(axis=-1) < 2
    assert dark.sum() > 300
    assert one[dark].mean() == pytest.approx(sum_of_all[dark].mean(), rel=0.01)
    found, wanted = (
        np.where(dark, image[..., 0], 0).reshape(4, 8, 4, 8).sum(axis=(1, 3)) for image in (one, sum_of_all)
    )
    np.testing.assert_allclose(found, wanted, rtol=0.06, atol=0.01 * wanted.max())


def test_the_eye_sees_the_nearest_ball(device: Device) -> None:
    scene = lit({"count": 1500, "radius": 0.02, "height": 0.4}, 1, material=BLACK)
    found, balls = balls_of(scene)
    assert found.count == 1500
    origin, way, _ = rays(scene)
    offset = balls[:, :3] - np.broadcast_to(origin, way.shape)[0, 0]
    along = np.einsum("hwi,ni->hwn", way, offset)
    beside = np.sqrt(np.maximum((offset**2).sum(axis=1) - along**2, 0))
    # The set hides those behind it.
    depth = shoot(lit({"count": 1, "visible": False}, 1, material=BLACK), device)
    here = np.stack([depth[name] for name in ("P.X", "P.Y", "P.Z")], axis=-1)
    far = np.linalg.norm(here - np.broadcast_to(origin, way.shape), axis=-1)
    far = np.where(depth["A"] > 0.5, far, np.inf)[..., None]
    clear = np.abs(beside - 0.02).min(axis=2) > 1e-4
    wanted = ((beside < 0.02) & (along < far)).any(axis=2)
    seen = shoot(scene, device)["R"] > 0.5
    assert wanted.sum() > 100
    assert (seen == wanted)[clear].mean() > 0.99
    hidden = lit({"count": 1500, "radius": 0.02, "height": 0.4, "visible": False}, 1, material=BLACK)
    assert not (shoot(hidden, device)["R"] > 0.5).any()


@pytest.mark.combination
@pytest.mark.parametrize("mode", [{}, PATHS], ids=["direct", "path"])
def test_every_lane_is_alone(device: Device, mode: dict[str, Any]) -> None:
    """A rounding may choose another ball now and then."""
    alike_by_lanes(lit({"count": 300, "radius": 0.01}, 8, **mode), device)


def test_colours_follow_the_trap() -> None:
    scene = lit({"count": 100, "palette": ["#000", "#fff"]}, 1)
    _, balls = balls_of(scene)
    near = places.places_of(scene, 0).trap
    assert near.std() > 0.1
    np.testing.assert_allclose(balls[:, 5], near / 3.9, atol=0.005)
    assert json.loads(scene.lights[0].model_dump_json())["palette"][1]["at"] == 1
