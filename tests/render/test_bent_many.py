"""Light of many lamps, which stand in a tree, that clear bodies bend: beside that of one lamp, and chance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.scene.model import Scene
from clfractal.shading.emitter_tree import shining_of
from clfractal.shading.light_tree import lamps_of
from tests.render.bent_scenes import (
    ALBEDO,
    INDEX,
    assert_as_by_chance,
    light_of,
    pool,
    transmittance,
    under_ball,
)

MANY = 20
PLACES = [
    [0.9 * np.cos(each), 0.9 * np.sin(each), 1.3 + 0.3 * np.cos(2 * each)]
    for each in np.arange(MANY) * 2 * np.pi / MANY
]


def test_many_lamps_at_one_place_bring_the_light_of_one_through_water() -> None:
    """As in `test_bent_light.py`, where one lamp of their strength is over the floor."""
    lamp = {"type": "point", "position": [0, 0, 0.8], "falloff": "inverse_square", "intensity": 2 / MANY}
    scene = pool([lamp] * MANY)
    assert len(lamps_of(scene).nodes) > 0
    found = light_of(scene, 4)
    expected = ALBEDO * 2 * transmittance(1.0) / (0.8 + 1 / INDEX) ** 2 / INDEX**2
    np.testing.assert_allclose(found.max(), expected, rtol=0.01)


def under_many(lights: list[dict[str, Any]], bounces: int, **objects: Any) -> Scene:
    """A ball of glass over a floor, with lamps, and with more objects."""
    scene = under_ball(lights, [0, -2.5, 1], [0, 0, -0.8], 40, bounces).model_dump(
        mode="json", exclude_unset=True
    )
    scene["objects"] |= objects
    scene["materials"] |= {
        "white": {"base": {"color": [ALBEDO] * 3}, "specular": {"weight": 0}},
        "shines": {"base": {"weight": 0}, "specular": {"weight": 0}, "emission": {"luminance": 1}},
    }
    return Scene.model_validate(scene)


BALLS = {
    f"lamp {number}": {
        "type": "sphere",
        "radius": 0.1,
        "position": [float(x) for x in place],
        "material": "shines",
    }
    for number, place in enumerate(PLACES)
}
LAMPS = [
    {"type": "sphere", "radius": 0.1, "position": [float(x) for x in place], "intensity": 0.2 + 0.05 * number}
    for number, place in enumerate(PLACES)
]


@pytest.mark.light
@pytest.mark.parametrize("many", ["lamps", "objects"])
def test_no_light_of_many_lamps_is_lost_or_counted_twice(many: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same light as by chance on the whole, and less noise."""
    scene = under_many(LAMPS, 8) if many == "lamps" else under_many([], 8, **BALLS)
    assert len(lamps_of(scene).nodes) + len(shining_of(scene).nodes) > 0
    own, chance = assert_as_by_chance(scene, 64, monkeypatch)
    # At equal samples.
    assert own / 4 < chance


def test_beside_lights_on_the_set_no_light_is_counted_twice() -> None:
    """Very weak ones change nothing: they are left to chance behind glass, and chains find all others as without them."""
    lamp = {"type": "point", "falloff": "inverse_square", "position": [1.8, 0, 2], "intensity": 2}
    weak = {
        "type": "set",
        "trap": {"shape": "plane", "center": [0, 0, 0]},
        "threshold": 0.4,
        "count": 40,
        "radius": 0.05,
        "intensity": 1e-6,
    }
    # A ball of radius 1 at the origin, and one of glass beside it, over the floor.
    scene = under_many([], 6).model_dump(mode="json", exclude_unset=True)
    scene["formula"] = {"name": "quaternion_julia", "iterations": 6, "julia": [0, 0, 0, 0]}
    scene["objects"]["ball"]["position"] = [1.8, 0, 0]
    scene["camera"] |= {"position": [1.8, -1.5, 0], "target": [1.8, 0, -0.8], "fov": 10}
    found, alone = (
        light_of(Scene.model_validate({**scene, "lights": lights}), 32) for lights in ([lamp, weak], [lamp])
    )
    np.testing.assert_allclose(found.mean(), alone.mean(), rtol=0.003)
