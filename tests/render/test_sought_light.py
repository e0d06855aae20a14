"""Light that is sought: of maps, blends, formulas, the set and what is joined to it, beside quadrature and chance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.tune import accepted_lanes
from clfractal.scene.model import Scene
from clfractal.shading.emitters import emitters_of, seeks_light
from tests.render.bits import same
from tests.render.emitter_choices import chance_alone
from tests.render.glowing import BLACK, DULL, FLOOR, MATERIALS, blocks, colors, lit
from tests.render.path_scenes import BALL
from tests.render.shots import Floats, points_of, shoot, stacked
from tests.scenes import scene_of
from tests.variants import one_of

pytestmark = pytest.mark.light

DARK: dict[str, Any] = {"base": {"color": [0, 0, 0]}, "specular": DULL}


def glow(luminance: Any, **more: Any) -> dict[str, Any]:
    """A black material that shines."""
    return {**DARK, "emission": {"luminance": luminance, **more}}


def ramp(low: float, high: float, *, by: str = "height", **keys: Any) -> dict[str, Any]:
    """From 0 to 8 between two quantities."""
    return {"by": by, "range": [low, high], "curve": [[0, 0], [1, 8]], **keys}


def over_floor(
    it: dict[str, Any], material: dict[str, Any], samples: int, bounces: int = 0, **more: Any
) -> Scene:
    """One thing above a white floor, as `lit`."""
    materials = {**MATERIALS, "glow": material, **more.pop("materials", {})}
    return lit({"it": {**it, "material": "glow"}}, samples, bounces, materials=materials, **more)


def irradiance(points: Floats, places: Floats, normals: Floats, light: Floats, areas: Floats) -> Floats:
    """What a floor gets at points, shape (n, 3), of places of a surface, over pi."""
    found = []
    for point in points:
        way = places - point
        square = (way**2).sum(axis=1)
        facing = np.maximum(-(way * normals).sum(axis=1), 0)
        found.append((light * facing * np.maximum(way[:, 2], 0) * areas / square**2).sum() / np.pi)
    return np.array(found)


def floor_light(scene: Scene, device: Device) -> tuple[Floats, Floats]:
    """Red light of the floor, and where that is."""
    film = shoot(scene, device)
    return film["R"].astype(float), points_of(film).reshape(-1, 3)


def check(found: Floats, right: Floats) -> None:
    assert found.mean() == pytest.approx(right.mean(), rel=0.005)
    np.testing.assert_allclose(
        blocks(found[..., None]), blocks(right.reshape(24, 24, 1)), rtol=0.015, atol=0.003
    )


def test_a_panel_with_a_ramp(device: Device) -> None:
    """By quadrature over its lower side; its rim is a thousandth as wide."""
    panel = {"type": "box", "position": [0.1, 0.1, 0.8], "size": [1.2, 0.8, 0.0005]}
    scene = over_floor(panel, glow(ramp(-0.5, 0.7, direction=[1, 0, 0])), 256)
    assert [each.sought for each in emitters_of(scene)] == [True]
    found, points = floor_light(scene, device)
    x, y = (np.arange(48) + 0.5) / 48 - 0.5, (np.arange(32) + 0.5) / 32 - 0.5
    at = np.stack(np.meshgrid(0.1 + 1.2 * x, 0.1 + 0.8 * y, [0.79975]), axis=-1).reshape(-1, 3)
    light = 8 * (at[:, 0] + 0.5) / 1.2
    check(found, irradiance(points, at, np.array([0, 0, -1.0]), light, np.array(1.2 * 0.8 / len(at))))


@pytest.mark.parametrize("by", one_of("height", "normal"))
def test_a_ball_with_a_ramp(device: Device, by: str) -> None:
    """By quadrature over what is seen of it."""
    ball = {"type": "sphere", "position": [0.3, 0.1, 0.9], "radius": 0.3}
    way = {"direction": [0, 0.6, -0.8]}
    low, high = (-1.0, 1.0) if by == "normal" else (-0.66 - 0.3, -0.66 + 0.3)
    found, points = floor_light(over_floor(ball, glow(ramp(low, high, by=by, **way)), 256), device)
    turn, z = (np.arange(96) + 0.5) / 96 * 2 * np.pi, (np.arange(64) + 0.5) / 32 - 1
    angle, level = (each.reshape(-1) for each in np.meshgrid(turn, z))
    wide = np.sqrt(1 - level**2)
    normals = np.stack([wide * np.cos(angle), wide * np.sin(angle), level], axis=1)
    light = 4 * (1 + normals @ np.array(way["direction"]))
    places = np.array(ball["position"]) + 0.3 * normals
    check(found, irradiance(points, places, normals, light, np.array(4 * np.pi * 0.09 / len(normals))))


def of_a_ball(points: Floats, middle: Floats, radius: float) -> Floats:
    """What a floor gets of a ball of light 1 wholly above it, over pi."""
    way = middle - points
    square = (way**2).sum(axis=1)
    return np.asarray(radius**2 / square * way[:, 2] / np.sqrt(square))


def test_a_ball_that_is_a_formula(device: Device) -> None:
    it = {"type": "formula", "formula": BALL, "scale": 0.3, "position": [0.3, 0.1, 0.9]}
    scene = over_floor(it, glow(6), 256)
    assert [each.sought for each in emitters_of(scene)] == [True]
    found, points = floor_light(scene, device)
    right = 6 * of_a_ball(points, np.array(it["position"]), 0.3)
    assert found.mean() == pytest.approx(right.mean(), rel=0.005)
    np.testing.assert_allclose(
        blocks(found[..., None]), blocks(right.reshape(24, 24, 1)), rtol=0.03, atol=0.005
    )


def test_the_set_lights_a_floor(device: Device) -> None:
    """The set of a formula that is a ball of radius 1."""
    camera = {"position": [0.5, -0.3, -1.5], "target": [0.5, -0.3, -3], "up": [0, 1, 0], "fov": 90}
    scene = scene_of(
        BALL,
        camera,
        (24, 24),
        lights=[],
        background=BLACK,
        lighting={"mode": "path", "bounces": 0},
        materials={**MATERIALS, "glow": glow(6)},
        material={"name": "glow"},
        objects={"floor": {**FLOOR, "position": [0, 0, -3]}},
        renderer={"samples": 256, "detail": 0.1},
    )
    assert [each.thing for each in emitters_of(scene) if each.sought] == [0]
    found, points = floor_light(scene, device)
    right = 6 * of_a_ball(points, np.zeros(3), 1.0)
    assert found.mean() == pytest.approx(right.mean(), rel=0.005)
    np.testing.assert_allclose(
        blocks(found[..., None]), blocks(right.reshape(24, 24, 1)), rtol=0.03, atol=0.005
    )


BULB = {"type": "formula", "formula": {"name": "mandelbulb", "iterations": 4}, "scale": 0.45}
SHINING: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "blend": (
        {"type": "cylinder", "radius": 0.4, "height": 0.5, "rotation": [30, 40, 0]},
        {"blend": ["one", "other"], "mask": ramp(-0.3, 2, direction=[1, 0, 0]) | {"curve": [[0, 0], [1, 1]]}},
    ),
    "trap": ({"type": "box", "size": [0.5, 0.4, 0.3], "rotation": [20, 30, 0]}, glow(ramp(0, 2, by="trap"))),
    "torus": ({"type": "torus", "radius": 0.35, "tube": 0.12, "rotation": [40, 0, 0]}, glow(ramp(0.5, 1.3))),
    "formula": (BULB, glow(ramp(1, 4, by="iterations"))),
    "curved": (BULB, glow(ramp(0, 40, by="curvature", step=0.02), color={"by": "normal"})),
    "flowing": (
        {"type": "sphere", "radius": 0.4, "join": "smooth_union", "smoothness": 0.2},
        glow(ramp(0.5, 1.3)),
    ),
}
OPEN = [
    {"plane": {"center": [0, 0, 0.95], "normal": [1, 0, 0.2]}, "cut": True, "set": False, "objects": ["it"]}
]
PARTS = {
    "one": {**DARK, "emission": {"luminance": 8, "color": [1, 0.3, 0.1]}},
    "other": {"base": {"color": [0.5, 0.5, 0.5]}, "emission": {"luminance": 2, "color": [0.1, 0.4, 1]}},
}


def beside_chance(
    device: Device, it: dict[str, Any], material: dict[str, Any], **more: Any
) -> tuple[float, float]:
    """The same light as by chance alone, which needs one bounce more; and the variances of both in their time, samples."""
    found = {}
    for name, samples, bounces in (("sought", 128, 1), ("chance", 2048, 2)):
        scene = over_floor(
            {"position": [0.1, 0.05, 0.9], **it}, material, samples, bounces, materials=PARTS, **more
        )
        if name == "sought":
            assert seeks_light(scene)
            found[name] = colors(scene, device)
            continue
        with chance_alone():
            found[name] = colors(scene, device)
    one, other = found["sought"], found["chance"]
    assert one.mean() == pytest.approx(other.mean(), rel=0.02)
    np.testing.assert_allclose(
        blocks(one).mean(axis=-1), blocks(other).mean(axis=-1), rtol=0.1, atol=0.02 * other.mean()
    )
    rough = [each[..., 0] - np.roll(each[..., 0], 1, axis=1) for each in (one, other)]
    return float(rough[0].var() * 128), float(rough[1].var() * 2048)


@pytest.mark.parametrize("name", one_of("formula", "blend", "trap", "torus", "curved", "flowing"))
def test_what_is_sought_is_what_chance_finds(device: Device, name: str) -> None:
    sought, chance = beside_chance(device, *SHINING[name])
    assert sought < chance / 2


@pytest.mark.combination
def test_a_ball_that_a_plane_has_opened(device: Device) -> None:
    """It shines out of the opening with its inside; its face does not shine."""
    ball = {"type": "sphere", "radius": 0.4}
    sought, chance = beside_chance(device, ball, glow(6), cut_planes=OPEN)
    assert sought < chance / 2


@pytest.mark.combination
def test_things_before_it_hide_it(device: Device) -> None:
    """Another object, the set, and a lamp, each of them half of it."""
    shade = {"type": "box", "position": [0.3, 0, 0.5], "size": [0.5, 0.5, 0.02], "material": "white"}
    lamp = {"type": "sphere", "position": [-0.4, 0.2, 0.55], "radius": 0.12, "intensity": 0.3}

    def picture(samples: int, bounces: int) -> Floats:
        objects = {"it": {**BULB, "position": [0.1, 0.05, 0.9], "material": "glow"}, "shade": shade}
        materials = {**MATERIALS, "glow": glow(ramp(1, 4, by="iterations"))}
        return colors(lit(objects, samples, bounces, materials=materials, lights=[lamp]), device)

    sought = picture(256, 1)
    with chance_alone():
        chance = picture(2048, 2)
    assert sought.mean() == pytest.approx(chance.mean(), rel=0.01)
    np.testing.assert_allclose(blocks(sought), blocks(chance), rtol=0.06, atol=0.02 * chance.max())


HALF = {"base": {"color": [0.5] * 3}, "specular": DULL}
EVERYWHERE = {"by": "height", "curve": [[0, 0.5], [1, 0.5]]}


@pytest.mark.parametrize("name", one_of("formula", "torus", "even torus", "flowing"))
def test_a_furnace_of_what_is_sought(device: Device, name: str) -> None:
    """What shines with half and reflects half, in a room that does: 1 everywhere, also in its hollows."""
    luminance: Any = 0.5 if name == "even torus" else EVERYWHERE
    half = {**HALF, "emission": {"luminance": luminance}}
    it = {"position": [0, 0, 1], **SHINING[name.removeprefix("even ")][0], "material": "glow"}
    room = {
        "type": "box",
        "position": [0, 0, 1],
        "size": [3, 4, 2.4],
        "rotation": [0, 0, 20],
        "material": "wall",
    }
    walls = {**HALF, "emission": {"luminance": 0.5}}
    camera = {"position": [0.7, -1.2, 0.8], "target": [0.1, 0, 0.9], "fov": 60}
    materials = {**MATERIALS, "wall": walls, "glow": half, "white": walls}
    found = colors(lit({"it": it, "room": room}, 64, 24, camera, materials=materials), device)
    assert found.mean() == pytest.approx(1, abs=0.004)
    assert np.abs(blocks(found) - 1).max() < 0.03


def test_mirrors_show_the_map_after_the_last_bounce(device: Device) -> None:
    mirror = {"base": {"color": [1, 1, 1], "metalness": 1}, "specular": {"roughness": 0}}
    ball = {"type": "sphere", "position": [0, 3, 1.2], "radius": 0.6}
    camera = {"position": [0, -3, 1.2], "target": [0, 0, 0], "fov": 8}
    shown = []
    for bounces in (0, 1):
        scene = over_floor(
            ball, glow(ramp(0.6, 1.8)), 64, bounces, camera=camera, materials={"white": mirror}
        )
        shown.append(colors(scene, device)[..., 0])
    np.testing.assert_allclose(
        shown[0][6:18, 6:18].mean(axis=1), shown[1][6:18, 6:18].mean(axis=1), rtol=0.05
    )
    # The mirror image is upside down: what is below is the upper side of it.
    rows = shown[0][6:18, 6:18].mean(axis=1)
    assert rows[-1] > rows[0] + 1


def every_kind(samples: int) -> Scene:
    """A set, a formula, a ball and a lamp that shine, in glass and beside gloss."""
    materials = {
        **MATERIALS,
        "glow": glow(ramp(1, 4, by="iterations")),
        "embers": {"base": {"color": [0.4] * 3}, "emission": {"luminance": ramp(-1, 2, by="normal")}},
        "glass": {"transmission": {"weight": 1, "color": [0.7, 0.9, 0.8], "depth": 0.3}},
    }
    return scene_of(
        {"name": "mandelbulb", "iterations": 4},
        {"position": [1.5, -4, 1.2], "target": [0.4, 0, -0.4], "fov": 45},
        (40, 30),
        lights=[{"type": "point", "position": [2, -2, 2], "intensity": 2, "falloff": "inverse_square"}],
        background=[0.02, 0.02, 0.03],
        lighting={"mode": "path", "bounces": 4},
        materials=materials,
        material={"name": "embers"},
        objects={
            "floor": {**FLOOR, "position": [0, 0, -1.3]},
            "other": {**BULB, "position": [1.4, -0.6, -0.8], "material": "glow"},
            "ball": {"type": "sphere", "position": [-1.3, -1, -0.9], "radius": 0.3, "material": "embers"},
            "pane": {"type": "sphere", "position": [0.7, -1.5, -0.9], "radius": 0.35, "material": "glass"},
        },
        renderer={"samples": samples},
    )


@pytest.mark.combination
def test_every_lane_is_alone(device: Device) -> None:
    """(In both number types they are alike by what these tests find of chance.)"""
    one = stacked(shoot(every_kind(4), device, lanes=1), "RGB")
    for each in accepted_lanes(device, "float32")[:2]:
        many = stacked(shoot(every_kind(4), device, lanes=each), "RGB")
        assert np.isclose(one, many, rtol=1e-3, atol=1e-3).all(axis=-1).mean() > 0.9
        assert many.mean() == pytest.approx(one.mean(), rel=0.05)


def test_a_part_of_the_picture_has_its_bits(device: Device) -> None:
    scene = every_kind(2)
    assert [each.thing for each in emitters_of(scene)] == [0, 2, 3]
    whole = stacked(shoot(scene, device))
    for x, y, width, height in [(5, 3, 30, 21)]:
        part = stacked(shoot(scene, device, region=(x, y, width, height)))
        assert same(np.ascontiguousarray(whole[y : y + height, x : x + width]), part)


def test_which_light_is_sought() -> None:
    cloud_free = over_floor(BULB, glow(1), 1)
    assert seeks_light(cloud_free)
    opened = over_floor(BULB, glow(1), 1, cut_planes=[{"plane": {"center": [0, 0, 3]}, "cut": True}])
    assert not seeks_light(opened)
    glass = over_floor({"type": "sphere"}, {**glow(ramp(0, 1)), "transmission": {"weight": 1}}, 1)
    assert not emitters_of(glass)
    assert not emitters_of(over_floor(BULB, glow({"by": "height", "curve": [[0, 0], [1, 0]]}), 1))
    direct = lit({"it": {**BULB, "material": "glow"}}, 1, lighting={"mode": "direct"})
    assert not emitters_of(direct)
