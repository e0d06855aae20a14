"""Grids whose pictures are known from mathematics, scenes that show them, and rays through them by NumPy."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.files.volume_file import Volume, write_volume
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.grid_place import GridPlace
from clfractal.scene.model import Scene
from tests.render.shots import BALL, Floats, normals_of, points_of, rays, to_sphere
from tests.scenes import scene_of

# Light that shows a place's own colour, whatever its normal.
FLAT: dict[str, Any] = {
    "material": {"ambient": 1, "diffuse": 0, "specular": 0, "color": [0.75, 0.5, 0.25]},
    "lights": [{"direction": [0, 1, -0.5], "shadow": False}],
    "background": "transparent",
}
# Two lights with highlights, over a grey background.
LIT: dict[str, Any] = {
    "material": {"color": [0.8, 0.6, 0.4]},
    "lights": [
        {"direction": [-1, 2, -1.5], "shadow": False},
        {"type": "point", "position": [3, -2, 4], "color": [0.2, 0.4, 0.9], "shadow": False},
    ],
    "background": {"top": [0.5, 0.5, 0.5], "bottom": [0.5, 0.5, 0.5]},
}
# To each axis another number of voxels.
SIDES = (40, 48, 32)


def middles(shape: Sequence[int], corner: npt.ArrayLike, spacing: npt.ArrayLike) -> Floats:
    """Middles of the voxels of a grid of `shape` (x, y, z), shape (nz, ny, nx, 3)."""
    axes = [
        c + (np.arange(n) + 0.5) * s
        for n, c, s in zip(shape, np.asarray(corner, float), np.asarray(spacing, float), strict=True)
    ]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    return np.stack([x, y, z], axis=-1)


def keep(path: Path, values: npt.NDArray[Any], corner: npt.ArrayLike, spacing: npt.ArrayLike) -> None:
    """Writes a grid; `spacing`: sides of a voxel along the axes, or the three steps of a turned grid."""
    steps = steps_of(spacing)
    write_volume(path, Volume(values, np.asarray(corner, float) + steps.sum(0) / 2, steps))


def steps_of(spacing: npt.ArrayLike) -> Floats:
    """Steps from voxel to voxel, shape (3, 3), of a grid along the axes or of any other."""
    sides = np.asarray(spacing, float)
    return np.diag(sides) if sides.ndim == 1 else sides


def in_voxels(vectors: Floats, spacing: npt.ArrayLike) -> Floats:
    """Vectors of the scene, shape (..., 3), in voxels along the grid's own axes."""
    found = np.linalg.solve(steps_of(spacing).T, vectors.reshape(-1, 3).T)
    return np.asarray(found.T.reshape(vectors.shape), np.float64)


def own_rays(place: GridPlace, origin: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Rays in voxels from the first corner of a grid, and their way per scene unit."""
    return in_voxels(origin - place.corner, place.steps), in_voxels(direction, place.steps)


def volume_scene(
    camera: Mapping[str, Any],
    *,
    folder: Path | None = None,
    size: tuple[int, int] = (48, 48),
    formula: Mapping[str, Any] = BALL,
    look: Mapping[str, Any] = FLAT,
    sections: Mapping[str, Any] | None = None,
    **renderer: Any,
) -> Scene:
    """A scene of a volume: of a ball that is filled, or of a `file` in `folder`."""
    others = {"renderer": {"type": "volume", **renderer}, **look, **(sections or {})}
    return scene_of(formula, camera, size, folder=folder, **others)


def value_at(values: npt.NDArray[Any], places: Floats, *, nearest: bool = False) -> Floats:
    """Values at places given in voxels from the grid's corner; beyond the outermost middles the nearest goes on."""
    shape = np.array(values.shape[::-1])
    at = np.clip(places - 0.5, 0, shape - 1)
    cell = np.minimum(at.astype(int), np.maximum(shape - 2, 0))
    share = at - cell
    if nearest:
        share = (share >= 0.5).astype(float)
    result = np.zeros(places.shape[:-1])
    for corner in range(8):
        bits = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
        weight = np.where(bits, share, 1 - share).prod(-1)
        x, y, z = np.moveaxis(np.minimum(cell + bits, shape - 1), -1, 0)
        result += weight * np.where(weight > 0, values[z, y, x], 0)
    return result


def to_box(origin: Floats, direction: Floats, corner: Floats, sides: Floats) -> tuple[Floats, Floats]:
    """Where rays enter and leave a box; they miss it where the first is not less."""
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (corner - origin) / direction, (corner + sides - origin) / direction
    return np.maximum(np.minimum(one, other).max(-1), 0), np.maximum(one, other).min(-1)


def composited(
    scene: Scene,
    values: npt.NDArray[Any],
    corner: npt.ArrayLike,
    spacing: npt.ArrayLike,
    look: Callable[[Floats], tuple[Floats, Floats]],
    *,
    step: float = 0.5,
    nearest: bool = False,
    limit: float = 0.99,
) -> tuple[Floats, Floats]:
    """Colour (premultiplied) and opacity of each pixel's ray, place after place, in flat light.

    Args:
        look: of values their opacity for a voxel's side, and their colour.
    """
    steps = steps_of(spacing)
    origin, direction, _ = rays(scene)
    first, way = in_voxels(origin - np.asarray(corner, float), steps), in_voxels(direction, steps)
    shape = np.array(values.shape[::-1], float)
    near, far = to_box(first, way, np.zeros(3), shape)
    length = step * np.linalg.norm(steps, axis=1).min()
    through = np.ones(near.shape)
    color = np.zeros((*near.shape, 3))
    for number in range(int(np.linalg.norm(steps, axis=1) @ shape / length) + 2):
        t = near + number * length
        going = (t < far) & (through > 1 - limit)
        places = first + t[..., None] * way
        opacity, tint = look(value_at(values, np.where(going[..., None], places, 0), nearest=nearest))
        share = np.where(going, 1 - (1 - opacity) ** step, 0)
        color += (through * share)[..., None] * tint
        through *= 1 - share
    return color, 1 - through


def check_ball(
    framebuffer: Framebuffer, scene: Scene, center: Floats, radius: float, voxel: float, degrees: float = 0.5
) -> None:
    """The ball is where it is, and so are its normals, to a part of a voxel."""
    origin, direction, _ = rays(scene)
    t, nearest = to_sphere(origin, direction, center, radius)
    hit = framebuffer["A"] == 1
    sure = np.abs(nearest - radius) > 0.15 * voxel
    np.testing.assert_array_equal(hit[sure], (nearest < radius)[sure])
    clear = nearest < 0.8 * radius
    assert clear.sum() > 200
    expected = origin + np.where(clear, t, 0)[..., None] * direction
    assert np.linalg.norm(points_of(framebuffer) - expected, axis=-1)[clear].max() < 0.15 * voxel
    outward = (points_of(framebuffer) - center)[clear]
    cosine = (normals_of(framebuffer)[clear] * outward).sum(-1) / np.linalg.norm(outward, axis=-1)
    assert np.degrees(np.arccos(np.minimum(cosine, 1))).max() < degrees
