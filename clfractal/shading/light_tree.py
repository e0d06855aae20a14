"""A tree of lamps, in which paths choose one by where they are, and find those that they meet.

Each node says where its lamps stand, how strong they are, and where they shine to (Conty Estevez and Kulla 2018,
Importance Sampling of Many Lights with Adaptive Tree Splitting). Nodes stand depth first: the first child behind its
parent, and the second where the first one's nodes end. `kernels/shading/light_tree.h` reads them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.schema.base import unit
from clfractal.schema.light import SingleLight

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]

MOST_WEIGHED = 16
"""So many lamps are weighed one by one at each place; more stand in a tree."""
NODE_NUMBERS = 21
"""Middle and radius of a ball; strength with and without distance; axis, cosine and sine of the angle about it in which
lamps shine as along their own axes, cosine of what they shine beyond it; lowest and highest corner of a box; number of the
node behind its last one; number of its first lamp; whether rays meet any of them."""
ALL_AROUND = 2.0
"""In the place of the last cosine of the root: all lamps shine all around, so that no node has to be asked for its axis."""
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # ITU-R BT.709-6, item 3.2
# Boxes are wider by so much of their coordinates and size, since float32 rounds them.
_WIDER = 4e-7
_AFAR = 1e9


@dataclass(frozen=True, slots=True, eq=False)
class Lamps:
    """A scene's lights with records of their own, in the order of these.

    Attributes:
        lights: those that are weighed one by one, then those of the tree.
        single: how many the former are.
        nodes: of the tree, shape (n, NODE_NUMBERS).
    """

    lights: list[SingleLight]
    single: int
    nodes: Floats


def single_lights(scene: Scene) -> list[SingleLight]:
    """The lights that have records of their own, as the scene has them."""
    return [light for light in scene.lights if isinstance(light, SingleLight)]


def lamps_of(scene: Scene) -> Lamps:
    """The lights; along paths more than MOST_WEIGHED that have a place stand in a tree."""
    return scene.derived(_lamps)


def _lamps(scene: Scene) -> Lamps:
    lights = single_lights(scene)
    near = [light for light in lights if light.stands_at is not None]
    if not isinstance(scene.lighting, PathLighting) or len(near) <= MOST_WEIGHED:
        return Lamps(lights, len(lights), np.zeros((0, NODE_NUMBERS), np.float32))
    far = [light for light in lights if light.stands_at is None]
    order, nodes = tree(leaves(near, [_most(scene, light) for light in near]))
    nodes[:, 19] += len(far)
    return Lamps([*far, *(near[number] for number in order)], len(far), nodes)


def _most(scene: Scene, light: SingleLight) -> float:
    """The most that a light's table tells, or 1."""
    if light.reads is None:
        return 1.0
    return light.most_of(scene.light_tables[light.tag, light.reads].numbers.tolist())


def leaves(lights: list[SingleLight], most: list[float]) -> Doubles:
    """What nodes of single lamps say, in the order of NODE_NUMBERS, but for where they stand in the tree.

    Args:
        most: factors on the lamps' strengths.
    """
    rows = np.zeros((len(lights), NODE_NUMBERS))
    for row, light, factor in zip(rows, lights, most, strict=True):
        place = light.stands_at
        assert place is not None
        bright = factor * math.pi * light.intensity * float(LUMINANCE @ light.used_color)
        row[0:3], reach = place, np.array(light.extent)
        row[3] = np.linalg.norm(reach)
        if light.weakens:
            row[4] = bright * light.given(_AFAR) * _AFAR**2
        else:
            row[5] = bright
        axis, even, beyond = light.beam or ((0.0, 0.0, 1.0), math.pi, 0.0)
        row[6:9] = unit(axis)
        row[9:12] = math.cos(even), math.sin(even), math.cos(beyond)
        row[12:15], row[15:18] = place - reach, place + reach
        row[20] = light.is_seen
    return rows


def tree(rows: Doubles) -> tuple[list[int], Floats]:
    """The order of lamps, and the nodes, from their leaves."""
    order: list[int] = []
    nodes: list[Doubles] = []
    # What is to be written: lamps as indices, depth first; or a node whose children are written.
    todo: list[npt.NDArray[np.intp] | int] = [np.arange(len(rows))]
    while todo:
        each = todo.pop()
        if isinstance(each, int):
            nodes[each][18] = len(nodes)
        elif len(each) == 1:
            node = rows[each[0]].copy()
            node[18:20] = len(nodes) + 1, len(order)
            nodes.append(node)
            order.append(int(each[0]))
        else:
            node = _united(rows[each])
            node[19] = len(order)
            first, second = _split(rows, each)
            todo += [len(nodes), second, first]
            nodes.append(node)
    found = np.array(nodes)
    if rows[:, 9].max() <= -1:
        found[0, 11] = ALL_AROUND
    # (A box may be flat.)
    wide = _WIDER * (np.abs(found[:, 12:18]).max(axis=1) + found[:, 3])[:, None]
    found[:, 12:15] -= wide
    found[:, 15:18] += wide
    return order, np.ascontiguousarray(found, np.float32)


def _split(rows: Doubles, here: npt.NDArray[np.intp]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Lamps in two, along the longest side of their middles: where strengths by areas are least in all."""
    middles = rows[here, 0:3]
    axis = int(np.argmax(np.ptp(middles, axis=0)))
    here = here[np.argsort(middles[:, axis], kind="stable")]
    if len(here) == 2:
        return here[:1], here[1:]
    low, high = rows[here, 12:15], rows[here, 15:18]
    bright = rows[here, 4] + rows[here, 5] + 1e-30
    costs = np.zeros(len(here) - 1)
    for way in (slice(None), slice(None, None, -1)):
        sides = np.maximum.accumulate(high[way]) - np.minimum.accumulate(low[way])
        one = np.cumsum(bright[way]) * (sides**2).sum(axis=1)
        costs += one[:-1] if way == slice(None) else one[:-1][::-1]
    # (Lamps at one place cost nothing, however they are cut.)
    cut = int(np.argmin(costs)) + 1 if np.ptp(costs) > 0 else len(here) // 2
    return here[:cut], here[cut:]


def _united(rows: Doubles) -> Doubles:
    """A node of these lamps."""
    node = np.zeros(NODE_NUMBERS)
    low, high = rows[:, 12:15].min(axis=0), rows[:, 15:18].max(axis=0)
    node[0:3] = (low + high) / 2
    node[3] = np.linalg.norm(high - low) / 2
    node[4:6] = rows[:, 4:6].sum(axis=0)
    axes = rows[:, 6:9]
    axis = axes.sum(axis=0)
    size = np.linalg.norm(axis)
    axis = axis / size if size > 1e-9 else np.array([0.0, 0.0, 1.0])
    off = np.arccos(np.clip(axes @ axis, -1, 1)) + np.arctan2(rows[:, 10], rows[:, 9])
    even = min(float(off.max()), math.pi)
    node[6:9] = axis
    node[9:12] = math.cos(even), math.sin(even), rows[:, 11].min()
    node[12:15], node[15:18] = low, high
    node[20] = rows[:, 20].max()
    return node


def tree_fields(scene: Scene, begin: int) -> dict[str, object]:
    """What settings of a march or of a volume say of a scene's lamps.

    Args:
        begin: the number of the tables at which the tree's nodes begin.
    """
    found = lamps_of(scene)
    return {
        "light_count": len(found.lights),
        "single_lights": found.single,
        "tree_nodes": len(found.nodes),
        "light_tree": begin,
    }
