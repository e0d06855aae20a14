"""Orbits of a million applications: cancelled launches end early where the device sees what the host writes."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

import clfractal
from clfractal.device.cancel import CancelToken
from clfractal.device.orbit import ORBIT
from clfractal.device.select import Device, sees_host_writes
from clfractal.device.watched import CANCELLED, Watched, is_watched
from clfractal.engine.engine import Engine
from clfractal.errors import Stopped
from clfractal.formulas.catalog import load_chain
from clfractal.integrators import points
from clfractal.integrators.lanes import best_lanes
from clfractal.integrators.passes import SAMPLING
from tests.engine.small_pictures import equal

LONG = """
version: 1
formula: {name: hast, iterations: 1000000}
image: {width: 96, height: 96}
camera: {position: [0, -2.5, 0.3]}
"""
RENDERERS = {
    "surface": "renderer: {}\n",
    "steps": "renderer: {search: steps}\n",
    "plane": "renderer: {type: cut_plane, plane: {width: 3, height: 3}, periodicity: false}\n",
}


def test_which_records_are_watched() -> None:
    assert is_watched(np.zeros(2, ORBIT.dtype("float32")))
    assert is_watched(np.zeros((), SAMPLING.dtype("float64")))
    assert not is_watched(np.zeros(2))


def test_the_flag_reaches_the_device(device: Device) -> None:
    import pyopencl as cl

    if not sees_host_writes(device.info):
        pytest.skip(f"{device.info.name} does not see what the host writes while a kernel runs")
    records = np.zeros(3, ORBIT.dtype("float32"))
    records["iterations"] = 7
    watched = Watched(device, records)
    for cancelled in (True, False):
        watched.cancel(cancelled)
        found = np.empty_like(records)
        cl.enqueue_copy(device.queue, found, watched.buffer)
        assert (found[CANCELLED] == int(cancelled)).all()
        assert (found["iterations"] == 7).all()


@pytest.mark.parametrize("kind", RENDERERS)
def test_a_cancel_ends_long_orbits(kind: str, device: Device) -> None:
    """Whole launches would take minutes. (Bounds are far above the milliseconds that it takes on an idle machine.)"""
    if not sees_host_writes(device.info):
        pytest.skip(f"{device.info.name} does not see what the host writes while a kernel runs")
    scene = clfractal.load_scene(LONG + RENDERERS[kind])
    short = scene.model_copy(update={"formula": scene.formula.model_copy(update={"iterations": 20})})
    expected = clfractal.render(short)
    with Engine(device, budget_seconds=0.02) as engine:
        equal(engine.render(short), expected)
        token, asked = CancelToken(), []

        def cancel() -> None:
            asked.append(time.perf_counter())
            token.cancel()

        timer = threading.Timer(0.4, cancel)
        timer.start()
        with pytest.raises(Stopped):
            engine.render(scene, token=token)
        assert time.perf_counter() - asked[0] < 2
        # Nothing of it is left: the next picture is right.
        equal(engine.render(short), expected)


def test_lists_of_points_are_cancelled(device: Device) -> None:
    chain, token = load_chain("hast"), CancelToken()
    places = np.random.default_rng(1).uniform(-0.1, 0.1, (200_000, 3))
    timer = threading.Timer(0.3, token.cancel)
    start = time.perf_counter()
    timer.start()
    lanes = best_lanes(device, "float32")
    with pytest.raises(Stopped):
        points.escape(chain, places, 1_000_000, device=device, lanes=lanes, token=token)
    assert time.perf_counter() - start < 10
    counts, inside = points.escape(chain, places[:100], 50, device=device, lanes=lanes)
    assert inside.all()
    assert (counts == 50).all()
