"""The sizes of work-groups, of which OpenCL 1.2 guarantees none."""

from __future__ import annotations

import math

import pyopencl as cl

from clfractal.device.select import Device


def fitting(device: Device, kernel: cl.Kernel, group: tuple[int, ...]) -> tuple[int, ...]:
    """The group that a kernel is launched in: the one that is asked for, or sides of it halved until the device takes it.

    Apple's CPU device takes one work-item along the second dimension. A kernel that needs many registers may allow fewer
    work-items than the device does. Whatever the group's sides divide, the smaller ones divide, too.

    Args:
        group: work-items along each dimension, powers of two. The kernel's work-items know nothing of their group.
    """
    most, longest = _limits(device, kernel)
    sides = list(group)
    for place, limit in enumerate(longest[: len(sides)]):
        while sides[place] > max(limit, 1):
            sides[place] //= 2
    while math.prod(sides) > max(most, 1):
        sides[sides.index(max(sides))] //= 2
    return tuple(sides)


def _limits(device: Device, kernel: cl.Kernel) -> tuple[int, tuple[int, ...]]:
    """How many work-items a group of the kernel may have, and how many of them along each dimension."""
    most = kernel.get_work_group_info(cl.kernel_work_group_info.WORK_GROUP_SIZE, device.cl_device)
    return int(most), tuple(device.cl_device.max_work_item_sizes)
