"""Small scenes for windows: quick to render, and each with what a renderer's pictures may depend on."""

from __future__ import annotations

SURFACE = """# A bulb
version: 1
formula: {name: mandelbulb, iterations: 7}
image: {width: 360, height: 240}  # not the window's
camera: {position: [1.25, -2.05, 0.85], fov: 50}
renderer: {samples: 3}
lights:
  - {direction: [0.95, 0.6, -0.85], color: [1.0, 0.80, 0.56], intensity: 1.7}
  - {direction: [-1.0, -0.45, -0.15], color: [0.25, 0.5, 1.0], intensity: 1.2}
material: {ambient: 0.02, diffuse: 0.9, specular: 0.3, shininess: 35}
coloring: {by: iterations, palette: viridis, scale: 0.3}
background: {top: [0.06, 0.10, 0.28], bottom: [0.413, 0.275, 0.33]}
output: {exposure: 0.5}
"""

SPHERE = """version: 1
formula: {name: quaternion_julia, julia: [0, 0, 0, 0], iterations: 12}
image: {width: 480, height: 360}
camera: {position: [0, -3, 0], fov: 60}
renderer: {samples: 1}
"""
"""The unit sphere: squares of quaternions stay bounded within it. So what lies under a pixel is known."""

VOLUME = """version: 1
formula: {name: mandelbulb, iterations: 5}
camera: {position: [1.25, -2.05, 0.85], fov: 50}
renderer:
  type: volume
  box: {size: 2.6}
  resolution: 32
  samples: 2
"""

CUT_PLANE = """version: 1
formula: {name: hast, iterations: 60}
camera: {}
renderer:
  type: cut_plane
  plane: {center: [-0.75, 0, 0], width: 3.6, height: 2.4}
  samples: 2
"""

LAYOUT = """version: 1
formula: {name: hast, iterations: 10}
image: {width: 400, height: 240}
camera: {position: [-0.6, -3, 1.2], target: [-0.5, 0, 0]}
cut_planes:
  - plane: {center: [-0.6, 0, 0], width: 2.6, height: 2.6}
    opacity: 0.4
renderer: {samples: 1}
layout:
  columns: 2
  views:
    - {}
    - renderer: {type: cut_plane, plane: {center: [-0.6, 0, 0], width: 2.6, height: 2.6}, samples: 1}
"""
"""The thesis's cut plane: the object with its transparent plane on the left, the cut on the right."""
