"""Rays through grids of others: opacity, values and colours against closed forms, and place by place by NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.scene.volume import VolumeRenderer
from clfractal.voxels.fill import fill_grid
from tests.render.shots import (
    BALL_RADIUS,
    CAMERAS,
    CHANNELS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    Floats,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
    view_of,
)
from tests.render.volumes import FLAT, LIT, SIDES, composited, keep, middles, to_box, volume_scene

CORNER, VOXEL = np.array([-1.15, -1.45, -1.1]), 0.0625
CENTER, RADIUS = np.array([0.1, 0.05, -0.1]), 0.8
COLOR = np.array(FLAT["material"]["color"])
# Opacity in proportion to the value, 0.1 of a voxel's side where it is 1.
FOG = {"opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": 0.1}]}
STOPS: dict[str, Any] = {
    "opacity": [
        {"at": 0.2, "opacity": 0},
        {"at": 0.5, "opacity": 0.3},
        {"at": 0.7, "opacity": 0.05},
        {"at": 1.0, "opacity": 0.2},
    ],
    "color": [
        {"at": 0.0, "color": [1, 0, 0]},
        {"at": 0.5, "color": [0, 1, 0]},
        {"at": 1.0, "color": [0, 0, 4]},
    ],
}
# Transfer tables have 1024 entries, rounding adds up over a hundred places.
ROUNDING = 1e-4


def ball() -> npt.NDArray[np.float32]:
    """1 within the ball, 0 outside; over the width of a voxel at its surface the part of it, in one direction."""
    distance = np.linalg.norm(middles(SIDES, CORNER, [VOXEL] * 3) - CENTER, axis=-1) - RADIUS
    values: Floats = np.clip(0.5 - distance / VOXEL, 0, 1)
    return values.astype(np.float32)


def ramp() -> npt.NDArray[np.float32]:
    """A linear function of the place: between voxels it is met exactly."""
    values: Floats = middles(SIDES, CORNER, [VOXEL] * 3) @ np.array([0.2, 0.1, -0.15]) + 0.5
    return values.astype(np.float32)


def noise() -> npt.NDArray[np.float32]:
    """Smooth clouds with empty space between them."""
    coarse = np.random.default_rng(3).uniform(-1, 1, [n // 8 + 2 for n in SIDES[::-1]])
    fine: Floats = coarse.repeat(8, 0).repeat(8, 1).repeat(8, 2)
    for axis in range(3):
        fine = np.mean([np.roll(fine, shift, axis) for shift in range(6)], axis=0)
    x, y, z = SIDES
    part: Floats = np.clip(4 * fine[8 : 8 + z, 8 : 8 + y, 8 : 8 + x], 0, 1)
    return part.astype(np.float32)


GRIDS = {"ball": ball, "ramp": ramp, "noise": noise}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The grids in files, as if from another program."""
    path = tmp_path_factory.mktemp("grids")
    for name, values in GRIDS.items():
        keep(path / f"{name}.nrrd", values(), CORNER, [VOXEL] * 3)
    return path


def look_of(transfer: dict[str, Any]) -> Any:
    """Opacity and colour of values."""
    stops = [(stop["at"], stop["opacity"]) for stop in transfer["opacity"]]
    colors = [(stop["at"], stop["color"]) for stop in transfer.get("color", ())]

    def look(values: Floats) -> tuple[Floats, Floats]:
        opacity = np.interp(values, [at for at, _ in stops], [each for _, each in stops])
        if not colors:
            return opacity, COLOR
        at = [place for place, _ in colors]
        return opacity, np.stack([np.interp(values, at, [c[i] for _, c in colors]) for i in range(3)], -1)

    return look


@pytest.mark.parametrize("step", [0.05, 0.5, 1, 2])
def test_opacity_does_not_depend_on_the_step(device: Device, folder: Path, step: float) -> None:
    """A slab of one density, seen from the front: any step stops the same part of the light, to within a step."""
    camera = {
        "projection": "orthographic",
        "position": [0.1, -4, -0.1],
        "target": [0.1, 0, -0.1],
        "height": 1.5,
    }
    transfer = {"opacity": [{"at": -1, "opacity": 0.05}]}
    scene = volume_scene(
        camera, folder=folder, file="ramp.nrrd", transfer=transfer, step=step, opacity_limit=1, size=(8, 8)
    )
    framebuffer = shoot(scene, device)
    # 48 voxels deep; places lie at 0, step, 2 step ... below 48.
    places = np.ceil(48 / step)
    expected = 1 - 0.95 ** (step * places)
    np.testing.assert_allclose(framebuffer["A"], expected, atol=0.05 * step * 0.95**48 + ROUNDING)
    assert expected == pytest.approx(1 - 0.95**48, abs=0.01)


@pytest.mark.parametrize("interpolation", ["trilinear", "nearest"])
@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("name", ["ramp", "noise"])
def test_places_one_by_one(device: Device, folder: Path, name: str, camera: str, interpolation: str) -> None:
    """Every place of every ray, by NumPy: values between voxels, colours and opacities between stops, the order."""
    scene = volume_scene(
        CAMERAS[camera], folder=folder, file=f"{name}.nrrd", transfer=STOPS, interpolation=interpolation
    )
    framebuffer = shoot(scene, device)
    nearest = interpolation == "nearest"
    color, opacity = composited(scene, GRIDS[name](), CORNER, [VOXEL] * 3, look_of(STOPS), nearest=nearest)
    # A place at the very middle between two voxels, and a ray at its opacity limit, may go either way.
    off = np.abs(framebuffer["A"] - opacity) > ROUNDING
    off |= np.abs(stacked(framebuffer, "RGB") - color).max(-1) > 10 * ROUNDING
    assert off.mean() < (0.02 if nearest else 0.004)
    assert (framebuffer["A"] > 0.5).mean() > 0.1
    assert framebuffer["A"].max() <= 1


def test_a_ramp_has_its_values(device: Device, folder: Path) -> None:
    """Where half of the light is stopped, `iterations` has the value there, P the place, Z its depth."""
    scene = volume_scene(
        PERSPECTIVE,
        folder=folder,
        file="ramp.nrrd",
        transfer={"opacity": [{"at": -1, "opacity": 0.2}]},
        step=1,
    )
    framebuffer = shoot(scene, device)
    origin, direction, _ = rays(scene)
    near, far = to_box(origin, direction, CORNER, np.array(SIDES) * VOXEL)
    # 0.8^4 is the first power below a half: the fourth place, three steps in.
    t = near + 3 * VOXEL
    seen = t < far - 1e-5
    assert seen.sum() > 800
    points = origin + t[..., None] * direction
    np.testing.assert_allclose(points_of(framebuffer)[seen], points[seen], atol=1e-5)
    depth = (t[..., None] * direction) @ view_of(scene).axis
    np.testing.assert_allclose(framebuffer["Z"][seen], depth[seen], atol=1e-5)
    inner = np.clip(points, CORNER + VOXEL / 2, CORNER + np.array(SIDES) * VOXEL - VOXEL / 2)
    np.testing.assert_allclose(
        framebuffer["iterations"][seen], (inner @ [0.2, 0.1, -0.15] + 0.5)[seen], atol=1e-4
    )
    np.testing.assert_array_equal(framebuffer["samples"], 1)


def test_normals_of_fog_are_those_of_its_surface(device: Device, folder: Path) -> None:
    """Where a dense ball stops half of the light, the normal is the ball's, to within some degrees."""
    dense = {"opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": 0.8}]}
    scene = volume_scene(ORTHOGRAPHIC, folder=folder, file="ball.nrrd", transfer=dense, step=0.25)
    framebuffer = shoot(scene, device)
    offset = points_of(framebuffer) - CENTER
    found = np.isfinite(framebuffer["Z"])
    clear = found & (to_sphere(*rays(scene)[:2], CENTER, RADIUS)[1] < 0.8 * RADIUS)
    assert clear.sum() > 300
    distance = np.linalg.norm(offset, axis=-1)
    assert (np.abs(distance - RADIUS)[clear] < VOXEL).all()
    cosine = (normals_of(framebuffer) * offset).sum(-1)[clear] / distance[clear]
    assert np.degrees(np.arccos(np.minimum(cosine, 1))).max() < 4
    # What stops less than half of the light has no place.
    faint = (framebuffer["A"] > 0) & (framebuffer["A"] < 0.49)
    assert faint.any()
    assert np.isposinf(framebuffer["Z"][faint]).all()
    assert not points_of(framebuffer)[faint].any()


@pytest.mark.parametrize("side", [1, -1])
def test_the_far_side_of_fog_faces_the_eye(device: Device, folder: Path, side: int) -> None:
    """The ramp's normal is the same everywhere; seen from where it points away, it and its light are turned around."""
    normal = np.array([0.2, 0.1, -0.15]) / -np.linalg.norm([0.2, 0.1, -0.15])  # away from larger values
    position = CENTER + side * 4 * normal + [0.2, 0, 0.3]
    camera = {
        "projection": "orthographic",
        "position": position.tolist(),
        "target": CENTER.tolist(),
        "height": 2,
    }
    light = {"direction": (CENTER - position).tolist(), "shadow": False}
    look = {**FLAT, "material": {**FLAT["material"], "ambient": 0, "diffuse": 1}, "lights": [light]}
    transfer = {"opacity": [{"at": -1, "opacity": 0.1}]}
    framebuffer = shoot(
        volume_scene(camera, folder=folder, file="ramp.nrrd", transfer=transfer, look=look), device
    )
    # Within the grid: at its faces values go on unchanged, and normals turn.
    depth = np.array(SIDES) * VOXEL / 2 - np.abs(points_of(framebuffer) - CENTER)
    inner = (depth > 2 * VOXEL).all(-1) & (framebuffer["A"] > 0.99)
    assert inner.sum() > 100
    np.testing.assert_allclose(
        normals_of(framebuffer)[inner], side * normal + 0 * points_of(framebuffer)[inner], atol=0.02
    )
    toward = (position - CENTER) / np.linalg.norm(position - CENTER)
    brightness = stacked(framebuffer, "RGB")[inner] / framebuffer["A"][inner, None]
    np.testing.assert_allclose(np.median(brightness, axis=0), COLOR * side * (normal @ toward), rtol=0.05)


OUTSIDE = {
    "inside": [{"at": 0, "opacity": 0.03}, {"at": 1, "opacity": 0}],
    # (0 is an entry of the table.)
    "coverage": [{"at": -2, "opacity": 0}, {"at": 0, "opacity": 0.04}, {"at": 1, "opacity": 0.02}],
}


@pytest.mark.parametrize("value", OUTSIDE)
@pytest.mark.parametrize("camera", CAMERAS)
def test_fog_outside_of_a_filled_grid(device: Device, camera: str, value: str) -> None:
    """Places outside have a value like others: nothing of the box is missing, and no brick of fog."""
    transfer = {"opacity": OUTSIDE[value]}
    scene = volume_scene(
        CAMERAS[camera], value=value, resolution=60, box={"size": 3}, transfer=transfer, opacity_limit=1
    )
    framebuffer = shoot(scene, device)
    corner, voxel = np.full(3, -1.5), 0.05
    if value == "inside":
        values = np.linalg.norm(middles((60, 60, 60), corner, [voxel] * 3), axis=-1) < BALL_RADIUS
    else:
        thirds = (np.arange(180) + 0.5) / 180 * 3 - 1.5
        z, y, x = np.meshgrid(thirds, thirds, thirds, indexing="ij")
        points = (x * x + y * y + z * z < BALL_RADIUS**2).reshape(60, 3, 60, 3, 60, 3)
        values = np.rint(255 * points.mean(axis=(1, 3, 5))) / 255
    color, opacity = composited(scene, values, corner, [voxel] * 3, look_of(transfer))
    assert opacity.min() > 0.3
    # A few voxels at the surface are another's by rounding.
    off = np.abs(framebuffer["A"] - opacity)
    assert np.quantile(off, 0.95) < ROUNDING
    assert off.max() < 0.01
    np.testing.assert_allclose(stacked(framebuffer, "RGB"), color, atol=0.01)


def test_fog_outside_is_lit_as_that_of_a_file(device: Device, tmp_path: Path) -> None:
    """The same voxels, all of them stored: the same normals, if a brick has surface or only touches one that has."""
    look: dict[str, Any] = {
        "value": "coverage",
        "resolution": 60,
        "box": {"size": 3},
        "normal_radius": 2,
        "step": 1,
    }
    fog = [{"at": 0, "opacity": 0.05}, {"at": 1, "opacity": 0}]
    scene = volume_scene(PERSPECTIVE, look=LIT, transfer={"opacity": fog}, **look)
    own = shoot(scene, device)
    assert isinstance(scene.renderer, VolumeRenderer)
    grid = fill_grid(scene, scene.renderer, device, lanes=1, precision="float32")
    assert grid.outside_slot is not None
    assert (grid.table_entries >= 0).all()
    assert (grid.table_entries == grid.outside_slot).sum() > 50
    keep(tmp_path / "all.nrrd", grid.dense(), grid.corner, grid.spacing)
    bytes_fog = [{"at": 0, "opacity": 0.05}, {"at": 255, "opacity": 0}]
    other = shoot(
        volume_scene(
            PERSPECTIVE,
            look=LIT,
            folder=tmp_path,
            file="all.nrrd",
            transfer={"opacity": bytes_fog},
            normal_radius=2,
            step=1,
        ),
        device,
    )
    assert own["A"].max() > 0.5
    np.testing.assert_allclose(stacked(own, "RGBA"), stacked(other, "RGBA"), atol=2e-5)


def test_the_opacity_limit_ends_rays(device: Device, folder: Path) -> None:
    """At 0.6 no ray goes on that is as opaque; it takes fewer steps, and what it misses is below the limit."""
    dense = {"opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": 0.5}]}
    framebuffers = [
        shoot(
            volume_scene(PERSPECTIVE, folder=folder, file="ball.nrrd", transfer=dense, opacity_limit=limit),
            device,
        )
        for limit in (0.6, 1)
    ]
    early, late = framebuffers
    core = late["A"] > 0.99
    assert core.sum() > 200
    assert (early["A"][core] >= 0.6 - 1e-6).all()
    # A step adds at most 1 - 0.5^0.5 of what comes through before it.
    assert early["A"].max() <= 1 - 0.4 * np.sqrt(0.5) + 1e-6
    assert early["steps"][core].mean() < 0.6 * late["steps"][core].mean()
    rest = late["A"] < 0.6 - 1e-6
    np.testing.assert_array_equal(early["A"][rest], late["A"][rest])


def test_empty_space_is_left_out(device: Device, folder: Path) -> None:
    """Rays past a ball in empty space take few steps, and rays past the grid none; steps are whole numbers."""
    scene = volume_scene(ORTHOGRAPHIC, folder=folder, file="ball.nrrd", transfer=FOG)
    framebuffer = shoot(scene, device)
    origin, direction, _ = rays(scene)
    near, far = to_box(origin, direction, CORNER, np.array(SIDES) * VOXEL)
    steps = framebuffer["steps"]
    assert np.array_equal(steps, np.round(steps))
    assert not steps[near > far].any()
    assert (steps[far - near > VOXEL] >= 1).all()
    past = (to_sphere(origin, direction, CENTER, RADIUS)[1] > RADIUS + 9 * VOXEL * np.sqrt(3)) & (near < far)
    assert past.any()
    assert steps[past].max() < 15
    assert steps.max() <= np.ceil(((far - near) / (0.5 * VOXEL)).max()) + 1


@pytest.mark.parametrize("transfer", [FOG, {}], ids=["fog", "surface"])
def test_an_empty_grid(device: Device, folder: Path, transfer: dict[str, Any]) -> None:
    """A grid in which nothing can be seen shows the background."""
    if transfer:
        keep(folder / "empty.nrrd", np.zeros((9, 20, 30), np.float32), CORNER, [VOXEL] * 3)
        scene = volume_scene(PERSPECTIVE, folder=folder, file="empty.nrrd", transfer=transfer)
    else:
        # Far off the ball.
        box = {"center": [5, 5, 5], "size": 2}
        camera = {"position": [1, 1, 1], "target": [5, 5, 5]}
        scene = volume_scene(camera, box=box, resolution=24)
    framebuffer = shoot(scene, device)
    assert not stacked(
        framebuffer, [name for name in CHANNELS if name not in ("Z", "steps", "samples")]
    ).any()
    assert np.isposinf(framebuffer["Z"]).all()
