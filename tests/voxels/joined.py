"""Sets that are joined of several objects, and which points belong to them in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject
from tests.voxels.grids import inside

Floats = npt.NDArray[np.float64]

SPONGE = {
    "type": "formula",
    "formula": {"name": "menger_sponge", "iterations": 4},
    "scale": 0.4,
    "position": [0, 1.2, 0.8],
    "rotation": [20, 0, 45],
}
JULIA = {
    "type": "formula",
    "formula": {"name": "quaternion_julia", "iterations": 20},
    "scale": 0.6,
    "position": [0.9, 0.9, -0.8],
    "rotation": [-30, 50, 10],
}
EVERY_JOIN: dict[str, Any] = {
    "egg": {
        "type": "sphere",
        "radius": 0.6,
        "position": [1.2, 0, 0.4],
        "scale": [1, 0.7, 1.2],
        "rotation": [10, 20, 30],
    },
    "box": {"type": "box", "size": [1, 0.6, 0.5], "position": [-1.2, 0, -0.4], "rotation": [30, 20, 0]},
    "hole": {"type": "cylinder", "radius": 0.3, "height": 4, "rotation": [15, 0, 0], "join": "cut"},
    "all": {"type": "sphere", "radius": 1.8, "position": [0, 0.2, -0.1], "join": "intersection"},
    "floor": {"type": "plane", "position": [0, 0, -1.5], "normal": [0.1, 0, 1]},
    "sponge": SPONGE,
    "julia": JULIA,
    "mould": {**JULIA, "scale": 0.5, "position": [-0.5, -0.6, 0.5], "join": "cut"},
}


def own_places(each: Any, at: Floats) -> Floats:
    """Points in an object's own space: a formula's, or units of a solid's half sides."""
    places = [
        np.array(each.own_place(tuple(point))) for point in np.vstack([np.zeros(3), np.eye(3)]).tolist()
    ]
    found: Floats = places[0] + at @ (np.array(places[1:]) - places[0])
    return found


def held_by(each: Any, at: Floats) -> npt.NDArray[np.bool_]:
    """Which points are in a simple solid."""
    if each.type == "plane":
        below: npt.NDArray[np.bool_] = (at - each.position) @ np.array(each.normal) < 0
        return below
    own = np.abs(own_places(each, at))
    low = own[..., 2] < 1
    if each.type == "box":
        return np.asarray((own < 1).all(axis=-1))
    if each.type == "cylinder":
        return np.asarray(low & (np.linalg.norm(own[..., :2], axis=-1) < 1))
    return np.asarray(np.linalg.norm(own, axis=-1) < 1)


def belongs(scene: Scene, at: Floats) -> npt.NDArray[np.bool_]:
    """Which points belong to the scene's joined set, one object after the other."""
    found = inside(scene.chain, at, scene.formula.iterations)
    for name, each in scene.joined.items():
        if isinstance(each, FormulaObject):
            more = inside(scene.joined_chains[name], own_places(each, at), each.formula.iterations)
        else:
            more = held_by(each, at)
        if each.join == "cut":
            found &= ~more
        elif each.join == "intersection":
            found &= more
        else:
            found |= more
    return found
