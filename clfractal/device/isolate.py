"""Runs a job in a child process, so that a driver which aborts or hangs takes nothing else with it.

LLVM, inside most CPU drivers, answers some inputs by aborting the process. The parent only waits, so it can
also be interrupted at any moment of a long compilation. The child stays for some seconds, for further jobs.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import clfractal
from clfractal import errors
from clfractal.device.child import ANSWER, DONE, NOISE, REQUEST
from clfractal.device.select import Device
from clfractal.errors import DeviceError, FileError, Where

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
            keys `device` (see `select.by_key`), `folder` (where files may be left), `doing` and `job`.
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
    }
    try:
        (folder / REQUEST).write_text(json.dumps(request), encoding="utf-8")
    except OSError as error:
        raise FileError(f"cannot be written: {error.strerror}", Where(str(folder))) from error
    status = _wait_for_child(folder, timeout_s)
    return _answer(folder, status, device.info.name, doing, timeout_s)


class _Child:
    """A child that waits for requests. It belongs to the thread that started it: it ends with it."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.environment = dict(environment)
        self.owner = os.getpid()
        reading, writing = os.pipe()
        try:
            self.process = subprocess.Popen(
                # -P: the folder the user happens to be in is no place to import from.
                [sys.executable, "-P", "-m", "clfractal.device.child", str(writing), str(self.owner)],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env=self.environment,
                pass_fds=[writing],
                start_new_session=True,
                bufsize=0,
            )
        except BaseException:
            os.close(reading)
            raise
        finally:
            os.close(writing)
        self.answers = reading

    def serves(self, environment: Mapping[str, str]) -> bool:
        """Whether it can take a request: it lives, is this process's own, and its drivers were told the same."""
        return (
            self.owner == os.getpid()
            and self.process.poll() is None
            and self.environment == dict(environment)
        )

    def ask(self, folder: Path, timeout_s: float) -> int | None:
        """0 once it has answered; else its exit status, negative for a signal; None if it takes too long.

        Raises:
            BrokenPipeError: it ended, but not by what it was asked.
        """
        assert self.process.stdin is not None
        self.process.stdin.write(os.fsencode(folder) + b"\n")
        if not select.select([self.answers], [], [], timeout_s)[0]:
            return None
        if os.read(self.answers, len(DONE)):
            return 0
        status = self.process.wait()
        if status in (
            0,
            -signal.SIGKILL,
        ):  # it had waited long enough just then, or somebody ended it; no driver does
            raise BrokenPipeError
        return status

    def end(self) -> None:
        """Ends it, whatever it does."""
        if self.owner != os.getpid():
            return
        # Also on an interrupt: the child is in a session of its own, so the terminal did not tell it.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        with contextlib.suppress(OSError):
            os.close(self.answers)
        if self.process.stdin is not None:
            with contextlib.suppress(OSError):
                self.process.stdin.close()


class _Children(threading.local):
    """The child of each thread."""

    child: _Child | None = None


_children = _Children()


def _wait_for_child(folder: Path, timeout_s: float) -> int | None:
    """0 once a request is answered; else the child's exit status; None if it was killed for taking too long."""
    package_root = str(Path(clfractal.__file__).resolve().parent.parent)
    paths = [package_root, *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    for fresh in (False, True):
        child = _children.child
        if child is None or fresh or not child.serves(environment):
            end_child()
            child = _children.child = _Child(environment)
        status: int | None = None
        try:
            status = child.ask(folder, timeout_s)
        except BrokenPipeError:
            if not fresh:
                continue
            status = child.process.wait()
        finally:
            if status != 0:
                end_child()
        return status
    raise AssertionError("a fresh child answers or fails")


def end_child() -> None:
    """Ends the child that waits for this thread's next request, if there is one."""
    child, _children.child = _children.child, None
    if child is not None:
        child.end()


atexit.register(end_child)


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
