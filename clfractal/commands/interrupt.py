"""Ctrl-C: answered within half a second, in the middle of a kernel or a compilation too.

Python tells the main thread of a signal only between two of its own instructions, and a call into a driver
may last. So there are two answers. The first is KeyboardInterrupt, which lets every `finally` do its work.
The second is a thread of its own, woken by the signal itself: if the process is still there after a while it
ends it.
"""

from __future__ import annotations

import _thread
import os
import signal
import time
from collections.abc import Callable
from types import FrameType

GRACE_SECONDS = 0.35
"""How long the orderly way may take. A child process that compiles is given 0.25 s by Python itself."""


def watch(last_words: Callable[[], None], status: int) -> None:
    """From now on Ctrl-C raises KeyboardInterrupt once, and ends the process with `status` soon after.

    `last_words` is called before the process is ended by force. An interrupt that whoever started us chose
    to ignore (`nohup`, a shell's `&`) stays ignored.
    """
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        return
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    signal.signal(signal.SIGINT, _raise_once)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    _thread.start_new_thread(_end_by_force, (reading, last_words, status))


def _raise_once(_number: int, _frame: FrameType | None) -> None:
    signal.signal(signal.SIGINT, _ignore)
    raise KeyboardInterrupt


def _ignore(_number: int, _frame: FrameType | None) -> None:
    """A second Ctrl-C must not stop the cleaning up after the first (children would inherit SIG_IGN)."""


def _end_by_force(reading: int, last_words: Callable[[], None], status: int) -> None:
    while os.read(reading, 1) != bytes([signal.SIGINT]):
        pass
    time.sleep(GRACE_SECONDS)
    last_words()
    os._exit(status)
