"""Light along paths through a medium, beside Beer's law, quadrature, and a Monte Carlo by NumPy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal.integrators.volume
from clfractal.device.select import Device
from clfractal.integrators.volume import brick_bounds
from clfractal.scene.grid_place import GridPlace
from clfractal.scene.model import Scene
from clfractal.shading.light_tree import lamps_of
from clfractal.voxels.blocks import brick_ranges
from clfractal.voxels.dense import grid_from_dense
from tests.environment_maps import write_map
from tests.render.bits import alike_by_lanes
from tests.render.media import (
    CAMERA,
    CORNER,
    OBLIQUE,
    OPACITY,
    SIDE,
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
from tests.render.shots import Floats, rays, shoot
from tests.render.volumes import to_box
from tests.scenes import scene_of

pytestmark = pytest.mark.light

COLOR = np.array([0.9, 0.6, 0.2])
SUN = np.array([-0.5, 0.6, -0.8]) / np.linalg.norm([-0.5, 0.6, -0.8])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return keep_media(tmp_path_factory.mktemp("media"))


def medium(
    folder: Path, *, file: str = "cube.nrrd", bounces: int = 0, samples: int = 256, **given: Any
) -> Scene:
    """A scene of a medium; keys of the renderer's, or `transfer`'s, or sections."""
    transfer: dict[str, Any] = {
        "opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": OPACITY}],
        "color": [{"at": 0, "color": COLOR.tolist()}],
        **given.pop("transfer", {}),
    }
    usual: dict[str, Any] = {
        "renderer": {
            "type": "volume",
            "file": file,
            "samples": samples,
            "anisotropy": given.pop("anisotropy", 0.0),
            "seed": given.pop("seed", 0),
            "filter_width": 0.1,
            "transfer": transfer,
        },
        "lighting": {"mode": "path", "bounces": bounces, **given.pop("lighting", {})},
        "lights": [],
        "background": "transparent",
        "camera": CAMERA,
    }
    return scene_of(size=(24, 24), folder=folder, **{**usual, **given})


def within(scene: Scene) -> tuple[Floats, Floats, Floats, Floats]:
    """Each pixel's ray: its origin, direction, and where it enters and leaves the cube."""
    origin, direction, _ = rays(scene)
    near, far = to_box(origin, direction, CORNER, SIDES)
    return origin, direction, near, np.maximum(far, near)


BLACK: dict[str, Any] = {"transfer": {"color": [{"at": 0, "color": [0, 0, 0]}]}}


@pytest.mark.parametrize(
    ("file", "values", "steps"),
    [
        ("cube.nrrd", np.ones((VOXELS,) * 3), VOXEL * np.eye(3)),
        ("waves.nrrd", waves(), VOXEL * np.eye(3)),
        ("oblique.nrrd", waves(), OBLIQUE),
    ],
    ids=["cube", "waves", "oblique"],
)
def test_what_comes_through(device: Device, folder: Path, file: str, values: Floats, steps: Floats) -> None:
    """exp(-depth) of a white sky behind a black medium; alpha is the rest. Where the density goes up and down within a
    brick, its integral decides, by NumPy; in an oblique grid, too."""
    scene = medium(folder, file=file, samples=1024, **BLACK, **WHITE)
    origin, direction, _ = rays(scene)
    depth = optical_depth(values, -steps.sum(0) * VOXELS / 2, steps, origin, direction)
    framebuffer = shoot(scene, device)
    assert np.exp(-depth).min() < 0.6
    assert_alike(framebuffer["R"], np.exp(-depth), 1024)
    np.testing.assert_allclose(framebuffer["A"], 1 - framebuffer["R"], atol=1e-5)


def from_sun(points: Floats) -> tuple[Floats, Floats]:
    return np.broadcast_to(-SUN, points.shape), np.full(points.shape[:-1], np.pi * 2.0)


LAMP = np.array([2.5, -2.5, 3.0])


def from_lamp(points: Floats) -> tuple[Floats, Floats]:
    offset = LAMP - points
    square = (offset**2).sum(-1)
    return offset / np.sqrt(square)[..., None], np.pi * 20 / square


def from_ball(points: Floats) -> tuple[Floats, Floats]:
    toward, irradiance = from_lamp(points)
    return toward, irradiance * 5 * 0.2**2


def from_panel(points: Floats) -> tuple[Floats, Floats]:
    toward, irradiance = from_lamp(points)
    facing = toward @ (LAMP / np.linalg.norm(LAMP))
    return toward, irradiance / np.pi * 0.4 * 0.3 * 5 * facing


LIGHTS: dict[str, tuple[dict[str, Any], Callable[[Floats], tuple[Floats, Floats]]]] = {
    "sun": ({"direction": SUN.tolist(), "intensity": 2}, from_sun),
    "disc": ({"direction": SUN.tolist(), "intensity": 2, "angular_size": 4}, from_sun),
    "point": (
        {"type": "point", "position": LAMP.tolist(), "intensity": 20, "falloff": "inverse_square"},
        from_lamp,
    ),
    "sphere": (
        {"type": "sphere", "position": LAMP.tolist(), "radius": 0.2, "intensity": 100, "visible": False},
        from_ball,
    ),
    "rectangle": (
        {
            "type": "rectangle",
            "position": LAMP.tolist(),
            "direction": (-LAMP).tolist(),
            "width": 0.4,
            "height": 0.3,
            "intensity": 100,
            "visible": False,
        },
        from_panel,
    ),
}


@pytest.mark.parametrize("g", [0.0, 0.6, -0.4])
@pytest.mark.parametrize("light", LIGHTS)
def test_light_scattered_once(device: Device, folder: Path, light: str, g: float) -> None:
    """Of each light: albedo, phase and what comes through to the place and from there, by quadrature along the ray."""
    keys, lit_from = LIGHTS[light]
    scene = medium(folder, lights=[keys], anisotropy=g)
    origin, direction, near, far = within(scene)
    expected = np.zeros(near.shape)
    for part in (np.arange(300) + 0.5) / 300:
        way = part * (far - near)
        points = origin + (near + way)[..., None] * direction
        toward, irradiance = lit_from(points)
        left = np.maximum(to_box(points, toward, CORNER, SIDES)[1], 0)
        scattered = (
            phase((toward * direction).sum(-1), g) * irradiance * SIGMA * np.exp(-SIGMA * (way + left))
        )
        expected += np.where(far > near, scattered, 0) * (far - near) / 300
    found = light_of(scene, device)
    for channel in range(3):
        assert found[..., channel].mean() == pytest.approx(expected.mean() * COLOR[channel], rel=0.015)
    error = np.abs(found / COLOR - expected[..., None]).max()
    assert error < 5 * 2.0 * expected.max() / np.sqrt(256)


def test_many_lamps_in_a_tree_are_their_sum(device: Device, folder: Path) -> None:
    """Lamps that are chosen on the way down a tree, of which rays meet some: each beside quadrature, as above."""
    random = np.random.default_rng(5)
    ways = random.normal(size=(40, 3))
    places = ways / np.linalg.norm(ways, axis=1)[:, None] * random.uniform(2.2, 5, 40)[:, None]
    strengths, radii = random.uniform(0.5, 3, 40), random.uniform(0.05, 0.3, 40)
    lights: list[dict[str, Any]] = []
    for number, (place, strength, radius) in enumerate(zip(places, strengths, radii, strict=True)):
        point = {"type": "point", "falloff": "inverse_square", "intensity": float(strength)}
        ball = {"type": "sphere", "radius": float(radius), "visible": False}
        ball["intensity"] = float(strength / radius**2)  # as bright from afar
        lights.append({**(ball if number % 2 else point), "position": place.tolist()})
    scene = medium(folder, lights=lights, anisotropy=0.5, samples=512)
    assert len(lamps_of(scene).nodes) == 2 * len(lights) - 1
    origin, direction, near, far = within(scene)
    expected = np.zeros(near.shape)
    for part in (np.arange(100) + 0.5) / 100:
        way = part * (far - near)
        points = origin + (near + way)[..., None] * direction
        for place, strength in zip(places, strengths, strict=True):
            offset = place - points
            square = (offset**2).sum(-1)
            toward = offset / np.sqrt(square)[..., None]
            left = np.maximum(to_box(points, toward, CORNER, SIDES)[1], 0)
            comes = np.pi * strength / square * SIGMA * np.exp(-SIGMA * (way + left))
            scattered = phase((toward * direction).sum(-1), 0.5) * comes
            expected += np.where(far > near, scattered, 0) * (far - near) / 100
    found = light_of(scene, device)
    for channel in range(3):
        assert found[..., channel].mean() == pytest.approx(expected.mean() * COLOR[channel], rel=0.01)
    ours, exact = (
        each.reshape(4, 6, 4, 6).mean(axis=(1, 3)) for each in (found[..., 0], COLOR[0] * expected)
    )
    np.testing.assert_allclose(ours, exact, rtol=0.06, atol=0.02 * expected.max())


def followed(scene: Scene, g: float, orders: int, count: int) -> float:
    """Mean light of the picture with albedo COLOR[0], lit by the sun: paths of NumPy, scattered up to `orders` times."""
    random = np.random.default_rng(11)
    origin, direction, near, far = (
        np.repeat(each.reshape(-1, *each.shape[2:]), count, 0) for each in within(scene)
    )
    total, pixels = 0.0, len(near)
    alive = far > near
    place = (origin + near[:, None] * direction)[alive]
    ahead = direction[alive]
    weight = np.ones(len(place))
    for _ in range(orders):
        room = np.maximum(to_box(place, ahead, CORNER, SIDES)[1], 0)
        way = random.exponential(1 / SIGMA, len(place))
        stays = way < room
        place, ahead, weight = (place + way[:, None] * ahead)[stays], ahead[stays], weight[stays] * COLOR[0]
        out = np.maximum(to_box(place, np.broadcast_to(-SUN, place.shape), CORNER, SIDES)[1], 0)
        total += float((weight * phase(ahead @ -SUN, g) * 2 * np.pi * np.exp(-SIGMA * out)).sum())
        u = random.random(len(place))
        cosine = 1 - 2 * u if g == 0 else (1 + g * g - ((1 - g * g) / (1 - g + 2 * g * u)) ** 2) / (2 * g)
        side = np.cross(ahead, np.where(np.abs(ahead[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]]))
        side /= np.linalg.norm(side, axis=1)[:, None]
        angle, sine = 2 * np.pi * random.random(len(place)), np.sqrt(np.maximum(1 - cosine**2, 0))
        across = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(ahead, side)
        ahead = cosine[:, None] * ahead + sine[:, None] * across
    return total / pixels


@pytest.mark.parametrize("g", [0.0, 0.7])
@pytest.mark.parametrize("bounces", [1, 24])
def test_light_scattered_often(device: Device, folder: Path, g: float, bounces: int) -> None:
    """Beside paths of NumPy, with as many orders of scattering."""
    scene = medium(folder, lights=[LIGHTS["sun"][0]], anisotropy=g, bounces=bounces, samples=2048)
    expected = followed(scene, g, bounces + 1, 2048)
    assert light_of(scene, device)[..., 0].mean() == pytest.approx(expected, rel=0.015)


@pytest.mark.parametrize("g", [0.0, 0.8])
@pytest.mark.parametrize("sky", ["background", "environment"])
def test_a_white_medium_in_a_white_sky(device: Device, folder: Path, sky: str, g: float) -> None:
    """What absorbs nothing cannot be seen where light comes from everywhere alike."""
    around: dict[str, Any] = WHITE
    if sky == "environment":
        write_map(folder / "white.exr", 1.0)
        around = {"environment": {"file": "white.exr"}, "background": {"top": [0, 0, 0], "bottom": [0, 0, 0]}}
    white: dict[str, Any] = {
        "transfer": {"color": [{"at": 0, "color": [1, 1, 1]}]},
        "anisotropy": g,
        "bounces": 64,
    }
    light = light_of(medium(folder, file="ball.nrrd", **white, **around), device)
    assert light.mean() == pytest.approx(1, abs=0.003)
    assert np.abs(light[8:16, 8:16].mean() - 1) < 0.01


def test_a_medium_that_shines(device: Device, folder: Path) -> None:
    """j (1 - exp(-sigma L)) / sigma, also where its opacity is 0."""
    for opacity in (0.0, OPACITY):
        transfer = {
            "opacity": [{"at": 1, "opacity": opacity}],
            "color": [{"at": 0, "color": [0, 0, 0]}],
            "emission": [{"at": 1, "emission": [0.1, 0.02, 0.3]}],
        }
        scene = medium(folder, transfer=transfer, samples=512)
        _, _, near, far = within(scene)
        length = (far - near) / VOXEL
        sigma = -np.log(1 - opacity)
        way = length if opacity == 0 else -np.expm1(-sigma * length) / sigma
        light = light_of(scene, device)
        for channel, each in enumerate((0.1, 0.02, 0.3)):
            assert light[..., channel].mean() == pytest.approx(each * way.mean(), rel=0.01)
        np.testing.assert_allclose(light[..., 0], 0.1 * way, atol=0.15)


LAMPS: dict[str, Any] = {
    "lights": [LIGHTS["disc"][0], LIGHTS["sphere"][0], LIGHTS["rectangle"][0]],
    "environment": {"name": "studio"},
    "bounces": 4,
    "samples": 8,
    "anisotropy": 0.5,
}


def test_every_lane_is_alone(device: Device, folder: Path) -> None:
    alike_by_lanes(medium(folder, file="waves.nrrd", **LAMPS), device)


def test_double_precision(device: Device, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rays of float64 show the same medium."""
    scene = medium(folder, **{**LAMPS, "samples": 128})
    single = light_of(scene, device)
    monkeypatch.setattr(clfractal.integrators.volume, "ray_precision", lambda scene, plan: "float64")
    # (By an executor of its own, which keeps no buffers of the other type.)
    double = light_of(medium(folder, **{**LAMPS, "samples": 128}), device, budget_seconds=1.0)
    assert double.mean() == pytest.approx(single.mean(), rel=0.02)


def test_bounds_hold(device: Device, folder: Path) -> None:
    """No place of a brick has more extinction than the brick's bound, and some brick's is reached."""
    scene = medium(folder, file="waves.nrrd")
    values = np.asarray(waves())
    grid = grid_from_dense(
        values,
        device,
        place=GridPlace.along_axes((-SIDE / 2,) * 3, (VOXEL,) * 3, (VOXELS,) * 3),
        threshold=0.0,
        normal_radius=1,
    )
    ranges = brick_ranges(grid)
    bounds = brick_bounds(scene, grid, ranges)
    highest = -np.log(1 - OPACITY * ranges[:, 1].astype(float))
    assert (bounds >= highest * (1 - 1e-6)).all()
    assert bounds.max() == pytest.approx(highest.max(), rel=0.01)
