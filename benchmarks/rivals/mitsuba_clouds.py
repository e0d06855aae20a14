"""Mitsuba 3's pictures of the scenes of `benchmarks.clouds`, in a process of its own (`mitsuba_seeds.py`)."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from benchmarks.rivals.mitsuba_seeds import framed, write_pictures


def scene_of(told: dict[str, Any]) -> dict[str, Any]:
    """The scene that is told."""
    transform, side = mi.ScalarTransform4f(), told["side"]
    box = transform.translate([-side / 2] * 3).scale([side] * 3)
    medium = {
        "type": "heterogeneous",
        "scale": told["extinction"],
        "sigma_t": {
            "type": "gridvolume",
            "grid": mi.VolumeGrid(np.load(told["values"])[..., None]),
            "to_world": box,
            "filter_type": "trilinear",
            "wrap_mode": "clamp",
        },
        "albedo": {"type": "constvolume", "value": {"type": "rgb", "value": [told["albedo"]] * 3}},
        "phase": {"type": "hg", "g": told["anisotropy"]},
    }
    return {
        **framed(told, "volpath"),
        "cloud": {
            "type": "cube",
            "to_world": transform.scale([side / 2] * 3),
            "bsdf": {"type": "null"},
            "interior": medium,
        },
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": told["sky"]}},
        "sun": {
            "type": "directional",
            "direction": told["from_sun"],
            "irradiance": {"type": "rgb", "value": [np.pi * each for each in told["sun"]]},
        },
    }


if __name__ == "__main__":
    write_pictures(scene_of)
