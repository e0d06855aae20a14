"""What an observer sums: launches and times of stages, and lanes that wait in orbits of others."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.engine.drawing import Drawing
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.observer import Observer
from clfractal.engine.run import Progress, run
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.kernel import Stage
from clfractal.integrators.lanes import best_lanes
from clfractal.integrators.state import state_numbers
from clfractal.integrators.waves import stage_name, surface_stages
from clfractal.scene.model import Scene
from tests.devices import check_usable
from tests.render.shots import job_of, plan_of
from tests.scenes import scene_of
from tests.small_kernels import LOADS, SmallKernels
from tests.variants import one_of

CAMERA = {"position": [1.3, -2.6, 1.6], "target": [0, 0, 0], "fov": 45}
LIGHTS = [{"direction": [-1, 1, -1], "shadow": True}]
BULB = {"name": "mandelbulb", "iterations": 12}
HAST = {"name": "hast", "iterations": 20}


def scene(formula: dict[str, Any], size: tuple[int, int] = (48, 40), **renderer: Any) -> Scene:
    return scene_of(formula, CAMERA, size, lights=LIGHTS, renderer=renderer)


def observed(
    shown: Scene, device: Device, lanes: int, observer: Observer | None
) -> tuple[Progress, Framebuffer]:
    """A picture by an executor of its own, which may have an observer."""
    plan = plan_of(shown, device, lanes=lanes)
    executor = LocalExecutor(device)
    executor.observer = observer
    framebuffer = Framebuffer(plan.channels, (plan.region.width, plan.region.height), plan.region)
    return run(job_of(shown, plan, device), [framebuffer], executor), framebuffer


def test_stages_are_those_that_are_launched(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    shown, lanes = scene(HAST, samples=2), best_lanes(device, "float32")
    plan, launched = plan_of(shown, device, lanes=lanes), Counter[str]()
    enqueue = Drawing._enqueue

    def counted(self: Drawing, of: Any, kernels: Any, stage: Stage, *rest: Any) -> cl.Event:
        launched[stage_name(stage)] += 1
        return enqueue(self, of, kernels, stage, *rest)

    monkeypatch.setattr(Drawing, "_enqueue", counted)
    observer = Observer()
    state, _ = observed(shown, device, lanes, observer)
    sums = observer.stages()
    assert {name: each.launches for name, each in sums.items()} == launched
    assert list(sums) == list(dict.fromkeys(map(stage_name, surface_stages(shown, plan, (0, 2)))))
    assert {"march_rays cone", "march_rays surface", "march_rays shadow"} < set(sums)
    assert all(each.ms > 0 for each in sums.values())
    # The device's clock has its own grain.
    assert sum(each.ms for each in sums.values()) <= 1.01 * state.kernel_ms
    assert observer.state_bytes == 4 * state_numbers(shown, plan)
    assert observer.queue_bytes > 0
    observer.forget()
    assert observer.stages() == {}


@pytest.mark.parametrize(("formula", "renderer"), one_of((HAST, {}), (BULB, {}), (BULB, {"search": "steps"})))
def test_only_lanes_of_packets_wait_and_only_the_observed(
    device: Device, formula: dict[str, Any], renderer: dict[str, Any]
) -> None:
    """A single lane waits for nobody, packets compute what it does, and a picture is the same whoever looks."""
    shown = scene(formula, **renderer)
    alone, _ = observed(shown, device, 1, Observer())
    assert alone.waits == alone.orbit_waits == 0
    narrow, usual = accepted_lanes(device, "float32")[1:2], best_lanes(device, "float32")
    for lanes in {*narrow, usual} - {1}:
        state, seen = observed(shown, device, lanes, Observer())
        assert 0 < state.orbit_waits < (lanes - 1) * state.iterations
        assert state.iterations == pytest.approx(alone.iterations, rel=0.01)
        unseen, plain = observed(shown, device, lanes, None)
        assert unseen.orbit_waits == 0
        assert (unseen.steps, unseen.iterations) == (state.steps, state.iterations)
        for name in plain.channels:
            np.testing.assert_array_equal(seen[name], plain[name], err_msg=name)


def test_a_ray_by_itself_keeps_lanes_without_one_waiting(device: Device) -> None:
    """They wait in the march, for all its steps, and not in orbits."""
    lanes = best_lanes(device, "float32")
    shown = scene(BULB, (1, 1), search="steps")
    state, _ = observed(shown, device, lanes, Observer())
    assert state.steps > 0
    assert state.waits == (lanes - 1) * state.steps
    assert state.orbit_waits == 0


_TEXT = f"""\
#include "device/lanes.h"
{LOADS}
#include "integrators/march/waits.h"

__kernel void waited(__global const scalar *counts, __global const scalar *active, __global scalar *found) {{
    const int lane = (int)get_global_id(0) * LANES;
    const mask waits = orbit_waits(less(R(0.5), load(active + lane)), load(counts + lane));
    store(found + lane, to_reals(waits));
}}
"""


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("lanes", [1, 4, 8, 16])
def test_lanes_wait_for_the_longest_orbit(device: Device, precision: Precision, lanes: int) -> None:
    """Counted in whole applications, for lanes with a ray."""
    check_usable(precision, lanes)
    kernels = SmallKernels(device, _TEXT, precision, lanes)
    random = np.random.default_rng(5)
    active = random.random((60, lanes)) < 0.7
    counts = np.where(active, random.integers(1, 300, (60, lanes)), 0)
    found = kernels.run(
        "waited",
        kernels.planes(counts.reshape(-1)),
        kernels.planes(active.reshape(-1)),
        result := np.zeros(60 * lanes, precision),
        result=result,
    )
    expected = np.where(active, counts.max(axis=1, keepdims=True) - counts, 0)
    np.testing.assert_array_equal(found.reshape(60, lanes), expected)
