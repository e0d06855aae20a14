"""A ball in the light of paths, and what is seen of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

import clfractal
from clfractal.scene.model import Scene
from tests.scenes import sections_of

Floats = npt.NDArray[np.float64]

BALL = {"name": "quaternion_julia", "iterations": 12, "julia": [0, 0, 0, 0]}

BLACK = {"top": [0, 0, 0], "bottom": [0, 0, 0]}

GREY = {"top": [1, 1, 1], "bottom": [1, 1, 1]}


def scene_of(**sections: Any) -> Scene:
    """A ball of radius 1 in 48 x 48 pixels, unless the sections say otherwise."""
    usual: dict[str, Any] = {
        "formula": BALL,
        "camera": {"position": [0, -4, 0], "fov": 40},
        "size": (48, 48),
        "lights": [],
        "background": BLACK,
    }
    return clfractal.Scene(**sections_of(**{**usual, **sections}))


def seen(scene: Scene, samples: int, **options: Any) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
    """Colours, shape (n, 3), and normals of the pixels that see the set wholly; and which pixels these are."""
    renderer = scene.surface.model_copy(update={"samples": samples})
    channels = ("R", "G", "B", "A", "N.X", "N.Y", "N.Z")
    film = clfractal.render(scene.model_copy(update={"renderer": renderer}), channels=channels, **options)
    whole = np.asarray(film["A"]) == 1
    colors = np.stack([film[name] for name in "RGB"], axis=-1).astype(np.float64)
    normals = np.stack([film[f"N.{axis}"] for axis in "XYZ"], axis=-1).astype(np.float64)
    return colors[whole], normals[whole], whole


def path(bounces: int = 0, **values: Any) -> dict[str, Any]:
    return {"mode": "path", "bounces": bounces, **values}
