"""A ball of glass beside Mitsuba 3: clear, rough, of media that absorb and scatter; and with another ball in it.

The ball fills the picture. It stands under a sky whose colour changes with the height, so that light which is bent the
wrong way has the wrong colour. Regions are compared as in `test_mitsuba.py`.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clfractal

pytestmark = pytest.mark.light

Floats = npt.NDArray[np.float64]

SIZE, SAMPLES, SEEDS, REGIONS = 32, 48, 6, 4
EYE, FOV = [1.0, -3.6, 1.4], 17.0
TOP, BOTTOM = [1.0, 0.3, 0.1], [0.1, 0.25, 0.8]
BOUNCES, CLOUDY_BOUNCES = 24, 64
FAR_OFF = [0.0, 60.0, 0.0]
INDEX, ALPHA = 1.5, 0.06
COLOR, DEPTH = [0.9, 0.7, 0.5], 1.5
_THEIRS = """
import json, sys
import mitsuba as mi
import numpy as np
mi.set_variant("scalar_rgb")
from mitsuba import ScalarTransform4f as T
told = json.load(sys.stdin)
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
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": told["integrator"], "max_depth": told["bounces"] + 2, "rr_depth": 1000},
    "sensor": {
        "type": "perspective", "fov": told["fov"], "fov_axis": "y",
        "to_world": T().look_at(origin=told["eye"], target=[0, 0, 0], up=[0, 0, 1]),
        "film": {"type": "hdrfilm", "width": told["size"], "height": told["size"], "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": told["samples"]},
    },
    **bodies,
    "sky": {"type": "envmap", "bitmap": mi.Bitmap(sky), "to_world": T().rotate([1, 0, 0], 90)},
})
np.save(told["to"], np.stack([np.array(mi.render(scene, seed=1 + seed))[..., :3] for seed in range(told["seeds"])]))
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


def fov_of(ball: str) -> float:
    """That the bodies fill the picture."""
    return 35.0 if ball in AROUND else FOV


def theirs(ball: str, folder: Path) -> Floats:
    """Pictures by Mitsuba, one of each seed, shape (SEEDS, SIZE, SIZE, 3)."""
    told = {
        "material": BALLS[ball][1],
        "medium": BALLS[ball][2],
        "integrator": "volpathmis" if ball in CLOUDY else "volpath",
        "around": AROUND[ball][1] if ball in AROUND else None,
        "around_medium": AROUND[ball][2] if ball in AROUND else None,
        "top": TOP,
        "bottom": BOTTOM,
        "bounces": 1000 if ball in CLOUDY else BOUNCES,
        "fov": fov_of(ball),
        "eye": EYE,
        "size": SIZE,
        "samples": SAMPLES,
        "seeds": SEEDS,
        "to": str(folder / "theirs.npy"),
    }
    subprocess.run(
        [sys.executable, "-c", _THEIRS], input=json.dumps(told), text=True, check=True, timeout=300
    )
    return np.asarray(np.load(folder / "theirs.npy"), np.float64)


def ours(ball: str) -> Floats:
    """The same by paths."""
    pictures = []
    objects: dict[str, Any] = {}
    if ball in AROUND:
        objects = {"outer": {"type": "sphere", "radius": 2.0, "material": "around"}}
    middle = FAR_OFF if ball in OBJECTS else [0.0, 0.0, 0.0]
    if ball in OBJECTS:
        objects = {"ball": {"type": "sphere", "radius": 1.0, "position": middle, "material": "m"}}
    bounces = CLOUDY_BOUNCES if ball in CLOUDY else BOUNCES
    for seed in range(SEEDS):
        scene = clfractal.Scene(
            version=1,
            formula={"name": "quaternion_julia", "iterations": 12, "julia": [0, 0, 0, 0]},
            camera={
                "position": np.add(EYE, middle).tolist(),
                "target": middle,
                "fov": fov_of(ball),
            },
            image={"width": SIZE, "height": SIZE},
            renderer={"samples": SAMPLES, "detail": 0.02, "seed": seed},
            lighting={"mode": "path", "bounces": bounces, "roulette": bounces},
            background={"top": TOP, "bottom": BOTTOM},
            lights=[],
            materials={"m": BALLS[ball][0], "around": AROUND[ball][0] if ball in AROUND else {}, "set": {}},
            objects=objects,
            material={"name": "set" if ball in OBJECTS else "m"},
        )
        film = clfractal.render(scene)
        pictures.append(np.stack([film[name] for name in "RGB"], axis=-1).astype(np.float64))
    return np.stack(pictures)


def regions(pictures: Floats) -> Floats:
    """Means of regions, shape (SEEDS, REGIONS, REGIONS, 3)."""
    each = SIZE // REGIONS
    return np.asarray(pictures.reshape(len(pictures), REGIONS, each, REGIONS, each, 3).mean(axis=(2, 4)))


# The others are kinds of these.
KINDS = ("core",)


@pytest.mark.parametrize(
    "ball",
    [*KINDS, *(pytest.param(name, marks=pytest.mark.combination) for name in BALLS if name not in KINDS)],
)
def test_balls_of_glass_agree_with_mitsuba(ball: str, tmp_path: Path) -> None:
    from scipy.stats import t

    # One of all regions fails in a thousand runs.
    factor = float(t.ppf(1 - 0.001 / 2 / (REGIONS * REGIONS * 3), 2 * SEEDS - 2))
    one, other = regions(ours(ball)), regions(theirs(ball, tmp_path))
    error = np.sqrt((one.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)) / SEEDS)
    difference, scale = one.mean(axis=0) - other.mean(axis=0), other.mean(axis=0)
    assert scale.max() > 0.3
    assert scale.max() / scale.min() > 1.8
    assert (np.abs(difference) <= 0.01 * scale + factor * error + 1e-4).all()
    assert abs(difference.mean() / scale.mean()) < 0.005
