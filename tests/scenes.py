"""Small scenes of a formula, a camera and whatever else a test wants."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene

# Squaring the quaternion x + iy + jz squares its length, so after n applications |z| <= 4 is the ball of radius
# 4^(2^-n) exactly.
BALL_ITERATIONS = 8


def scene_of(
    formula: Mapping[str, Any],
    camera: Mapping[str, Any],
    size: tuple[int, int] = (64, 64),
    **sections: Any,
) -> Scene:
    """A scene of a whole `formula` section, or of an inline formula (with enough iterations for a ball)."""
    if "map" in formula:
        formula = {"inline": dict(formula), "iterations": BALL_ITERATIONS}
    image = {"width": size[0], "height": size[1]}
    return load_scene(
        {"version": 1, "formula": dict(formula), "image": image, "camera": dict(camera), **sections}
    )
