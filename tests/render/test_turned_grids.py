"""Grids whose axes are turned, oblique, mirrored or in another order: what they hold is shown where their files say.

The files hold functions of places in space, sampled at the middles of voxels: so pictures are those of balls, wherever
the axes of a grid go.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.engine.engine import Engine
from clfractal.files.volume_file import Volume, read_volume, write_volume
from clfractal.scene.model import Scene
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import (
    ORTHOGRAPHIC,
    PERSPECTIVE,
    Floats,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
)
from tests.render.volumes import FLAT, composited, volume_scene
from tests.scenes import scene_of

SHAPE = (38, 42, 46)
"""Voxels along the file's own axes."""
CENTER, RADIUS = np.array([0.25, -0.2, 0.15]), 0.7
_C, _S = np.cos(np.pi / 6), np.sin(np.pi / 6)
_TURN = np.array([[_C, _S, 0], [-_S, _C, 0], [0, 0, 1]]) @ np.array(
    [[1, 0, 0], [0, 0.8, 0.6], [0, -0.6, 0.8]]
)
STEPS: dict[str, Floats] = {
    "turned": np.diag([0.06, 0.05, 0.07]) @ _TURN,
    "oblique": np.array([[0.07, 0.01, 0.0], [0.025, 0.065, 0.0], [0.015, -0.02, 0.06]]),
    "mirrored": np.diag([0.06, -0.05, 0.06]) @ _TURN,
    "in another order": (np.diag([0.06, 0.055, 0.06]) @ _TURN)[[2, 0, 1]] * [[-1], [1], [1]],
    "against the axes": np.array([[0.0, -0.06, 0.0], [0.0, 0.0, 0.06], [-0.055, 0.0, 0.0]]),
}
"""Steps from voxel to voxel along the file's axes, one in each row."""


def origin_of(steps: Floats) -> Floats:
    """Where the first voxel's middle is, of a grid around the origin."""
    return np.asarray(-(np.array(SHAPE) - 1) / 2 @ steps)


def places(steps: Floats) -> Floats:
    """The middles of all voxels, shape (nz, ny, nx, 3)."""
    z, y, x = np.indices(SHAPE[::-1])
    return np.asarray(origin_of(steps) + np.stack([x, y, z], axis=-1) @ steps)


def depth(points: Floats) -> Floats:
    """How deep in the ball places are."""
    return np.asarray(RADIUS - np.linalg.norm(points - CENTER, axis=-1))


def file_of(name: str) -> str:
    return f"{name.replace(' ', '_')}.nrrd"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("turned")
    for name, steps in STEPS.items():
        values = depth(places(steps)).astype(np.float32)
        write_volume(path / file_of(name), Volume(values, origin_of(steps), steps))
    return path


def check_ball(framebuffer: Any, scene: Scene, steps: Floats) -> None:
    """The ball is where it is, and so are its normals."""
    origin, direction, _ = rays(scene)
    t, nearest = to_sphere(origin, direction, CENTER, RADIUS)
    hit, voxel = framebuffer["A"] == 1, float(np.linalg.norm(steps, axis=1).max())
    sure = np.abs(nearest - RADIUS) > 0.15 * voxel
    np.testing.assert_array_equal(hit[sure], (nearest < RADIUS)[sure])
    clear = nearest < 0.8 * RADIUS
    assert clear.sum() > 200
    expected = origin + np.where(clear, t, 0)[..., None] * direction
    assert np.linalg.norm(points_of(framebuffer) - expected, axis=-1)[clear].max() < 0.15 * voxel
    outward = points_of(framebuffer) - CENTER
    cosine = ((normals_of(framebuffer) * outward).sum(-1) / np.linalg.norm(outward, axis=-1))[clear]
    assert np.degrees(np.arccos(np.minimum(cosine, 1))).max() < 0.5


@pytest.mark.parametrize("name", STEPS)
@pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC], ids=["perspective", "orthographic"])
def test_a_surface(device: Device, folder: Path, name: str, camera: dict[str, Any]) -> None:
    scene = volume_scene(camera, folder=folder, file=file_of(name), level=0.0)
    check_ball(shoot(scene, device), scene, STEPS[name])


@pytest.mark.parametrize("name", STEPS)
def test_an_object(device: Device, folder: Path, name: str) -> None:
    scene = object_scene(folder, file=file_of(name), level=0.0)
    check_ball(shoot(scene, device), scene, STEPS[name])


def object_scene(folder: Path, **volume: Any) -> Scene:
    return scene_of(
        NOWHERE,
        PERSPECTIVE,
        (48, 48),
        folder=folder,
        background=[0, 0, 0],
        lights=[{"direction": [1, 1, -2]}],
        objects={"v": {"type": "volume", **volume}},
    )


def test_an_object_is_scaled_along_the_files_axes_and_then_turned(device: Device, folder: Path) -> None:
    """Of an oblique grid, too: the ball becomes that ellipsoid. By the normals and places of its surface."""
    steps, factors = STEPS["oblique"], np.array([0.7, 1.2, 0.9])
    scene = object_scene(
        folder,
        file=file_of("oblique"),
        level=0.0,
        scale=factors.tolist(),
        rotation=[0, 0, 90],
        position=[0.1, 0, 0],
    )
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] == 1
    assert hit.sum() > 200
    # Back to the file's own space: x was turned to y, and y to -x.
    x, y, z = np.moveaxis(points_of(framebuffer) - [0.1, 0, 0], -1, 0)
    back = np.stack([y, -x, z], -1) / factors
    voxel = float(np.linalg.norm(steps, axis=1).max())
    assert np.abs(depth(back))[hit].max() < 0.15 * voxel


OPACITY = [{"at": -0.25, "opacity": 0}, {"at": 0.5, "opacity": 0.5}]


@pytest.mark.parametrize("name", STEPS)
def test_places_one_by_one(device: Device, folder: Path, name: str) -> None:
    """Every place of every ray, by NumPy in the file's own array."""
    steps = STEPS[name]
    colors = [{"at": -0.5, "color": [1, 0, 0.25]}, {"at": 0.5, "color": [0.25, 1, 0]}]
    transfer = {"opacity": OPACITY, "color": colors}
    scene = volume_scene(PERSPECTIVE, folder=folder, file=file_of(name), transfer=transfer, look=FLAT)
    framebuffer = shoot(scene, device)

    def look(values: Floats) -> tuple[Floats, Floats]:
        tints = [np.interp(values, [-0.5, 0.5], ends) for ends in ([1, 0.25], [0, 1], [0.25, 0])]
        return np.interp(values, [-0.25, 0.5], [0, 0.5]), np.stack(tints, -1)

    values = read_volume(folder / file_of(name)).values
    color, opacity = composited(scene, values, origin_of(steps) - steps.sum(0) / 2, steps, look)
    off = np.abs(framebuffer["A"] - opacity) > 2e-4
    off |= np.abs(stacked(framebuffer, "RGB") - color).max(-1) > 2e-3
    assert off.mean() < 0.004
    assert 0.1 < (framebuffer["A"] > 0.5).mean() < 0.9


@pytest.mark.parametrize("name", STEPS)
def test_a_mesh(folder: Path, name: str) -> None:
    """Of the scene and of the file: the same ball, outside out."""
    scene = volume_scene(PERSPECTIVE, folder=folder, file=file_of(name), level=0.0)
    for mesh in (clfractal.mesh(scene), clfractal.mesh(read_volume(folder / file_of(name)), level=0.0)):
        assert np.abs(depth(mesh.vertices)).max() < 0.005
        corners = mesh.vertices[mesh.triangles] - CENTER
        volume = (np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum() / 6
        assert volume == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=0.02)
        outward = (mesh.normals * (mesh.vertices - CENTER)).sum(-1) / RADIUS
        assert outward.min() > 0.98


@pytest.mark.parametrize("ending", [".nrrd", ".npy"])
@pytest.mark.parametrize("name", STEPS)
def test_what_this_program_writes_stays_where_it_was(
    device: Device, folder: Path, tmp_path: Path, name: str, ending: str
) -> None:
    scene = volume_scene(PERSPECTIVE, folder=folder, file=file_of(name), level=0.0)
    clfractal.voxelize(scene).save(tmp_path / f"again{ending}")
    again = read_volume(tmp_path / f"again{ending}")
    z, y, x = np.indices(again.values.shape)
    found = again.origin + np.stack([x, y, z], axis=-1) @ again.directions
    np.testing.assert_allclose(again.values, depth(found), atol=1e-5)
    shown = volume_scene(PERSPECTIVE, folder=tmp_path, file=f"again{ending}", level=0.0)
    assert scene.given is not None
    assert shown.given is not None
    np.testing.assert_allclose(shown.given.place.ends, scene.given.place.ends, atol=1e-12)
    if ending == ".nrrd":
        check_ball(shoot(shown, device), shown, STEPS[name])


def test_a_pixel_is_probed_where_it_is(folder: Path) -> None:
    scene = volume_scene(ORTHOGRAPHIC, folder=folder, file=file_of("turned"), level=0.0)
    found = clfractal.probe(scene, 28, 20)
    assert found.point is not None
    assert abs(float(depth(np.array(found.point)))) < 0.01


def test_a_grid_that_moves_is_shown_anew(tmp_path: Path, device: Device) -> None:
    """The same values under the same name in another place, by one engine that keeps grids."""
    engine, found = Engine(device), []
    values = depth(places(STEPS["turned"])).astype(np.float32)
    for origin in (0.0, 0.4):
        at = origin_of(STEPS["turned"]) + np.array([origin, 0, 0])
        write_volume(tmp_path / "v.nrrd", Volume(values, at, STEPS["turned"]))
        scene = volume_scene(ORTHOGRAPHIC, folder=tmp_path, file="v.nrrd", level=0.0)
        found.append(engine.render(scene, precision="float32", channels=("R", "G", "B", "A")))
    first, second = (np.mean(np.nonzero(framebuffer["A"] == 1)[1]) for framebuffer in found)
    assert second - first > 3


def corners(scene: Scene) -> npt.NDArray[np.float64]:
    """The corners of the scene's grid in the picture, in halves of its width and height; shape (8, 2)."""
    assert scene.given is not None
    camera = scene.camera
    forward = np.array(camera.target) - camera.position
    side = np.cross(forward, camera.up)
    up = np.cross(side, forward)
    basis = [each / np.linalg.norm(each) for each in (side, up)]
    half = camera.height / 2  # type: ignore[union-attr]
    return np.asarray((scene.given.place.ends - camera.target) @ np.array(basis).T / half)


@pytest.mark.parametrize("name", STEPS)
def test_a_camera_frames_all_of_it(folder: Path, name: str) -> None:
    camera = {"projection": "orthographic", "position": [1, -2, 1.5], "frame": "all"}
    scene = volume_scene(camera, folder=folder, file=file_of(name), level=0.0)
    assert np.abs(corners(scene)).max() == pytest.approx(0.9, abs=1e-6)
    np.testing.assert_allclose(scene.camera.target, 0, atol=1e-9)


@pytest.mark.parametrize("name", STEPS)
def test_a_box_holds_all_of_it(folder: Path, name: str) -> None:
    box = {"center": [1, 2, 3], "size": [1.0, 1.5, 2.0]}
    scene = volume_scene(PERSPECTIVE, folder=folder, file=file_of(name), level=0.0, box=box)
    assert scene.given is not None
    ends = np.abs(scene.given.place.ends - [1, 2, 3]) / [0.5, 0.75, 1]
    assert ends.max() == pytest.approx(1)
    # Only larger or smaller: no other angles.
    steps = np.array(scene.given.place.steps)
    own = volume_scene(PERSPECTIVE, folder=folder, file=file_of(name), level=0.0).given
    assert own is not None
    ratio = steps[np.abs(steps) > 1e-9] / np.array(own.place.steps)[np.abs(steps) > 1e-9]
    np.testing.assert_allclose(ratio, ratio[0])
