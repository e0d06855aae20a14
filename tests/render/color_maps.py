"""Colours that a map gives, and a set that has many of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def ramp(place: Floats, stops: list[list[float]]) -> Floats:
    at = np.linspace(0, 1, len(stops))
    return np.stack([np.interp(place, at, [stop[i] for stop in stops]) for i in range(3)], axis=-1)


BULB: dict[str, Any] = {
    "formula": {"name": "mandelbulb", "iterations": 7},
    "camera": {"position": [1.3, -2.6, 0.5], "fov": 50},
}
