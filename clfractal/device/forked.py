"""Refuses OpenCL in a forked process, which lacks the drivers' threads and would wait for ever.

`multiprocessing` forks by default on Linux before Python 3.14. A child that was forked before OpenCL was used may use it.
"""

from __future__ import annotations

import os

from clfractal.errors import DeviceError

_used = False  # by this process, or by one that it was forked from
_lost = False  # this process was forked after that


def is_lost() -> bool:
    """Whether this process was forked from one that has used OpenCL; what that one holds must not be touched here."""
    return _lost


def use_opencl() -> None:
    """To be called before OpenCL is used.

    Raises:
        DeviceError: status 3, this process was forked from one that has used OpenCL.
    """
    global _used
    if _lost:
        raise DeviceError(
            "OpenCL does not work in a process that was forked from one that has used it; start processes by "
            "multiprocessing.get_context('spawn')"
        )
    _used = True


def _after_fork() -> None:
    global _lost
    _lost = _used


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
