"""Clouds of a grid beside Mitsuba 3, under a sky and a sun: a thin one that scatters forwards, and a thick, white one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.render.mitsuba import assert_alike, by_mitsuba, by_us
from tests.variants import one_of

pytestmark = pytest.mark.light

WIDTH, HEIGHT, SEEDS, SAMPLES = 40, 24, 6, 24
EYE, TARGET, FOV = [1.2, -5.2, 0.4], [0.0, 0.0, 0.0], 17.0
SIDE, VOXELS, STOPS = 2.0, 24, 65
SKY, SUN, FROM_SUN = [0.4, 0.5, 0.7], [2.0, 1.8, 1.5], [-0.6, 0.5, -0.62]
# Extinction where values are 1, per unit; albedo and anisotropy of a scattering; and how often light is scattered at most.
CLOUDS: dict[str, tuple[float, list[float], float, int]] = {
    "thick": (40.0, [0.995, 0.99, 0.98], 0.0, 128),
    "thin": (1.5, [0.9, 0.8, 0.95], 0.6, 32),
}
_THEIRS = """
side = told["side"]
box = T().translate([-side / 2] * 3).scale([side] * 3)
medium = {
    "type": "heterogeneous", "scale": told["extinction"],
    "sigma_t": {
        "type": "gridvolume", "grid": mi.VolumeGrid(np.load(told["values"])[..., None]), "to_world": box,
        "filter_type": "trilinear", "wrap_mode": "clamp",
    },
    "albedo": {"type": "constvolume", "value": {"type": "rgb", "value": told["albedo"]}},
    "phase": {"type": "hg", "g": told["anisotropy"]},
}
cloud = {"type": "cube", "to_world": T().scale([side / 2] * 3), "bsdf": {"type": "null"}, "interior": medium}
sky = {"type": "constant", "radiance": {"type": "rgb", "value": told["sky"]}}
sun = {"type": "rgb", "value": [np.pi * each for each in told["sun"]]}
found = pictures({
    "cloud": cloud, "sky": sky, "sun": {"type": "directional", "direction": told["from_sun"], "irradiance": sun},
})
"""


def heap() -> np.ndarray[Any, np.dtype[np.float32]]:
    """Two balls of cloud that are thinner outside, with nothing at the box's sides; shape (z, y, x)."""
    across = (np.arange(VOXELS) + 0.5) / VOXELS * 2 - 1
    z, y, x = np.meshgrid(across, across, across, indexing="ij")
    balls = [
        1 - np.sqrt((x - right) ** 2 + y**2 + (z - up) ** 2) / radius
        for right, up, radius in ((-0.3, -0.2, 0.6), (0.4, 0.25, 0.45))
    ]
    return np.asarray(np.clip(2 * np.maximum(*balls), 0, 1), np.float32)


@pytest.mark.parametrize("cloud", one_of(*CLOUDS))
def test_clouds_agree_with_mitsuba(cloud: str, tmp_path: Path) -> None:
    extinction, albedo, anisotropy, bounces = CLOUDS[cloud]
    np.save(tmp_path / "cloud.npy", heap())
    at = np.linspace(0, 1, STOPS)
    opacity = -np.expm1(-extinction * SIDE / VOXELS * at)
    told = {
        "eye": EYE,
        "target": TARGET,
        "fov": FOV,
        "size": [WIDTH, HEIGHT],
        "samples": SAMPLES,
        "seeds": SEEDS,
        "bounces": bounces,
        "integrator": "volpath",
        "side": SIDE,
        "values": str(tmp_path / "cloud.npy"),
        "extinction": extinction,
        "albedo": albedo,
        "anisotropy": anisotropy,
        "sky": SKY,
        "sun": SUN,
        "from_sun": FROM_SUN,
    }
    found = by_us(
        SEEDS,
        {"samples": SAMPLES},
        folder=tmp_path,
        formula="none",
        camera={"position": EYE, "target": TARGET, "fov": FOV},
        image={"width": WIDTH, "height": HEIGHT},
        lighting={"mode": "path", "bounces": bounces, "roulette": bounces},
        background=SKY,
        lights=[{"direction": FROM_SUN, "color": SUN}],
        objects={
            "cloud": {
                "type": "volume",
                "file": "cloud.npy",
                "size": SIDE,
                "anisotropy": anisotropy,
                "transfer": {
                    "opacity": [
                        {"at": place, "opacity": each}
                        for place, each in zip(at.tolist(), opacity.tolist(), strict=True)
                    ],
                    "color": [{"at": 0, "color": albedo}],
                },
            }
        },
    )
    light = assert_alike(found, by_mitsuba(_THEIRS, told, tmp_path), 4, 5)
    assert light.max() > 1.3 * light.min()
