"""A scene that moves, for tests of the window's timeline."""

from __future__ import annotations

from typing import Any

from clfractal.viewer.studio import Studio
from tests.viewer.panel_harness import make_ui

MOVING = """# A film
version: 1
formula: {name: mandelbulb, iterations: 6}
image: {width: 96, height: 64}
camera: {position: [0, -3, 0.5], fov: 45}  # as it stands
renderer: {samples: 1}
animation:
  fps: 20
  frames: 41
  tracks:
    camera.position:  # a quarter of the way round
      keys:
        - {frame: 0, value: [0, -3, 0.5]}
        - {time: 2.0, value: [3, 0, 0.5]}
    formula.parameters.power: {expression: "8 + sin(2*pi*u)"}
    camera.fov: {keys: [{frame: 0, value: 30}, {frame: 10, value: 60}], interpolation: linear}
"""


STILL = MOVING.partition("animation:")[0]


def studio_of(text: str = MOVING, frame: float | None = 0) -> Studio:
    """A studio that renders nothing, at a frame."""
    studio = make_ui(text)[0].studio
    if frame is not None:
        assert studio.go_to_frame(frame)
    return studio


def keys(studio: Studio, name: str) -> dict[float, Any]:
    animation = studio.scene.animation
    assert animation is not None
    return {animation.frame_of(key): key.value for key in animation.tracks[name].keys or ()}
