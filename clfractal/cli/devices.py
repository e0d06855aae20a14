"""`clfractal devices`: every OpenCL device, what it can do and how fast it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from clfractal.cli.shell import Shell
from clfractal.device import select
from clfractal.device.select import Device, DeviceInfo
from clfractal.errors import ClfractalError, DeviceError
from clfractal.integrators import lanes
from clfractal.integrators.trial import RULES

_HEAD = ("", "index", "name", "platform", "memory", "float64", "GL", "lanes", "speed")


@dataclass(frozen=True, slots=True)
class _Measured:
    """What was measured of a device, or why nothing was.

    Attributes:
        lanes: the best lane counts, by a scalar rule and by the Jacobian where they differ.
        pixels_per_second: the speed of the march.
        reason: why there is no speed; empty if there is one.
    """

    lanes: tuple[int, ...]
    pixels_per_second: float | None
    reason: str = ""


def list_devices(shell: Shell, *, as_json: bool) -> None:
    """Prints a table of all devices; `*` marks the one that is used unless another is named. Or a list, as JSON.

    Raises:
        DeviceError: there is none.
    """
    default = select.choose(None)
    found = [
        (info, _measured(select.by_key(info.index, info.key), shell.say), info.index == default.info.index)
        for info in select.devices()
    ]
    if as_json:
        shell.print_json([_facts(*each) for each in found])
        return
    rows = [_HEAD, *(_row(*each) for each in found)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEAD))]
    lines = ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)) for row in rows]
    shell.print("\n".join(line.rstrip() for line in lines))


def _row(info: DeviceInfo, measured: _Measured, is_default: bool) -> tuple[str, ...]:
    speed = measured.pixels_per_second
    return (
        "*" if is_default else "",
        info.index,
        info.name,
        f"{info.platform} ({info.version})",
        f"{info.memory / 2**30:.1f} GiB",
        _yes(info.has_float64),
        _yes(info.gl_sharing),
        ", ".join(map(str, measured.lanes)) or "-",
        measured.reason if speed is None else f"{speed / 1e6:.2f} Mpixels/s",
    )


def _facts(info: DeviceInfo, measured: _Measured, is_default: bool) -> dict[str, Any]:
    return {
        "index": info.index,
        "name": info.name,
        "platform": info.platform,
        "version": info.version,
        "driver": info.driver,
        "kind": info.kind,
        "compute_units": info.compute_units,
        "memory": info.memory,
        "largest_buffer": info.max_alloc,
        "float64": info.has_float64,
        "gl_sharing": info.gl_sharing,
        "lanes": list(measured.lanes),
        "pixels_per_second": measured.pixels_per_second,
        "remark": measured.reason or None,
        "default": is_default,
    }


def _measured(device: Device, on_start: Callable[[str], None]) -> _Measured:
    if select.is_simulator(device.info):
        return _Measured((1,), None, "a simulator")
    try:
        best = [lanes.best_lanes(device, "float32", rule, on_start=on_start) for rule in RULES]
        speed = lanes.pixels_per_second(lanes.march_reports(device, "float32", on_start=on_start))
    except ClfractalError as error:
        works = isinstance(error, DeviceError)
        return _Measured((), None, f"does not work: {error.message}" if works else error.message)
    return _Measured(tuple(dict.fromkeys(best)), float(speed))


def _yes(value: bool) -> str:
    return "yes" if value else "no"
