"""Mitsuba 3's pictures of a scene with several random numbers: what the modules of its scenes have in common.

Each reads what is told as JSON, and writes pictures, shape (seeds, height, width, 3), and the seconds of all cores that
each took.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import mitsuba as mi
import numpy as np

Told = dict[str, Any]


def framed(told: Told, integrator: str) -> Told:
    """The integrator and the camera of a scene."""
    transform = mi.ScalarTransform4f()
    return {
        "type": "scene",
        "integrator": {
            "type": integrator,
            "max_depth": told["bounces"] + 2,
            "rr_depth": told["roulette"] + 1,
        },
        "sensor": {
            "type": "perspective",
            "fov": told["fov"],
            "fov_axis": "y",
            "to_world": transform.look_at(origin=told["eye"], target=told["target"], up=[0, 0, 1]),
            "film": {
                "type": "hdrfilm",
                "width": told["size"][0],
                "height": told["size"][1],
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "independent", "sample_count": told["samples"]},
        },
    }


def write_pictures(scene_of: Callable[[Told], Told]) -> None:
    """Renders what standard input tells, for each of its seeds, into its file."""
    mi.set_variant("scalar_rgb")
    told = json.load(sys.stdin)
    found = mi.load_dict(scene_of(told))
    mi.render(found, spp=1)  # begins its threads
    light, seconds = [], []
    for seed in told["seeds"]:
        begun = time.process_time()
        light.append(np.array(mi.render(found, seed=1 + seed, spp=told["samples"]))[..., :3])
        seconds.append(time.process_time() - begun)
    np.savez(told["file"], light=np.stack(light), seconds=seconds)
