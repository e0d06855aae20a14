"""Grids whose axes are turned, oblique, mirrored or in another order: what they hold is shown where their files say.

The files hold functions of places in space, sampled at the middles of voxels: so pictures are those of balls, wherever
the axes of a grid go.
"""

from __future__ import annotations

from dataclasses import replace
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
from clfractal.voxels import pool
from tests import scenes
from tests.render.bits import same
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import (
    BALL,
    CAMERAS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    Floats,
    points_of,
    shoot,
    stacked,
)
from tests.render.volumes import FLAT, LIT, check_ball, composited, keep, middles, volume_scene
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


def voxel_of(steps: Floats) -> float:
    """The longest side."""
    return float(np.linalg.norm(steps, axis=1).max())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("turned")
    for name, steps in STEPS.items():
        values = depth(places(steps)).astype(np.float32)
        write_volume(path / file_of(name), Volume(values, origin_of(steps), steps))
    return path


@pytest.mark.parametrize("name", STEPS)
@pytest.mark.parametrize("kind", ["perspective", "orthographic", "object"])
def test_surfaces_and_objects(device: Device, folder: Path, name: str, kind: str) -> None:
    shown: dict[str, Any] = {"folder": folder, "file": file_of(name), "level": 0.0}
    scene = object_scene(**shown) if kind == "object" else volume_scene(CAMERAS[kind], **shown)
    check_ball(shoot(scene, device), scene, CENTER, RADIUS, voxel_of(STEPS[name]))


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
    assert np.abs(depth(back))[hit].max() < 0.15 * voxel_of(steps)


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
        check_ball(shoot(shown, device), shown, CENTER, RADIUS, voxel_of(STEPS[name]))


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


SIZE = (70, 40)
FOG = {"opacity": [{"at": 0.1, "opacity": 0}, {"at": 1, "opacity": 0.4}]}
WHITE = [{"at": 0, "color": [1, 1, 1]}, {"at": 1, "color": [1, 1, 1]}]
LIGHTS = [{"direction": [-1, 1, -1], "shadow": True}, {"type": "point", "position": [2, -2, 3]}]
HAST = {"name": "hast", "iterations": 12}
CAMERA = {"position": [1.5, -2.5, 1.5], "target": [0, 0, 0], "fov": 45}


def zoomed_scene(**sections: Any) -> Scene:
    usual: dict[str, Any] = {"formula": {"inline": BALL, "iterations": 4}, "camera": CAMERA, "size": SIZE}
    return scenes.scene_of(**{**usual, "lights": LIGHTS, **sections})


def shaded(look: dict[str, Any]) -> dict[str, Any]:
    """With shadows, as the other fog of this file: the same program."""
    return {**look, "lights": [{**light, "shadow": True} for light in look["lights"]]}


@pytest.mark.parametrize("parts", [2, 4])
def test_a_grid_in_several_pools(
    device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parts: int
) -> None:
    """Larger than the device's largest buffer: values and normals come from the right part."""
    values = np.random.default_rng(5).uniform(0, 255, (33, 41, 50)).astype(np.uint8)
    values[:12] //= 16
    keep(tmp_path / "a.nrrd", values, [-1.2, -1, -0.8], [0.05] * 3)
    transfer = {"opacity": [{"at": 20, "opacity": 0}, {"at": 255, "opacity": 0.5}]}
    scene = volume_scene(
        PERSPECTIVE,
        folder=tmp_path,
        file="a.nrrd",
        look=shaded(LIT),
        transfer=transfer,
        shadows=True,
        size=(40, 40),
    )
    whole = stacked(shoot(scene, device))
    usual = pool.plan_pools
    monkeypatch.setattr(
        "clfractal.voxels.dense.plan_pools",
        lambda *given: replace(usual(*given), part_slots=-(-usual(*given).slots // parts)),
    )
    assert same(stacked(shoot(scene, device)), whole)
    assert (whole[..., 3] > 0.9).mean() > 0.1


@pytest.mark.parametrize("scales", [[4], [2, 2]])
def test_a_zoom_shows_the_small_box_as_large_as_the_first(device: Device, scales: list[int]) -> None:
    """The same voxels as of the small box by itself, seen by a camera that is as much nearer."""
    middle = np.array([-0.4, 0.1, 0.05])
    first = {"center": list(middle), "size": [2.4, 2.0, 1.6]}
    small = middle + np.array([-0.3, 0.25, 0.2])
    light = {"lights": [{"direction": [-1, 1, -1]}], "formula": HAST}
    eye = np.array([1.2, -2.8, 1.6])
    common = {"type": "volume", "resolution": [48, 40, 32], "value": "coverage", "precision": "float32"}
    zoom = {"box": first, "zoom": [{"center": list(small), "scale": s} for s in scales]}
    itself = {"box": {"center": list(small), "size": [0.6, 0.5, 0.4]}}
    near, far = (
        shoot(
            zoomed_scene(
                camera={"position": list(target + away), "target": list(target), "fov": 45},
                renderer={**common, **box},
                **light,
            ),
            device,
        )
        for target, away, box in ((middle, eye, zoom), (small, eye / 4, itself))
    )
    hit = (near["A"] > 0) & (far["A"] > 0)
    assert hit.mean() > 0.1
    assert ((near["A"] > 0) != (far["A"] > 0)).mean() < 0.01
    both = points_of(near)[hit], points_of(far)[hit]
    off = np.linalg.norm((both[0] - middle) / 4 - (both[1] - small), axis=-1)
    assert np.percentile(off, 98) < 1e-4
    different = np.abs(stacked(near, "RGB") - stacked(far, "RGB")).max(-1)[hit]
    assert np.percentile(different, 98) < 1e-2
    np.testing.assert_allclose(near["Z"][hit][off < 1e-4] / 4, far["Z"][hit][off < 1e-4], atol=2e-4)


def test_samples(device: Device, tmp_path: Path) -> None:
    """With many samples a pixel's coverage is the part of it that a box covers; data channels are of one sample."""
    keep(tmp_path / "full.nrrd", np.full((8, 8, 8), 200, np.uint8), [-0.5, -0.5, -0.5], [0.125] * 3)
    camera = {"projection": "orthographic", "position": [0, -3, 0], "height": 1.6}
    solid = {"opacity": [{"at": 0, "opacity": 1}]}
    scene = volume_scene(
        camera,
        folder=tmp_path,
        file="full.nrrd",
        look=shaded(FLAT),
        transfer=solid,
        shadows=True,
        samples=64,
        size=(15, 15),
    )
    framebuffer = shoot(scene, device)
    edges = np.clip((np.arange(16) - 7.5) * 1.6 / 15, -0.5, 0.5)
    part = np.diff(edges) / (1.6 / 15)
    np.testing.assert_allclose(framebuffer["A"], part[:, None] * part[None], atol=0.05)
    assert framebuffer["A"].sum() * (1.6 / 15) ** 2 == pytest.approx(1, rel=5e-3)
    color = np.array(FLAT["material"]["color"])
    np.testing.assert_allclose(stacked(framebuffer, "RGB"), framebuffer["A"][..., None] * color, atol=1e-5)
    assert (framebuffer["samples"] == 64).all()
    # A ray that nothing changes needs no more samples than the fewest.
    scene = volume_scene(
        camera,
        folder=tmp_path,
        file="full.nrrd",
        transfer=solid,
        samples=256,
        noise=0.02,
        min_samples=8,
        size=(15, 15),
    )
    framebuffer = shoot(scene, device)
    assert set(framebuffer["samples"][4:11, 4:11].flat) == {8}
    assert framebuffer["samples"][2, 4:11].min() > 30


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("transfer", [{**FOG, "color": WHITE}, {}], ids=["fog", "surface"])
def test_values_that_are_no_numbers(
    device: Device, tmp_path: Path, transfer: dict[str, Any], value: float
) -> None:
    """A few of them leave the rest of the picture as it is, and make no pixel a NaN."""
    corner, spacing = [-1.0, -1, -1], [0.0625] * 3
    distance = np.linalg.norm(middles((32, 32, 32), corner, spacing), axis=-1)
    values = np.clip(0.5 + (0.7 - distance) / 0.0625, 0, 1).astype(np.float32)
    keep(tmp_path / "good.nrrd", values, corner, spacing)
    values[3:5, 4, 5] = value
    values[16, 16, 16] = value
    keep(tmp_path / "bad.nrrd", values, corner, spacing)
    scenes = [
        volume_scene(PERSPECTIVE, folder=tmp_path, file=f"{name}.nrrd", transfer=transfer)
        for name in ("good", "bad")
    ]
    good, bad = (stacked(shoot(scene, device), "RGBA") for scene in scenes)
    assert np.isfinite(bad).all()
    assert (np.abs(good - bad).max(-1) > 0.01).mean() < 0.05
