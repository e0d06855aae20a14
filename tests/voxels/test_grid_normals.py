"""Normals of stored bricks: Eq. 6 and its filter against NumPy, and those of a ball against its radius."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.geometry.planes import zoom_of
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject
from clfractal.schema.shape import turned_axes
from clfractal.voxels.dense import grid_from_dense
from clfractal.voxels.grid import Grid
from tests.devices import device
from tests.render.levels import BESIDE, CAMERA, UNEVEN, along, degrees, onto_level, sizes, slopes
from tests.render.shots import BALL, normals_of, points_of, shoot
from tests.scenes import BALL_ITERATIONS, scene_of
from tests.variants import one_of
from tests.voxels.grids import Floats, decoded, filled, place_of, volume_scene, voxel_points

BINOMIAL = {
    0: [1],
    1: [1, 2, 1],
    2: [1, 4, 6, 4, 1],
    3: [1, 6, 15, 20, 15, 6, 1],
    4: [1, 8, 28, 56, 70, 56, 28, 8, 1],
}
NONE = [128, 128, 128]


def filtered(values: Floats, weights: list[int], axis: int) -> Floats:
    """A filter along an axis; past the ends the last value repeats."""
    reach = len(weights) // 2
    padding = [(reach, reach) if a == axis else (0, 0) for a in range(3)]
    padded = np.pad(values, padding, mode="edge")
    n = values.shape[axis]
    parts = [w * np.take(padded, np.arange(i, i + n), axis=axis) for i, w in enumerate(weights)]
    total: Floats = np.sum(parts, axis=0)
    return total


def gradient_colors(values: Floats, radius: int, spacing: tuple[float, float, float] = (1, 1, 1)) -> Floats:
    """Eq. 6 after a binomial filter, as unrounded colours; past the grid's ends the last voxel repeats."""
    smooth = np.pad(values.astype(float), radius + 1, mode="edge")
    for axis in range(3):
        smooth = filtered(smooth, BINOMIAL[radius], axis)
    inner = tuple(slice(radius + 1, -radius - 1) for _ in range(3))
    gradient = np.stack([filtered(smooth, [-1, 0, 1], axis)[inner] for axis in (2, 1, 0)], axis=-1) / spacing
    length = np.linalg.norm(gradient, axis=-1, keepdims=True)
    with np.errstate(all="ignore"):
        return np.where(length > 0, 127.5 * (1 - gradient / length), 128.0)


def in_mixed_bricks(grid: Grid) -> npt.NDArray[np.bool_]:
    """Voxels that a brick with samples of its own holds."""
    first = 0 if grid.solid_slot is None else 1
    nx, ny, nz = grid.shape
    result = np.zeros((nz, ny, nx), np.bool_)
    for z, y, x in np.argwhere(grid.table_entries >= first):
        result[8 * z : 8 * z + 9, 8 * y : 8 * y + 9, 8 * x : 8 * x + 9] = True
    return result


def check_colors(grid: Grid, expected: Floats) -> None:
    stored = in_mixed_bricks(grid)
    found = grid.dense_normals()[stored]
    assert stored.sum() > 500
    np.testing.assert_array_equal((found[:, :3] == NONE).all(axis=1), (expected[stored] == 128).all(axis=1))
    assert np.abs(found[:, :3] - expected[stored]).max() <= 0.501


@pytest.mark.parametrize("radius", [0, 1, 2, 3, 4])
def test_differences_and_filter_against_numpy(radius: int) -> None:
    settings: dict[str, Any] = {"resolution": (41, 34, 50), "normal_radius": radius}
    # The box cuts through the set, so that the grid's borders matter.
    box = {"center": [-0.2, 0.1, 0.1], "size": [1.6, 1.4, 1.9]}
    grid = filled(volume_scene("hast", 20, box=box, **settings))
    dense = grid.dense()
    assert dense[:, :, 0].any() or dense[:, 0].any() or dense[0].any()
    stretch = np.array(grid.spacing) / min(grid.spacing)
    check_colors(grid, gradient_colors(dense, radius, tuple(stretch)))
    alpha = grid.dense_normals()[..., 3]
    stored = in_mixed_bricks(grid)
    np.testing.assert_array_equal(alpha[stored], dense[stored])


def test_normals_of_shares_and_of_values_of_others() -> None:
    settings = {"resolution": 40, "value": "coverage", "sub_points": 2, "box": {"size": 2.6}}
    grid = filled(volume_scene("hast", 12, **settings))
    check_colors(grid, gradient_colors(grid.dense(), 1))
    np.testing.assert_array_equal(grid.dense_normals()[..., 3] == 255, grid.dense() >= 127.5)
    values = np.random.default_rng(5).normal(size=(20, 9, 17)).astype(np.float32)
    given = grid_from_dense(values, device(), place=place_of(values, (1, 1, 1)), normal_radius=2)
    check_colors(given, gradient_colors(values.astype(float), 2))


# --- a ball ---


def angles(kind: str, **settings: Any) -> Floats:
    """Degrees between the normals and a ball's radius, at the samples of cells that the surface goes through."""
    box = {"center": [0.02, -0.03, 0.01], "size": 2.4}
    grid = filled(
        volume_scene(BALL, BALL_ITERATIONS, resolution=64, box=box, normals=kind, **settings),
    )
    solid = grid.dense() > 0
    low, high = np.ones((63, 63, 63), np.bool_), np.zeros((63, 63, 63), np.bool_)
    corners = [
        tuple(slice(1 if bit & i else 0, 64 if bit & i else 63) for bit in (1, 2, 4)) for i in range(8)
    ]
    for corner in corners:
        low &= solid[corner]
        high |= solid[corner]
    surface = np.zeros_like(solid)
    for corner in corners:
        surface[corner] |= high & ~low
    # A sample that bricks share has a refined normal in those whose cells need it.
    index = np.indices(surface.shape)
    surface &= (index % 8 != 0).all(axis=0)
    vectors, there = decoded(grid.dense_normals())
    assert surface.sum() > 10_000
    if kind != "gradient":
        assert there[surface].all()
    at = voxel_points(grid.place)
    chosen = surface & there
    cosine = (vectors * at).sum(-1)[chosen] / np.linalg.norm(vectors[chosen], axis=-1)
    cosine /= np.linalg.norm(at[chosen], axis=-1)
    degrees: Floats = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return degrees


@pytest.mark.parametrize(("radius", "median", "worst"), [(0, 21, 54), (1, 5.5, 27), (2, 3, 19), (4, 1.6, 12)])
def test_differences_on_a_ball(radius: int, median: float, worst: float) -> None:
    """Of values 0 and 1 differences know few directions; the filter mixes more."""
    off = angles("gradient", normal_radius=radius)
    assert np.median(off) < median
    assert off.max() < worst


def test_exact_normals_of_a_ball() -> None:
    """A sample's normal is that of the surface where the line along -G meets it, up to half a voxel aside."""
    off = angles("exact")
    assert np.median(off) < 0.3  # 8 bits: half a step in each component is up to 0.4 degrees
    assert off.max() < 1.3


def test_planes_through_the_surface_of_a_ball() -> None:
    off = angles("least_squares")
    assert np.median(off) < 0.3
    assert off.max() < 1.4


# --- `exact` normals are those of the level set of |z| at the limit of applications ---


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


@pytest.mark.parametrize("lanes", one_of(None, 1, 4))
@pytest.mark.parametrize("value", ["inside", "coverage"])
def test_zoomed_boxes_values_and_lanes(device: Device, value: str, lanes: int | None) -> None:
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
