"""Bodies of glass and other media, far from the set and at its place."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

import clfractal
from clfractal.scene.model import Scene
from tests.render.path_scenes import GREY, path, scene_of

Floats = npt.NDArray[np.float64]

BODIES: dict[str, dict[str, Any]] = {
    "sphere": {"type": "sphere", "radius": 1},
    "box": {"type": "box", "size": [1.6, 1.2, 1], "rotation": [20, 10, 30]},
    "cylinder": {"type": "cylinder", "radius": 0.8, "height": 1.2, "rotation": [30, 0, 0]},
}

# The scene's set, where it is not looked at.
FAR_OFF = {"position": [0, 40, 0], "target": [0, 44, 0], "fov": 30}


def glass(roughness: float = 0, ior: float = 1.5, **transmission: Any) -> dict[str, Any]:
    return {"specular": {"roughness": roughness, "ior": ior}, "transmission": {"weight": 1, **transmission}}


def scene(objects: dict[str, Any], materials: dict[str, Any], **sections: Any) -> Scene:
    """Objects about (0, 44, 0), far from the set."""
    moved = {
        name: {**each, "position": np.add(each.get("position", [0, 0, 0]), [0, 44, 0]).tolist()}
        for name, each in objects.items()
    }
    bounces = sections.pop("bounces", 48)
    return scene_of(
        objects=moved,
        materials=materials,
        lighting=path(bounces),
        image={"width": 32, "height": 32},
        **{"background": GREY, "camera": FAR_OFF, **sections},
    )


def colors_of(found: Scene, samples: int, **options: Any) -> Floats:
    """The picture's colours, shape (height, width, 3)."""
    found = found.model_copy(update={"renderer": found.surface.model_copy(update={"samples": samples})})
    film = clfractal.render(found, **options)
    return np.stack([film[name] for name in "RGB"], axis=-1).astype(np.float64)


def ball(roughness: float, ior: float = 1.5, *, bounces: int = 48, **sections: Any) -> Scene:
    """A ball of radius 1 of glass; `transmission` has more of it."""
    clear = {"weight": 1, **sections.pop("transmission", {})}
    material = {"base": {"color": [1, 1, 1]}, "specular": {"roughness": roughness, "ior": ior}}
    return scene_of(
        materials={"glass": {**material, "transmission": clear}},
        material={"name": "glass"},
        lighting=path(bounces),
        image={"width": 32, "height": 32},
        **{"background": GREY, **sections},
    )
