"""Orbit traps, and the distances to them in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.formulas.backends import NumpyBackend
from clfractal.formulas.chain import Chain
from clfractal.formulas.reference import apply, constant_of, start
from clfractal.scene.model import Scene
from clfractal.shading.kind_numbers import TRAPS
from tests.render.levels import orbit
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


def trap_distances(z: npt.ArrayLike) -> Floats:
    """From points (..., 3) in z to the shapes of TRAP, in the order of TRAPS."""
    offset, axis = np.asarray(z) - TRAP["center"], np.array(TRAP["direction"]) / 3
    reach, along = np.linalg.norm(offset, axis=-1), offset @ axis
    found = {
        "point": reach,
        "axis": np.linalg.norm(np.cross(offset, axis), axis=-1),
        "plane": np.abs(along),
        "sphere": np.abs(reach - TRAP["radius"]),
    }
    return np.array([found[shape] for shape in TRAPS])


def trap_by_numpy(scene: Scene, points: Floats) -> Floats:
    """Smallest distance of z_1, z_2, ... to each shape of TRAP, shape (4, n); of points that are within the bailout."""
    result, alive = np.full((len(TRAPS), len(points)), np.inf), np.ones(len(points), bool)
    for z in orbit(scene.chain, points, scene.formula.iterations):
        result = np.where(alive, np.minimum(result, trap_distances(np.stack(z[:3], axis=-1))), result)
        alive &= np.linalg.norm(z, axis=0) <= scene.chain.bailout
    return result


def carried_by_numpy(chain: Chain, points: Floats, applications: int) -> dict[str, Floats]:
    """The carried numbers of points, shape (n,) each, when their orbits end: beyond the bailout, or at the limit."""
    backend = NumpyBackend()
    with np.errstate(all="ignore"):
        state, point = start(chain, points, backend)
        for application in range(applications):
            alive = np.linalg.norm(state[: chain.size], axis=0) <= chain.bailout
            bound = chain.link_at(application).bound
            found = apply(
                bound, state, constant_of(bound, point), backend, number=application, carried=chain.carried
            )
            state = [np.where(alive, new, old) for new, old in zip(found, state, strict=True)]
    return dict(zip(chain.carried, state[chain.size :], strict=True))
