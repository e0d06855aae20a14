"""Light that water and balls of glass bend: beside closed forms, and beside what paths find by chance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.render.bent_scenes import (
    ALBEDO,
    GLASS,
    INDEX,
    assert_as_by_chance,
    light_of,
    pool,
    transmittance,
    under_ball,
)
from tests.variants import one_of

TOWARD = np.array([0.5, 0.3, -1.0])
SUN = {"type": "directional", "direction": TOWARD.tolist(), "intensity": 3}
LAMP = {"type": "sphere", "position": [0.6, -0.8, 0.7], "radius": 0.4, "intensity": 5}
PANEL = {
    "type": "rectangle",
    "position": [-0.5, 0, 0.8],
    "direction": [0.3, 0, -1],
    "width": 0.8,
    "height": 0.5,
    "intensity": 6,
}
# A lamp in the water, whose light leaves it, as seen on a wall over it.
SUNK = {"type": "sphere", "position": [0, 0.2, -0.5], "radius": 0.35, "intensity": 5}
BALL = {"type": "sphere", "position": [0.3, -0.4, 0.7], "radius": 0.35, "material": "shines"}


def test_a_floor_under_flat_water_has_the_suns_light() -> None:
    """A sun without a size, which no path meets. Radiance in water is told over the square of its index."""
    cosine = 1 / float(np.linalg.norm(TOWARD))
    expected = ALBEDO * 3 * cosine * transmittance(cosine) / INDEX**2
    found = light_of(pool([SUN]), 4)
    np.testing.assert_allclose(found, expected, rtol=2e-3)


def test_a_point_under_water_has_light_by_the_chains_of_snells_law() -> None:
    """A point light over the water: straight below it, where its image is nearer by the index."""
    height, depth = 0.8, 1.0
    lamp = {"type": "point", "position": [0, 0, height], "falloff": "inverse_square", "intensity": 2}
    found = light_of(pool([lamp]), 4)
    assert found.min() > 0
    # On the axis the light's solid angle on the floor is that of a way of (height + depth / index).
    expected = ALBEDO * 2 * transmittance(1.0) / (height + depth / INDEX) ** 2 / INDEX**2
    np.testing.assert_allclose(found.max(), expected, rtol=0.01)


@pytest.mark.parametrize("distance", [1.0, 1.5, 2.5])
def test_a_place_on_the_axis_of_a_ball_has_a_suns_light_by_its_focal_length(distance: float) -> None:
    """Behind the focus of a ball only the way along the axis leads to a place there, through two boundaries straight on.

    A direction that turns by an angle leaves the ball turned by 1 - distance / focal length times that.
    """
    sun = {"type": "directional", "direction": [0, 0, -1], "intensity": 3}
    scene = under_ball([sun], [0, -1, 0.6 - distance], [0, 0, -distance], 0.2, 0)
    focal = 0.5 * GLASS / (2 * (GLASS - 1))
    passes = (1 - ((GLASS - 1) / (GLASS + 1)) ** 2) ** 2
    np.testing.assert_allclose(
        light_of(scene, 4), ALBEDO * 3 * passes / (1 - distance / focal) ** 2, rtol=0.01
    )


CASES: dict[str, tuple[list[dict[str, Any]], float, dict[str, Any]]] = {
    "sun": ([{**SUN, "angular_size": 30}], -0.4, {}),
    "lamp": ([LAMP], -0.4, {}),
    "panel": ([PANEL], -0.4, {}),
    "ball": ([], -0.4, {"ball": BALL}),
    "sunk": (
        [SUNK],
        1.2,
        {"wall": {"type": "plane", "position": [0, 1.2, 0], "normal": [0, -1, 0], "material": "white"}},
    ),
    "both": ([LAMP, {**SUN, "angular_size": 30}], -0.4, {}),
    "waves": ([LAMP], -0.4, {"height": 0.12}),
    "waves over": (
        [SUNK],
        1.2,
        {
            "height": 0.08,
            "wall": {"type": "plane", "position": [0, 1.2, 0], "normal": [0, -1, 0], "material": "white"},
        },
    ),
}


@pytest.mark.light
@pytest.mark.parametrize("case", one_of("lamp", *(name for name in CASES if name != "lamp")))
def test_no_light_is_lost_or_counted_twice(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lights that are large enough for paths to find them by chance: the same light on the whole, and less noise."""
    lights, eye, objects = CASES[case]
    scene = pool(lights, eye, 12, **objects)
    own, chance = assert_as_by_chance(scene, 32, monkeypatch, 0.01)
    # With a quarter of the samples; a lamp as wide as that under water, and those over waves, are met by
    # chance as well as by chains.
    if "height" not in objects:
        worth = 4.5 if case == "sunk" else 1.0
        assert own < worth * chance


@pytest.mark.light
def test_a_white_floor_under_a_ball_in_a_white_furnace_is_white() -> None:
    """With a ball that shines as all around does, which chains lead to through the one of glass."""
    lamp = {"base": {"weight": 0}, "specular": {"weight": 0}, "emission": {"luminance": 1}}
    glass = {"specular": {"roughness": 0, "ior": GLASS}, "transmission": {"weight": 1}}
    white = {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}
    scene = under_ball(
        [],
        [0, -2.5, 1],
        [0, 0, -0.8],
        40,
        64,
        background={"top": [1, 1, 1], "bottom": [1, 1, 1]},
        materials={"glass": glass, "white": white, "shines": lamp},
        objects={
            "ball": {"type": "sphere", "radius": 0.5, "material": "glass"},
            "lamp": {"type": "sphere", "radius": 0.3, "position": [0.4, 0.3, 1.2], "material": "shines"},
            "floor": {"type": "plane", "position": [0, 0, -0.8], "material": "white"},
        },
    )
    found = np.array([light_of(scene, 64, seed) for seed in range(4)])
    assert abs(found.mean() - 1) < 0.005
    np.testing.assert_allclose(found.mean(axis=0).reshape(3, 4, 3, 4).mean(axis=(1, 3)), 1, atol=0.01)
