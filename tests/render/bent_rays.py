"""Solids of glass over a floor, and rays through them in NumPy, for tests of light that these bend."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.scene.model import Scene
from clfractal.schema.shape import Solid
from tests.render.bent_scenes import under_ball

Floats = npt.NDArray[np.float64]
SHAPES: dict[str, dict[str, Any]] = {
    "box": {"type": "box", "size": [1, 0.8, 0.5], "rotation": [12, 20, 30]},
    "ellipsoid": {"type": "sphere", "radius": 0.5, "scale": [1, 0.7, 0.8], "rotation": [20, 30, 0]},
    "cylinder": {"type": "cylinder", "radius": 0.3, "height": 0.9, "rotation": [70, 0, 20]},
    "cone": {"type": "cone", "radius": 0.5, "top": 0.2, "height": 0.7, "rotation": [15, 10, 0]},
    "torus": {"type": "torus", "rotation": [10, 15, 0]},
}


def under(shape: dict[str, Any], lights: list[dict[str, Any]], size: int = 12, **eye: Any) -> Scene:
    """A solid of glass at the origin over a white floor."""
    view: dict[str, Any] = {"eye": [0, -2.5, 1], "target": [0, 0, -0.8], "fov": 40, "bounces": 8, **eye}
    scene = under_ball(lights, **{**view, "eye": [0, -2.5, 1]}).model_dump(mode="json", exclude_unset=True)
    scene["camera"] |= {"position": view["eye"], "up": [0, 1, 0] if view["eye"][:2] == [0, 0] else [0, 0, 1]}
    scene["objects"]["ball"] = {**shape, "material": "glass"}
    scene["image"] = {"width": size, "height": size}
    return Scene.model_validate(scene)


def transmittance(cosine: Floats, index: float) -> Floats:
    """Of unpolarised light into matter that is denser by an index (Fresnel)."""
    beyond = np.sqrt(np.maximum(1 - (1 - cosine**2) / index**2, 0))
    across = (cosine - index * beyond) / (cosine + index * beyond)
    along = (index * cosine - beyond) / (index * cosine + beyond)
    return np.asarray(np.where(beyond > 0, 1 - (across**2 + along**2) / 2, 0.0))


def marched(solid: Solid, begin: Floats, way: Floats, side: float) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Where rays from outside (1) or inside (-1) come to a solid's surface, and whether they do."""
    at, going = begin.copy(), np.arange(len(begin))
    met = np.zeros(len(begin), bool)
    for _ in range(4000):
        step = side * solid.away(at[going])
        met[going] |= step < 1e-9
        left = (step >= 1e-9) & (abs(at[going]).max(axis=1) < 5)
        going, step = going[left], step[left]
        if not len(going):
            break
        at[going] += step[:, None] * way[going]
    return at, met


def normals(solid: Solid, at: Floats) -> Floats:
    """Outwards, by differences."""
    steps = 1e-6 * np.eye(3)
    slopes = np.stack([solid.away(at + step) - solid.away(at - step) for step in steps], axis=1)
    return np.asarray(slopes / np.linalg.norm(slopes, axis=1, keepdims=True))


def bent(way: Floats, normal: Floats, index: float) -> tuple[Floats, Floats]:
    """Directions beyond a boundary (Snell), of which the normal is against them, and the part that goes there."""
    cosine = -(way * normal).sum(axis=1)
    square = 1 - (1 - cosine**2) / index**2
    turned = way / index + (cosine / index - np.sqrt(np.maximum(square, 0)))[:, None] * normal
    # It is the same from both sides.
    dense = np.where(index > 1, cosine, np.sqrt(np.maximum(square, 0)))
    return turned, np.where(square > 0, transmittance(dense, max(index, 1 / index)), 0.0)
