"""Exact normals and colours of a mesh's vertices, from the formula."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.files.mesh import Mesh
from clfractal.geometry.objects import own_color
from clfractal.geometry.solids import Body
from clfractal.integrators.points import nearest
from clfractal.scene.coloring import Coloring
from clfractal.scene.model import Scene
from clfractal.scene.palette import SIZE, palette_table

Doubles = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

AT_ONCE = 1 << 20
# Voxels along the normal of the grid, from where a vertex is looked at: first a voxel out, in a narrow gap half of one.
# A vertex itself lies within detail that the grid does not show, or inside, where the distance has no slope; and along
# its normal a distance keeps its slope, so that on smooth surfaces nothing is lost.
PUSHES = (1.0, 0.5)
WALL_PUSH = 0.5
# Least cosine between the formula's normal and the grid's: what is further apart belongs to detail finer than the grid,
# and would be seen as dark speckles on a surface that does not have it.
LEAST_COSINE = 0.5


def dress(
    mesh: Mesh,
    scene: Scene,
    coloring: Coloring,
    device: Device,
    *,
    lanes: int,
    precision: Precision,
    voxel: float,
    flat: Flags | None = None,
    progress: Callable[[float], None] | None = None,
) -> Mesh:
    """The mesh with normals from the formula's Jacobian, and colours; objects have those of their own.

    A normal stays unchanged if the formula has none nearby, or a very different one: there the detail is finer than
    the grid. What chooses colours must be known with a hit (the others
    need a ray, or are too costly here): else colours are the material's.

    Args:
        coloring: used instead of the scene's coloring.
        voxel: the side of a voxel, scene units.
        flat: (n,), vertices that keep their normal: those of faces that the box cuts.
        progress: called with the finished fraction, 0 to 1.

    Raises:
        DeviceError, KernelBuildError: the device failed.
    """
    assert mesh.normals is not None
    count = len(mesh.vertices)
    normals = np.array(mesh.normals, np.float32)
    limit = np.float32(scene.formula.iterations)
    smooth = np.full(count, limit)
    things = np.zeros(count, np.int64)
    body = Body.of(scene)
    for start in range(0, count, AT_ONCE):
        part = np.arange(start, min(start + AT_ONCE, count))
        left = part if flat is None else part[~flat[part]]
        for push in PUSHES:
            if not len(left):
                break
            outward = np.asarray(mesh.normals[left], np.float64)
            found, _ = nearest(
                body,
                mesh.vertices[left] + push * voxel * outward,
                device=device,
                lanes=lanes,
                precision=precision,
            )
            seen = ~found.inside & (np.abs(np.linalg.norm(found.normal, axis=1) - 1) < 0.01)
            good = seen & (np.sum(found.normal * outward, axis=1) > LEAST_COSINE)
            normals[left[good]] = found.normal[good]
            first = seen & (smooth[left] == limit)
            smooth[left[first]] = found.smooth[first]
            left = left[~good]
        if scene.joined:
            # A little out of the solid, where walls of cuts are known from what they cut; not as far as the next solid.
            near = mesh.vertices[part] + WALL_PUSH * voxel * np.asarray(mesh.normals[part], np.float64)
            things[part] = nearest(body, near, device=device, lanes=lanes, precision=precision)[1]
        if progress is not None:
            progress((part[-1] + 1) / count)
    colors = np.array(_colors(scene, coloring, normals, smooth))
    for number, each in enumerate(scene.objects.values(), 1):
        color = own_color(scene, each)
        if color is not None:
            colors[things == number] = color
    return replace(mesh, normals=normals, colors=colors)


def on_faces(vertices: Doubles, corner: Doubles, spacing: Doubles, shape: tuple[int, int, int]) -> Flags:
    """Which vertices lie on the faces of a grid's box; `shape` is of voxels along x, y and z."""
    far = corner + spacing * shape
    near = np.abs(vertices - corner) < 1e-3 * spacing
    return np.asarray((near | (np.abs(vertices - far) < 1e-3 * spacing)).any(axis=1))


def _colors(
    scene: Scene, coloring: Coloring, normals: npt.NDArray[np.float32], smooth: npt.NDArray[np.float32]
) -> npt.NDArray[np.float32]:
    """Linear colours, (n, 3), as rays find them (kernels/shading/color.h)."""
    plain = np.broadcast_to(np.array(scene.material.color, np.float32), normals.shape)
    if coloring.kind.known != "at_hit":
        return plain
    if coloring.uses_palette:
        return _from_palette(coloring, smooth)
    return np.asarray(coloring.kind.own_colors(normals, plain), np.float32)


def _from_palette(coloring: Coloring, quantity: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Blended between neighbours; one that repeats is squeezed by a 256th, where its end blends into its start."""
    table = palette_table(coloring)
    where = quantity.astype(np.float64) * coloring.scale + coloring.offset
    place = where - np.floor(where) if coloring.repeat else np.clip(where, 0, 1)
    intervals = SIZE if coloring.repeat else SIZE - 1
    at = np.nan_to_num(place) * intervals
    first = np.clip(at.astype(np.int64), 0, intervals - 1)
    share = (at - first).astype(np.float32)[:, None]
    return np.asarray(table[first] * (1 - share) + table[(first + 1) % SIZE] * share)
