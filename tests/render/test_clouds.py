"""Clouds among the objects: white rooms, Beer and Lambert's law, shadows, and the volume renderer's clouds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.scene.model import Scene
from clfractal.scene.named_files import volumes_of
from clfractal.scene.object_grids import placed
from tests import scenes
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import Floats, rays, shoot, stacked
from tests.render.volumes import keep, middles, own_rays, to_box, value_at
from tests.variants import one_of

pytestmark = pytest.mark.light

VOXELS = 16
VOXEL = 2 / VOXELS
OPACITY = 0.12
SIGMA = -np.log(1 - OPACITY) / VOXEL  # per scene unit, of a value of 1
CAMERA = {"position": [1.6, -4.2, 1.3], "fov": 40}
TURNED: dict[str, Any] = {"rotation": [20, -35, 50], "scale": [1, 1.3, 0.8], "position": [0.2, 0, 0.1]}
WHITE: dict[str, Any] = {"background": {"top": [1, 1, 1], "bottom": [1, 1, 1]}}
# Steps of a grid that is turned, oblique and left-handed.
OBLIQUE = VOXEL * np.array([[0.9, 0.4, 0.1], [0.5, -0.8, 0.2], [0.1, 0.3, 1.0]])
BLACK: dict[str, Any] = {"background": {"top": [0, 0, 0], "bottom": [0, 0, 0]}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube in which all values are 1, one whose values grow and fall, and a soft ball."""
    path = tmp_path_factory.mktemp("clouds")
    spacing = [VOXEL] * 3
    keep(path / "cube.nrrd", np.ones((VOXELS,) * 3, np.float32), [-1] * 3, spacing)
    keep(path / "waves.nrrd", waves(), [-1] * 3, spacing)
    keep(path / "oblique.nrrd", waves(), [0] * 3, OBLIQUE)
    distance = np.linalg.norm(middles((VOXELS,) * 3, [-1] * 3, spacing), axis=-1)
    keep(path / "ball.nrrd", np.clip(2 - 2 * distance, 0, 1).astype(np.float32), [-1] * 3, spacing)
    return path


def waves() -> Floats:
    """From 0 to 1 and back within a brick."""
    places = middles((VOXELS,) * 3, [-1] * 3, [VOXEL] * 3)
    found: Floats = np.clip(np.sin(7 * places[..., 0]) * np.cos(5 * places[..., 2] + places[..., 1]), 0, 1)
    return found.astype(np.float32)


def cloud(file: str, albedo: float = 0.0, opacity: float = OPACITY, **given: Any) -> dict[str, Any]:
    """An object; its opacity grows with the value up to 1."""
    transfer = {
        "opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": opacity}],
        "color": [{"at": 0, "color": [albedo] * 3}],
        **given.pop("transfer", {}),
    }
    return {"type": "volume", "file": file, "transfer": transfer, **given}


def scene_of(
    folder: Path, objects: dict[str, Any], bounces: int = 0, samples: int = 256, **sections: Any
) -> Scene:
    usual: dict[str, Any] = {
        "formula": NOWHERE,
        "camera": CAMERA,
        "size": (24, 24),
        "renderer": {"samples": samples, "filter_width": 0.1},
        "lighting": {"mode": "path", "bounces": bounces},
        "material": {"color": [1, 1, 1], "diffuse": 1, "specular": 0},
        "lights": [],
        "objects": objects,
    }
    return scenes.scene_of(folder=folder, **{**usual, **BLACK, **sections})


def light_of(scene: Scene, device: Device, **settings: Any) -> Floats:
    return stacked(shoot(scene, device, **settings), "RGB").astype(float)


def depth_of(scene: Scene, name: str, values: npt.NDArray[Any], origin: Floats, direction: Floats) -> Floats:
    """The optical depth of a cloud on rays, by the values at many places; in units of SIGMA."""
    each = volumes_of(scene.objects)[name]
    place = placed(each, scene.grids[each.file])
    first, step = own_rays(place.place, origin, direction)
    near, far = to_box(first, step, np.zeros(3), np.array(place.place.shape, float))
    way = np.maximum(far - near, 0)
    depth: Floats = np.zeros(way.shape)
    count = 600
    for part in (np.arange(count) + 0.5) / count:
        value = value_at(values, np.nan_to_num(first + (near + part * way)[..., None] * step))
        depth += -np.log(1 - OPACITY * value) / place.voxel * way / count
    return depth


def assert_alike(light: npt.NDArray[Any], expected: Floats, samples: int, share: float = 0.01) -> None:
    """In all within a hundredth; each pixel within five standard errors of one whose samples are 0 or 1."""
    assert light.mean() == pytest.approx(expected.mean(), rel=share)
    assert np.abs(light - expected).max() < 5 * 0.5 / np.sqrt(samples)


@pytest.mark.parametrize("anisotropy", one_of(0.8, 0.0))
def test_a_white_cloud_before_white_is_not_seen(device: Device, folder: Path, anisotropy: float) -> None:
    objects = {"cloud": cloud("ball.nrrd", 1.0, 0.5, anisotropy=anisotropy, **TURNED)}
    light = light_of(scene_of(folder, objects, bounces=64, samples=16, **WHITE), device)
    assert abs(light.mean() - 1) < 0.01


@pytest.mark.parametrize(("precision", "lanes"), one_of(("float32", None), ("float32", 1), ("float64", 4)))
def test_what_comes_through(device: Device, folder: Path, precision: Precision, lanes: int | None) -> None:
    """exp(-depth) of a white sky behind a black cloud that is turned and scaled; alpha is the rest."""
    scene = scene_of(folder, {"cloud": cloud("waves.nrrd", **TURNED)}, samples=1024, **WHITE)
    framebuffer = shoot(scene, device, precision, **({"lanes": lanes} if lanes else {}))
    origin, direction, _ = rays(scene)
    expected = np.exp(-depth_of(scene, "cloud", waves(), origin, direction))
    assert expected.min() < 0.5
    assert_alike(framebuffer["R"], expected, 1024)
    # Alpha and colour are means of the same samples.
    np.testing.assert_allclose(framebuffer["A"], 1 - framebuffer["R"], atol=1e-5)


def test_what_comes_through_an_oblique_cloud(device: Device, folder: Path) -> None:
    """exp(-depth) again; opacity is that of a voxel's shortest side."""
    scene = scene_of(folder, {"cloud": cloud("oblique.nrrd", **TURNED)}, samples=1024, **WHITE)
    origin, direction, _ = rays(scene)
    # (The second axis of the array goes down, so it is turned round.)
    expected = np.exp(-depth_of(scene, "cloud", waves()[:, ::-1], origin, direction))
    assert expected.min() < 0.5
    assert_alike(light_of(scene, device)[..., 0], expected, 1024)


@pytest.mark.combination
def test_clouds_in_one_place_take_what_each_would(device: Device, folder: Path) -> None:
    objects = {"cloud": cloud("waves.nrrd", **TURNED), "cube": cloud("cube.nrrd", size=1.5)}
    scene = scene_of(folder, objects, samples=1024, **WHITE)
    origin, direction, _ = rays(scene)
    ones = np.ones((VOXELS,) * 3, np.float32)
    depth = depth_of(scene, "cloud", waves(), origin, direction) + depth_of(
        scene, "cube", ones, origin, direction
    )
    assert_alike(light_of(scene, device)[..., 0], np.exp(-depth), 1024)


def test_a_cloud_throws_its_shadow(device: Device, folder: Path) -> None:
    """On a white floor under the sun: what comes through to each place, by Beer and Lambert's law."""
    sun = np.array([0.5, 0.4, -1.0])
    objects = {"cloud": cloud("waves.nrrd", opacity=0.6), "floor": {"type": "plane", "position": [0, 0, -2]}}
    camera = {"position": [0.5, 0, -1.5], "target": [0.5, 0.4, -2], "fov": 90}
    lights = [{"direction": sun.tolist()}]
    scene = scene_of(folder, objects, samples=1024, camera=camera, lights=lights)
    origin, direction, _ = rays(scene)
    t = (-2 - origin[..., 2]) / direction[..., 2]
    points = origin + t[..., None] * direction
    toward = -sun / np.linalg.norm(sun)
    # (The depth of its values at most, as the opacity is another one here.)
    each = volumes_of(scene.objects)["cloud"]
    place = placed(each, scene.grids[each.file])
    depth = np.zeros(t.shape)
    near, far = to_box(points, np.broadcast_to(toward, points.shape), np.full(3, -1.0), np.full(3, 2.0))
    for part in (np.arange(400) + 0.5) / 400:
        way = np.maximum(far - near, 0)
        value = value_at(waves(), (points + (near + part * way)[..., None] * toward + 1) / VOXEL)
        depth += -np.log(1 - 0.6 * value) / place.voxel * way / 400
    expected = np.exp(-depth) * toward[2]
    assert expected.min() < 0.2 * expected.max()
    assert_alike(light_of(scene, device)[..., 0], expected, 1024, share=0.015)


@pytest.mark.combination
def test_clouds_are_those_of_the_volume_renderer(device: Device, folder: Path) -> None:
    """The same grid, light and phase function, many times scattered, in both renderers."""
    lights = [{"direction": [-1, 0.4, -0.5], "intensity": 3, "angular_size": 3}]
    given: dict[str, Any] = {"bounces": 16, "samples": 256, "lights": lights}
    given["background"] = {"top": [0.2, 0.3, 0.5], "bottom": [0.4, 0.3, 0.2]}
    scene = scene_of(folder, {"cloud": cloud("ball.nrrd", 0.95, 0.4, anisotropy=0.5)}, **given)
    body = scene.objects["cloud"].model_dump(mode="json")
    renderer = {
        "type": "volume",
        "samples": 256,
        "filter_width": 0.1,
        **{key: body[key] for key in ("file", "transfer", "anisotropy")},
    }
    other = scene.model_copy(update={"objects": {}, "renderer": renderer})
    ours, theirs = light_of(scene, device), light_of(other, device)
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)
    # Of blocks of pixels: the noise of both is that of a few samples' light.
    blocks = [found.reshape(6, 4, 6, 4, 3).mean(axis=(1, 3)) for found in (ours, theirs)]
    np.testing.assert_allclose(blocks[0], blocks[1], atol=0.03)


def test_a_lamp_shines_through_a_cloud_once(device: Device, folder: Path) -> None:
    """Light scattered once: a place that is asked for brings albedo, phase and what comes through both ways."""
    lamp = np.array([2.5, -2.5, 3.0])
    lights = [{"type": "point", "position": lamp.tolist(), "intensity": 20, "falloff": "inverse_square"}]
    scene = scene_of(folder, {"cloud": cloud("cube.nrrd", 0.8, anisotropy=0.6)}, lights=lights, samples=512)
    origin, direction, _ = rays(scene)
    near, far = to_box(origin, direction, np.full(3, -1.0), np.full(3, 2.0))
    way, g = np.maximum(far - near, 0), 0.6
    expected = np.zeros(way.shape)
    for part in (np.arange(300) + 0.5) / 300:
        points = origin + (near + part * way)[..., None] * direction
        offset = lamp - points
        square = (offset**2).sum(-1)
        toward = offset / np.sqrt(square)[..., None]
        cosine = (toward * direction).sum(-1)
        phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
        out = to_box(points, toward, np.full(3, -1.0), np.full(3, 2.0))[1]
        through = np.exp(-SIGMA * (part * way + out))
        expected += 0.8 * SIGMA * way / 300 * through * phase * np.pi * 20 / square
    light = light_of(scene, device)[..., 0]
    assert light.mean() == pytest.approx(expected.mean(), rel=0.01)
    blocks = [found.reshape(6, 4, 6, 4).mean(axis=(1, 3)) for found in (light, expected)]
    np.testing.assert_allclose(blocks[0], blocks[1], atol=0.1 * expected.max())


def test_layers_have_the_light_of_clouds(device: Device, folder: Path) -> None:
    """Before nothing too, where coverage says that nothing is seen."""
    shine = {"emission": [{"at": 0, "emission": [0, 0, 0]}, {"at": 1, "emission": [0.04, 0.02, 0.01]}]}
    objects = {"cloud": cloud("cube.nrrd", 0.5, 0.05, transfer=shine)}
    scene = scene_of(
        folder, objects, samples=4, background="transparent", lighting={"mode": "path", "bounces": 2}
    )
    layers = [f"{name}.R" for name in ("emission", "direct", "indirect")]
    framebuffer = shoot(scene, device, channels=["R", "A", *layers])
    assert framebuffer["R"][framebuffer["A"] == 0].max() > 0.05
    np.testing.assert_allclose(sum(framebuffer[name] for name in layers), framebuffer["R"], atol=1e-6)


@pytest.mark.combination
def test_a_cloud_shines_by_itself(device: Device, folder: Path) -> None:
    """j (1 - exp(-sigma L)) / sigma of a black cloud, and of one in front of another."""
    shine = {"emission": [{"at": 0, "emission": [0, 0, 0]}, {"at": 1, "emission": [0.04, 0.02, 0.01]}]}
    objects = {"cloud": cloud("cube.nrrd", transfer=shine)}
    scene = scene_of(folder, objects, samples=512)
    origin, direction, _ = rays(scene)
    near, far = to_box(origin, direction, np.full(3, -1.0), np.full(3, 2.0))
    way = np.maximum(far - near, 0)
    expected = (1 - np.exp(-SIGMA * way)) / SIGMA / VOXEL
    light = light_of(scene, device)
    for channel, j in enumerate((0.04, 0.02, 0.01)):
        assert light[..., channel].mean() == pytest.approx(j * expected.mean(), rel=0.01)
    dark = {**objects, "front": cloud("cube.nrrd", position=[0.8, -2.1, 0.65], opacity=0.3)}
    scene = scene_of(folder, dark, samples=512)
    depth = depth_of(scene, "front", np.ones((VOXELS,) * 3, np.float32), origin, direction)
    depth *= np.log(0.7) / np.log(1 - OPACITY)
    # Where the one in front stands wholly before the other.
    faces = to_box(origin, direction, np.array([-0.2, -3.1, -0.35]), np.full(3, 2.0))[1] < near
    light = light_of(scene, device)[..., 0]
    assert faces.sum() > 60
    seen = 0.04 * expected * np.exp(-depth)
    assert light[faces].mean() == pytest.approx(seen[faces].mean(), rel=0.03)


@pytest.mark.combination
def test_a_white_cloud_in_a_white_room_with_glass(device: Device, folder: Path) -> None:
    """An environment that is asked for, a ball of glass and one of milk in the cloud: all stays white."""
    from tests.environment_maps import write_map

    write_map(folder / "white.exr", 1.0)
    materials = {
        "glass": {"specular": {"roughness": 0}, "transmission": {"weight": 1}},
        "milk": {"transmission": {"weight": 1, "depth": 0.5, "scatter": [1, 1, 1]}},
    }
    objects = {
        "cloud": cloud("ball.nrrd", 1.0, 0.4, anisotropy=0.3),
        "glass": {"type": "sphere", "radius": 0.4, "position": [0.4, -0.8, 0.2], "material": "glass"},
        "milk": {"type": "sphere", "radius": 0.4, "position": [-0.5, -0.4, 0.2], "material": "milk"},
    }
    scene = scene_of(
        folder,
        objects,
        bounces=64,
        samples=64,
        materials=materials,
        environment={"file": "white.exr"},
        **WHITE,
    )
    assert abs(light_of(scene, device).mean() - 1) < 0.01
