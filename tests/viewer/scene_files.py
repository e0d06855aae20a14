"""Scenes in files as the window opens and saves them."""

from __future__ import annotations

from typing import Any

from clfractal.files import resources
from clfractal.scene.model import Scene

SCENES = sorted(resources.folder("scenes").glob("*.yaml"))

FORMULA = """\
# The third power
title: Own
variables: [x, y, z]
parameters: {a: {default: 1, minimum: 0, maximum: 2}}
map: [x*x - y*y, 2*a*x*y, z*z]
degree: 2
bounds: {radius: 2}
"""

SCENE = """\
# Mine

version: 1
formula: {file: own.yaml, iterations: 12}  # my own
camera:
  position: [0, -3, 0]  # near
  fov: 30
lights:
  # the key light
  - {direction: [0, 0, -1], intensity: 2}
  # the fill light
  - {direction: [1, 0, 0], shadow: false}
"""


def with_camera(scene: Scene, **values: Any) -> Scene:
    return scene.model_copy(update={"camera": scene.camera.model_copy(update=values)})
