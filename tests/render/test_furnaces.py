"""White sets in a white furnace: of light that goes from wall to wall of a fractal nothing is lost."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clfractal

pytestmark = pytest.mark.light

WHITE = {"top": [1, 1, 1], "bottom": [1, 1, 1]}


@pytest.mark.parametrize(
    ("formula", "position", "bounces", "least"),
    [
        ({"name": "mandelbox", "iterations": 10}, [11, -19, 10], 64, 0.999),
        # Its holes keep light for long: by exact cubes 0.973 of it leaves in 64 bounces, in 256 all but 0.0005;
        # what goes on for so long is rare and weighs much, so that means of these samples are 0.003 off.
        ({"name": "menger_sponge", "iterations": 4}, [1.8, -3, 1.7], 256, 0.99),
    ],
    ids=["mandelbox", "menger_sponge"],
)
def test_a_white_set_is_as_bright_as_its_furnace(
    formula: dict[str, Any], position: list[float], bounces: int, least: float
) -> None:
    """Where the surface, as far as it is known, faces away from a path it has light, too: 2 % of all was lost there."""
    scene = clfractal.Scene(
        version=1,
        formula=formula,
        image={"width": 48, "height": 48},
        renderer={"samples": 24, "firefly_limit": None},
        lighting={
            "mode": "path",
            "bounces": bounces,
            "detail": 1,
        },  # (Finer, more light is caught for longer.)
        lights=[],
        background=WHITE,
        camera={"position": position, "fov": 40},
        materials={"white": {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}},
        material={"name": "white"},
    )
    film = clfractal.render(scene, channels=("R", "G", "B", "A"))
    seen = film["A"] == 1
    mean = np.array([film[name][seen].mean() for name in "RGB"])
    assert seen.mean() > 0.2
    assert (mean > least).all(), mean
    assert (mean < 2 - least).all(), mean
