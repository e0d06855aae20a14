"""`exact` normals of voxels are those of the level set of |z| at the limit of applications, by finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from clfractal.device.select import Device
from tests.render.levels import Floats, degrees, onto_level, sizes, slopes
from tests.render.shots import normals_of, points_of, scene_of, shoot

CAMERA = {"position": [1.7, -2.9, 1.4], "target": [0, 0, 0], "frame": "all"}


@pytest.fixture(scope="module")
def device() -> Device:
    from tests.voxels.grids import device as chosen

    return chosen()


def off(device: Device, name: str, iterations: int, resolution: int) -> Floats:
    """Angles to the slope of |z| where the surface is nearest to what was met in the grid."""
    renderer = {"type": "volume", "resolution": resolution, "normals": "exact"}
    scene = scene_of({"name": name, "iterations": iterations}, CAMERA, (120, 90), renderer=renderer)
    film = shoot(scene, device)
    there = np.isfinite(film["Z"]) & (film["A"] > 0.999)
    places, normals, level = points_of(film)[there], normals_of(film)[there], scene.chain.bailout
    surface = onto_level(scene.chain, places, iterations, level)
    voxel = 2 * scene.chain.radius / resolution
    found = np.abs(sizes(scene.chain, surface, iterations)[-1] / level - 1) < 1e-4
    found &= np.linalg.norm(surface - places, axis=-1) < 1.5 * voxel
    assert found.mean() > 0.9
    return degrees(normals[found], slopes(scene.chain, surface[found], iterations))


@pytest.mark.parametrize("name", ["hast", "aexion", "makin_brot", "tetrabrot"])
def test_pictures_of_voxels_have_the_normals_of_the_last_z(device: Device, name: str) -> None:
    """Each normal is stored in three bytes, and blended with seven others of its cell."""
    angles = off(device, name, 3, 256)
    assert np.median(angles) < 0.1
    assert np.percentile(angles, 90) < 0.3
