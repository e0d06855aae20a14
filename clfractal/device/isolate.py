"""Runs a job in a child process, so that a driver which aborts or hangs takes nothing else with it.

LLVM, which most CPU drivers contain, aborts the process for some inputs. The parent only waits, so it can
be interrupted or cancelled at any moment of a long compilation. `children.py` keeps the children.
"""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import clfractal
from clfractal import errors
from clfractal.device import children
from clfractal.device.child import ANSWER, NOISE, REQUEST
from clfractal.device.select import Device
from clfractal.errors import DeviceError
from clfractal.files.atomic import file_error

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
    stopped: Callable[[], bool] | None = None,
) -> Any:
    """The JSON value that `job` returns in a child process.

    Args:
        job: `package.module:function`; it is called with one dictionary that holds `arguments` and the
            keys `device` (see `select.by_key`), `folder` (where files may be left), `doing` and `job`.
        device: the device the job will use.
        arguments: JSON data.
        doing: the activity, for messages, such as `building`.
        timeout_s: seconds after which the child is killed.
        folder: a folder for request, answer and files; a temporary one if None.
        stopped: asked at least every 20 ms while the child works, in the thread that called; once it answers True
            the child is ended.

    Raises:
        DeviceError: status 3, the child was ended by a signal, failed, or took too long; what the driver wrote is in
            the details. Errors of this package raised by the job are raised here again.
        FileError: the folder has no room for the request.
        Stopped: `stopped` answered True.
    """
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="clfractal-") as temporary:
            return run(
                job,
                device,
                arguments,
                doing=doing,
                timeout_s=timeout_s,
                folder=Path(temporary),
                stopped=stopped,
            )
    request = {
        **arguments,
        "job": job,
        "device": [device.info.index, device.info.key],
        "doing": doing,
        "folder": str(folder),
    }
    try:
        (folder / REQUEST).write_text(json.dumps(request), encoding="utf-8")
    except OSError as error:
        # (The folder itself has a name that nobody knows, and is gone when this is read.)
        raise file_error(folder.parent, "has no room for temporary files", error) from error
    status = _wait_for_child(folder, timeout_s, stopped)
    return _answer(folder, status, device.info.name, doing, timeout_s)


def end_children() -> None:
    """End all children, idle or working; the next job starts a new one."""
    children.pool.close()


def _wait_for_child(folder: Path, timeout_s: float, stopped: Callable[[], bool] | None) -> int | None:
    """0 once a request is answered; else the child's exit status; None if it was killed for taking too long."""
    package_root = str(Path(clfractal.__file__).resolve().parent.parent)
    paths = [package_root, *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    while True:
        pool, lease, status = children.pool, children.Lease(), None
        try:
            status = pool.take(lease, environment, stopped).ask(folder, timeout_s, stopped)
        except children.EndedError:
            continue
        finally:
            # Also after an interrupt: the terminal tells the child nothing, it is in a session of its own.
            pool.give_back(lease, usable=status == 0)
        return status


def _answer(folder: Path, status: int | None, device_name: str, doing: str, timeout_s: float) -> Any:
    noise = ""
    with contextlib.suppress(OSError):
        noise = (folder / NOISE).read_text(encoding="utf-8", errors="replace")[-_NOISE_SHOWN:]
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
