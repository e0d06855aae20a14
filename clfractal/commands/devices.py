"""`clfractal devices`: every OpenCL device, what it can do and how fast it is."""

from __future__ import annotations

from collections.abc import Callable

from clfractal.commands.shell import Shell
from clfractal.device import select, tune
from clfractal.device.select import Device, DeviceInfo
from clfractal.errors import ClfractalError, DeviceError
from clfractal.work.probe import probe_for

_HEAD = ("", "index", "name", "platform", "memory", "float64", "GL", "lanes", "speed")


def list_devices(shell: Shell) -> None:
    """Prints a table of all devices; `*` marks the one that is taken unless another is named.

    Raises:
        DeviceError: there is none.
    """
    shell.mute_drivers()
    default = select.choose(None)
    rows = [_HEAD]
    for info in select.devices():
        lanes, speed = _measured(select.by_key(info.index, info.key), shell.say)
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
                lanes,
                speed,
            )
        )
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEAD))]
    lines = ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True)) for row in rows]
    shell.print("\n".join(line.rstrip() for line in lines))


def _measured(device: Device, on_start: Callable[[str], None]) -> tuple[str, str]:
    """The best lane count and its speed, in Mandelbulb points per second."""
    if select.is_simulator(device.info):
        return "1", "a simulator"
    try:
        probe = probe_for(device.info)
        lanes = tune.best_lanes(device, "float32", probe=probe, on_start=on_start)
        report = tune.lane_reports(device, "float32", (lanes,), probe=probe)[0]
    except ClfractalError as error:
        return "-", f"does not work: {error.message}" if isinstance(error, DeviceError) else error.message
    return str(lanes), f"{report.points_per_second / 1e6:.1f} Mpoints/s" if report.accepted else report.fault


def _platform(info: DeviceInfo) -> str:
    return f"{info.platform} ({info.version})"


def _yes(value: bool) -> str:
    return "yes" if value else "no"
