"""Surfaces of volumes among the objects: where interpolated values pass the level, by NumPy; balls, planes, shadows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.geometry.object_grids import brick_ranges
from clfractal.scene.model import Scene
from clfractal.scene.named_files import volumes_of
from clfractal.scene.object_grids import placed
from tests import scenes
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import PERSPECTIVE, Floats, beside, normals_of, points_of, rays, shoot, to_sphere
from tests.render.volumes import keep, middles, own_rays, to_box, value_at

TURNED: dict[str, Any] = {"rotation": [20, -35, 50], "position": [0.1, 0.2, -0.1], "scale": [1, 1.3, 0.8]}
ROUGH = np.random.default_rng(3).uniform(0, 1, (9, 13, 20)).astype(np.float32)
ROUGH_LEVEL = 0.7
BALL_RADIUS = 0.8
_PLACES = 900


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Random values; the depth in a ball; a value that grows along a direction; a corner."""
    path = tmp_path_factory.mktemp("grids")
    keep(path / "rough.nrrd", ROUGH, [0, 0, 0], [0.1, 0.1, 0.15])
    depth = BALL_RADIUS - np.linalg.norm(middles((48,) * 3, [-1] * 3, [1 / 24] * 3), axis=-1)
    keep(path / "ball48.nrrd", depth.astype(np.float32), [-1] * 3, [1 / 24] * 3)
    places = middles((20, 12, 10), [-1, -1, -1], [0.1, 2 / 12, 0.2])
    slope = (places @ np.array([0.3, -0.2, 1.0])).astype(np.float32)
    keep(path / "slope.nrrd", slope, [-1, -1, -1], [0.1, 2 / 12, 0.2])
    return path


def scene_of(
    folder: Path, volume: dict[str, Any], size: tuple[int, int] = (48, 40), **sections: Any
) -> Scene:
    usual: dict[str, Any] = {
        "formula": NOWHERE,
        "camera": PERSPECTIVE,
        "background": [0, 0, 0],
        "lights": [{"direction": [1, 1, -2]}],
        "objects": {"volume": {"type": "volume", **volume}, **sections.pop("others", {})},
    }
    return scenes.scene_of(size=size, folder=folder, **{**usual, **sections})


def placed_rays(scene: Scene) -> tuple[Floats, Floats, Floats, Floats]:
    """Rays in voxels from the corner of the grid, the way per scene unit; what brings to its own axes; and its sides."""
    (each,) = volumes_of(scene.objects).values()
    place = placed(each, scene.grids[each.file]).place
    origin, direction, _ = rays(scene)
    first, step = own_rays(place, origin, direction)
    own = np.asarray(np.linalg.inv(np.array(place.steps)).T, np.float64)
    return first, step, own, np.array(place.shape, float)


def met(scene: Scene, values: npt.NDArray[Any], level: float) -> tuple[Floats, Floats]:
    """Distances (infinity: none) and normals of the surface, by looking at many places and halving."""
    first, step, own, sides = placed_rays(scene)
    near, far = to_box(first, step, np.zeros(3), sides.astype(float))
    far = np.maximum(near, far)

    def above(t: Floats) -> npt.NDArray[np.bool_]:
        return value_at(values, first + t[..., None] * step) >= level

    low, high = near, np.where(above(near) & (far > near), near, np.inf)
    before = near
    for share in np.linspace(0, 1, _PLACES)[1:]:
        t = near + share * (far - near)
        crosses = np.isinf(high) & above(t) & (far > near)
        low, high = np.where(crosses, before, low), np.where(crosses, t, high)
        before = t
    found = np.where(np.isinf(high), near, high)
    for _ in range(40):
        half = (low + found) / 2
        inside = above(half)
        low, found = np.where(inside, low, half), np.where(inside, half, found)
    found = np.where(np.isinf(high), np.inf, found)
    p = first + np.where(np.isfinite(found), found, 0)[..., None] * step
    rise = np.zeros(p.shape)
    for axis in range(3):
        ends = [p.copy(), p.copy()]
        for end, way in zip(ends, (-1, 1), strict=True):
            end[..., axis] = np.clip(end[..., axis] + way, 0.5, sides[axis] - 0.5)
        apart = ends[1][..., axis] - ends[0][..., axis]
        rise[..., axis] = (value_at(values, ends[1]) - value_at(values, ends[0])) / np.maximum(apart, 1e-9)
    normal = -rise @ own
    # A wall of the box cuts what is above the level.
    box = 2 * p / sides - 1
    wall = np.abs(box).max(-1) > 1 - 1e-9
    flat = np.where(np.abs(box) == np.abs(box).max(-1, keepdims=True), np.sign(box), 0) @ own
    normal = np.where(wall[..., None], flat, normal)
    return found, normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)


def facing(normal: Floats, scene: Scene) -> Floats:
    direction = rays(scene)[1]
    return np.where(((normal * direction).sum(-1) > 0)[..., None], -normal, normal)


@pytest.mark.parametrize(
    ("precision", "lanes", "error"),
    [("float32", None, 2e-5), ("float32", 1, 2e-5), ("float64", 4, 1e-6)],
    ids=["float32", "one lane", "float64"],
)
def test_a_rough_grid_is_met_where_its_values_pass_the_level(
    device: Device, folder: Path, precision: Precision, lanes: int | None, error: float
) -> None:
    scene = scene_of(folder, {"file": "rough.nrrd", "level": ROUGH_LEVEL, **TURNED})
    t, normal = met(scene, ROUGH, ROUGH_LEVEL)
    found = beside(shoot(scene, device, precision, lanes=lanes), scene, t, facing(normal, scene))
    assert 500 < found.both.sum() < found.both.size - 300
    # (The search by NumPy may miss what is thinner than its steps.)
    assert (found.off > 10 * error).mean() < 0.01
    assert np.median(found.off) < error
    assert (found.turned > 2e-3).mean() < 0.01
    assert np.median(found.turned) < 2e-5


def test_values_that_grow_along_a_direction_have_a_plane(device: Device, folder: Path) -> None:
    """Exactly; what is above the level is cut by the walls of the box, exactly too."""
    up = np.array([0.3, -0.2, 1.0])
    # Values above the level are the solid, so its plane is seen from below, and its walls from the side.
    below = {**PERSPECTIVE, "position": [1.2, -2.2, -2.4], "target": [0, 0, 0]}
    for camera in (PERSPECTIVE, below):
        scene = scene_of(folder, {"file": "slope.nrrd", "level": 0.1}, camera=camera)
        framebuffer = shoot(scene, device)
        origin, direction, _ = rays(scene)
        near, far = to_box(origin, direction, np.full(3, -1.0), np.full(3, 2.0))
        t = (0.1 - origin @ up) / (direction @ up)
        entry, crossing = origin + near[..., None] * direction, origin + t[..., None] * direction
        wall = (near < far) & (entry @ up > 0.1 + 0.1) & (np.sort(np.abs(entry), -1)[..., 1] < 0.89)
        plane = (near < t) & (t < far) & (np.abs(crossing).max(-1) < 0.89) & (entry @ up < 0.1)
        assert (wall if camera is PERSPECTIVE else plane).sum() > 150
        np.testing.assert_allclose(points_of(framebuffer)[wall], entry[wall], atol=3e-6)
        assert np.abs(np.abs(normals_of(framebuffer)[wall]).max(-1) - 1).max(initial=0) < 1e-6
        np.testing.assert_allclose(points_of(framebuffer)[plane], crossing[plane], atol=3e-6)
        normal = np.broadcast_to(-up / np.linalg.norm(up), crossing.shape)
        np.testing.assert_allclose(normals_of(framebuffer)[plane], normal[plane], atol=3e-6)


def test_a_ball_throws_its_shadow_on_a_floor(device: Device, folder: Path) -> None:
    """Where rays to the sun go through the ball, and nowhere else."""
    floor = {"floor": {"type": "plane", "position": [0, 0, -1]}}
    camera = {"position": [0, -6, 5], "target": [0.3, 0.3, -1], "fov": 40}
    material = {"ambient": 0, "diffuse": 1, "specular": 0, "color": [1, 1, 1]}
    scene = scene_of(
        folder,
        {"file": "ball48.nrrd", "level": 0.0},
        size=(96, 80),
        others=floor,
        camera=camera,
        material=material,
    )
    framebuffer = shoot(scene, device)
    origin, direction, _ = rays(scene)
    t = (-1 - origin[..., 2]) / direction[..., 2]
    points = origin + t[..., None] * direction
    ball = np.isfinite(to_sphere(origin, direction, np.zeros(3), 1.03 * BALL_RADIUS)[0])
    sun = -np.array([1, 1, -2]) / np.sqrt(6)
    miss = to_sphere(points, np.broadcast_to(sun, points.shape), np.zeros(3), BALL_RADIUS)[1]
    dark, lit = ~ball & (miss < 0.99 * BALL_RADIUS), ~ball & (miss > 1.01 * BALL_RADIUS)
    assert dark.sum() > 50
    assert (framebuffer["R"][dark] == 0).all()
    np.testing.assert_allclose(framebuffer["R"][lit], sun[2], rtol=1e-5)


def test_bricks_know_their_least_and_largest_value() -> None:
    random = np.random.default_rng(0).uniform(size=(9, 17, 30)).astype(np.float32)
    found = brick_ranges(random)
    shape = [-(-(n + 1) // 8) for n in random.shape]
    assert found.shape == (np.prod(shape), 2)
    for number, (z, y, x) in enumerate(np.ndindex(*shape)):
        # Cells from -1 on: values 8 b - 1 to 8 b + 7.
        part = random[tuple(slice(max(8 * b - 1, 0), 8 * b + 8) for b in (z, y, x))]
        if part.size:
            assert tuple(found[number]) == (part.min(), part.max())
