"""Lane counts: tried in children that may crash, and remembered; and the measured peak."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from clfractal.device import cache, child, tune
from clfractal.device.peak import fma_peak
from clfractal.device.select import Device, has_float64
from clfractal.errors import DeviceError
from tests.portability.lane_counts import accepted_in_use, counts_in_use

pytestmark = pytest.mark.conformance

_HERE = "tests.device.test_tune"


def rigged_job(request: dict[str, Any]) -> dict[str, Any]:
    """A trial in which 4 lanes compute nonsense."""
    return {"fault": "nonsense" if request["lanes"] == 4 else ""}


def wide_numbers_job(request: dict[str, Any]) -> dict[str, Any]:
    """A trial in which float64 computes nonsense."""
    return {"fault": "nonsense" if request["precision"] == "float64" else ""}


@pytest.fixture
def _rigged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tune, "PROBE", f"{_HERE}:rigged_job")


def test_this_device_computes_rightly_with_every_accepted_lane_count(
    device: Device, empty_cache: Path
) -> None:
    """At least scalars and small packets must work anywhere."""
    counts = counts_in_use(device)
    assert {1, 4, 8}.intersection(counts) <= set(accepted_in_use(device, "float32"))
    if has_float64(device.info):
        assert tune.lane_reports(device, "float64", (4 if 4 in counts else 1,))[0].fault == ""


@pytest.mark.usefixtures("_rigged")
def test_a_lane_count_that_computes_nonsense_or_aborts_is_left_out(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(child.TEST_ABORT, "trying 16 lanes")
    assert tune.accepted_lanes(device, "float32") == (1, 8)
    reports = tune.lane_reports(device, "float32", (4, 16))
    assert reports[0].fault == "nonsense"
    assert not reports[1].accepted
    assert "the driver aborted (signal 6) while trying 16 lanes" in reports[1].fault


@pytest.mark.usefixtures("_rigged")
def test_a_trial_is_remembered(device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    first = tune.lane_reports(device, "float32", on_start=told.append)
    assert told == [f"measuring {device.info.name}, once"]
    monkeypatch.setenv(child.TEST_ABORT, "trying")
    assert tune.lane_reports(device, "float32", on_start=told.append) == first
    assert len(told) == 1
    facts = cache.recall("lanes")
    assert len(facts) == 4
    assert all(key.startswith(device.info.key) for key in facts)


def test_each_number_type_has_its_own_trials(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tune, "PROBE", f"{_HERE}:wide_numbers_job")
    both = Device(dataclasses.replace(device.info, has_float64=True), device.cl_device)
    for _ in range(2):  # tried, then remembered
        assert tune.accepted_lanes(both, "float32") == (1, 4, 8, 16)
        assert tune.accepted_lanes(both, "float64") == ()
    assert len(cache.recall("lanes")) == 8


def test_a_device_without_float64_says_so(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lesser = Device(dataclasses.replace(device.info, has_float64=False), device.cl_device)
    for question in (tune.accepted_lanes, fma_peak):
        with pytest.raises(DeviceError, match=r"has no float64$") as caught:
            question(lesser, "float64")
        assert caught.value.status == 2


def test_the_peak_is_a_rate(device: Device) -> None:
    """No timing is tested, only that the chains are not folded away: that would give millions of GFLOP/s."""
    assert 1e-6 < fma_peak(device, "float32") < 1e6
