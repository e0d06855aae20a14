"""Ctrl-C: ends the program within half a second, even in the middle of a kernel or a compilation.

Python handles a signal only in the main thread and between two of its own instructions, but a call into a driver
may last long. So there are two reactions. The first is KeyboardInterrupt, which lets every `finally` do its work.
The second is a separate thread, woken by the signal itself: if the process is still running after a while, this thread
ends it.
"""

from __future__ import annotations

import _thread
import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from types import FrameType

GRACE_SECONDS = 0.35
"""How long the orderly way may take. A child process that compiles is given 0.25 s by Python itself."""


def _sleep_on() -> None:
    """Nobody waits outside of Python."""


wake: Callable[[], None] = _sleep_on
"""Called from another thread when Ctrl-C has come: makes a main thread that waits outside of Python go on."""


def watch(last_words: Callable[[], None], status: int) -> None:
    """From now on Ctrl-C raises KeyboardInterrupt once, and ends the process with `status` soon after.

    `last_words` is called before the process is ended by force. If the process was started with
    interrupts ignored (`nohup`, a shell's `&`), they stay ignored.
    """
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        return
    reading, writing = os.pipe()
    if hasattr(os, "set_blocking"):  # not on Windows before Python 3.12, which does not ask for it either
        with suppress(OSError):
            os.set_blocking(writing, False)
    signal.signal(signal.SIGINT, _raise_once)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    _thread.start_new_thread(_end_by_force, (reading, last_words, status))


def _raise_once(_number: int, _frame: FrameType | None) -> None:
    signal.signal(signal.SIGINT, _ignore)
    raise KeyboardInterrupt


def _ignore(_number: int, _frame: FrameType | None) -> None:
    """A second Ctrl-C must not stop the clean-up after the first one (SIG_IGN would be inherited by child processes)."""


def _end_by_force(reading: int, last_words: Callable[[], None], status: int) -> None:
    while os.read(reading, 1) != bytes([signal.SIGINT]):
        pass
    wake()
    time.sleep(GRACE_SECONDS)
    last_words()
    os._exit(status)
