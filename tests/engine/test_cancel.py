"""Cancelling: soon, with the device idle, and the engine ready for the next picture."""

from __future__ import annotations

import threading
import time
from typing import Any

import numpy as np
import pytest

import clfractal
from benchmarks.cancel import waits
from clfractal.cli.bench import HAST
from clfractal.device import isolate, launch
from clfractal.device.cancel import CancelToken
from clfractal.device.launch import Pace
from clfractal.device.select import Device
from clfractal.engine.engine import Engine
from clfractal.errors import Stopped
from tests.engine.small_pictures import BULB, VOLUME, changed, equal


def test_a_token_is_set_by_any_thread() -> None:
    token = CancelToken()
    assert not token.cancelled
    assert not token()
    token.check()
    thread = threading.Thread(target=token.cancel)
    thread.start()
    thread.join()
    assert token.cancelled
    assert token()
    with pytest.raises(Stopped):
        token.check()


def test_cancels_at_random_moments(device: Device) -> None:
    """Ten times looser than `python -m benchmarks.cancel` measures: other tests run beside this one."""
    budget = 0.02
    scene = clfractal.load_scene(HAST, overrides=["image.width=500", "image.height=500"])
    with Engine(device, budget_seconds=budget) as engine:
        found = waits(engine, scene, 20)
        equal(engine.render(changed(BULB)), clfractal.render(changed(BULB)))
    assert np.median(found) < 20 * budget
    assert max(found) < 50 * budget


@pytest.mark.parametrize("text", [BULB, VOLUME])
def test_a_token_that_is_set_starts_nothing(text: str, device: Device) -> None:
    token = CancelToken()
    token.cancel()
    with Engine(device) as engine:
        with pytest.raises(Stopped):
            engine.render(changed(text), token=token)
        equal(engine.render(changed(text)), clfractal.render(changed(text)))


def test_many_samples_of_few_pixels(device: Device) -> None:
    """One tile with 60,000 samples: its samples are split, or nothing could end it."""
    token = CancelToken()
    scene = changed(BULB, "image.width=32", "image.height=32")
    with Engine(device, budget_seconds=0.02) as engine:
        engine.render(scene)
        timer = threading.Timer(0.2, token.cancel)
        start = time.perf_counter()
        timer.start()
        with pytest.raises(Stopped):
            engine.render(scene, samples=60_000, token=token)
        assert time.perf_counter() - start < 5


def test_a_build_is_left(device: Device) -> None:
    """Compiling goes on in a child; who waits for it need not."""
    token = CancelToken()
    # A formula that nobody has compiled, and large.
    formula = "{variables: [x, y, z], map: ["
    terms = " + ".join(f"sin({number}.125 * x) * cos({number}.25 * y)" for number in range(60))
    formula += (
        f"'{terms} + x*x - {time.time_ns() % 10**6}', '2*x*y', '2*x*z'], add: point, degree: 2, bailout: 4,"
    )
    formula += " bounds: {center: [0, 0, 0], radius: 2}}"
    scene = clfractal.load_scene(BULB, overrides=[f"formula={{iterations: 8, inline: {formula}}}"])
    with Engine(device) as engine:
        engine.render(changed(BULB))  # lanes are measured
        timer = threading.Timer(0.3, token.cancel)
        start = time.perf_counter()
        timer.start()
        with pytest.raises(Stopped):
            engine.render(scene, token=token)
        assert time.perf_counter() - start < 3
        engine.render(changed(BULB))
    isolate.end_children()


def test_a_pace_begins_with_what_is_safe_for_the_heaviest() -> None:
    """The last tiles of a picture are light; the first of the next one are not."""
    pace = Pace(10.0, seconds=0.05)
    pace.learn(10, 100)
    assert pace.size == pytest.approx(5)
    for _ in range(10):
        pace.learn(pace.size, 0.1)
    assert pace.size > 1000
    pace.begin()
    assert pace.size == pytest.approx(5)


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_after_an_error_the_device_is_idle(
    error: type[BaseException], device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At once, not when the launches' generator happens to be collected."""
    ended: list[int] = []
    end = launch._end

    def noted(flying: Any, *others: Any) -> None:
        end(flying, *others)
        ended.append(len(flying))

    monkeypatch.setattr(launch, "_end", noted)

    def stop(_: object) -> None:
        raise error

    scene = changed(BULB, "image.width=640", "image.height=480", "renderer.samples=4")
    with Engine(device, budget_seconds=0.001) as engine:
        with pytest.raises(error) as raised:
            engine.render(scene, stop)
        # (The exception is still alive, and with it all frames that it went through.)
        assert raised.value.__traceback__ is not None
        assert ended == [2]
