"""`exact` normals of voxels are those of the level set of |z| at the limit of applications, by finite differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.geometry.planes import zoom_of
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject
from clfractal.schema.shape import turned_axes
from tests.render.levels import BESIDE, CAMERA, UNEVEN, Floats, along, degrees, onto_level, sizes, slopes
from tests.render.shots import normals_of, points_of, shoot
from tests.scenes import scene_of
from tests.voxels.grids import filled


def seen(scene: Scene, device: Device, **settings: Any) -> tuple[Floats, Floats]:
    """Places of hits where the formula is evaluated, and the normals there, length 1."""
    framebuffer = shoot(scene, device, **settings)
    there = np.isfinite(framebuffer["Z"]) & (framebuffer["A"] > 0.999)
    assert there.sum() > 60
    zoom, origin = zoom_of(scene)
    normals = normals_of(framebuffer)[there]
    return points_of(framebuffer)[there] * zoom + origin, normals / np.linalg.norm(
        normals, axis=-1, keepdims=True
    )


def off(scene: Scene, places: Floats, normals: Floats, voxel: float, least: float = 0.95) -> Floats:
    """Angles to the slope of |z| at the limit, on the solid's surface straight below or above what was met in the grid."""
    limit = scene.formula.iterations
    surface = along(scene.chain, places, normals, limit, 1.5 * voxel)
    found = np.isfinite(surface).all(axis=-1)
    assert found.mean() > least
    return degrees(normals[found], slopes(scene.chain, surface[found], limit))


@pytest.mark.parametrize("iterations", [3, 5, 8])
@pytest.mark.parametrize("name", UNEVEN)
def test_pictures_of_voxels_have_the_normals_of_the_last_z(
    device: Device, name: str, iterations: int
) -> None:
    renderer = {"type": "volume", "resolution": 256, "normals": "exact"}
    scene = scene_of({"name": name, "iterations": iterations}, CAMERA, (120, 90), renderer=renderer)
    places, normals = seen(scene, device)
    # Of the dust that the last one is of, some hits have nothing of it straight below or above them.
    dust = name == "riemann_sphere" and iterations > 5
    angles = off(scene, places, normals, 2 * scene.chain.radius / 256, 0.85 if dust else 0.95)
    assert np.median(angles) < 0.1
    if iterations == 3:
        assert np.percentile(angles, 90) < 0.1


@pytest.mark.parametrize("lanes", [1, 4])
@pytest.mark.parametrize("value", ["inside", "coverage"])
def test_zoomed_boxes_values_and_lanes(device: Device, value: str, lanes: int) -> None:
    zoom = [{"center": [-0.3, -0.3, 0.1], "scale": 3}]
    renderer = {"type": "volume", "resolution": 128, "normals": "exact", "value": value, "zoom": zoom}
    scene = scene_of({"name": "hast", "iterations": 4}, CAMERA, (48, 36), renderer=renderer)
    places, normals = seen(scene, device, lanes=lanes)
    voxel = 2 * scene.chain.radius / 3 / 128
    # (What the box cuts has no surface there.)
    middle = np.abs(places - np.array(zoom[0]["center"])).max(axis=-1) < 62 * voxel
    assert middle.sum() > 60
    assert np.median(off(scene, places[middle], normals[middle], voxel)) < 0.05


def test_each_of_several_solids_has_its_own(device: Device) -> None:
    renderer = {"type": "volume", "resolution": 128, "normals": "exact"}
    scene = scene_of(
        {"name": "hast", "iterations": 4}, CAMERA, (96, 72), objects={"other": BESIDE}, renderer=renderer
    )
    places, normals = seen(scene, device)
    part = scene.objects["other"]
    assert isinstance(part, FormulaObject)
    axes, chain = np.array(turned_axes(part.rotation)), scene.joined_chains["other"]
    own, turned = (places - np.array(part.position)) @ axes.T / part.scale, normals @ axes.T
    for which, at, facing in ((scene.chain, places, normals), (chain, own, turned)):
        surface = along(which, at, facing, 4, 0.03)
        found = np.isfinite(surface).all(axis=-1)
        assert found.sum() > 100
        assert np.median(degrees(facing[found], slopes(which, surface[found], 4))) < 0.1


def test_where_no_surface_is_near_normals_are_blended(device: Device) -> None:
    """A level of counts far from the set, whose normals are those of its values."""

    def normals(kind: str) -> Floats:
        renderer = {
            "type": "volume",
            "resolution": 48,
            "normals": kind,
            "value": "iterations",
            "level": 1.5,
            "store": "float",
        }
        scene = scene_of({"name": "hast", "iterations": 6}, CAMERA, (48, 36), renderer=renderer)
        return seen(scene, device)[1]

    np.testing.assert_array_equal(normals("exact"), normals("gradient"))


@pytest.mark.parametrize("name", ["hast", "aexion", "makin_brot", "tetrabrot"])
def test_stored_normals_are_of_the_surface_near_the_sample(device: Device, name: str) -> None:
    """Each is stored in three bytes, which turns it by 0.06 degrees in the median."""
    renderer = {"type": "volume", "resolution": 256, "normals": "exact"}
    scene = scene_of({"name": name, "iterations": 3}, CAMERA, renderer=renderer)
    grid = filled(scene)
    stored = grid.dense_normals()
    # Samples beside a change of inside and outside along x: cells of these have normals of the formula.
    changes = np.argwhere((stored[:, :, 1:, 3] != stored[:, :, :-1, 3])[2:-2, 2:-2, 2:-2]) + 2
    z, y, x = changes[:: max(len(changes) // 2000, 1)].T
    places = np.array(grid.corner) + (np.stack([x, y, z], axis=-1) + 0.5) * np.array(grid.spacing)
    normals = stored[z, y, x, :3].astype(float) - 127.5
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    surface = onto_level(scene.chain, places, 3, scene.chain.bailout)
    near = np.linalg.norm(surface - places, axis=-1) < 1.5 * grid.spacing[0]
    near &= np.abs(sizes(scene.chain, surface, 3)[-1] / scene.chain.bailout - 1) < 1e-4
    assert near.mean() > 0.9
    assert np.median(degrees(normals[near], slopes(scene.chain, surface[near], 3))) < 0.15
