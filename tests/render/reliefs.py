"""A ball with a relief, and the normals that it must have."""

from __future__ import annotations

from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt

import clfractal
from clfractal.scene.model import Scene
from tests.render.normals_oracle import unit
from tests.render.path_scenes import GREY, path, scene_of

Floats = npt.NDArray[np.float64]

EYE = np.array([0.0, -4.0, 0.0])

GROUPS = {name: [f"{name}.{axis}" for axis in "XYZ"] for name in ("N", "P", "normal")}
GROUPS |= {"color": ["R", "G", "B"], "iterations": ["iterations"]}


def relief(height: Any, width: float | None = None, **sections: Any) -> Scene:
    """A ball with a relief."""
    bump = {"height": height, "width": width}
    values = {
        "lighting": path(),
        "background": GREY,
        "materials": {"m": {"bump": bump}},
        "material": {"name": "m"},
        "renderer": {"samples": 1, "detail": 0.01},
        **sections,
    }
    return scene_of(**values)


def facts(scene: Scene, **options: Any) -> dict[str, Floats]:
    """The surface's own normals (`N`), places (`P`), the relief's normals (`normal`), colours and counts of pixels that see
    the set wholly, shape (n, 3) each, or (n, 1)."""
    film = clfractal.render(scene, channels=("A", *chain(*GROUPS.values())), **options)
    whole = np.asarray(film["A"]) == 1
    assert whole.sum() > 300
    return {
        name: np.stack([np.asarray(film[each], np.float64)[whole] for each in names], axis=-1)
        for name, names in GROUPS.items()
    }


def displaced(found: dict[str, Floats], gradient: Floats, eye: Floats = EYE) -> Floats:
    """Normals of the surface moved up by a height with that gradient in space, lowered where they turn from the viewer."""
    n = found["N"]
    slope = gradient - n * (n * gradient).sum(axis=-1, keepdims=True)
    toward = unit(eye - found["P"])
    facing, turned = (n * toward).sum(axis=-1), (slope * toward).sum(axis=-1)
    lowered = np.where(turned > 0.9 * facing, 0.9 * facing / np.where(turned > 0, turned, 1), 1.0)
    return unit(n - lowered[:, None] * slope)


def ramp(place: Floats, stops: list[list[float]]) -> Floats:
    """Colours of a palette at places from 0 to 1."""
    at = np.linspace(0, 1, len(stops))
    return np.stack([np.interp(place, at, [stop[i] for stop in stops]) for i in range(3)], axis=-1)


# A set of many colours.
BULB: dict[str, Any] = {
    "formula": {"name": "mandelbulb", "iterations": 7},
    "camera": {"position": [1.3, -2.6, 0.5], "fov": 50},
}
