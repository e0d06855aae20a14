"""Rows of the speed table for films: the cost of a frame in a kept engine, compared with its kernel."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping

from clfractal.device.select import Device
from clfractal.engine.engine import Engine
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene

FRAMES = 60
_SIZE = "image: {width: 320, height: 180}\n"
_BULB = f"""\
version: 1
formula: {{name: mandelbulb, parameters: {{power: 8, theta_phase: 0.01}}, iterations: 250}}
{_SIZE}camera: {{position: [0, -3, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 53.13}}
lights: [{{direction: [0.5, 0.6, -0.62], shadow: true}}]
"""
_LIVE = _BULB.replace("power: 8,", "power: 7.5,")
_FOG = f"""\
version: 1
formula: {{name: hast, parameters: {{power: 2}}, iterations: 40}}
{_SIZE}camera: {{position: [-0.8, 2.2, 3.0], target: [-0.5, 0, 0], up: [0, 1, 0], fov: 53.13}}
renderer:
  type: volume
  box: {{center: [-0.3, 0, 0], size: 4}}
  resolution: 256
  transfer: {{opacity: [{{at: 0.2, opacity: 0}}, {{at: 0.8, opacity: 1}}]}}
"""


def _turn(scene: Scene, part: float) -> Scene:
    angle = 2 * math.pi * part
    place = (3 * math.sin(angle), -3 * math.cos(angle), 0.0)
    return scene.model_copy(update={"camera": scene.camera.model_copy(update={"position": place})})


def _parameter(name: str, start: float, width: float) -> Callable[[Scene, float], Scene]:
    def moved(scene: Scene, part: float) -> Scene:
        values = {**scene.formula.parameters, name: start + width * part}
        formula = scene.formula.model_copy(update={"parameters": values})
        return scene.model_copy(update={"formula": formula})

    return moved


def _light(scene: Scene, part: float) -> Scene:
    angle = 2 * math.pi * part
    light = scene.lights[0].model_copy(update={"direction": (math.cos(angle), 0.6, math.sin(angle))})
    return scene.model_copy(update={"lights": (light,)})


def _transfer(scene: Scene, part: float) -> Scene:
    opacity = [{"at": 0.2 + 0.3 * part, "opacity": 0}, {"at": 0.8, "opacity": 1}]
    renderer = scene.renderer.model_copy(update={"transfer": {"opacity": opacity}})
    return scene.model_copy(update={"renderer": renderer})


ROWS: Mapping[str, tuple[str, Callable[[Scene, float], Scene]]] = {
    "frame-camera": (_BULB, _turn),
    "frame-environment": (_BULB + "environment: {name: studio}\n", _turn),
    "frame-parameter": (_BULB, _parameter("theta_phase", 0.01, 0.5)),
    "frame-live-parameter": (_LIVE, _parameter("power", 7.5, 1.0)),
    "frame-light": (_BULB, _light),
    "frame-transfer": (_FOG, _transfer),
}
"""By row: a scene, and how it changes from frame to frame; its part of the film goes from 0 to 1."""


def frame_times(name: str, device: Device) -> tuple[float, float]:
    """Medians of a frame's milliseconds on the device and for the caller, without preparations before the first."""
    text, change = ROWS[name]
    scene = load_scene(text)
    frames = [change(scene, number / FRAMES) for number in range(FRAMES)]
    kernels, walls, beside = [], [], []
    told: list[float] = []
    with Engine(device) as engine:
        for frame in [*frames[:2], *frames]:
            start = time.perf_counter()
            engine.render(frame, lambda state: told.append(state.kernel_ms))
            walls.append(1e3 * (time.perf_counter() - start))
            kernels.append(told[-1])
            beside.append(walls[-1] - kernels[-1])
    kernel_ms = statistics.median(kernels[2:])
    return kernel_ms, kernel_ms + statistics.median(beside[2:])
