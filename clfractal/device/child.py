"""The child process that talks to drivers which may abort: `python -m clfractal.device.child DESCRIPTOR`.

It takes one job after the other, because starting a driver takes longer than many compilations. A line on standard input
names a folder that holds `request.json`; the answer goes into `answer.json` there, and a line into the pipe DESCRIPTOR. A
job is a function of one argument, the request, that returns JSON data; it may leave files there. Nothing is printed:
what appears on the standard streams comes from the driver, and goes into the folder's `driver.log`.

It ends when there is no request for some seconds, when its parent ends, and after a failed job.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import resource
import select
import signal
import sys
import traceback
from pathlib import Path
from typing import Any

from clfractal.errors import ClfractalError

REQUEST, ANSWER, NOISE = "request.json", "answer.json", "driver.log"
DONE = b"done\n"

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
    done = int(sys.argv[1])
    _die_with(int(sys.argv[2]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for _ in range(MOST_JOBS):
        folder = _next_folder()
        if folder is None:
            break
        _work(folder)
        os.write(done, DONE)
    os._exit(0)


def _next_folder() -> Path | None:
    """The folder of the next request; None if there is none for some time, or the parent has ended."""
    if not select.select([0], [], [], IDLE_S)[0]:
        return None
    # The parent writes a line at once, and no other before it is answered.
    line = os.read(0, _LONGEST_LINE)
    return Path(os.fsdecode(line.rstrip(b"\n"))) if line else None


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
        answer = {"error": [type(error).__name__, error.message, error.details, error.status]}
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    temporary = folder / f"{ANSWER}.new"
    temporary.write_text(json.dumps(answer), encoding="utf-8")
    temporary.replace(folder / ANSWER)
    sys.stdout.flush()
    sys.stderr.flush()


def _die_with(parent: int) -> None:
    """Ask the kernel to kill this process when its parent ends, however that happens (Linux)."""
    if sys.platform.startswith("linux"):
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
