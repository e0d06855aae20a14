"""Materials of one lobe or several, and directions to look at them from."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.scene.materials import PbrMaterial
from tests.render.material_kernel import turned

Floats = npt.NDArray[np.floating[Any]]

WHITE: dict[str, Any] = {"color": [1, 1, 1]}

NO_GLOSS = {"weight": 0}

LOBES: dict[str, dict[str, Any]] = {
    "lambert": {"base": WHITE, "specular": NO_GLOSS},
    "rough body": {"base": {**WHITE, "diffuse_roughness": 1}, "specular": NO_GLOSS},
    "gloss": {"base": WHITE, "specular": {"roughness": 0.3}},
    "rough gloss": {"base": {**WHITE, "diffuse_roughness": 0.4}, "specular": {"roughness": 0.9, "ior": 2.2}},
    "weak gloss": {"base": WHITE, "specular": {"roughness": 0.5, "weight": 0.3}},
    "metal": {"base": {**WHITE, "metalness": 1}, "specular": {"roughness": 0.4}},
    "rough metal": {"base": {**WHITE, "metalness": 1}, "specular": {"roughness": 1}},
    "half metal": {"base": {**WHITE, "metalness": 0.5}, "specular": {"roughness": 0.6}},
    "coat": {"base": WHITE, "specular": NO_GLOSS, "coat": {"weight": 1, "roughness": 0.3}},
    "coated metal": {
        "base": {**WHITE, "metalness": 1},
        "specular": {"roughness": 0.5},
        "coat": {"weight": 0.7, "roughness": 0.2},
    },
    "fuzz": {"base": WHITE, "specular": NO_GLOSS, "fuzz": {"weight": 1}},
    "all": {
        "base": {**WHITE, "metalness": 0.3, "diffuse_roughness": 0.5},
        "specular": {"roughness": 0.4},
        "coat": {"weight": 0.6, "roughness": 0.5},
        "fuzz": {"weight": 0.5, "roughness": 0.3},
    },
}

COSINES = (0.1, 0.35, 0.7, 1.0)


def material(values: dict[str, Any]) -> PbrMaterial:
    found: PbrMaterial = PbrMaterial.model_validate(values)
    return found


def toward(cosine: float) -> Floats:
    """A direction with this cosine to the normal, not along an axis."""
    sine = math.sqrt(1 - cosine * cosine)
    return turned(np.array([[0.6 * sine, 0.8 * sine, cosine]]))


def hemisphere(cosines: int = 400, angles: int = 400) -> tuple[Floats, float]:
    """Middles of cells of equal solid angle over the normal, and that angle."""
    z = (np.arange(cosines) + 0.5) / cosines
    phi = 2 * math.pi * (np.arange(angles) + 0.5) / angles
    level = np.sqrt(1 - z * z)
    local = np.stack(
        np.broadcast_arrays(level[:, None] * np.cos(phi), level[:, None] * np.sin(phi), z[:, None])
    )
    return turned(local.reshape(3, -1).T), 2 * math.pi / (cosines * angles)


def numbers(count: int) -> Floats:
    from scipy.stats import qmc

    return np.asarray(np.clip(qmc.Sobol(3, seed=5).random(count), 1e-6, 1 - 1e-6))
