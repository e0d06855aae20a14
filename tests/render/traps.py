"""Orbit traps, and the distances to them in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.formulas import reference
from clfractal.scene.model import Scene
from clfractal.shading.kind_numbers import TRAPS
from tests.render.shots import PERSPECTIVE
from tests.scenes import scene_of

Floats = npt.NDArray[np.float64]

TRAP: dict[str, Any] = {"center": [0.1, -0.2, 0.3], "direction": [1.0, 2.0, -2.0], "radius": 0.4}

TRAP_FORMULAS: dict[str, dict[str, Any]] = {
    "hast": {"name": "hast"},
    "mandelbulb": {"name": "mandelbulb"},
    "quaternion_julia": {"name": "quaternion_julia", "julia": [-0.2, 0.6, 0.2, 0.2]},
}


def trap_scene(name: str) -> Scene:
    formula = {**TRAP_FORMULAS[name], "iterations": 6}
    return scene_of(formula, PERSPECTIVE, coloring={"by": "trap", "trap": TRAP})


def trap_distances(z: npt.ArrayLike) -> list[float]:
    """From a point in z to the shapes of TRAP, in the order of TRAPS."""
    offset, axis = np.asarray(z) - TRAP["center"], np.array(TRAP["direction"]) / 3
    reach, along = float(np.linalg.norm(offset)), float(offset @ axis)
    found = {
        "point": reach,
        "axis": float(np.linalg.norm(np.cross(offset, axis))),
        "plane": abs(along),
        "sphere": abs(reach - TRAP["radius"]),
    }
    return [found[shape] for shape in TRAPS]


def trap_by_numpy(scene: Scene, points: Floats) -> Floats:
    """Smallest distance of z_1, z_2, ... to each shape of TRAP, shape (4, n)."""
    chain, backend = scene.chain, reference.NumpyBackend()
    result = np.full((4, len(points)), np.inf)
    with np.errstate(all="ignore"):
        for index, point in enumerate(points):
            place = [np.float64(x) for x in reference.space_to_state(chain, list(point), backend)]
            z = [np.float64(0.0) for _ in place] if chain.add == "point" else list(place)
            for n in range(scene.formula.iterations):
                if np.linalg.norm(z) > chain.bailout:
                    break
                bound = chain.link_at(n).bound
                z = reference.apply(bound, z, reference.constant_of(bound, place), backend)
                result[:, index] = np.minimum(result[:, index], trap_distances(z[:3]))
    return result
