"""Interrupts: end the program within half a second, even in the middle of a kernel or a compilation.

Ctrl-C is one; so is what batch systems, containers, service managers and `timeout` send before they kill, and what a
terminal sends that closes. All take the same course: what is done is kept, and one line says how to go on.

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

from clfractal.errors import STATUS_SIGNALLED

GRACE_SECONDS = 0.35
"""How long the orderly way may take. A child process that compiles is given 0.25 s by Python itself."""

SIGNALS = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # the last is Ctrl-Break of Windows
    if hasattr(signal, name)
)

_came: int | None = None


def _sleep_on() -> None:
    """Nobody waits outside of Python."""


wake: Callable[[], None] = _sleep_on
"""Called from another thread when an interrupt has come: makes a main thread that waits outside of Python go on."""


def status() -> int:
    """The exit status for the signal that came, as shells have it: 128 and its number; without one that of Ctrl-C."""
    return STATUS_SIGNALLED + (signal.SIGINT if _came is None else _came)


def came() -> bool:
    """Whether one has come: whatever the main thread ends with from then on is its consequence."""
    return _came is not None


def watch(last_words: Callable[[], None]) -> None:
    """From now on the first of the signals raises KeyboardInterrupt, and ends the process with `status()` soon after.

    `last_words` is called before the process is ended by force. Signals that were ignored when the process was started
    (by `nohup`, a shell's `&`) stay ignored.
    """
    watched = [each for each in SIGNALS if signal.getsignal(each) != signal.SIG_IGN]
    if not watched:
        return
    reading, writing = os.pipe()
    if hasattr(os, "set_blocking"):  # not on Windows before Python 3.12, which does not ask for it either
        with suppress(OSError):
            os.set_blocking(writing, False)

    def raise_once(number: int, frame: FrameType | None) -> None:
        global _came
        _came = number
        if frame is not None and _swallows(frame):
            _thread.start_new_thread(_again, (number,))
            return
        for each in watched:
            signal.signal(each, _ignore)
        raise KeyboardInterrupt

    for each in watched:
        signal.signal(each, raise_once)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    _thread.start_new_thread(_end_by_force, (reading, frozenset(watched), last_words))


def _swallows(frame: FrameType) -> bool:
    """Whether exceptions are only printed there: where an import gives its lock back, in a callback of a weak reference."""
    code = frame.f_code
    return code.co_filename == "<frozen importlib._bootstrap>" and code.co_name == "cb"


def _again(number: int) -> None:
    time.sleep(0.001)
    _thread.interrupt_main(signal.Signals(number))


def _ignore(_number: int, _frame: FrameType | None) -> None:
    """A second signal must not stop the clean-up after the first one (SIG_IGN would be inherited by child processes)."""


def _end_by_force(reading: int, watched: frozenset[int], last_words: Callable[[], None]) -> None:
    global _came
    while (came := os.read(reading, 1)[0]) not in watched:
        pass
    _came = came
    wake()
    time.sleep(GRACE_SECONDS)
    try:
        last_words()
    finally:
        os._exit(status())
