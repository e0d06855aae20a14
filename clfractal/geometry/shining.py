"""The records of things that shine, which stand behind the objects (`kernels/shading/emitters.h`)."""

from __future__ import annotations

import numpy as np

from clfractal.device.orbit import SHAPE_KINDS, Record
from clfractal.scene.model import Scene
from clfractal.schema.base import Vector
from clfractal.shading.emitter_tree import shining_of
from clfractal.shading.emitters import Emitter


def luminance_of(radiance: Vector) -> float:
    """The luminance of linear Rec. 709."""
    return float(np.dot(radiance, (0.2126, 0.7152, 0.0722)))  # ITU-R BT.709-6, item 3.2


def shining_records(scene: Scene, objects: Record) -> Record:
    """Of each of `shining_of` a record like those of objects: by its own shape, or as the ball in which it is sought.

    Args:
        objects: the objects' own records, in the order of the scene.
    """
    shining = shining_of(scene).emitters
    found = np.zeros(len(shining), objects.dtype)
    convex = {
        thing
        for thing, (name, each) in enumerate(scene.objects.items(), start=1)
        if getattr(each, "spans", 2) == 1 and name not in scene.joined
    }
    for index, each in enumerate(shining):
        if each.thing:
            found[index] = objects[each.thing - 1]
        row = found[index]
        row["convex"] = int(each.thing in convex)
        if each.ball is not None:
            _as_ball(row, each)
        row["thing"], row["sought"] = each.thing, int(each.sought)
        row["radiance"] = (1.0, 1.0, 1.0) if each.sought else each.radiance
        row["luminance"] = luminance_of(each.radiance)
    return found


def _as_ball(row: np.void, each: Emitter) -> None:
    assert each.ball is not None
    center, radius = each.ball
    row["kind"], row["middle"], row["form"], row["spans"] = SHAPE_KINDS["sphere"], center, 0.0, 1
    row["sides"] = radius
    for name, axis in zip(("own_x", "own_y", "own_z"), np.eye(3) / radius, strict=True):
        row[name] = axis
