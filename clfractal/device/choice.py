"""Chooses several devices for one picture, by their names or by their measured speed."""

from __future__ import annotations

import os
from collections.abc import Sequence

from clfractal.device.select import (
    ALL,
    ENVIRONMENT_VARIABLE,
    Device,
    by_key,
    choose,
    devices,
    is_simulator,
)
from clfractal.device.subdevices import without_parts
from clfractal.errors import STATUS_BAD_INPUT, DeviceError, Where

_OPTION = Where("--device")


def choose_all(specs: Sequence[str] = ()) -> tuple[Device, ...]:
    """The devices that are named, in this order, else those of the variable CLFRACTAL_DEVICE, else the best one.

    Each name is as for `select.choose`; `NAME/1+1` are parts of that device, with so many compute units each. `all` are
    all devices, the best first: without simulators, and of several drivers of the processor only the best one.

    Raises:
        DeviceError: status 2 if a name fits nothing, a device or a part of it is named twice, or `all` is not alone;
            else as `select.choose`.
    """
    given = [spec.strip() for spec in specs] or [os.environ.get(ENVIRONMENT_VARIABLE, "").strip()]
    if any(spec.casefold() == ALL for spec in given):
        if len(given) > 1:
            raise _refusal("all stands alone: it names every device")
        return _every()
    found: list[Device] = []
    names: dict[str, str] = {}  # by the index of a whole device: how it was named
    for spec in given:
        name, counts = without_parts(spec)
        whole = choose(name)
        if whole.info.index in names:
            raise _refusal(_twice(whole.info.index, names[whole.info.index], spec))
        names[whole.info.index] = spec
        found += whole.divided(counts) if counts else [whole]
    return tuple(found)


def _twice(index: str, before: str, spec: str) -> str:
    if "/" in before or "/" in spec:
        return f"{before} and {spec} share the device {index}; name its parts together, such as {index}/1+1"
    if before == spec:
        return f"{spec} is named twice; parts of a device are named together, such as {index}/1+1"
    return f"{before} and {spec} are the same device, {index}"


def _every() -> tuple[Device, ...]:
    best = choose("")
    others = [
        by_key(info.index, info.key)
        for info in devices()
        if info.kind != "cpu" and not is_simulator(info) and info.index != best.info.index
    ]
    processors = [info for info in devices() if info.kind == "cpu" and not is_simulator(info)]
    if processors and best.info.kind != "cpu":
        others.append(choose("cpu"))
    return best, *others


def _refusal(message: str) -> DeviceError:
    return DeviceError(message, _OPTION, status=STATUS_BAD_INPUT)
