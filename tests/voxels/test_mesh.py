"""Isosurfaces: closed, turned outward, where mathematics puts them, and the same whatever the bricks are."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import skimage.measure
import trimesh

from clfractal.files.mesh import Mesh
from clfractal.scene.grid_values import finite_range
from clfractal.voxels.isosurface import extract

marching_cubes: Any = skimage.measure.marching_cubes
Doubles = npt.NDArray[np.float64]

SIDE = 48
STEP = 2 / SIDE
ORIGIN = np.full(3, -1 + STEP / 2)
RADIUS = 0.8


def points(side: int = SIDE) -> Doubles:
    """Middles of the voxels of the box from -1 to 1: (z, y, x, 3), the last x, y, z."""
    axis = (np.arange(side) + 0.5) * 2 / side - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.stack([x, y, z], axis=-1)


def ball(radius: float = RADIUS) -> Doubles:
    """Depth below a sphere's surface."""
    return np.asarray(radius - np.linalg.norm(points(), axis=-1), np.float64)


def mesh_of(values: npt.NDArray[Any], level: float = 0.0, **settings: Any) -> Mesh:
    return extract(values, level, origin=ORIGIN, directions=STEP * np.eye(3), **settings)


def body(mesh: Mesh) -> Any:
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)


def is_closed(mesh: Mesh) -> bool:
    """Each edge is in two triangles, once in each direction; no vertex is left over; no triangle is flat."""
    edges = np.concatenate([mesh.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]).astype(np.int64)
    forth = np.unique(edges[:, 0] * len(mesh.vertices) + edges[:, 1])
    back = np.unique(edges[:, 1] * len(mesh.vertices) + edges[:, 0])
    shape = body(mesh)
    return bool(
        len(forth) == len(edges)
        and np.array_equal(forth, back)
        and shape.is_watertight
        and shape.is_winding_consistent
        and len(np.unique(mesh.triangles)) == len(mesh.vertices)
        and shape.area_faces.min() > 0
    )


def normals_of(mesh: Mesh) -> Doubles:
    assert mesh.normals is not None
    return np.asarray(mesh.normals, np.float64)


def triangle_set(mesh: Mesh) -> npt.NDArray[Any]:
    """All triangles as their corners' coordinates, in an order that does not depend on the mesh's."""
    corners = mesh.vertices[mesh.triangles]
    first = np.lexsort([corners[:, :, axis] for axis in range(3)])[:, 0]
    turned = corners[np.arange(len(corners))[:, None], (first[:, None] + np.arange(3)) % 3].reshape(-1, 9)
    return np.asarray(turned[np.lexsort(turned.T)])


def test_a_ball() -> None:
    mesh = mesh_of(ball(), brick=20)
    assert is_closed(mesh)
    shape = body(mesh)
    # Chords of a step lie below the surface by step^2 / 8r, twice that in volume's relative error.
    assert shape.volume == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=2e-3)
    assert shape.area == pytest.approx(4 * np.pi * RADIUS**2, rel=2e-3)
    distance = np.linalg.norm(mesh.vertices, axis=1)
    assert np.abs(distance - RADIUS).max() < STEP**2 / (4 * RADIUS)
    assert np.abs(np.linalg.norm(normals_of(mesh), axis=1) - 1).max() < 1e-6
    assert (np.sum(normals_of(mesh) * mesh.vertices, axis=1) / distance).min() > 0.9999


def test_a_ball_of_bytes() -> None:
    """Only 0 and 255: the surface is somewhere between the voxels, its normals are smoothed."""
    mesh = mesh_of((ball() >= 0).astype(np.uint8) * np.uint8(255), 127.5, brick=20)
    assert is_closed(mesh)
    assert body(mesh).volume == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=2e-2)
    distance = np.linalg.norm(mesh.vertices, axis=1)
    assert np.abs(distance - RADIUS).max() < STEP
    assert (np.sum(normals_of(mesh) * mesh.vertices, axis=1) / distance).min() > 0.9


def test_the_side_of_triangles_and_of_normals() -> None:
    """Both look away from the larger values, in a mirrored grid too."""
    for turn in (np.diag([1.0, 1, 1]), np.diag([-1.0, 1, 1]), np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 2]])):
        mesh = extract(ball(), 0.0, origin=ORIGIN @ turn, directions=STEP * turn)
        assert is_closed(mesh)
        assert body(mesh).volume == pytest.approx(
            4 / 3 * np.pi * RADIUS**3 * abs(np.linalg.det(turn)), rel=2e-3
        )
        corners = mesh.vertices[mesh.triangles]
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        for corner in range(3):
            assert (np.sum(flat * normals_of(mesh)[mesh.triangles[:, corner]], axis=1) > 0).all()


def test_normals_of_a_stretched_grid() -> None:
    """An ellipsoid's normal is along x / a^2."""
    axes = np.array([1.0, 2.0, 0.5])
    mesh = extract(ball() ** 1, 0.0, origin=ORIGIN * axes, directions=STEP * np.diag(axes))
    expected = mesh.vertices / axes**2
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    assert np.sum(normals_of(mesh) * expected, axis=1).min() > 0.9999


@pytest.mark.parametrize(
    "steps",
    [
        [[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]],
        [[1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [0.0, -0.7, 2.0]],
        [[0.0, -1.0, 0.3], [1.0, 0.0, 0.0], [0.4, 0.2, 1.5]],
        [[1.0, 0.2, 0.0], [0.3, -1.0, 0.0], [0.1, 0.0, 0.5]],
    ],
    ids=["rotated", "sheared", "both", "mirrored"],
)
def test_normals_of_a_grid_whose_steps_are_not_along_the_axes(steps: list[list[float]]) -> None:
    """Of a linear function of the place: the surface is a plane, and its normal the same everywhere."""
    slope, directions, origin = np.array([0.3, -0.5, 0.4]), np.array(steps), np.array([1.0, -2.0, 0.5])
    z, y, x = np.indices((9, 8, 7))
    places = origin + np.stack([x, y, z], axis=-1) @ directions
    level = float(np.median(places @ slope)) + 0.01
    mesh = extract(places @ slope, level, origin=origin, directions=directions, close=False)
    outward = -slope / np.linalg.norm(slope)
    np.testing.assert_allclose(mesh.vertices @ slope, level, atol=1e-3)
    # At the outermost voxels values go on unchanged, and normals turn.
    at = (mesh.vertices - origin) @ np.linalg.inv(directions)
    inner = ((at >= 1) & (at <= np.array([5, 6, 7]))).all(axis=1)
    assert inner.sum() > 30
    np.testing.assert_allclose(normals_of(mesh)[inner], np.tile(outward, (inner.sum(), 1)), atol=1e-5)
    corners = mesh.vertices[mesh.triangles]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (flat @ outward > 0).all()


@pytest.mark.parametrize("brick", [5, 16, 23])
@pytest.mark.parametrize("kind", ["smooth", "bytes", "noise"])
def test_bricks_leave_no_trace(brick: int, kind: str) -> None:
    rng = np.random.default_rng(brick)
    values = {
        "smooth": ball()[:30, :26, :29],
        "bytes": rng.integers(0, 2, (17, 24, 19), np.uint8),
        "noise": rng.normal(size=(17, 24, 19)),
    }[kind]
    level = {"smooth": 0.0, "bytes": 0.5, "noise": 0.3}[kind]
    for close in (True, False):
        whole = extract(values, level, close=close, brick=1000)
        parts = extract(values, level, close=close, brick=brick)
        assert len(whole.vertices) == len(parts.vertices)
        assert np.array_equal(triangle_set(whole), triangle_set(parts))
        assert np.array_equal(
            np.sort(whole.vertices.view("f8,f8,f8"), axis=0), np.sort(parts.vertices.view("f8,f8,f8"), axis=0)
        )


def test_the_same_as_scikit_image_in_one_piece() -> None:
    """Of a smooth field without corners that lie on the level."""
    x, y, z = np.moveaxis(points(40), -1, 0) * 4
    values = (np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)).astype(np.float32)
    theirs = marching_cubes(values, 0.123, gradient_direction="descent")
    mesh = extract(values, 0.123, close=False, brick=13)
    corners = theirs[0][:, ::-1].astype(np.float64)
    assert len(mesh.vertices) == len(corners)
    assert len(mesh.triangles) == len(theirs[1])
    # Middles of all triangles, found among each other; (z, y, x) turns theirs around.
    ours = mesh.vertices[mesh.triangles].mean(axis=1)
    others = corners[theirs[1]].mean(axis=1)
    assert np.abs(ours[np.lexsort(np.rint(ours * 50).T)].sum(axis=0) - others.sum(axis=0)).max() < 0.5
    from scipy.spatial import cKDTree

    assert cKDTree(others).query(ours)[0].max() < 2e-3


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["bits", "normal", "integers", "wild", "holes"])
def test_noise_is_closed(kind: str, seed: int) -> None:
    """Every case of marching cubes occurs, the ambiguous ones too, and values that lie on the level."""
    rng = np.random.default_rng(seed)
    shape = (15, 16, 17)
    values: npt.NDArray[Any] = {
        "bits": rng.integers(0, 2, shape, np.uint8),
        "normal": rng.normal(0.5, 1, shape),
        "integers": rng.integers(-2, 4, shape) + 0.5,
        "wild": rng.normal(size=shape) * 10.0 ** rng.uniform(-40, 40, shape) + 0.5,
        "holes": np.where(rng.uniform(size=shape) < 0.2, rng.choice([np.nan, np.inf, -np.inf], shape), 1.0),
    }[kind]
    mesh = extract(values, 0.5, brick=7)
    assert is_closed(mesh)
    assert np.isfinite(mesh.vertices).all()
    assert np.abs(np.linalg.norm(normals_of(mesh), axis=1) - 1).max() < 1e-5


def test_what_the_box_cuts_is_closed_on_its_faces() -> None:
    mesh = mesh_of(ball(1.2), brick=20)
    assert is_closed(mesh)
    assert np.abs(mesh.vertices).max() == pytest.approx(1.0, abs=1e-12)
    # A ball of radius r without its six caps of height r - 1.
    caps = 6 * np.pi * 0.2**2 * (3 * 1.2 - 0.2) / 3
    assert body(mesh).volume == pytest.approx(4 / 3 * np.pi * 1.2**3 - caps, rel=5e-3)
    on_top = (mesh.vertices[:, 2] > 1 - 1e-9) & (np.linalg.norm(mesh.vertices[:, :2], axis=1) < 0.5)
    assert np.allclose(normals_of(mesh)[on_top], (0, 0, 1))
    opened = mesh_of(ball(1.2), close=False)
    assert not body(opened).is_watertight
    assert np.abs(opened.vertices).max() <= 1 - STEP / 2 + 1e-12


def test_all_inside_is_the_box() -> None:
    mesh = mesh_of(np.ones((SIDE,) * 3, np.uint8), 0.5)
    assert is_closed(mesh)
    assert body(mesh).volume == pytest.approx(8, rel=2e-3)
    assert len(mesh_of(np.ones((SIDE,) * 3), 0.5, close=False).triangles) == 0


def test_nothing_inside() -> None:
    mesh = mesh_of(np.zeros((5, 6, 7)), 0.5)
    assert mesh.vertices.shape == (0, 3)
    assert mesh.triangles.shape == (0, 3)


def test_one_voxel_and_thin_grids() -> None:
    for shape in ((1, 1, 1), (1, 5, 1), (2, 1, 3)):
        mesh = extract(np.ones(shape), 0.5)
        assert is_closed(mesh)
        assert len(extract(np.ones(shape), 0.5, close=False).triangles) == 0


def test_positions_in_a_deep_zoom() -> None:
    """Scene units of 1e-12 far from the origin: vertices are as fine as float64 is."""
    mesh = extract(
        ball(), 0.0, origin=np.array([-1.7, 0, 0]) + 1e-10 * ORIGIN, directions=1e-10 * STEP * np.eye(3)
    )
    assert is_closed(mesh)
    distance = np.linalg.norm(mesh.vertices - np.array([-1.7, 0, 0]), axis=1)
    assert np.abs(distance / 1e-10 - RADIUS).max() < STEP**2 / (4 * RADIUS)


def test_progress_and_range() -> None:
    told: list[float] = []
    mesh_of(ball(), brick=25, progress=told.append)
    assert told == [pytest.approx(part / 8) for part in range(1, 9)]
    assert finite_range(np.array([[[3.0, np.nan, -1.0, np.inf]]])) == (-1, 3)
    assert finite_range(np.full((2, 2, 2), np.nan)) is None
    assert finite_range(np.arange(40 * 6, dtype=np.uint8).reshape(40, 2, 3)) == (0, 239)


class Watched:
    """Values that are only given out in pieces, and how large the largest was."""

    def __init__(self, values: Doubles) -> None:
        self.values, self.shape, self.largest = values, values.shape, 0

    def __getitem__(self, place: tuple[slice, slice, slice]) -> Doubles:
        part = self.values[place]
        self.largest = max(self.largest, part.size)
        return part


def test_no_more_than_a_brick_is_asked_for_at_once() -> None:
    watched = Watched(ball())
    values: Any = watched
    mesh = mesh_of(values, brick=12)
    # A brick of 12 cells has 13 samples a side, and one more on each side for slopes.
    assert 0 < watched.largest <= 15**3
    assert np.array_equal(triangle_set(mesh), triangle_set(mesh_of(ball())))
