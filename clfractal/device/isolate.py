"""Runs a job in a child process, so that a driver which aborts or hangs takes nothing else with it.

LLVM, which most CPU drivers contain, aborts the process for some inputs. The parent only waits, so it can
be interrupted or cancelled at any moment of a long compilation. `children.py` keeps the children.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from clfractal import errors
from clfractal.device import children, drivers_folder
from clfractal.device.child import ANSWER, FAILED, NOISE, REQUEST
from clfractal.device.select import Device
from clfractal.errors import DeviceError, UntriedError
from clfractal.files import resources

_NOISE_SHOWN = 20_000  # characters
# Signals that no driver ends a process by: other programs send them, and the system where memory or time is short.
_FROM_OUTSIDE = frozenset(
    int(getattr(signal, name))
    for name in ("SIGKILL", "SIGTERM", "SIGHUP", "SIGINT", "SIGXCPU")
    if hasattr(signal, name)
)


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
        DeviceError: status 3, the driver aborted, failed, or took too long; what it wrote is in the details. Errors of this
            package raised by the job are raised here again.
        UntriedError: the child was ended from outside, or failed without the driver.
        FileError: there is no room for the request, or for what the driver writes.
        Stopped: `stopped` answered True.
    """
    if folder is None:
        with job_folder() as temporary:
            return run(
                job,
                device,
                arguments,
                doing=doing,
                timeout_s=timeout_s,
                folder=temporary,
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
        raise drivers_folder.no_room(error) from error
    status = _wait_for_child(folder, timeout_s, stopped)
    try:
        return _answer(folder, status, device.info.name, doing, timeout_s)
    except DeviceError:
        drivers_folder.check_room()
        raise


@contextlib.contextmanager
def job_folder() -> Iterator[Path]:
    """A folder for request, answer and files.

    Raises:
        FileError: there is no room for it.
    """
    root = drivers_folder.path()
    try:
        # What is old in a temporary folder may have been cleared away.
        root.mkdir(parents=True, exist_ok=True)
        temporary = tempfile.mkdtemp(prefix="job-", dir=root)
    except OSError as error:
        raise drivers_folder.no_room(error) from error
    try:
        yield Path(temporary)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def end_children() -> None:
    """End all children, idle or working; the next job starts a new one."""
    children.pool.close()


drivers_folder.users.append(end_children)


def _wait_for_child(folder: Path, timeout_s: float, stopped: Callable[[], bool] | None) -> int | None:
    """0 once a request is answered; else the child's exit status; None if it was killed for taking too long."""
    package_root = str(resources.PACKAGE.parent)
    paths = [package_root, *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(paths),
        # The child's own folder is made in this process's.
        drivers_folder.POCL_VARIABLE: str(drivers_folder.path()),
    }
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
    if -status in _FROM_OUTSIDE:
        raise UntriedError(f"{device_name}: signal {-status} from outside ended {doing}", details=noise)
    if status == FAILED:
        raise UntriedError(f"{device_name}: clfractal's own program failed while {doing}", details=noise)
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
