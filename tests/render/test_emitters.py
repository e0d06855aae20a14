"""Objects that shine, along paths: against lights of the same shape, quadrature, what chance finds, and white rooms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from clfractal.shading.emitters import emitters_of, sampled_radiance
from tests.render.bits import alike_by_lanes
from tests.render.emitter_choices import chance_alone
from tests.render.glowing import BY_CHANCE, COLOR, DULL, GLOW, MATERIALS, blocks, colors, lit
from tests.render.shots import Floats, normals_of, points_of, shoot, stacked
from tests.variants import one_of

pytestmark = pytest.mark.light

LAMPS: dict[str, dict[str, Any]] = {
    "ball": {"type": "sphere", "position": [0.3, 0.1, 0.9], "radius": 0.3},
    "egg": {"type": "sphere", "position": [0, 0.1, 0.9], "radius": 0.3, "scale": [1.2, 1, 0.5]},
    "box": {"type": "box", "position": [0.2, 0, 0.95], "size": [0.5, 0.3, 0.4]},
    "panel": {"type": "box", "position": [0, 0.1, 0.8], "size": [1.5, 0.8, 0.01]},
    "drum": {"type": "cylinder", "position": [0.1, -0.1, 0.85], "radius": 0.25, "height": 0.3},
    "tube": {"type": "cylinder", "position": [0, 0, 0.75], "radius": 0.03, "height": 2, "scale": [1, 1.5, 1]},
}
TURNS: dict[str, tuple[float, float, float]] = {
    "ball": (0, 0, 0),
    "egg": (10, 20, 30),
    "box": (20, 35, 50),
    "panel": (5, 8, 20),
    "drum": (30, 10, 0),
    "tube": (90, 3, 15),
}


def lamp(name: str) -> dict[str, Any]:
    return {**LAMPS[name], "rotation": list(TURNS[name]), "material": "glow"}


def test_a_ball_is_what_a_light_of_its_size_is(device: Device) -> None:
    """Both are asked for by the same numbers: the pictures are the same but for rounding."""
    it = lamp("ball")
    light = {"type": "sphere", "intensity": 6, "color": COLOR.tolist()}
    light |= {key: it[key] for key in ("position", "radius")}
    one = colors(lit({"ball": it}, 16), device)
    other = colors(lit({}, 16, lights=[light]), device)
    assert one.min() > 0.01
    np.testing.assert_allclose(one, other, atol=2e-5)


def test_the_floor_has_the_irradiance_of_a_ball(device: Device) -> None:
    framebuffer = shoot(lit({"it": lamp("ball")}, 256), device)
    found, points = stacked(framebuffer, ("R", "G", "B")).astype(float), points_of(framebuffer).reshape(-1, 3)
    assert np.abs(points[:, 2]).max() < 1e-3
    way = np.array(LAMPS["ball"]["position"]) - points
    square = (way**2).sum(axis=1)
    right = 0.3**2 / square * way[:, 2] / np.sqrt(square)  # Wholly above the horizon.
    assert found.mean(axis=(0, 1)) == pytest.approx(6 * COLOR * right.mean(), rel=0.005)
    np.testing.assert_allclose(blocks(found[..., 0]), 6 * blocks(right.reshape(24, 24)), rtol=0.01)


@pytest.mark.parametrize("side", [1, -1])
def test_a_plane_fills_half_of_what_is_around(device: Device, side: int) -> None:
    """A matt ball over it, or under it, has L (1 - cosine to the side away from it) / 2."""
    plane = {"type": "plane", "position": [0, 0, -0.8], "normal": [0, 0, side], "material": "glow"}
    ball = {"type": "sphere", "radius": 0.4, "material": "white"}
    scene = lit({"floor": plane, "ball": ball}, 256, camera={"position": [0, -2.2, 0], "fov": 20})
    framebuffer = shoot(scene, device)
    found, normals = stacked(framebuffer, ("R", "G", "B")).astype(float), normals_of(framebuffer)
    # (Not at its rim, which pixels see a part of.)
    here = (np.abs(np.linalg.norm(points_of(framebuffer), axis=-1) - 0.4) < 1e-3) & (normals[..., 1] < -0.5)
    assert here.sum() > 200
    right = 6 * (1 - normals[..., 2]) / 2
    assert found[here].mean(axis=0) == pytest.approx(COLOR * right[here].mean(), rel=0.005)
    np.testing.assert_allclose(found[here][:, 0], right[here], atol=0.25)


# Large lamps of all kinds, one half hidden by another, near a gloss and a metal; and a dull one that is lit by others.
MANY: dict[str, Any] = {
    "box": {"type": "box", "position": [-0.9, 0.5, 0.5], "size": [0.6, 0.5, 0.8], "rotation": [0, 0, 30]},
    "ball": {"type": "sphere", "position": [0.9, 0.6, 0.5], "radius": 0.4},
    "drum": {
        "type": "cylinder",
        "position": [0, 1, 0.4],
        "radius": 0.35,
        "height": 0.7,
        "rotation": [0, 60, 20],
    },
}
GLOSS = {"base": {"color": [0.5, 0.3, 0.2]}, "specular": {"roughness": 0.25}}
METAL = {"base": {"color": [0.9, 0.8, 0.7], "metalness": 1}, "specular": {"roughness": 0.3}}


def among_many(glow: dict[str, Any], samples: int, bounces: int = 3) -> Scene:
    glow = {**glow, "base": {"color": [0.6, 0.6, 0.6]}}
    objects = {name: {**each, "material": "glow"} for name, each in MANY.items()}
    objects["egg"] = {"type": "sphere", "position": [0, 0, 0.3], "radius": 0.3, "material": "metal"}
    objects["wall"] = {
        "type": "box",
        "position": [0.4, 0.4, 0.3],
        "size": [0.1, 0.6, 0.6],
        "material": "gloss",
    }
    camera = {"position": [0.5, -3, 2], "target": [0, 0.4, 0.3], "fov": 42}
    materials = {**MATERIALS, "gloss": GLOSS, "metal": METAL, "glow": glow}
    return lit(objects, samples, bounces, camera, materials=materials)


@pytest.mark.combination
def test_asking_and_chance_agree(device: Device) -> None:
    # After the last bounce lamps are still asked for, and nothing is met any more.
    asked, sought = (colors(among_many(glow, 256), device) for glow in (GLOW, BY_CHANCE))
    with chance_alone():
        chance = colors(among_many(BY_CHANCE, 2048, bounces=4), device)
    np.testing.assert_allclose(blocks(asked), blocks(sought), rtol=0.02, atol=0.002)
    assert asked.mean(axis=(0, 1)) == pytest.approx(chance.mean(axis=(0, 1)), rel=0.005)
    one, other = (blocks(each) for each in (asked, chance))
    np.testing.assert_allclose(one, other, rtol=0.04, atol=0.004)


def test_a_small_lamp_is_little_noise(device: Device) -> None:
    small = {**LAMPS["ball"], "radius": 0.05, "material": "glow"}

    def spread(glow: dict[str, Any], bounces: int) -> tuple[float, float]:
        """Mean and variance of the pixels' light."""
        materials = {**MATERIALS, "glow": glow}
        pictures = np.stack(
            [
                colors(
                    lit(
                        {"it": small},
                        16,
                        bounces,
                        materials=materials,
                        renderer={"samples": 16, "seed": seed, "detail": 0.1},
                    ),
                    device,
                )[..., 0]
                for seed in range(24)
            ]
        )
        return float(pictures.mean()), float(pictures.var(axis=0, ddof=1).mean())

    asked, sought = spread(GLOW, 0), spread(BY_CHANCE, 0)
    with chance_alone():
        chance = spread(BY_CHANCE, 1)
    assert asked[0] == pytest.approx(chance[0], rel=0.1)
    assert asked[0] == pytest.approx(sought[0], rel=0.001)
    assert max(asked[1], sought[1]) < chance[1] / 1000


@pytest.mark.parametrize("name", one_of("drum", "ball", "egg", "box"))
def test_a_room_that_shines_and_reflects_half_is_white(device: Device, name: str) -> None:
    """L = 1/2 + 1/2 L everywhere: on the walls, which nobody asks for from inside, and on what stands in the room."""
    half = {"base": {"color": [0.5] * 3}, "specular": DULL, "emission": {"luminance": 0.5}}
    room = {
        "type": "box",
        "position": [0, 0, 1],
        "size": [3, 4, 2.4],
        "rotation": [0, 0, 20],
        "material": "glow",
    }
    camera = {"position": [0.7, -1.2, 0.8], "target": [0.1, 0, 0.8], "fov": 70}
    objects = {"it": lamp(name), "room": room}
    scene = lit(objects, 64, 24, camera, materials={**MATERIALS, "white": half, "glow": half})
    found = colors(scene, device)
    assert found.mean() == pytest.approx(1, abs=0.002)
    assert np.abs(blocks(found) - 1).max() < 0.02


def test_the_eye_and_mirrors_see_the_whole_of_it(device: Device) -> None:
    """A smooth mirror finds a lamp by its own rays: the lamp is there as bright as it is."""
    mirror = {"base": {"color": [1, 1, 1], "metalness": 1}, "specular": {"roughness": 0}}
    camera = {"position": [0, -3, 1.2], "target": [0, 0, 0], "fov": 5}
    ball = {"type": "sphere", "position": [0, 3, 1.2], "radius": 0.6, "material": "glow"}
    scene = lit({"it": ball}, 16, 1, camera, materials={**MATERIALS, "white": mirror})
    middle = colors(scene, device)[8:16, 8:16]
    assert middle.mean(axis=(0, 1)) == pytest.approx(6 * COLOR, rel=0.01)
    # (Its width is 1/512, so that single pixels are a little noisy.)
    assert np.abs(middle / (6 * COLOR) - 1).max() < 0.15
    at_it = {**camera, "target": [0, 3, 1.2]}
    np.testing.assert_array_equal(
        colors(lit({"it": ball}, 2, 1, at_it), device)[12, 12], np.float32(6 * COLOR)
    )


@pytest.mark.combination
def test_every_lane_is_alone(device: Device) -> None:
    alike_by_lanes(among_many(GLOW, 4), device, share=0.99, mean=0.02, rtol=0, atol=1e-3)


def test_what_is_asked_for() -> None:
    blend = {"blend": ["glow", "white"], "mask": 0.5}
    materials = {
        **MATERIALS,
        "map": BY_CHANCE,
        "blend": blend,
        "glass": {**GLOW, "transmission": {"weight": 0.5}},
        "dark": {"emission": {"luminance": 1, "color": [0, 0, 0]}},
    }
    objects = {name: {"material": name} for name in materials}
    objects |= {
        "box": {"type": "box", "material": "glow"},
        "cylinder": {"type": "cylinder", "material": "glow"},
        "plane": {"type": "plane", "material": "glow"},
        "part": {"material": "glow", "join": "smooth_union"},
    }
    scene = lit(objects, 1, materials=materials)
    found = dict(zip(scene.objects, sampled_radiance(scene), strict=True))
    assert {name for name, radiance in found.items() if radiance is not None} == {
        "glow",
        "box",
        "cylinder",
        "plane",
    }
    assert found["glow"] == (6.0, 3.0, 1.5)
    # Of what is joined to the set nobody knows the shape.
    names = list(scene.objects)
    assert {names[each.thing - 1] for each in emitters_of(scene) if each.sought} == {"map", "blend", "part"}
    direct = lit({"it": lamp("ball")}, 1, lighting={"mode": "direct"})
    assert sampled_radiance(direct) == [None, None]
    # Objects without a material have the scene's.
    named = lit({"it": {}}, 1, material={"name": "glow"})
    assert sampled_radiance(named)[1] == (6.0, 3.0, 1.5)


def test_a_limit_holds_for_what_shines(device: Device) -> None:
    """`lighting.clamp`: what a bounce finds by chance is limited too."""
    path = {"mode": "path", "bounces": 1}
    for glow in (GLOW, BY_CHANCE):
        materials = {**MATERIALS, "glow": glow}
        with chance_alone():
            scenes = [
                lit({"it": lamp("panel")}, 16, materials=materials, lighting={**path, "clamp": clamp})
                for clamp in (None, 0.05)
            ]
            free, limited = (colors(each, device) for each in scenes)
        assert free.mean() > 0.5
        # The first spot's own question is not limited: nobody has bounced yet.
        if glow is BY_CHANCE:
            assert limited.max() <= 0.05 * (1 + 1e-5)
        assert limited.mean() < free.mean()


@pytest.mark.combination
def test_all_kinds_of_light_add_up(device: Device) -> None:
    """Of lamps, lights and an environment one is asked for at each spot: the mean is their sum."""
    lamps = {"ball": lamp("ball"), "tube": lamp("tube")}
    dark = {**GLOW, "emission": {"luminance": 0}}
    lights = [
        {"type": "point", "position": [0, -1, 1.2], "falloff": "inverse_square", "intensity": 2},
        {"direction": [1, 0.3, -1], "angular_size": 4, "intensity": 0.5},
    ]
    sky = {"name": "overcast", "intensity": 0.5}

    def mean(glow: dict[str, Any], **sections: Any) -> Floats:
        found = colors(lit(lamps, 256, 1, materials={**MATERIALS, "glow": glow}, **sections), device)
        return np.asarray(found.mean(axis=(0, 1)))

    parts = [mean(GLOW), mean(dark, lights=lights), mean(dark, environment=sky)]
    assert min(part.min() for part in parts) > 0.03
    assert mean(GLOW, lights=lights, environment=sky) == pytest.approx(sum(parts), rel=0.005)


@pytest.mark.combination
def test_lamps_in_glass_and_under_water(device: Device) -> None:
    """Where glass is in the way only chance finds them; spots in the same glass ask for them, through what it absorbs."""
    clear = {
        "specular": {"roughness": 0},
        "transmission": {"weight": 1, "color": [0.5, 0.8, 0.9], "depth": 0.5},
    }
    objects = {
        "lamp": {**LAMPS["ball"], "position": [0.1, 0, 0.3], "radius": 0.2, "material": "glow"},
        "lantern": {**LAMPS["drum"], "position": [-0.9, 0.3, 0.75], "radius": 0.15, "material": "glow"},
        "pane": {"type": "sphere", "position": [-0.9, 0.3, 0.75], "radius": 0.35, "material": "clear"},
        "water": {"type": "plane", "position": [0, 0, 0.62], "material": "clear"},
    }
    camera = {"position": [0.3, -2.2, 1.6], "target": [-0.3, 0.1, 0.3], "fov": 45}

    def picture(glow: dict[str, Any], samples: int, bounces: int) -> Floats:
        materials = {**MATERIALS, "clear": clear, "glow": glow}
        return colors(lit(objects, samples, bounces, camera, materials=materials), device)

    with chance_alone():
        chance = picture(BY_CHANCE, 1024, 8)
    for asked in (picture(GLOW, 256, 7), picture(BY_CHANCE, 256, 7)):
        assert asked.mean(axis=(0, 1)) == pytest.approx(chance.mean(axis=(0, 1)), rel=0.01)
        one, other = (blocks(each) for each in (asked, chance))
        np.testing.assert_allclose(one, other, rtol=0.08, atol=0.01)
