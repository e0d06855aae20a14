"""Compiling the programs of several scenes at once: compilers run in child processes, one on every core."""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.engine.drawing import Drawing, OutputBuffers
from clfractal.integrators.kept import Resources
from clfractal.integrators.plan import PlannedView
from clfractal.scene.model import Scene
from tests.render.shots import plan_of


def compile_all(scenes: Iterable[Scene], device: Device, precision: Precision = "float32") -> None:
    """Leaves the programs of the scenes in the cache, from where later renders take them."""

    def compile_one(scene: Scene) -> None:
        view = PlannedView(scene, plan_of(scene, device, precision))
        Drawing(device, OutputBuffers(device)).update(view, Resources(device), tiles=1)

    plan_of(next(iter(scenes := list(scenes))), device, precision)  # measures the lanes, once
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        list(pool.map(compile_one, scenes))
