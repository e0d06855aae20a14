"""Normals of stored bricks: Eq. 6 and its filter against NumPy, and those of a ball against its radius."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.voxels.dense import grid_from_dense
from clfractal.voxels.grid import Grid
from tests.devices import device
from tests.render.shots import BALL
from tests.scenes import BALL_ITERATIONS
from tests.voxels.grids import Floats, decoded, filled, place_of, volume_scene, voxel_points

BINOMIAL = {
    0: [1],
    1: [1, 2, 1],
    2: [1, 4, 6, 4, 1],
    3: [1, 6, 15, 20, 15, 6, 1],
    4: [1, 8, 28, 56, 70, 56, 28, 8, 1],
}
NONE = [128, 128, 128]


def along(values: Floats, weights: list[int], axis: int) -> Floats:
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
        smooth = along(smooth, BINOMIAL[radius], axis)
    inner = tuple(slice(radius + 1, -radius - 1) for _ in range(3))
    gradient = np.stack([along(smooth, [-1, 0, 1], axis)[inner] for axis in (2, 1, 0)], axis=-1) / spacing
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
