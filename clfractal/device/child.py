"""The child process that talks to drivers which may abort: `python -m clfractal.device.child PARENT`.

It takes one job after the other, as starting a driver takes longer than many compilations. A line on standard input
names a folder that holds `request.json`; the answer goes into `answer.json` there, and a line to its first output. A
job is a function of one argument, the request, that returns JSON data; it may leave files there. Nothing is printed:
what appears on the standard streams comes from the driver, and goes into the folder's `driver.log`.

It ends when there is no request for some seconds, when its parent ends or closes standard input, and after a failed job.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import queue
import signal
import sys
import threading
import traceback
from pathlib import Path
from typing import Any

from clfractal.device import drivers_folder
from clfractal.errors import ClfractalError

REQUEST, ANSWER, NOISE = "request.json", "answer.json", "driver.log"
DONE = b"done\n"
FAILED = 86
"""Status of a child whose job failed by a fault of ours, or for want of memory."""

# The process holds some 200 MB of the compiler's memory, so it does not wait long.
IDLE_S = 10.0
# Jobs of one child: a compiler's memory grows with every compilation.
MOST_JOBS = 20

# A stand-in for a broken driver: the child aborts if its request contains this variable's text.
TEST_ABORT = "CLFRACTAL_TEST_ABORT"

_PR_SET_PDEATHSIG = 1  # <sys/prctl.h>
_LONGEST_LINE = 4096


def main() -> None:
    """Do what the requests ask and leave at once, without a driver's clean-up, which may hang or crash."""
    # Drivers write to the descriptors 1 and 2 as they like.
    done = os.dup(1)
    _leave_signals_to_the_parent()
    _die_with(int(sys.argv[1]))
    _leave_no_core()
    drivers_folder.nest()
    folders: queue.SimpleQueue[Path] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(folders,), daemon=True).start()
    for _ in range(MOST_JOBS):
        try:
            folder = folders.get(timeout=IDLE_S)
        except queue.Empty:
            break
        _work(folder)
        os.write(done, DONE)
    os._exit(0)


def _listen(folders: queue.SimpleQueue[Path]) -> None:
    """Takes requests as they come; when the parent has ended, or closed the pipe, nobody waits for an answer either."""
    # The parent writes a line at once, and no other before it is answered.
    while line := os.read(0, _LONGEST_LINE):
        folders.put(Path(os.fsdecode(line.rstrip(b"\r\n"))))
    os._exit(0)


def _leave_signals_to_the_parent() -> None:
    """Batch systems tell every process of a job to end; the parent decides, and must not take it for a driver's failure."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)


def _leave_no_core() -> None:
    """A driver that aborts leaves no file of the process's memory."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _work(folder: Path) -> None:
    with open(folder / NOISE, "wb", buffering=0) as noise:
        for stream in (1, 2):
            os.dup2(noise.fileno(), stream)
    text = (folder / REQUEST).read_text(encoding="utf-8")
    request: dict[str, Any] = json.loads(text)
    _play_broken_driver(text)
    module, function = request["job"].split(":")
    try:
        answer: dict[str, Any] = {"value": getattr(importlib.import_module(module), function)(request)}
    except ClfractalError as error:
        answer = {"error": [type(error).__name__, str(error), error.details, error.status]}
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(FAILED)
    temporary = folder / f"{ANSWER}.new"
    temporary.write_text(json.dumps(answer), encoding="utf-8")
    temporary.replace(folder / ANSWER)
    sys.stdout.flush()
    sys.stderr.flush()


def _die_with(parent: int) -> None:
    """Ask the kernel to kill this process when its parent ends, however that happens (elsewhere `_listen` sees it)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL), 0, 0, 0)
        if os.getppid() != parent:  # the parent ended before the call above
            os._exit(1)


def _play_broken_driver(request: str) -> None:
    marker = os.environ.get(TEST_ABORT)
    if marker and marker in request:
        print("LLVM ERROR: Cannot select: intrinsic", file=sys.stderr, flush=True)
        os.abort()


if __name__ == "__main__":
    main()
