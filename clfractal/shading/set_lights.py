"""Lights on the set as kernels read them: balls, by which of them to sample from where, and what a ray meets.

All of them stand in a cube. A coarse grid of it has in each cell the probabilities with which a place there samples each
ball, as running sums: by brightness, distance, and the side to which the ball shines (as the bounds of Conty Estevez
and Kulla 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting). A finer grid lists the balls in each of
its cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.device.structs import Precision
from clfractal.elements.lights.set import SetLight
from clfractal.scene.model import Scene
from clfractal.scene.places import places_of

Floats = npt.NDArray[np.float64]

BALL_NUMBERS = 8
"""Numbers of a ball: its middle, its radius, the radiance that it shows, and its flags."""
VISIBLE, SHADOW = 1, 2
# Most probabilities in all, and most cells of each grid along a side.
_MOST_NUMBERS, _MOST_CELLS, _MOST_LISTS = 3_000_000, 16, 40
# Of a ball's part in a cell what it has at least: from behind, and of the whole.
_BEHIND, _LEAST = 0.05, 0.02
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, slots=True, eq=False)
class SetLights:
    """All balls of a scene.

    Attributes:
        corner: of the cube that holds them, scene units.
        edge: its length.
        cells: of the coarse grid along an edge.
        lists: of the fine one.
        rays: shadow rays of a sample, with `lighting.mode: direct`.
        count: of balls.
        data: balls, each BALL_NUMBERS long; for each coarse cell the running sums of probabilities and the irradiance that
            all bring there; for each fine cell where its list begins, and one number more; the lists.
    """

    corner: tuple[float, float, float]
    edge: float
    cells: int
    lists: int
    rays: int
    count: int
    data: Floats

    @property
    def balls(self) -> Floats:
        """Of each ball its BALL_NUMBERS."""
        return self.data[: self.count * BALL_NUMBERS].reshape(self.count, BALL_NUMBERS)


def set_lights_of(scene: Scene) -> SetLights | None:
    """The balls of a scene's lights on the set, or None if it has no such light."""
    return scene.derived(_set_lights)


def _set_lights(scene: Scene) -> SetLights | None:
    lights = [(number, light) for number, light in enumerate(scene.lights) if isinstance(light, SetLight)]
    if not lights:
        return None
    rows, normals = zip(*(_balls(scene, number, light) for number, light in lights), strict=True)
    rays = max(light.used_rays for _, light in lights)
    return packed(np.concatenate(rows), np.concatenate(normals), rays)


def _balls(scene: Scene, number: int, light: SetLight) -> tuple[Floats, Floats]:
    places = places_of(scene, number)
    radius = light.radius if light.radius is not None else scene.size / 200
    height = light.height if light.height is not None else radius
    rows = np.zeros((len(places.trap), BALL_NUMBERS))
    rows[:, :3] = places.surface + height * places.normal
    rows[:, 3] = radius
    rows[:, 4:7] = light.intensity * np.array(light.used_color)
    if light.palette is not None:
        # Here, as few scenes need it.
        from clfractal.scene.palette import named_table

        table = named_table(light.palette)
        rows[:, 4:7] *= table[(places.trap / light.threshold * (len(table) - 1)).astype(int)]
    rows[:, 7] = VISIBLE * light.visible + SHADOW * light.shadow
    return rows, places.normal


def packed(balls: Floats, normals: Floats, rays: int) -> SetLights:
    """What kernels read of balls, shape (n, BALL_NUMBERS), on surfaces with these normals, shape (n, 3)."""
    middle, radius = balls[:, :3], balls[:, 3]
    low = (middle - radius[:, None]).min(axis=0)
    edge = float(((middle + radius[:, None]).max(axis=0) - low).max()) * (1 + 1e-6)
    cells = max(min(int((_MOST_NUMBERS / (len(balls) + 1)) ** (1 / 3)), _MOST_CELLS), 1)
    lists = max(min(math.ceil((4 * len(balls)) ** (1 / 3)), _MOST_LISTS), 1)
    places = (np.indices((cells,) * 3).reshape(3, -1).T[:, ::-1] + 0.5) * (edge / cells) + low
    rows = [
        probabilities(balls, normals, part, edge / cells * math.sqrt(3) / 2)
        for part in np.array_split(places, -(-len(places) // 256))
    ]
    starts, members = _listed(middle, radius, low, edge, lists)
    data = np.concatenate([balls.ravel(), *(row.ravel() for row in rows), starts, members])
    x, y, z = (float(part) for part in low)
    return SetLights((x, y, z), edge, cells, lists, rays, len(balls), data)


def probabilities(balls: Floats, normals: Floats, places: Floats, half: float) -> Floats:
    """For cells with these middles, shape (m, 3), and half their diagonal: rows of n running sums, and what all bring.

    No probability is below _LEAST / n, so that each ball is found from everywhere.
    """
    offset = places[:, None] - balls[None, :, :3]
    away = np.linalg.norm(offset, axis=2)
    facing = np.einsum("mni,ni->mn", offset, normals) / np.maximum(away, 1e-300)
    side = np.clip(facing + half / np.maximum(away, half), _BEHIND, 1.0)
    bright = math.pi * (balls[:, 4:7] @ _LUMINANCE) * balls[:, 3] ** 2
    weight = bright * side / (away**2 + half**2 / 4)
    total = weight.sum(axis=1, keepdims=True)
    even = 1 / len(balls)
    share = np.divide(weight, total, out=np.full(weight.shape, even), where=total > 0)
    sums = np.cumsum((1 - _LEAST) * share + _LEAST * even, axis=1)
    sums[:, -1] = 1.0
    return np.concatenate([sums, total], axis=1)


def _listed(middle: Floats, radius: Floats, low: Floats, edge: float, lists: int) -> tuple[Floats, Floats]:
    """Of each cell of the fine grid, x first, where its list begins in the second array, of the balls that reach there."""
    first = np.clip(((middle - radius[:, None] - low) / edge * lists).astype(int), 0, lists - 1)
    last = np.clip(((middle + radius[:, None] - low) / edge * lists).astype(int), 0, lists - 1)
    cells: list[list[int]] = [[] for _ in range(lists**3)]
    for ball, (begin, end) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
        for z in range(begin[2], end[2] + 1):
            for y in range(begin[1], end[1] + 1):
                for x in range(begin[0], end[0] + 1):
                    cells[(z * lists + y) * lists + x].append(ball)
    starts = np.concatenate([[0], np.cumsum([len(each) for each in cells])]).astype(float)
    return starts, np.array([ball for each in cells for ball in each], float)


def set_light_data(found: SetLights | None, precision: Precision) -> npt.NDArray[np.generic]:
    """The buffer; without such lights a stand-in."""
    return np.zeros(4, precision) if found is None else found.data.astype(precision)


def march_fields(found: SetLights | None) -> dict[str, object]:
    """The fields of March for `kernels/shading/set_lights.h`."""
    return {
        "set_count": found.count if found else 0,
        "set_cells": found.cells if found else 0,
        "set_lists": found.lists if found else 0,
        "set_rays": found.rays if found else 0,
        "set_corner": found.corner if found else (0.0, 0.0, 0.0),
        "set_edge": found.edge if found else 1.0,
    }
