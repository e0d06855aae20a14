"""A camera with two eyes and a plane before it, with the geometry to check them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.scene.stereo import EyeName

Floats = npt.NDArray[np.float64]

SIDES: tuple[EyeName, EyeName] = ("left", "right")

CAMERA: dict[str, Any] = {
    "position": [1.0, -4.0, 2.0],
    "target": [0.2, 0.1, -0.3],
    "up": [0.1, 0.0, 1.0],
    "fov": 50.0,
}


def dot(a: Floats, b: Floats) -> float:
    return float((a * b).sum())


def unit(vector: Any) -> Floats:
    return np.asarray(np.array(vector, float) / np.linalg.norm(vector))


# Neither of length 1 nor perpendicular.
PLANE: dict[str, Any] = {
    "center": [0.3, -0.1, 0.2],
    "normal": [0.5, -2, 1],
    "up": [0.3, 0.1, 2],
    "width": 3.0,
}
