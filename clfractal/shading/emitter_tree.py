"""Many things that shine stand in a tree, like lamps; paths go down from its root (`light_tree.h`)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.scene.model import Scene
from clfractal.schema.shape import Ball, Solid
from clfractal.shading import light_tree
from clfractal.shading.emitters import Emitter, emitters_of
from clfractal.shading.light_tree import LUMINANCE, NODE_NUMBERS

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]

# Of a body without hollows the mean of what it shows from all sides is a quarter of its surface (Cauchy): this times the
# sum of the products of half its sides, by how many of its axes are rounded. (Exact for boxes, cylinders and balls, about
# so for cones and tori.)
_SHOWN = (2.0, 2.0, math.pi / 2, math.pi / 3)


@dataclass(frozen=True, slots=True, eq=False)
class Shining:
    """What shines, in the order of its records.

    Attributes:
        emitters: those that are weighed one by one, then those of the tree.
        single: how many the former are.
        nodes: of the tree, shape (n, NODE_NUMBERS).
    """

    emitters: tuple[Emitter, ...]
    single: int
    nodes: Floats


def shining_of(scene: Scene) -> Shining:
    """The things that shine; more than MOST_WEIGHED that have an end stand in a tree."""
    return scene.derived(_shining)


def _shining(scene: Scene) -> Shining:
    found = emitters_of(scene)
    ends = [(each, row) for each in found if (row := _leaf(scene, each)) is not None]
    if len(ends) <= light_tree.MOST_WEIGHED:
        return Shining(found, len(found), np.zeros((0, NODE_NUMBERS), np.float32))
    near = {each.thing for each, _ in ends}
    far = [each for each in found if each.thing not in near]
    order, nodes = light_tree.tree(np.array([row for _, row in ends]))
    nodes[:, 19] += len(far)
    return Shining((*far, *(ends[number][0] for number in order)), len(far), nodes)


def _leaf(scene: Scene, each: Emitter) -> Doubles | None:
    """What a node of one thing says, as `light_tree.leaves`; None if it has no end."""
    reach, shown = np.zeros(3), 0.0
    ball: Ball
    if each.ball is not None:
        ball = each.ball
        reach[:], shown = ball[1], math.pi * ball[1] ** 2
    else:
        it = list(scene.objects.values())[each.thing - 1]
        if not isinstance(it, Solid):
            return None
        ball, axes = (it.position, it.reach), np.array(it.axes)
        reach[:] = np.linalg.norm(axes, axis=0)
        x, y, z = np.linalg.norm(axes, axis=1)
        shown = _SHOWN[it.rounded] * float(x * y + y * z + z * x)
    middle = np.array(ball[0])
    row = np.zeros(NODE_NUMBERS)
    row[0:3], row[3] = middle, ball[1]
    row[4] = shown * float(LUMINANCE @ each.radiance)
    row[6:12] = 0, 0, 1, -1, 0, 1
    row[12:15], row[15:18] = middle - reach, middle + reach
    return row


def emitter_fields(scene: Scene, begin: int) -> dict[str, object]:
    """What the settings of a march say of them.

    Args:
        begin: the number of the tables at which the tree's nodes begin.
    """
    found = shining_of(scene)
    return {
        "emitter_count": len(found.emitters),
        "single_emitters": found.single,
        "emitter_nodes": len(found.nodes),
        "emitter_tree": begin,
    }
