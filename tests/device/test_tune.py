"""Lane counts: tried in children that may crash, remembered, overridden; and the measured peak."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from clfractal.device import cache, child, select, tune
from clfractal.device.peak import fma_peak
from clfractal.device.select import Device, has_float64
from clfractal.errors import DeviceError

pytestmark = pytest.mark.conformance

_HERE = "tests.device.test_tune"


def rigged_job(request: dict[str, Any]) -> dict[str, Any]:
    """A probe in which 4 lanes compute nonsense, the fastest of all, and 8 are the best of the others."""
    lanes = request["lanes"]
    speed = {1: 10.0, 4: 99.0, 8: 30.0, 16: 20.0}[lanes]
    fault = "nonsense" if lanes == 4 else ""
    return {"milliseconds": 1 / speed, "points_per_second": speed, "fault": fault}


def failing_job(request: dict[str, Any]) -> dict[str, Any]:
    return {"milliseconds": 1.0, "points_per_second": 1.0, "fault": "nonsense"}


@pytest.fixture(autouse=True)
def _no_override(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(tune.LANES_VARIABLE, raising=False)


def _claim(monkeypatch: pytest.MonkeyPatch, vectorises: bool) -> None:
    monkeypatch.setattr(tune, "vectorises_across_work_items", lambda info: vectorises)


def test_this_device_computes_rightly_with_every_accepted_lane_count(
    device: Device, empty_cache: Path
) -> None:
    """At least scalars and small packets must work anywhere."""
    accepted = tune.accepted_lanes(device, "float32")
    assert {1, 4, 8} <= set(accepted)
    assert tune.best_lanes(device, "float32") in accepted
    if has_float64(device.info):
        assert tune.lane_reports(device, "float64", (8,))[0].fault == ""


@pytest.mark.parametrize("vectorises", [False, True])
def test_the_fastest_that_works_is_best(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch, vectorises: bool
) -> None:
    _claim(monkeypatch, vectorises)
    probe = f"{_HERE}:rigged_job"
    assert tune.accepted_lanes(device, "float32", probe=probe) == (1, 8, 16)
    best = 1 if vectorises and device.info.kind == "gpu" else 8
    assert tune.best_lanes(device, "float32", probe=probe) == best


def test_a_lane_count_on_which_the_driver_aborts_is_left_out(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _claim(monkeypatch, False)
    monkeypatch.setenv(child.TEST_ABORT, "trying 16 lanes")
    probe = f"{_HERE}:rigged_job"
    assert tune.best_lanes(device, "float32", probe=probe) == 8
    report = tune.lane_reports(device, "float32", (16,), probe=probe)[0]
    assert not report.accepted
    assert "the driver aborted (signal 6) while trying 16 lanes" in report.fault


def test_narrow_packets_are_tried_where_wide_ones_fail(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _claim(monkeypatch, False)
    monkeypatch.setattr(tune, "_promising", lambda device: ((4,), (1,)))
    assert tune.best_lanes(device, "float32", probe=f"{_HERE}:rigged_job") == 1


def test_no_lane_count_works(device: Device, empty_cache: Path) -> None:
    with pytest.raises(DeviceError, match=r"no kernel works on this device: \d+ lanes: nonsense$") as caught:
        tune.best_lanes(device, "float32", probe=f"{_HERE}:failing_job")
    assert caught.value.status == 3
    assert len(caught.value.details.splitlines()) == 4


def test_a_measurement_is_remembered(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    probe = f"{_HERE}:rigged_job"
    first = tune.lane_reports(device, "float32", probe=probe, on_start=told.append)
    assert told == [f"measuring {device.info.name}, once"]
    monkeypatch.setenv(child.TEST_ABORT, "trying")
    assert tune.lane_reports(device, "float32", probe=probe, on_start=told.append) == first
    assert len(told) == 1
    facts = cache.recall("lanes")
    assert len(facts) == 4
    assert all(key.startswith(device.info.key) for key in facts)


def test_the_speed_of_the_best_lanes_is_remembered(device: Device, empty_cache: Path) -> None:
    best = tune.best_lanes(device, "float32")
    report = tune.lane_reports(device, "float32", (best,))[0]
    assert cache.recall(select.SPEEDS) == {device.info.key: report.points_per_second}


def test_the_environment_variable(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    for lanes in tune.LANE_COUNTS:
        monkeypatch.setenv(tune.LANES_VARIABLE, str(lanes))
        assert tune.best_lanes(device, "float32", probe="never:called") == lanes
    for wrong in ("2", "-1", "eight", "08"):
        monkeypatch.setenv(tune.LANES_VARIABLE, wrong)
        message = f"CLFRACTAL_LANES must be one of 1, 4, 8, 16, got '{wrong}'"
        with pytest.raises(DeviceError, match=message) as caught:
            tune.best_lanes(device, "float32")
        assert caught.value.status == 2


def test_a_device_without_float64_says_so(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lesser = Device(dataclasses.replace(device.info, has_float64=False), device.cl_device)
    for question in (tune.accepted_lanes, tune.best_lanes, fma_peak):
        with pytest.raises(DeviceError, match=r"has no float64$") as caught:
            question(lesser, "float64")
        assert caught.value.status == 2


def test_the_peak_is_a_rate(device: Device) -> None:
    """No timing is tested, only that the chains are not folded away: that would give millions of GFLOP/s."""
    assert 1e-6 < fma_peak(device, "float32") < 1e6
