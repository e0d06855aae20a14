"""Light along paths beside Mitsuba 3, which renders the same ball, pillar and floor in a process of its own.

All three are a set, or the ball alone is one, and the others are objects beside it.

Regions of the pictures are compared: they may differ by the standard errors of both, found from
several pictures with other seeds, times the factor that Bonferroni's correction asks for, and by 1 % for what a surface's
footprint is wide.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clfractal

pytestmark = pytest.mark.light

Floats = npt.NDArray[np.float64]

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
_THEIRS = """
import json, sys
import mitsuba as mi
import numpy as np
mi.set_variant("scalar_rgb")
from mitsuba import ScalarTransform4f as T
told = json.load(sys.stdin)
body = told["material"]
for light in told["lights"]:
    if "to_world" in light:
        origin, target, up = light["to_world"]["look_at"]
        light["to_world"] = T().look_at(origin=origin, target=target, up=up) @ T().scale(light["to_world"]["scale"])
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "path", "max_depth": told["bounces"] + 2, "rr_depth": 1000},
    "sensor": {
        "type": "perspective", "fov": told["fov"], "fov_axis": "y",
        "to_world": T().look_at(origin=told["eye"], target=told["target"], up=[0, 0, 1]),
        "film": {"type": "hdrfilm", "width": told["size"][0], "height": told["size"][1], "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": told["samples"]},
    },
    "ball": {"type": "sphere", "radius": 0.5, "bsdf": body},
    "pillar": {"type": "cube", "to_world": T().translate([-0.95, -0.35, 0.05]) @ T().scale([0.2, 0.2, 0.55]), "bsdf": body},
    "floor": {"type": "disk", "to_world": T().translate([0, 0, -0.5]) @ T().scale([4, 4, 4]), "bsdf": body},
    **{f"light{number}": light for number, light in enumerate(told["lights"])},
})
pictures = [np.array(mi.render(scene, seed=1 + seed))[..., :3] for seed in range(told["seeds"])]
np.save(told["to"], np.stack(pictures))
"""

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


def theirs(material: str, lights: str, folder: Path) -> Floats:
    """Pictures by Mitsuba, one of each seed, shape (SEEDS, HEIGHT, WIDTH, 3)."""
    told = {
        "material": MATERIALS[material][1],
        "lights": LIGHTS[lights][1],
        "bounces": BOUNCES,
        "fov": FOV,
        "eye": EYE,
        "target": TARGET,
        "size": [WIDTH, HEIGHT],
        "samples": SAMPLES,
        "seeds": SEEDS,
        "to": str(folder / "theirs.npy"),
    }
    subprocess.run(
        [sys.executable, "-c", _THEIRS], input=json.dumps(told), text=True, check=True, timeout=300
    )
    return np.asarray(np.load(folder / "theirs.npy"), np.float64)


def ours(kind: str, material: str, lights: str) -> Floats:
    """The same by paths."""
    pictures, given, shown = [], KINDS[kind], LIGHTS[lights][0]
    for seed in range(SEEDS):
        scene = clfractal.Scene(
            version=1,
            **{**given, **shown, "objects": {**given.get("objects", {}), **shown.get("objects", {})}},
            camera={"position": EYE, "target": TARGET, "fov": FOV},
            image={"width": WIDTH, "height": HEIGHT},
            # A tenth of the footprint: at contacts light would be missing.
            renderer={"samples": SAMPLES, "detail": 0.1, "seed": seed},
            lighting={"mode": "path", "bounces": BOUNCES, "roulette": BOUNCES},
            materials={"m": MATERIALS[material][0], **GLOWS[lights]},
            material={"name": "m"},
        )
        film = clfractal.render(scene)
        pictures.append(np.stack([film[name] for name in "RGB"], axis=-1).astype(np.float64))
    return np.stack(pictures)


def regions(pictures: Floats) -> Floats:
    """Means of regions, shape (SEEDS, DOWN, ACROSS, 3)."""
    shape = (len(pictures), DOWN, HEIGHT // DOWN, ACROSS, WIDTH // ACROSS, 3)
    return np.asarray(pictures.reshape(shape).mean(axis=(2, 4)))


@cache
def factor() -> float:
    """Standard errors that a difference may be, so that one of all regions fails in a thousand runs."""
    from scipy.stats import t

    return float(t.ppf(1 - 0.001 / 2 / (DOWN * ACROSS * 3), 2 * SEEDS - 2))


# (Lamps that metals throw on metals are caustics, which neither finds in so few samples.)
@pytest.mark.parametrize(
    ("kind", "material", "lights"),
    [
        ("set", "lambert", "sky"),
        pytest.param("set", "lambert", "lamps", marks=pytest.mark.combination),
        pytest.param("set", "metal", "sky", marks=pytest.mark.combination),
        pytest.param("objects", "lambert", "sky", marks=pytest.mark.combination),
        pytest.param("objects", "lambert", "sizes", marks=pytest.mark.combination),
        ("objects", "lambert", "glowing"),
        pytest.param("objects", "metal", "sky", marks=pytest.mark.combination),
    ],
)
def test_pictures_agree_with_mitsuba(kind: str, material: str, lights: str, tmp_path: Path) -> None:
    one, other = regions(ours(kind, material, lights)), regions(theirs(material, lights, tmp_path))
    error = np.sqrt((one.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)) / SEEDS)
    difference, scale = one.mean(axis=0) - other.mean(axis=0), other.mean(axis=0)
    assert scale.max() > 0.1
    assert (np.abs(difference) <= 0.01 * scale + factor() * error + 1e-4).all()
    assert abs(difference.mean() / scale.mean()) < 0.005
