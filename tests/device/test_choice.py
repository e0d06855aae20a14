"""Several devices by their names, and parts of a device."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.device import choice
from clfractal.device.choice import choose_all
from clfractal.device.select import ENVIRONMENT_VARIABLE, Device, choose
from clfractal.device.subdevices import without_parts
from clfractal.errors import DeviceError
from tests.halves import halves_of, index_of


@given(st.text(max_size=20), st.lists(st.integers(0, 999), min_size=1, max_size=5))
def test_parts_are_read(name: str, counts: list[int]) -> None:
    spec = f"{name}/{'+'.join(map(str, counts))}"
    assert without_parts(spec) == (name.strip(), tuple(counts))


@given(st.text(max_size=30).filter(lambda text: "/" not in text))
def test_other_names_have_no_parts(name: str) -> None:
    assert without_parts(name) == (name, ())


def test_halves(device: Device) -> None:
    spec = halves_of(device)
    parts = choose_all([spec])
    assert [part.info.index for part in parts] == [f"{spec}#1", f"{spec}#2"]
    assert sum(part.info.compute_units for part in parts) == device.info.compute_units
    assert [int(part.cl_device.max_compute_units) for part in parts] == [
        part.info.compute_units for part in parts
    ]
    assert {part.info.key for part in parts} == {device.info.key}
    assert choose_all([spec]) == parts  # with the contexts that they have


def test_one_part_is_one_device(device: Device) -> None:
    halves_of(device)
    assert choose(f"{device.info.index}/1").info.compute_units == 1


def test_the_variable_may_name_several(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, halves_of(device))
    assert len(choose_all()) == 2
    with pytest.raises(DeviceError, match="--device: names several devices, but this work takes one"):
        choose()


def test_all_has_one_driver_of_the_processor(device: Device) -> None:
    found = choose_all(["all"])
    assert sum(each.info.kind == "cpu" for each in found) <= 1
    assert len({each.info.index for each in found}) == len(found)
    assert found[0].info == choose("").info


@pytest.mark.parametrize(
    ("specs", "message"),
    [
        (
            ["{0}", "{0}"],
            "--device: {0} is named twice; parts of a device are named together, such as {0}/1+1",
        ),
        (["{0}", "{kind}"], "--device: {0} and {kind} are the same device, {0}"),
        (["{0}/1", "{0}"], "--device: {0}/1 and {0} share the device {0}; name its parts together"),
        (["{0}", "all"], "--device: all stands alone: it names every device"),
        (["{0}", "no such device"], "unknown device 'no such device'; available: "),
        (["{0}/1000"], "has {units} compute units, but 1000 are wanted"),
        (["{0}/0+1"], "a part needs at least 1 compute unit, got 0+1"),
        (["all/1"], "--device: names several devices"),
    ],
)
def test_wrong_names(specs: list[str], message: str, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    halves_of(device)
    # `cpu` names the best one, which need not be the one under test.
    monkeypatch.setattr(choice, "choose", lambda spec: device if spec == device.info.kind else choose(spec))
    facts = {"kind": device.info.kind, "units": device.info.compute_units}
    index = index_of(device)
    with pytest.raises(DeviceError) as caught:
        choose_all([spec.format(index, **facts) for spec in specs])
    assert caught.value.status == 2
    assert message.format(index, **facts) in str(caught.value)
