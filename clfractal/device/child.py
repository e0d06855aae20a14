"""The child process that talks to drivers which may abort: `python -m clfractal.device.child FOLDER`.

The folder holds `request.json`; the answer goes into `answer.json` there. A job is a function of one
argument, the request, that returns JSON data; it may leave files in the folder. Nothing is printed: what
appears on the standard streams comes from the driver.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import os
import resource
import signal
import sys
from pathlib import Path
from typing import Any

from clfractal.errors import ClfractalError

REQUEST, ANSWER = "request.json", "answer.json"

# A stand-in for a broken driver: the child aborts if its request contains this variable's text.
TEST_ABORT = "CLFRACTAL_TEST_ABORT"

_PR_SET_PDEATHSIG = 1  # <sys/prctl.h>


def main() -> None:
    """Do what the request asks and leave at once, without a driver's clean-up, which may hang or crash."""
    folder = Path(sys.argv[1])
    text = (folder / REQUEST).read_text(encoding="utf-8")
    request: dict[str, Any] = json.loads(text)
    _die_with(int(request["parent"]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    _play_broken_driver(text)
    module, function = request["job"].split(":")
    try:
        answer: dict[str, Any] = {"value": getattr(importlib.import_module(module), function)(request)}
    except ClfractalError as error:
        answer = {"error": [type(error).__name__, error.message, error.details, error.status]}
    temporary = folder / f"{ANSWER}.new"
    temporary.write_text(json.dumps(answer), encoding="utf-8")
    temporary.replace(folder / ANSWER)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def _die_with(parent: int) -> None:
    """Ask the kernel to kill this process when its parent ends, however that happens (Linux)."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL), 0, 0, 0)
    if os.getppid() != parent:  # it ended before the question was asked
        os._exit(1)


def _play_broken_driver(request: str) -> None:
    marker = os.environ.get(TEST_ABORT)
    if marker and marker in request:
        print("LLVM ERROR: Cannot select: intrinsic", file=sys.stderr, flush=True)
        os.abort()


if __name__ == "__main__":
    main()
