"""The fastest lane count: measured by the march in children that may crash, remembered, overridden."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.device import cache, child, isolate, select, tune
from clfractal.device.select import Device, choose
from clfractal.device.structs import Precision
from clfractal.engine.prepare import prepare
from clfractal.errors import DeviceError
from clfractal.formulas.catalog import load_chain
from clfractal.integrators import lanes
from clfractal.integrators.lanes import best_lanes, is_measured, march_reports, rule_of
from clfractal.integrators.trial import RULES, Marcher, Rule
from clfractal.scene.load import load_scene
from tests.portability.lane_counts import accepted_in_use

pytestmark = pytest.mark.conformance

_HERE = "tests.render.test_lanes_measured"


def working_job(request: dict[str, Any]) -> dict[str, Any]:
    return {"fault": ""}


def failing_job(request: dict[str, Any]) -> dict[str, Any]:
    return {"fault": "nonsense"}


def without_16(request: dict[str, Any]) -> dict[str, Any]:
    return {"fault": "nonsense" if request["lanes"] == 16 else ""}


def without_8(request: dict[str, Any]) -> dict[str, Any]:
    return {"fault": "nonsense" if request["lanes"] == 8 else ""}


def without_8_16(request: dict[str, Any]) -> dict[str, Any]:
    return {"fault": "nonsense" if request["lanes"] > 4 else ""}


_RIGGED = {1: (9, 9), 4: (1, 1), 8: (4, 6), 16: (2, 8)}


def rigged_job(request: dict[str, Any]) -> dict[str, Any]:
    """16 lanes are the fastest by a scalar rule, and 8 by the Jacobian."""
    scalar, jacobian = zip(*(_RIGGED[lanes] for lanes in request["lanes"]), strict=True)
    return {"scalar": scalar, "jacobian": jacobian, "steady": True}


def busy_job(request: dict[str, Any]) -> dict[str, Any]:
    """The same, beside other work."""
    return {**rigged_job(request), "steady": False}


def one_by_one_job(request: dict[str, Any]) -> dict[str, Any]:
    """The driver cannot march with several lane counts in one process."""
    if len(request["lanes"]) > 1:
        raise DeviceError("no more programs")
    return rigged_job(request)


def all_accepted(
    device: Device, precision: str, lane_counts: Sequence[int], **more: object
) -> tuple[tune.LaneReport, ...]:
    return tuple(tune.LaneReport(count, "") for count in lane_counts)


def recorded(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What children do from now on."""
    doings: list[str] = []
    real = isolate.run

    def run(*arguments: Any, doing: str, **more: Any) -> Any:
        if "folder" not in more:  # it calls itself with one
            doings.append(doing)
        return real(*arguments, doing=doing, **more)

    monkeypatch.setattr(isolate, "run", run)
    return doings


@pytest.fixture
def device() -> Device:
    return choose()


@pytest.fixture(autouse=True)
def _of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(lanes.LANES_VARIABLE, raising=False)
    # Before what is there: a Debian in a folder has its packages by this variable.
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parents[2]), prepend=os.pathsep)
    monkeypatch.setenv(cache.ENVIRONMENT_VARIABLE, str(tmp_path / "cache"))


@pytest.fixture
def rigged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tune, "PROBE", f"{_HERE}:working_job")
    monkeypatch.setattr(lanes, "JOB", f"{_HERE}:rigged_job")
    monkeypatch.setattr(tune, "promising", lambda device: ((16, 8), (4, 1)))


@pytest.mark.usefixtures("rigged")
def test_the_fastest_by_each_rule(device: Device) -> None:
    told: list[str] = []
    assert best_lanes(device, "float32", on_start=told.append) == 16
    assert best_lanes(device, "float32", "jacobian", on_start=told.append) == 8
    assert told == [f"measuring {device.info.name}, once"]
    # A pixel by each rule, in 2 ns and in 6 ns.
    assert cache.recall(select.SPEEDS) == {device.info.key: pytest.approx(2 / 8e-9)}


@pytest.mark.usefixtures("rigged")
def test_a_measurement_is_remembered(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    first = march_reports(device, "float32")
    monkeypatch.setenv(child.TEST_ABORT, "lanes")
    lanes._reports.clear()  # in memory: now they come from the file
    assert march_reports(device, "float32") == first
    assert [report.lanes for report in first] == [16, 8]


@pytest.mark.usefixtures("rigged")
def test_what_a_busy_device_tells_is_not_for_ever(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """This process takes what it has found; the next one measures again."""
    with monkeypatch.context() as patch:
        patch.setattr(lanes, "JOB", f"{_HERE}:busy_job")
        assert best_lanes(device, "float32", "jacobian") == 8
        assert is_measured(device, "float32")
        lanes._reports.clear()
        assert not is_measured(device, "float32")
        assert cache.recall(select.SPEEDS) == {}
    march_reports(device, "float32")
    lanes._reports.clear()
    assert is_measured(device, "float32")
    assert device.info.key in cache.recall(select.SPEEDS)


@pytest.mark.usefixtures("rigged")
def test_a_driver_that_can_only_do_one_after_the_other(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No lane count is at fault, and what was measured one by one is not for ever."""
    monkeypatch.setattr(lanes, "JOB", f"{_HERE}:one_by_one_job")
    assert [report.lanes for report in march_reports(device, "float32")] == [16, 8]
    assert best_lanes(device, "float32", "jacobian") == 8
    lanes._reports.clear()
    assert not is_measured(device, "float32")


@pytest.mark.usefixtures("rigged")
def test_a_first_picture_is_not_measured_for(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its lanes fit the registers, and were tried; a process keeps them, the next one has those that were measured."""
    told: list[str] = []
    with monkeypatch.context() as patch:
        patch.setattr(lanes, "JOB", "never:called")
        first = best_lanes(device, "float32", "jacobian", measures=False, on_start=told.append)
        assert not is_measured(device, "float32")
    wide = device.cl_device.native_vector_width_float
    assert first == (16 if abs(16 - wide) < abs(8 - wide) else 8)
    assert told == [f"measuring {device.info.name}, once"]
    march_reports(device, "float32")
    assert is_measured(device, "float32")
    assert best_lanes(device, "float32", "jacobian") == first
    lanes._in_use.clear()
    lanes._reports.clear()
    assert is_measured(device, "float32")
    assert best_lanes(device, "float32", "jacobian", measures=False) == 8


@pytest.mark.usefixtures("rigged")
@pytest.mark.parametrize(("broken", "left"), [((16,), (8,)), ((8,), (16,)), ((8, 16), (4, 1))])
def test_what_computes_wrongly_is_no_guess(
    device: Device, monkeypatch: pytest.MonkeyPatch, broken: tuple[int, ...], left: tuple[int, ...]
) -> None:
    monkeypatch.setattr(tune, "PROBE", f"{_HERE}:{'_'.join(['without', *map(str, broken)])}")
    wide = device.cl_device.native_vector_width_float
    assert best_lanes(device, "float32", measures=False) == min(left, key=lambda lanes: abs(lanes - wide))


@pytest.mark.usefixtures("rigged")
def test_a_lane_count_on_which_the_driver_aborts_is_left_out(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes those with it that share its process; each is marched with alone then, and the sound ones together."""
    monkeypatch.setenv(child.TEST_ABORT, '"lanes": [16')
    monkeypatch.setattr(tune, "lane_reports", all_accepted)
    monkeypatch.setattr(tune, "promising", lambda device: ((16, 8, 1),))
    with monkeypatch.context() as patch:
        doings = recorded(patch)
        assert best_lanes(device, "float32") == 8
    assert doings == [
        "marching with 16 and 8 and 1 lanes",
        *(f"marching with {lanes} lanes" for lanes in (16, 8, 1)),
        "marching with 8 and 1 lanes",
    ]
    lanes._reports.clear()
    assert [report.lanes for report in march_reports(device, "float32")] == [8, 1]
    facts = cache.recall("marches").values()
    assert {fact["lanes"]: bool(fact["fault"]) for fact in facts} == {16: True, 8: False, 1: False}


@pytest.mark.usefixtures("rigged")
def test_narrow_packets_are_tried_where_wide_ones_fail(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tune, "promising", lambda device: ((8,), (4, 1)))
    monkeypatch.setenv(child.TEST_ABORT, "trying 8 lanes")
    assert best_lanes(device, "float32", "jacobian") == 4


def test_no_lane_count_works(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tune, "PROBE", f"{_HERE}:failing_job")
    with pytest.raises(DeviceError, match=r"no kernel works on this device: \d+ lanes: nonsense$") as caught:
        best_lanes(device, "float32")
    assert caught.value.status == 3
    assert len(caught.value.details.splitlines()) == 4


def test_the_environment_variable(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tune, "PROBE", "never:called")
    for count in tune.LANE_COUNTS:
        monkeypatch.setenv(lanes.LANES_VARIABLE, str(count))
        assert best_lanes(device, "float32") == count
    for wrong in ("2", "-1", "eight", "08"):
        monkeypatch.setenv(lanes.LANES_VARIABLE, wrong)
        message = f"CLFRACTAL_LANES must be one of 1, 4, 8, 16, got '{wrong}'"
        with pytest.raises(DeviceError, match=message) as caught:
            best_lanes(device, "float32")
        assert caught.value.status == 2


def test_a_device_without_float64_says_so(device: Device) -> None:
    lesser = Device(dataclasses.replace(device.info, has_float64=False), device.cl_device)
    with pytest.raises(DeviceError, match=r"has no float64$"):
        best_lanes(lesser, "float64")


def test_formulas_march_by_their_scalar_rule_if_all_have_one() -> None:
    assert rule_of(load_chain("mandelbulb")) == "scalar"
    assert rule_of(load_chain("hast")) == "jacobian"


@pytest.mark.parametrize("rule", RULES)
def test_what_is_marched_is_the_object(device: Device, rule: Rule) -> None:
    """With every lane count the same: rays that meet the set, and places that the light does not reach."""
    met = {
        count: Marcher(device, "float32", count, rule, 64).picture()
        for count in accepted_in_use(device, "float32")
    }
    wanted = next(iter(met.values()))
    hit = wanted[..., 0] > 0
    assert 0.15 < hit.mean() < 0.6
    assert 0.01 < wanted[hit, 1].mean() < 0.6
    assert np.isfinite(wanted).all()
    for found in met.values():
        assert ((found[..., 0] > 0) == hit).mean() > 0.99
        assert np.median(np.abs(found[..., 0] - wanted[..., 0])[hit]) < 1e-4


@pytest.mark.usefixtures("rigged")
@pytest.mark.parametrize(
    ("samples", "pictures", "waits"), [(1, 1, False), (65536, 1, True), (16, 100000, True)]
)
def test_long_work_waits_for_the_measurement(
    device: Device, samples: int, pictures: int, waits: bool
) -> None:
    """Of a film all frames count."""
    scene = load_scene(
        {"version": 1, "formula": {"name": "hast"}, "camera": {}, "image": {"width": 256, "height": 256}}
    )
    job = prepare(scene, device, precision="float32", samples=samples, pictures=pictures)
    assert is_measured(device, "float32") == waits
    assert job.lanes == (8 if waits else tune.first_lanes(device, "float32"))


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_the_job_itself(device: Device, precision: Precision) -> None:
    """Its answer has a time of each lane count by each rule; whether they are steady hangs on the machine."""
    counts = accepted_in_use(device, precision)[-2:]
    request = {"device": [device.info.index, device.info.key], "lanes": counts, "precision": precision}
    answer = lanes.march_job(request)
    assert set(answer) == {*RULES, "steady"}
    assert isinstance(answer["steady"], bool)
    for rule in RULES:
        assert len(answer[rule]) == len(counts)
        assert min(answer[rule]) > 0
