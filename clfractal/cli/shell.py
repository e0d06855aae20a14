"""Output of commands: results on standard output, messages of one line on standard error, and nothing else.

Drivers may also write to standard error. While a command runs, their output goes into a separate file,
which `--verbose` shows when something failed.
"""

from __future__ import annotations

import os
import shutil
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from typing import Any, BinaryIO, TextIO

from clfractal.errors import (
    STATUS_BAD_INPUT,
    STATUS_DEVICE_FAILED,
    CacheWarning,
    ClfractalError,
    FileError,
    Where,
)
from clfractal.files.system import read_at

OUTPUT = "standard output"
_CLEAR = "\r\x1b[2K"  # of a terminal: to the line's beginning, and nothing on it
_NOISE_SHOWN = 20_000  # bytes
_LAST_WORDS_SECONDS = 1.0  # for so long one thread waits for the other that tells of an interrupt


class Shell:
    """Standard output and standard error of one run of the program.

    `verbose` and `quiet` are set by a command from its options.
    """

    def __init__(self, *, owns_process: bool) -> None:
        """`owns_process`: whether the drivers' standard error may be redirected."""
        self.verbose = False
        self.quiet = False
        self._owns_process = owns_process
        # A stream that was closed by whoever started the program is None.
        self.errors: TextIO = sys.stderr or open(os.devnull, "w")  # noqa: SIM115 (until the process ends)
        """Standard error, also for a progress bar."""
        if owns_process:
            for stream in (sys.stdout, sys.stderr):
                if isinstance(stream, TextIOWrapper):
                    stream.reconfigure(errors="backslashreplace")  # rather than fail at a name's letter
        self._noise: int | None = None
        self._interrupted = False
        self._leaves = threading.Lock()
        self._kept: BinaryIO | None = None
        self.names: dict[str, str] = {}
        """What messages call a file, by its path."""
        self._status = False
        self._writing = threading.Lock()
        self.told = time.monotonic()
        """When the user last saw a sign of life."""
        self.stalled: Callable[[str], None] = self.status
        """Shows, on a terminal, what takes long; something else while there is a progress bar."""
        self.patient = True
        """Whether a command that takes long says what it is doing."""
        self.state: Callable[[], str] = lambda: "clfractal: interrupted"
        """The message for an interrupt."""
        self.leaving: list[Callable[[], None]] = []
        """What else an interrupt has to do where the main thread does not get to its own clean-up."""

    @property
    def terminal(self) -> bool:
        """Whether standard error is a terminal."""
        return self.errors.isatty()

    def mute_drivers(self) -> None:
        """From now on drivers' output does not reach standard error, except with `--verbose`."""
        if not self._owns_process or self.verbose or self._noise is not None:
            return
        with suppress(OSError, ValueError):
            own = os.fdopen(os.dup(2), "w", encoding="utf-8", errors="backslashreplace", buffering=1)
            self._noise = _noise_file()
            os.dup2(self._noise, 2)
            self.errors = own

    def tell_warnings(self) -> None:
        """From now on the package's own warnings are remarks; those of libraries go where drivers' output goes."""
        shown = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *rest: Any, **more: Any) -> None:
            if issubclass(category, CacheWarning):
                self.say(str(message))
            else:
                shown(message, category, *rest, **more)

        warnings.showwarning = show

    def alive(self) -> None:
        """There is progress, which the user sees or will soon see."""
        self.told = time.monotonic()

    def status(self, line: str) -> None:
        """A line on a terminal that the next output replaces."""
        line = self._named(line)
        with self._writing, suppress(OSError, ValueError):
            if not self._interrupted:
                self.errors.write(_CLEAR + line)
                self.errors.flush()
                self._status = True

    def clear_status(self) -> None:
        """Takes that line away."""
        if self._status:
            with self._writing, suppress(OSError, ValueError):
                self.errors.write(_CLEAR)
                self._status = False

    def say(self, line: str) -> None:
        """One line for the user, on standard error; nothing if it is closed, or with `--quiet`."""
        if not self.quiet:
            self._write(line)

    def can_print(self, text: str) -> bool:
        """Whether standard output has all the characters of a text; those that it lacks are printed as escapes."""
        try:
            text.encode(getattr(sys.stdout, "encoding", None) or "utf-8")
        except UnicodeEncodeError:
            return False
        return True

    def print(self, text: str) -> None:
        """A command's result, on standard output.

        Raises:
            FileError: it cannot be written (a full disk, a closed stream).
        """
        if sys.stdout is None:
            raise FileError("cannot be written: it is closed", Where(OUTPUT))

        with self._to_output():
            sys.stdout.write(text if text.endswith("\n") else text + "\n")
            sys.stdout.flush()

    def print_json(self, data: Any) -> None:
        """A command's result as JSON, in ASCII; errors as of `print`."""
        import json

        self.print(json.dumps(data, indent=2, allow_nan=False))

    def keep_output(self, *, is_text: bool) -> None:
        """Keeps standard output for a file that will be sent: from now on what drivers print there is dropped.

        Raises:
            FileError: it is closed; or a terminal, and the file is no text.
        """
        if sys.stdout is None or sys.stdout.closed:
            raise FileError("is closed", Where(OUTPUT))
        if not is_text and sys.stdout.isatty():
            raise FileError("is a terminal; send it to a file or a program, or name a file", Where(OUTPUT))
        if self._owns_process and self._kept is None:
            with suppress(OSError, ValueError):
                sys.stdout.flush()
                self._kept = os.fdopen(os.dup(1), "wb")
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)

    def send(self, stream: BinaryIO) -> None:
        """Writes bytes to standard output; nothing more if its reader is gone.

        Raises:
            FileError: it cannot be written (a full disk).
        """
        with self._to_output():
            target = self._kept or sys.stdout.buffer
            shutil.copyfileobj(stream, target, 1 << 20)
            target.flush()

    @contextmanager
    def _to_output(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError:
            # The reader closed the pipe, as `head` does; the rest of the output is dropped.
            self._drop_output()
        except OSError as error:
            self._drop_output()
            raise FileError(f"cannot be written: {error.strerror}", Where(OUTPUT)) from error

    def _drop_output(self) -> None:
        """What is still in a buffer goes nowhere, instead of failing again when the process ends."""
        with suppress(OSError):
            target = self._kept.fileno() if self._kept is not None else sys.stdout.fileno()
            os.dup2(os.open(os.devnull, os.O_WRONLY), target)

    def refuse(self, line: str) -> None:
        """One line about wrong input; `--quiet` does not silence it."""
        self._write(" ".join(line.split()))

    def fail(self, error: BaseException) -> int:
        """Prints an error in one line, with `--verbose` also its details; returns the exit status."""
        details = ""
        if isinstance(error, ClfractalError):
            line, status, details = str(error), int(error.status), error.details
        elif isinstance(error, MemoryError):
            line, status = "clfractal: out of memory", STATUS_BAD_INPUT
        elif isinstance(error, OSError) and error.strerror:
            file = error.filename if isinstance(error.filename, str) else "clfractal"
            line, status = f"{file}: {error.strerror}", STATUS_BAD_INPUT
        else:
            summary = " ".join(f"{type(error).__name__}: {error}".split())[:300]
            line = f"clfractal: internal error, please report it: {summary}"
            status = STATUS_DEVICE_FAILED
        self.refuse(line)
        if self.verbose:
            import traceback

            for text in (details, self.noise(), "".join(traceback.format_exception(error))):
                if text.strip():
                    self._write(text.rstrip())
        return status

    def interrupted(self) -> None:
        """Does what is left to do, and prints that the program was interrupted, once.

        Two threads may call it, of which each ends the process afterwards: the second one waits until the first is done.
        """
        held = self._leaves.acquire(timeout=_LAST_WORDS_SECONDS)
        try:
            if held and not self._interrupted:
                self._interrupted = True
                told = self.state()
                for leave in self.leaving:
                    with suppress(OSError):
                        leave()
                self._write(told)
        finally:
            if held:
                self._leaves.release()

    def noise(self) -> str:
        """What drivers wrote to standard error since `mute_drivers`."""
        if self._noise is None:
            return ""
        with suppress(OSError):
            size = os.fstat(self._noise).st_size
            tail = read_at(self._noise, _NOISE_SHOWN, max(0, size - _NOISE_SHOWN))
            return tail.decode("utf-8", "replace")
        return ""

    def _named(self, line: str) -> str:
        for path, name in self.names.items():
            line = line.replace(path, name)
        return line

    def _write(self, line: str) -> None:
        line = self._named(line)
        # (Whoever holds the lock may hang: last words do not wait for that.)
        held = self._writing.acquire(timeout=0.1)
        try:
            with suppress(OSError, ValueError):  # closed by whoever started us
                self.errors.write((_CLEAR if self._status else "") + line + "\n")
                self.errors.flush()
                self._status = False
        finally:
            if held:
                self._writing.release()
        self.alive()


def _noise_file() -> int:
    """A file without a name that goes with the process."""
    if hasattr(os, "memfd_create"):
        return int(os.memfd_create("driver"))
    import tempfile

    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())
