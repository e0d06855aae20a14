"""Things that shine over a white floor, seen from below them."""

from __future__ import annotations

from typing import Any

import numpy as np

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import Floats, shoot, stacked
from tests.scenes import scene_of

SIZE = (24, 24)
# From below what shines above, down to the floor.
CAMERA = {"position": [0.1, -0.05, 0.45], "target": [0.1, -0.05, 0], "up": [0, 1, 0], "fov": 120}
BLACK = {"top": [0, 0, 0], "bottom": [0, 0, 0]}
FLOOR = {"type": "plane", "material": "white"}
COLOR = np.array([1, 0.5, 0.25])
DULL = {"weight": 0}
GLOW = {"base": {"color": [0, 0, 0]}, "specular": DULL, "emission": {"luminance": 6, "color": COLOR.tolist()}}
# The same light as a map, which is sought.
EVEN = {"by": "height", "curve": [[0, 6], [1, 6]]}
BY_CHANCE = {**GLOW, "emission": {"luminance": EVEN, "color": COLOR.tolist()}}
MATERIALS = {"white": {"base": {"color": [1, 1, 1]}, "specular": DULL}, "glow": GLOW}


def lit(
    objects: dict[str, Any], samples: int, bounces: int = 0, camera: Any = CAMERA, **sections: Any
) -> Scene:
    """Objects over a white floor, in their own light."""
    values: dict[str, Any] = {
        "lights": [],
        "background": BLACK,
        "lighting": {"mode": "path", "bounces": bounces, "roulette": bounces},  # less noise
        "materials": MATERIALS,
        "objects": {"floor": FLOOR, **objects},
        "renderer": {"samples": samples, "detail": 0.1},
        **sections,
    }
    return scene_of(NOWHERE, camera, SIZE, **values)


def colors(scene: Scene, device: Device, **settings: Any) -> Floats:
    return stacked(shoot(scene, device, **settings), ("R", "G", "B")).astype(float)


def blocks(picture: Floats) -> Floats:
    """Means of blocks of 6 x 6 pixels."""
    return np.asarray(picture.reshape(4, 6, 4, 6, -1).mean(axis=(1, 3)))
