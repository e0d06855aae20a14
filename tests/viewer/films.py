"""A scene that moves, for tests of the window's timeline."""

from __future__ import annotations

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
