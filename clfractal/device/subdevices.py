"""Parts of a device: `cpu/2` has two of its compute units, and `cpu/2+2` are two devices of two each."""

from __future__ import annotations

import re
from typing import Any

import pyopencl as cl

from clfractal.errors import STATUS_BAD_INPUT, DeviceError

_PARTS = re.compile(r"(.*)/([0-9]{1,6}(?:\+[0-9]{1,6})*)", re.DOTALL)


def without_parts(spec: str) -> tuple[str, tuple[int, ...]]:
    """A device's name as it was given, without its parts; and the compute units of each part, none for the whole."""
    found = _PARTS.fullmatch(spec)
    if found is None:
        return spec, ()
    return found[1].strip(), tuple(int(count) for count in found[2].split("+"))


def divided(device: cl.Device, counts: tuple[int, ...], shown: str) -> list[cl.Device]:
    """Sub-devices with so many compute units each; units beyond their sum stay unused.

    Args:
        device: the whole.
        counts: of each part.
        shown: what messages call the device.

    Raises:
        DeviceError: status 2 if it has fewer units, or cannot be divided; status 3 if the driver fails.
    """
    have, need = int(device.max_compute_units), sum(counts)
    if min(counts) < 1:
        raise _refusal(f"{shown}: a part needs at least 1 compute unit, got {'+'.join(map(str, counts))}")
    if need > have:
        raise _refusal(f"{shown} has {have} compute units, but {need} are wanted")
    kind: Any = cl.device_partition_property.BY_COUNTS
    try:
        offered: Any = device.partition_properties
        if kind not in offered:
            raise _refusal(f"{shown} cannot be divided: its driver does not offer it")
        wanted: Any = [kind, *counts]
        return list(device.create_sub_devices(wanted))
    except cl.Error as error:
        raise DeviceError(f"{shown}: the driver failed while dividing it", details=str(error)) from error


def _refusal(message: str) -> DeviceError:
    return DeviceError(message, status=STATUS_BAD_INPUT)
