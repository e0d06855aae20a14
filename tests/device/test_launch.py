"""Launches in parts, once for every thing; work-groups as large as a device takes them; lane counts."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl
import pytest

from clfractal.device import cache, child, groups, launch, tune
from clfractal.device.launch import run_in_parts
from clfractal.device.peak import fma_peak
from clfractal.device.program import build, math_flags
from clfractal.device.select import Device, choose, has_float64
from clfractal.errors import DeviceError
from tests.portability.lane_counts import accepted_in_use, counts_in_use
from tests.portability.pictures import TINY_SIZE, picture

TEXT = """
__kernel void count(__global int *times, int first, int count) {
    const int thing = first + (int)get_global_id(1);
    if (thing < count) times[thing * 4 + get_global_id(0)] += 1;
}
"""


class Counter:
    """A kernel that counts how often each thing and item is visited."""

    def __init__(self, device: Device, things: int) -> None:
        self.device, self.things = device, things
        self.kernel = build(device, TEXT, flags=math_flags("float32"), isolated=False).kernel("count")
        zeros = np.zeros(max(4 * things, 4), np.int32)
        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        self.buffer = cl.Buffer(device.context, flags, hostbuf=zeros)
        self.kernel.set_args(self.buffer, np.int32(0), np.int32(things))

    def run(self, **options: Any) -> npt.NDArray[np.int32]:
        run_in_parts(self.device, self.kernel, 1, self.things, doing="counting", items=4, **options)
        found = np.empty(max(4 * self.things, 4), np.int32)
        cl.enqueue_copy(self.device.queue, found, self.buffer)
        return found[: 4 * self.things]


@pytest.mark.parametrize("things", [0, 1, 7, 1000, 100_000])
@pytest.mark.parametrize(("group", "first_part"), [((1, 1), 1), ((2, 16), 5), ((4, 1), 40_000)])
def test_every_thing_is_visited_once(
    device: Device, things: int, group: tuple[int, int], first_part: int
) -> None:
    told: list[int] = []
    counter = Counter(device, things)
    found = counter.run(group=group, first_part=first_part, done=told.append)
    assert (found == 1).all()
    assert told == sorted(told)
    assert (told[-1] if told else 0) == things


def test_parts_grow_to_their_time_and_no_further(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launch, "MOST_GROUPS", 300)
    told: list[int] = []
    Counter(device, 2000).run(first_part=10, done=told.append)
    parts = np.diff([0, *told])
    # Two are under way before the first is timed.
    assert parts[0] == parts[1] == 10
    assert 80 <= parts.max() <= 300


def test_an_interrupt_ends_the_parts(device: Device) -> None:
    told: list[int] = []

    def stop(done: int) -> None:
        told.append(done)
        raise KeyboardInterrupt

    counter = Counter(device, 1000)
    with pytest.raises(KeyboardInterrupt):
        counter.run(first_part=10, done=stop)
    assert told == [10]
    device.queue.finish()


# --- work-groups ---


def fitting(group: tuple[int, ...], most: int, longest: tuple[int, ...]) -> tuple[int, ...]:
    """Of a device with these limits."""
    device: Any = SimpleNamespace(cl_device=SimpleNamespace(max_work_item_sizes=list(longest)))
    kernel: Any = SimpleNamespace(get_work_group_info=lambda what, of: most)
    return groups.fitting(device, kernel, group)


@pytest.mark.parametrize(
    ("group", "most", "longest", "expected"),
    [
        ((32, 8), 256, (1024, 1024, 64), (32, 8)),
        ((1, 16), 1024, (1024, 1, 1), (1, 1)),  # Apple's CPU device
        ((32, 8), 1024, (1024, 1, 1), (32, 1)),
        ((32, 8), 64, (1024, 1024, 64), (8, 8)),
        ((64, 1), 1, (4096, 4096, 4096), (1, 1)),
        ((64,), 32, (16, 16, 16), (16,)),
        ((1, 64), 0, (0, 0, 0), (1, 1)),  # nonsense of a driver
    ],
)
def test_as_large_as_the_device_takes(
    group: tuple[int, ...], most: int, longest: tuple[int, ...], expected: tuple[int, ...]
) -> None:
    assert fitting(group, most, longest) == expected


@pytest.mark.parametrize("name", ["mandelbox", "coverage"])
def test_pictures_do_not_depend_on_groups(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A surface, and a volume with all that fills it."""
    device = choose()
    usual = picture(device, name, "float32", TINY_SIZE)
    asked = []

    def one_dimension(device: Any, kernel: Any) -> tuple[int, tuple[int, ...]]:
        asked.append(kernel.function_name)
        return 2, (1024, 1, 1)

    monkeypatch.setattr(groups, "_limits", one_dimension)
    device.loaded.clear()  # and with them the kernels that know their groups
    assert np.array_equal(picture(device, name, "float32", TINY_SIZE), usual, equal_nan=True)
    device.loaded.clear()
    assert len(set(asked)) >= {"mandelbox": 1, "coverage": 3}[name]


# --- lane counts, and the measured peak ---


_HERE = "tests.device.test_launch"


def rigged_job(request: dict[str, Any]) -> dict[str, Any]:
    """A trial in which 4 lanes compute nonsense."""
    return {"fault": "nonsense" if request["lanes"] == 4 else ""}


def wide_numbers_job(request: dict[str, Any]) -> dict[str, Any]:
    """A trial in which float64 computes nonsense."""
    return {"fault": "nonsense" if request["precision"] == "float64" else ""}


@pytest.fixture
def _rigged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tune, "PROBE", f"{_HERE}:rigged_job")


@pytest.mark.conformance
def test_this_device_computes_rightly_with_every_accepted_lane_count(
    device: Device, empty_cache: Path
) -> None:
    """At least scalars and small packets must work anywhere."""
    counts = counts_in_use(device)
    assert {1, 4, 8}.intersection(counts) <= set(accepted_in_use(device, "float32"))
    if has_float64(device.info):
        assert tune.lane_reports(device, "float64", (4 if 4 in counts else 1,))[0].fault == ""


@pytest.mark.conformance
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


@pytest.mark.conformance
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


@pytest.mark.conformance
def test_each_number_type_has_its_own_trials(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tune, "PROBE", f"{_HERE}:wide_numbers_job")
    both = Device(dataclasses.replace(device.info, has_float64=True), device.cl_device)
    for _ in range(2):  # tried, then remembered
        assert tune.accepted_lanes(both, "float32") == (1, 4, 8, 16)
        assert tune.accepted_lanes(both, "float64") == ()
    assert len(cache.recall("lanes")) == 8


@pytest.mark.conformance
def test_a_device_without_float64_says_so(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lesser = Device(dataclasses.replace(device.info, has_float64=False), device.cl_device)
    for question in (tune.accepted_lanes, fma_peak):
        with pytest.raises(DeviceError, match=r"has no float64$") as caught:
            question(lesser, "float64")
        assert caught.value.status == 2


@pytest.mark.conformance
def test_the_peak_is_a_rate(device: Device) -> None:
    """No timing is tested, only that the chains are not folded away: that would give millions of GFLOP/s."""
    assert 1e-6 < fma_peak(device, "float32") < 1e6
