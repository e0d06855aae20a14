"""Light along paths beside Mitsuba 3, which renders the same ball, pillar and floor in a process of its own.

All three are a set, or the ball alone is one, and the others are objects beside it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from tests.render.mitsuba import assert_alike, by_mitsuba, by_us
from tests.variants import combinations

pytestmark = pytest.mark.light

WIDTH, HEIGHT, SAMPLES, SEEDS = 48, 32, 96, 6
ACROSS, DOWN = 6, 4  # regions
EYE, TARGET, FOV = [0.7, -3.6, 1.9], [-0.08, -0.15, -0.12], 36.0
COLOR = [0.8, 0.5, 0.3]
BOUNCES = 6
SKY = 0.3
LAMP, POWER = [1.5, -1.5, 2.0], 2.0
SUN, SUN_POWER = [-1.0, 0.6, -1.2], 0.7
ALPHA = 0.03
BULB = [0.75, -0.7, 0.3]
CRATE = [-0.1, -1.0, -0.3]
ALONG = [CRATE[0] + math.cos(math.radians(30)), CRATE[1] + math.sin(math.radians(30)), CRATE[2]]
DARK: dict[str, Any] = {"base": {"color": [0, 0, 0]}, "specular": {"weight": 0}}
BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0}}
SHINES = {"type": "area", "radiance": {"type": "rgb", "value": 6}}

STAGE: dict[str, Any] = {
    "title": "A ball and a pillar on a floor",
    "variables": ["x", "y", "z"],
    "let": {
        "ball": "sqrt(x*x + y*y + z*z) - 0.5",
        "across": "abs(x + 0.95) - 0.2",
        "along": "abs(y + 0.35) - 0.2",
        "up": "abs(z - 0.05) - 0.55",
        "beside": "max(across, 0)*max(across, 0) + max(along, 0)*max(along, 0) + max(up, 0)*max(up, 0)",
        "pillar": "sqrt(beside) + min(max(across, along, up), 0)",
        "ground": "max(z + 0.5, sqrt(x*x + y*y) - 4)",
    },
    "map": ["x", "y", "z"],
    "shape": "min(ball, pillar, ground)",
    "add": "none",
    "degree": 1,
    "bounds": {"center": [0, 0, 0], "radius": 4.2},
    "bailout": 100,
    "derivative": "dr",
}
BALL = {
    **STAGE,
    "title": "A ball",
    "let": {"ball": STAGE["let"]["ball"]},
    "shape": "ball",
    "bounds": {"center": [0, 0, 0], "radius": 0.6},
}
KINDS: dict[str, dict[str, Any]] = {
    "set": {"formula": {"inline": STAGE, "iterations": 1}},
    "objects": {
        "formula": {"inline": BALL, "iterations": 1},
        "objects": {
            "pillar": {
                "type": "box",
                "position": [-0.95, -0.35, 0.05],
                "size": [0.4, 0.4, 1.1],
                "material": "m",
            },
            "floor": {
                "type": "cylinder",
                "position": [0, 0, -0.6],
                "radius": 4,
                "height": 0.2,
                "material": "m",
            },
        },
    },
}
MATERIALS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "lambert": (
        {"base": {"color": COLOR}, "specular": {"weight": 0}},
        {"type": "diffuse", "reflectance": {"type": "rgb", "value": COLOR}},
    ),
    # Mitsuba's GGX loses what is reflected between facets, so the white metal is nearly smooth.
    "metal": (
        {"base": {"color": [1, 1, 1], "metalness": 1}, "specular": {"roughness": math.sqrt(ALPHA)}},
        {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": ALPHA},
    ),
}
LIGHTS: dict[str, tuple[dict[str, Any], list[dict[str, Any]]]] = {
    "sky": (
        {"background": {"top": [SKY] * 3, "bottom": [SKY] * 3}, "lights": []},
        [{"type": "constant", "radiance": {"type": "rgb", "value": SKY}}],
    ),
    # Our light of intensity 1 makes white as bright as 1: an irradiance of pi.
    "lamps": (
        {
            "background": {"top": [0, 0, 0], "bottom": [0, 0, 0]},
            "lights": [
                {"type": "point", "position": LAMP, "falloff": "inverse_square", "intensity": POWER},
                {"direction": SUN, "intensity": SUN_POWER},
            ],
        },
        [
            {"type": "point", "position": LAMP, "intensity": {"type": "rgb", "value": POWER * math.pi}},
            {
                "type": "directional",
                "direction": SUN,
                "irradiance": {"type": "rgb", "value": SUN_POWER * math.pi},
            },
        ],
    ),
    # Lights with a size, which are seen: their intensity is their radiance.
    "sizes": (
        {
            "background": {"top": [0, 0, 0], "bottom": [0, 0, 0]},
            "lights": [
                {"type": "sphere", "position": BULB, "radius": 0.15, "intensity": 6},
                {
                    "type": "rectangle",
                    "position": [0, -0.3, 1.6],
                    "direction": [0, 0, -1],
                    "up": [0, 1, 0],
                    "width": 1.2,
                    "height": 0.6,
                    "intensity": 3,
                },
            ],
        },
        [
            {
                "type": "sphere",
                "center": BULB,
                "radius": 0.15,
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 6}},
            },
            {
                "type": "rectangle",
                "to_world": {"look_at": [[0, -0.3, 1.6], [0, -0.3, 0], [0, 1, 0]], "scale": [0.6, 0.3, 1]},
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 3}},
            },
        ],
    ),
    # Objects that shine: a ball, and a box that is turned about z.
    "glowing": (
        {
            "background": {"top": [0, 0, 0], "bottom": [0, 0, 0]},
            "lights": [],
            "objects": {
                "bulb": {"type": "sphere", "position": BULB, "radius": 0.15, "material": "glow"},
                "crate": {
                    "type": "box",
                    "position": CRATE,
                    "size": [0.5, 0.3, 0.2],
                    "rotation": [0, 0, 30],
                    "material": "glow",
                },
            },
        },
        [
            {"type": "sphere", "center": BULB, "radius": 0.15, "bsdf": BLACK, "emitter": SHINES},
            {
                "type": "cube",
                # Its z looks along our x, its y is up.
                "to_world": {"look_at": [CRATE, ALONG, [0, 0, 1]], "scale": [0.15, 0.1, 0.25]},
                "bsdf": BLACK,
                "emitter": SHINES,
            },
        ],
    ),
}

# Materials of the lights' own objects.
GLOWS: dict[str, dict[str, Any]] = {
    **{name: {} for name in LIGHTS},
    "glowing": {"glow": {**DARK, "emission": {"luminance": 6}}},
}


_THEIRS = """
body = told["material"]
for light in told["lights"]:
    if "to_world" in light:
        origin, target, up = light["to_world"]["look_at"]
        light["to_world"] = T().look_at(origin=origin, target=target, up=up) @ T().scale(light["to_world"]["scale"])
found = pictures({
    "ball": {"type": "sphere", "radius": 0.5, "bsdf": body},
    "pillar": {"type": "cube", "to_world": T().translate([-0.95, -0.35, 0.05]) @ T().scale([0.2, 0.2, 0.55]), "bsdf": body},
    "floor": {"type": "disk", "to_world": T().translate([0, 0, -0.5]) @ T().scale([4, 4, 4]), "bsdf": body},
    **{f"light{number}": light for number, light in enumerate(told["lights"])},
})
"""


# (Lamps that metals throw on metals are caustics, which neither finds in so few samples.)
@pytest.mark.parametrize(
    ("kind", "material", "lights"),
    [
        ("set", "lambert", "sky"),
        ("objects", "lambert", "glowing"),
        *combinations(
            [
                ("set", "lambert", "lamps"),
                ("set", "metal", "sky"),
                ("objects", "lambert", "sky"),
                ("objects", "lambert", "sizes"),
                ("objects", "metal", "sky"),
            ]
        ),
    ],
)
def test_pictures_agree_with_mitsuba(kind: str, material: str, lights: str, tmp_path: Path) -> None:
    (ours, theirs), (shown, lamps) = MATERIALS[material], LIGHTS[lights]
    view = {"eye": EYE, "target": TARGET, "fov": FOV, "size": [WIDTH, HEIGHT]}
    told = {
        **view,
        "bounces": BOUNCES,
        "samples": SAMPLES,
        "seeds": SEEDS,
        "material": theirs,
        "lights": lamps,
    }
    found = by_us(
        SEEDS,
        # A tenth of the footprint: at contacts light would be missing.
        {"samples": SAMPLES, "detail": 0.1},
        **{
            **KINDS[kind],
            **shown,
            "objects": {**KINDS[kind].get("objects", {}), **shown.get("objects", {})},
        },
        camera={"position": EYE, "target": TARGET, "fov": FOV},
        image={"width": WIDTH, "height": HEIGHT},
        lighting={"mode": "path", "bounces": BOUNCES, "roulette": BOUNCES},
        materials={"m": ours, **GLOWS[lights]},
        material={"name": "m"},
    )
    assert assert_alike(found, by_mitsuba(_THEIRS, told, tmp_path), DOWN, ACROSS).max() > 0.1
