"""A ball of glass beside Mitsuba 3: clear, rough, of media that absorb and scatter; and with another ball in it.

The ball fills the picture. It stands under a sky whose colour changes with the height, so that light which is bent the
wrong way has the wrong colour.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.render.mitsuba import assert_alike, by_mitsuba, by_us
from tests.variants import one_of

pytestmark = pytest.mark.light

SIZE, SAMPLES, SEEDS, REGIONS = 32, 48, 6, 4
EYE, FOV = [1.0, -3.6, 1.4], 17.0
TOP, BOTTOM = [1.0, 0.3, 0.1], [0.1, 0.25, 0.8]
BOUNCES, CLOUDY_BOUNCES = 24, 64
FAR_OFF = [0.0, 60.0, 0.0]
INDEX, ALPHA = 1.5, 0.06
COLOR, DEPTH = [0.9, 0.7, 0.5], 1.5
_THEIRS = """
height = np.cos(np.pi * (np.arange(256) + 0.5) / 256)[:, None, None]
top, bottom = np.array(told["top"]), np.array(told["bottom"])
sky = np.broadcast_to(top + (bottom - top) * (0.5 - 0.5 * height), (256, 512, 3)).astype(np.float32).copy()

def medium(one):
    scale = max(one["extinction"])
    sigma = {"type": "rgb", "value": [part / scale for part in one["extinction"]]}
    albedo = {"type": "rgb", "value": one["albedo"]}
    phase = {"type": "hg", "g": one["g"]}
    return {"type": "homogeneous", "albedo": albedo, "scale": scale, "sigma_t": sigma, "phase": phase}
ball = {"type": "sphere", "radius": 1.0, "bsdf": told["material"]}
bodies = {"ball": ball}
if told["medium"]:
    ball["interior"] = medium(told["medium"])
if told["around"]:
    outer = {"type": "sphere", "radius": 2.0, "bsdf": told["around"], "interior": medium(told["around_medium"])}
    bodies["outer"] = outer
    ball["exterior"] = medium(told["around_medium"])
sky = {"type": "envmap", "bitmap": mi.Bitmap(sky), "to_world": T().rotate([1, 0, 0], 90)}
found = pictures({**bodies, "sky": sky})
"""


def medium_of(
    color: Sequence[float], depth: float, scatter: Sequence[float] = (0, 0, 0), g: float = 0.0
) -> dict[str, Any]:
    """A medium for Mitsuba, by what OpenPBR 1.1 says of one ("Translucent base")."""
    scatters = np.array(scatter, float) / depth
    absorbs = -np.log(np.array(color, float)) / depth - scatters
    extinction = absorbs + max(-absorbs.min(), 0) + scatters
    return {"extinction": extinction.tolist(), "albedo": (scatters / extinction).tolist(), "g": g}


def participating(
    color: Sequence[float], depth: float, scatter: Sequence[float], g: float
) -> tuple[Any, Any, Any]:
    """The same ball for both."""
    values = {
        "weight": 1,
        "color": list(color),
        "depth": depth,
        "scatter": list(scatter),
        "scatter_anisotropy": g,
    }
    ours = {"specular": {"roughness": 0, "ior": INDEX}, "transmission": values}
    return ours, BOUNDARY, medium_of(color, depth, scatter, g)


BOUNDARY = {"type": "dielectric", "int_ior": INDEX, "ext_ior": 1.0}
# For us, for Mitsuba, and what is in it.
BALLS: dict[str, tuple[dict[str, Any], dict[str, Any], dict[str, Any] | None]] = {
    "clear": (
        {"specular": {"roughness": 0, "ior": INDEX}, "transmission": {"weight": 1}},
        BOUNDARY,
        None,
    ),
    "rough": (
        {"specular": {"roughness": math.sqrt(ALPHA), "ior": INDEX}, "transmission": {"weight": 1}},
        {"type": "roughdielectric", "distribution": "ggx", "alpha": ALPHA, "int_ior": INDEX, "ext_ior": 1.0},
        None,
    ),
    "amber": (
        {
            "specular": {"roughness": 0, "ior": INDEX},
            "transmission": {"weight": 1, "color": COLOR, "depth": DEPTH},
        },
        BOUNDARY,
        medium_of(COLOR, DEPTH),
    ),
    "drop": (
        {"specular": {"roughness": 0, "ior": 1.2}, "transmission": {"weight": 1}},
        {"type": "dielectric", "int_ior": 1.2, "ext_ior": INDEX},
        None,
    ),
    "core": (
        {"base": {"color": [0.7, 0.8, 0.9]}, "specular": {"weight": 0}},
        {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.8, 0.9]}},
        None,
    ),
    "milk": participating([0.8, 0.8, 0.8], 1.0, [0.7, 0.7, 0.7], 0.0),
    "rose": participating([0.95, 0.75, 0.6], 0.5, [0.9, 0.85, 0.8], 0.6),
}
# Those of a medium that scatters: an object far from the set, of which paths know that nothing is near; and the set.
OBJECTS = {"rose"}
CLOUDY = {"milk", "rose"}
# What stands around some of them: an object, and the same for Mitsuba.
AROUND = dict.fromkeys(("drop", "core"), BALLS["amber"])


# (The others are kinds of the core.)
@pytest.mark.parametrize("ball", one_of("core", *(name for name in BALLS if name != "core")))
def test_balls_of_glass_agree_with_mitsuba(ball: str, tmp_path: Path) -> None:
    ours, theirs, medium = BALLS[ball]
    around: Any = AROUND.get(ball, ({}, None, None))
    middle = FAR_OFF if ball in OBJECTS else [0.0, 0.0, 0.0]
    bodies = {
        **({"outer": {"type": "sphere", "radius": 2.0, "material": "around"}} if ball in AROUND else {}),
        **(
            {"ball": {"type": "sphere", "radius": 1.0, "position": middle, "material": "m"}}
            if ball in OBJECTS
            else {}
        ),
    }
    # So that the bodies fill the picture.
    fov = 35.0 if ball in AROUND else FOV
    bounces = CLOUDY_BOUNCES if ball in CLOUDY else BOUNCES
    told = {
        "eye": EYE,
        "target": [0, 0, 0],
        "fov": fov,
        "size": [SIZE, SIZE],
        "samples": SAMPLES,
        "seeds": SEEDS,
        "top": TOP,
        "bottom": BOTTOM,
        "bounces": 1000 if ball in CLOUDY else BOUNCES,
        "integrator": "volpathmis" if ball in CLOUDY else "volpath",
        "material": theirs,
        "medium": medium,
        "around": around[1],
        "around_medium": around[2],
    }
    found = by_us(
        SEEDS,
        {"samples": SAMPLES, "detail": 0.02},
        formula={"name": "quaternion_julia", "iterations": 12, "julia": [0, 0, 0, 0]},
        camera={"position": np.add(EYE, middle).tolist(), "target": middle, "fov": fov},
        image={"width": SIZE, "height": SIZE},
        lighting={"mode": "path", "bounces": bounces, "roulette": bounces},
        background={"top": TOP, "bottom": BOTTOM},
        lights=[],
        materials={"m": ours, "around": around[0], "set": {}},
        objects=bodies,
        material={"name": "set" if ball in OBJECTS else "m"},
    )
    light = assert_alike(found, by_mitsuba(_THEIRS, told, tmp_path), REGIONS, REGIONS)
    assert light.max() > max(0.3, 1.8 * light.min())
