"""Runs a job in a child process, so that a driver which aborts or hangs takes nothing else with it.

LLVM, inside most CPU drivers, answers some inputs by aborting the process. The parent only waits, so it can
also be interrupted at any moment of a long compilation.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import clfractal
from clfractal import errors
from clfractal.device.child import ANSWER, REQUEST
from clfractal.device.select import Device
from clfractal.errors import DeviceError, FileError, Where

_NOISE = "driver.log"
_NOISE_SHOWN = 20_000  # characters


class DriverAbortedError(DeviceError):
    """The driver ended its process by a signal."""


def run(
    job: str,
    device: Device,
    arguments: Mapping[str, Any],
    *,
    doing: str,
    timeout_s: float,
    folder: Path | None = None,
) -> Any:
    """The JSON value that `job` returns in a child process.

    Args:
        job: `package.module:function`; it is called with one dictionary that holds `arguments` and the
            keys `device` (see `select.by_key`), `folder` (where files may be left), `doing`, `job` and
            `parent`.
        device: the device the job will use.
        arguments: JSON data.
        doing: what goes on, for messages: `building`.
        timeout_s: seconds after which the child is killed.
        folder: a folder for request, answer and files; a temporary one if None.

    Raises:
        DeviceError: status 3, the child was ended by a signal, failed, or took too long; what the driver
            wrote is in
            the details. Errors of this package raised by the job are raised here again.
        FileError: the folder has no room for the request.
    """
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="clfractal-") as temporary:
            return run(job, device, arguments, doing=doing, timeout_s=timeout_s, folder=Path(temporary))
    request = {
        **arguments,
        "job": job,
        "device": [device.info.index, device.info.key],
        "doing": doing,
        "folder": str(folder),
        "parent": os.getpid(),
    }
    try:
        (folder / REQUEST).write_text(json.dumps(request), encoding="utf-8")
    except OSError as error:
        raise FileError(f"cannot be written: {error.strerror}", Where(str(folder))) from error
    status = _wait_for_child(folder, timeout_s)
    return _answer(folder, status, device.info.name, doing, timeout_s)


def _wait_for_child(folder: Path, timeout_s: float) -> int | None:
    """The child's exit status, negative for a signal; None if it was killed for taking too long."""
    package_root = str(Path(clfractal.__file__).resolve().parent.parent)
    paths = [package_root, *filter(None, [os.environ.get("PYTHONPATH")])]
    with open(folder / _NOISE, "wb") as noise:
        child = subprocess.Popen(
            # -P: the folder the user happens to be in is no place to import from.
            [sys.executable, "-P", "-m", "clfractal.device.child", str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=noise,
            stderr=noise,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            start_new_session=True,
        )
    try:
        return child.wait(timeout_s)
    except subprocess.TimeoutExpired:
        return None
    finally:
        # Also on an interrupt: the child is in a session of its own, so the terminal did not tell it.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
        child.wait()


def _answer(folder: Path, status: int | None, device_name: str, doing: str, timeout_s: float) -> Any:
    noise = (folder / _NOISE).read_text(encoding="utf-8", errors="replace")[-_NOISE_SHOWN:]
    if status is None:
        raise DeviceError(
            f"{device_name}: the driver took more than {timeout_s:g} s while {doing}", details=noise
        )
    if status < 0:
        raise DriverAbortedError(
            f"{device_name}: the driver aborted (signal {-status}) while {doing}", details=noise
        )
    try:
        answer = json.loads((folder / ANSWER).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise DeviceError(
            f"{device_name}: the driver failed (status {status}) while {doing}", details=noise
        ) from None
    if "error" in answer:
        name, message, details, error_status = answer["error"]
        kind = getattr(errors, name)
        raise kind(message, details="\n".join(filter(None, [details, noise])), status=error_status)
    return answer["value"]
