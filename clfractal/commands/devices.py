"""`clfractal devices`: every OpenCL device, what it can do and how fast it is."""

from __future__ import annotations

from collections.abc import Callable

from clfractal.commands.shell import Shell
from clfractal.device import select
from clfractal.device.select import Device, DeviceInfo
from clfractal.errors import ClfractalError, DeviceError
from clfractal.renderers import lanes
from clfractal.renderers.trial import RULES

_HEAD = ("", "index", "name", "platform", "memory", "float64", "GL", "lanes", "speed")


def list_devices(shell: Shell) -> None:
    """Prints a table of all devices; `*` marks the one that is used unless another is named.

    Raises:
        DeviceError: there is none.
    """
    shell.mute_drivers()
    default = select.choose(None)
    rows = [_HEAD]
    for info in select.devices():
        width, speed = _measured(select.by_key(info.index, info.key), shell.say)
        mark = "*" if info.index == default.info.index else ""
        rows.append(
            (
                mark,
                info.index,
                info.name,
                _platform(info),
                f"{info.memory / 2**30:.1f} GiB",
                _yes(info.has_float64),
                _yes(info.gl_sharing),
                width,
                speed,
            )
        )
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEAD))]
    lines = ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)) for row in rows]
    shell.print("\n".join(line.rstrip() for line in lines))


def _measured(device: Device, on_start: Callable[[str], None]) -> tuple[str, str]:
    """The best lane counts, by a scalar rule and by the Jacobian where they differ, and the speed of the march."""
    if select.is_simulator(device.info):
        return "1", "a simulator"
    try:
        best = [lanes.best_lanes(device, "float32", rule, on_start=on_start) for rule in RULES]
        speed = lanes.pixels_per_second(lanes.march_reports(device, "float32", on_start=on_start))
    except ClfractalError as error:
        return "-", f"does not work: {error.message}" if isinstance(error, DeviceError) else error.message
    return ", ".join(dict.fromkeys(map(str, best))), f"{speed / 1e6:.2f} Mpixels/s"


def _platform(info: DeviceInfo) -> str:
    return f"{info.platform} ({info.version})"


def _yes(value: bool) -> str:
    return "yes" if value else "no"
