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
from tests.render.media import (
    CAMERA,
    CORNER,
    OPACITY,
    SIDES,
    SIGMA,
    VOXEL,
    VOXELS,
    WHITE,
    assert_alike,
    keep_media,
    light_of,
    optical_depth,
    phase,
    waves,
)
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import Floats, rays, shoot
from tests.render.volumes import to_box
from tests.variants import one_of

pytestmark = pytest.mark.light

TURNED: dict[str, Any] = {"rotation": [20, -35, 50], "scale": [1, 1.3, 0.8], "position": [0.2, 0, 0.1]}
SHINE = {"emission": [{"at": 0, "emission": [0, 0, 0]}, {"at": 1, "emission": [0.04, 0.02, 0.01]}]}
BLACK: dict[str, Any] = {"background": {"top": [0, 0, 0], "bottom": [0, 0, 0]}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return keep_media(tmp_path_factory.mktemp("clouds"))


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


def depth_of(
    scene: Scene, name: str, values: npt.NDArray[Any], origin: Floats, direction: Floats, **given: Any
) -> Floats:
    """The optical depth of a cloud on rays."""
    each = volumes_of(scene.objects)[name]
    own = placed(each, scene.grids[each.file])
    return optical_depth(
        values, own.place.corner, own.place.steps, origin, direction, voxel=own.voxel, **given
    )


@pytest.mark.parametrize("anisotropy", one_of(0.8, 0.0))
def test_a_white_cloud_before_white_is_not_seen(device: Device, folder: Path, anisotropy: float) -> None:
    objects = {"cloud": cloud("ball.nrrd", 1.0, 0.5, anisotropy=anisotropy, **TURNED)}
    light = light_of(scene_of(folder, objects, bounces=64, samples=16, **WHITE), device)
    assert abs(light.mean() - 1) < 0.01


@pytest.mark.parametrize(
    ("file", "precision", "lanes"),
    one_of(
        ("waves", "float32", None),
        ("waves", "float32", 1),
        ("waves", "float64", 4),
        ("oblique", "float32", None),
    ),
)
def test_what_comes_through(
    device: Device, folder: Path, file: str, precision: Precision, lanes: int | None
) -> None:
    """exp(-depth) of a white sky behind a black cloud that is turned and scaled; alpha is the rest."""
    scene = scene_of(folder, {"cloud": cloud(f"{file}.nrrd", **TURNED)}, samples=1024, **WHITE)
    framebuffer = shoot(scene, device, precision, **({"lanes": lanes} if lanes else {}))
    origin, direction, _ = rays(scene)
    # (The oblique array's second axis goes down, so it is turned round.)
    values = waves()[:, ::-1] if file == "oblique" else waves()
    expected = np.exp(-depth_of(scene, "cloud", values, origin, direction))
    assert expected.min() < 0.5
    assert_alike(framebuffer["R"], expected, 1024)
    # Alpha and colour are means of the same samples.
    np.testing.assert_allclose(framebuffer["A"], 1 - framebuffer["R"], atol=1e-5)


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
    ways = np.broadcast_to(toward, points.shape)
    expected = np.exp(-depth_of(scene, "cloud", waves(), points, ways, opacity=0.6)) * toward[2]
    assert expected.min() < 0.2 * expected.max()
    assert_alike(light_of(scene, device)[..., 0], expected, 1024, share=0.015)


def test_clouds_are_those_of_the_volume_renderer(device: Device, folder: Path) -> None:
    """The same grid, light, phase function and own light, many times scattered, in both renderers."""
    lights = [{"direction": [-1, 0.4, -0.5], "intensity": 3, "angular_size": 3}]
    sampling = {"samples": 256, "filter_width": 0.1, "seed": 3}
    given: dict[str, Any] = {"bounces": 16, "renderer": sampling, "lights": lights}
    given["background"] = {"top": [0.2, 0.3, 0.5], "bottom": [0.4, 0.3, 0.2]}
    shine = {"emission": [{"at": 0, "emission": [0, 0, 0]}, {"at": 1, "emission": [0.04, 0.02, 0.01]}]}
    own = cloud("ball.nrrd", 0.95, 0.4, anisotropy=0.5, transfer=shine)
    scene = scene_of(folder, {"cloud": own}, **given)
    body = scene.objects["cloud"].model_dump(mode="json")
    renderer = {
        "type": "volume",
        **sampling,
        **{key: body[key] for key in ("file", "transfer", "anisotropy")},
    }
    other = scene.model_copy(update={"objects": {}, "renderer": renderer})
    ours, theirs = light_of(scene, device), light_of(other, device)
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)
    # Of blocks of pixels: the noise of both is that of a few samples' light.
    blocks = [found.reshape(6, 4, 6, 4, 3).mean(axis=(1, 3)) for found in (ours, theirs)]
    np.testing.assert_allclose(blocks[0], blocks[1], atol=0.03)


def test_a_lamp_shines_through_a_cloud_once(device: Device, folder: Path) -> None:
    """Scattered once: a place that is asked for brings albedo, phase and what comes through both ways."""
    lamp = np.array([2.5, -2.5, 3.0])
    lights = [{"type": "point", "position": lamp.tolist(), "intensity": 20, "falloff": "inverse_square"}]
    scene = scene_of(folder, {"cloud": cloud("cube.nrrd", 0.8, anisotropy=0.6)}, lights=lights, samples=512)
    origin, direction, _ = rays(scene)
    near, far = to_box(origin, direction, CORNER, SIDES)
    way = np.maximum(far - near, 0)
    expected = np.zeros(way.shape)
    for part in (np.arange(300) + 0.5) / 300:
        points = origin + (near + part * way)[..., None] * direction
        square = ((lamp - points) ** 2).sum(-1)
        toward = (lamp - points) / np.sqrt(square)[..., None]
        out = to_box(points, toward, CORNER, SIDES)[1]
        scattered = phase((toward * direction).sum(-1), 0.6) * np.pi * 20 / square
        expected += 0.8 * SIGMA * way / 300 * np.exp(-SIGMA * (part * way + out)) * scattered
    light = light_of(scene, device)[..., 0]
    assert light.mean() == pytest.approx(expected.mean(), rel=0.01)
    blocks = [found.reshape(6, 4, 6, 4).mean(axis=(1, 3)) for found in (light, expected)]
    np.testing.assert_allclose(blocks[0], blocks[1], atol=0.1 * expected.max())


def test_a_cloud_shines_through_another(device: Device, folder: Path) -> None:
    """j (1 - exp(-sigma L)) / sigma of a black cloud, dimmed where another one stands wholly before it."""
    aside = np.array([2.2, -2.1, 0.65])
    front = cloud("cube.nrrd", position=aside.tolist(), opacity=0.06)
    objects = {"cloud": cloud("cube.nrrd", transfer=SHINE), "front": front}
    scene = scene_of(folder, objects, samples=512)
    origin, direction, _ = rays(scene)
    near, far = to_box(origin, direction, CORNER, SIDES)
    depth = depth_of(scene, "front", np.ones((VOXELS,) * 3, np.float32), origin, direction, opacity=0.06)
    expected = (1 - np.exp(-SIGMA * np.maximum(far - near, 0))) / SIGMA / VOXEL * np.exp(-depth)
    before = to_box(origin, direction, CORNER + aside, SIDES)[1] < near
    light = light_of(scene, device)
    for part in (before & (depth > 0) & (far > near), (depth == 0) & (far > near)):
        assert part.sum() > 60
        seen = light[part].mean(axis=0)
        np.testing.assert_allclose(seen, np.array([0.04, 0.02, 0.01]) * expected[part].mean(), rtol=0.03)


def test_layers_have_the_light_of_clouds(device: Device, folder: Path) -> None:
    """Before nothing too, where coverage says that nothing is seen."""
    objects = {"cloud": cloud("cube.nrrd", 0.5, 0.05, transfer=SHINE)}
    scene = scene_of(
        folder, objects, samples=4, background="transparent", lighting={"mode": "path", "bounces": 2}
    )
    layers = [f"{name}.R" for name in ("emission", "direct", "indirect")]
    framebuffer = shoot(scene, device, channels=["R", "A", *layers])
    assert framebuffer["R"][framebuffer["A"] == 0].max() > 0.05
    np.testing.assert_allclose(sum(framebuffer[name] for name in layers), framebuffer["R"], atol=1e-6)


def test_the_direct_light_of_a_cloud_is_scattered_once(device: Device, folder: Path) -> None:
    """However often light is scattered in all: paths go on from the same first place."""
    lights = [{"direction": [-1, 0.4, -0.5], "intensity": 3}]
    direct, indirect = [], []
    for bounces in (0, 6):
        scene = scene_of(
            folder, {"cloud": cloud("ball.nrrd", 0.95, 0.4)}, bounces=bounces, samples=4, lights=lights
        )
        framebuffer = shoot(scene, device, channels=["R", "direct.R", "indirect.R"])
        direct.append(framebuffer["direct.R"])
        indirect.append(framebuffer["indirect.R"].mean())
    np.testing.assert_allclose(direct[0], direct[1], rtol=1e-5, atol=1e-6)
    assert indirect[0] == pytest.approx(0, abs=1e-6)
    assert indirect[1] > 0.2 * direct[1].mean()


def test_a_white_cloud_around_a_white_set(device: Device, folder: Path) -> None:
    """Rays to an environment that is asked for may meet the set, and its own the cloud: all stays white."""
    from tests.environment_maps import write_map

    write_map(folder / "white.exr", 1.0)
    scene = scene_of(
        folder,
        {"cloud": cloud("ball.nrrd", 1.0, 0.5, anisotropy=0.3, position=[0.3, -0.4, 0.2])},
        formula={"name": "mandelbulb", "iterations": 3},
        bounces=64,
        samples=32,
        environment={"file": "white.exr"},
        **WHITE,
    )
    assert abs(light_of(scene, device).mean() - 1) < 0.01


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
