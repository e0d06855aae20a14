"""Filters: what a pixel sees of an edge is the filter's integral, its light neither more nor less."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.shots import SOLIDS, Floats, shoot
from tests.scenes import scene_of
from tests.variants import one_of

SIDE, DETAIL = 48, 0.01
HALF = 1.2  # of the box's side
FILTERS = [("box", 1.0), ("box", 0.5), ("box", 3.0), ("tent", 2.0), ("tent", 5.0)]
FILTERS += [("blackman_harris", 3.0), ("blackman_harris", 6.0)]


def passed(name: str, place: npt.NDArray[np.floating[Any]]) -> Floats:
    """The part of a filter's area, its width 1, that lies left of places: Harris 1978 for the window of four terms."""
    x = np.clip(place, -0.5, 0.5)
    if name == "box":
        return np.asarray(x + 0.5)
    if name == "tent":
        return np.asarray(np.where(x < 0, 2 * (x + 0.5) ** 2, 1 - 2 * (0.5 - x) ** 2))
    terms = (0.35875, 0.48829, 0.14128, 0.01168)
    waves = [a * np.sin(2 * np.pi * n * x) / (2 * np.pi * n) for n, a in enumerate(terms) if n]
    return np.asarray(0.5 + x + sum(waves) / terms[0])


def from_above(name: str, width: float | None, height: float, up: list[float], samples: int) -> Scene:
    """The box, a square of the side 2 HALF."""
    return scene_of(
        SOLIDS,
        {
            "projection": "orthographic",
            "position": [0, 0, 4],
            "target": [0, 0, 0],
            "up": up,
            "height": height,
        },
        (SIDE, SIDE),
        lights=[],
        renderer={"samples": samples, "filter": name, "filter_width": width, "detail": DETAIL, "seed": 4},
    )


@pytest.mark.parametrize(("name", "width"), FILTERS)
@pytest.mark.parametrize("height", one_of(3.61, 3.3))
def test_profile_of_an_edge(device: Device, name: str, width: float, height: float) -> None:
    """Across an upright or level edge coverage is the filter's integral, but for one sample: of 2^n samples one falls into
    each 2^n-th of the filter's area. The light of the whole square stays."""
    samples = 256
    scene = from_above(name, width, height, [0, 1, 0], samples)
    coverage = shoot(scene, device, channels=("A",))["A"].astype(float)
    pixel = height / SIDE
    places = (np.arange(SIDE) + 0.5) - SIDE / 2
    inner = slice(SIDE // 2 - 4, SIDE // 2 + 4)
    for profile in (coverage[inner].T, coverage[:, inner]):
        least, most = (
            np.subtract(*(passed(name, (side - places) / width) for side in (edge, -edge)))
            for edge in (HALF / pixel, HALF / pixel + 1.1 * DETAIL)
        )
        assert ((least > 0.01) & (least < 0.99)).sum() >= 2 * round(width / 3)
        assert (profile >= least[:, None] - 1.001 / samples).all()
        assert (profile <= most[:, None] + 1.001 / samples).all()
    if (name, width) != ("box", 0.5):  # which leaves gaps between pixels
        assert coverage.sum() * pixel**2 == pytest.approx(4 * (HALF + DETAIL / 2 * pixel) ** 2, rel=1e-3)


@pytest.mark.parametrize(("name", "width"), [("box", 1.0), ("tent", 2.0), ("blackman_harris", 3.0)])
def test_usual_widths(device: Device, name: str, width: float) -> None:
    usual, given = (
        shoot(from_above(name, chosen, 4.0, [0, 1, 0], 8), device, channels=("A",))["A"]
        for chosen in (None, width)
    )
    np.testing.assert_array_equal(usual, given)
