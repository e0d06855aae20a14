"""Drivers begin in a thread of their own, while modules are loaded.

That takes PoCL 30 ms, in which pyopencl holds the interpreter's lock. So its first questions are asked before, through
ctypes, which does not hold it. When pyopencl asks them again the drivers are there.
"""

from __future__ import annotations

import ctypes
import threading
from contextlib import ExitStack, suppress
from typing import Any

import pyopencl as cl

from clfractal.device import bundled, drivers_folder
from clfractal.device.forked import use_opencl
from clfractal.errors import ClfractalError

_ALL_TYPES = 0xFFFFFFFF  # CL_DEVICE_TYPE_ALL

_under_way: list[threading.Thread] = []
_environment = ExitStack()


def begin() -> None:
    """Lets the drivers begin. What fails here fails again where they are asked for, and is told there."""
    if _under_way:
        return
    # (An AttributeError where the names of a library are not found in another that it loads.)
    with suppress(ClfractalError, OSError, AttributeError):
        use_opencl()
        library = ctypes.CDLL(cl._cl.__file__)
        platforms, devices = library.clGetPlatformIDs, library.clGetDeviceIDs
        platforms.argtypes = [ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p]
        devices.argtypes = [ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p]
        # By this thread: while drivers read the environment nobody changes it.
        bundled.offer()
        _environment.enter_context(drivers_folder.given_to_drivers())
        _under_way.append(threading.Thread(target=_ask, args=(platforms, devices), daemon=True))
        _under_way[0].start()


def began() -> bool:
    """Whether they were let begin."""
    return bool(_under_way)


def wait() -> None:
    """Waits until drivers that were let begin have done so."""
    for thread in _under_way:
        thread.join()
    _environment.close()


def _ask(platforms: Any, devices: Any) -> None:
    count = ctypes.c_uint(0)
    platforms(0, None, ctypes.byref(count))
    found = (ctypes.c_void_p * count.value)()
    platforms(count, found, None)
    for each in found:
        devices(each, _ALL_TYPES, 0, None, ctypes.byref(count))


drivers_folder.users.append(wait)  # they may be writing
