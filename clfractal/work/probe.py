"""The job that measures a lane count by rendering, for devices where a simple kernel tells too little.

Where the compiler vectorises across work-items by itself, how well it manages depends on the kernel: Intel's runtime is
fastest with one lane on short loops, and with sixteen on a whole renderer.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from clfractal.device import probe, tune
from clfractal.device.select import DeviceInfo, by_key, vectorises_across_work_items
from clfractal.pictures.film import Film
from clfractal.renderers.plan import make_plan
from clfractal.scene.load import load_scene
from clfractal.work.loop import render_one

JOB = "clfractal.work.probe:lanes_job"
_SIDE = 256
_RENDERS = 4
_SCENE = f"""\
version: 1
formula: {{name: mandelbulb, iterations: 60}}
image: {{width: {_SIDE}, height: {_SIDE}}}
camera: {{position: [0, -2.6, 0.6]}}
"""


def probe_for(info: DeviceInfo) -> str:
    """The job that measures lanes on a device."""
    return JOB if vectorises_across_work_items(info) and info.kind == "cpu" else tune.DEFAULT_PROBE


def lanes_job(request: Mapping[str, Any]) -> dict[str, Any]:
    """As `device.probe.lanes_job`, whose checks come first, but `milliseconds` are those of a picture."""
    answer = probe.lanes_job(request)
    if answer["fault"]:
        return answer
    device = by_key(*request["device"])
    scene = load_scene(_SCENE)
    plan = make_plan(scene, precision=request["precision"], lanes=int(request["lanes"]))
    times = []
    for _ in range(_RENDERS):
        film = Film(plan.channels, (_SIDE, _SIDE), plan.region)
        times.append(render_one(scene, plan, device, film).kernel_ms)
    return {**answer, "milliseconds": max(min(times), 1e-3)}
