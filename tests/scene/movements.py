"""Scenes that move, and the values of their tracks."""

from __future__ import annotations

from typing import Any

from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from tests.scenes import scene_of

HEAD = """\
version: 1
formula: {name: mandelbulb, iterations: 8}
camera: {position: [0, -3, 0.5], fov: 45}
"""


def moving(tracks: dict[str, Any], *, base: dict[str, Any] | None = None, **animation: Any) -> Scene:
    given: dict[str, Any] = {"fps": 10, "frames": 21, "tracks": tracks, **animation}
    usual: dict[str, Any] = {"camera": {"position": [0, -3, 0]}, "size": None}
    return scene_of(**{**usual, **(base or {}), "animation": given})


def values(scene: Scene, name: str) -> list[Any]:
    assert scene.animation is not None
    return [movement_of(scene).values(frame)[name] for frame in range(scene.animation.count)]
