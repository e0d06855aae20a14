"""Programs, built once: the cache's key is the whole text, the flags, the device and its driver."""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

import pyopencl as cl

from clfractal.device import activity, cache, compiler, driver_files, drivers_folder, isolate
from clfractal.device.compiler import BuildFailureError, Warm
from clfractal.device.quirks import (
    cannot_run_optimised_code,
    loses_copies_when_unrolling,
    vectorises_what_is_wide,
)
from clfractal.device.select import Device
from clfractal.device.source import SourceMap
from clfractal.device.structs import Precision
from clfractal.errors import FileError, NotReady, Stopped, Where
from clfractal.files import system

BUILD_TIMEOUT_S = 600.0
LEAST_FILE_SIZE = 4 << 20
"""Bytes; the largest programs take half of that, and PoCL keeps several files of each."""

_REMARK_SECONDS = 1.5  # longer than a failing build takes, so that no remark precedes an error
_FORMAT = 6  # of what is kept under a key
_TURN_SECONDS = 0.02
_TOLD_BY_COMPILERS = "error:"  # in the log of a text that is wrong
_turns: WeakValueDictionary[str, Any] = WeakValueDictionary()  # locks, as long as somebody needs them
_turns_lock = threading.Lock()


@dataclass(frozen=True, slots=True)
class Program:
    """A built program. `build_ms` is the time that `build` took, whether it compiled or found a binary."""

    device: Device
    cl_program: Any
    build_ms: float
    cached: bool

    def kernel(self, name: str) -> cl.Kernel:
        """A new kernel object, with its own arguments.

        Raises:
            DeviceError: the program has no kernel of that name.
        """
        with self.device.failures(f"making the kernel {name}"):
            return cl.Kernel(self.cl_program, name)


def math_flags(precision: Precision) -> tuple[str, ...]:
    """Compiler flags by number type. None of them allows compilers to assume that numbers are finite.

    float32 may fuse a*b+c with either rounding, and denormal numbers, which no picture shows, may become
    zero. float64 must keep denormal numbers, because it is used for small differences.
    """
    flags: dict[Precision, tuple[str, ...]] = {
        "float32": ("-cl-std=CL1.2", "-cl-mad-enable", "-cl-denorms-are-zero"),
        "float64": ("-cl-std=CL1.2", "-cl-mad-enable"),
    }
    return flags[precision]


def build(
    device: Device,
    text: str,
    *,
    flags: Sequence[str],
    sources: SourceMap | None = None,
    warm: Sequence[Warm] = (),
    isolated: bool = True,
    keep: bool = True,
    on_compile: Callable[[str], None] | None = None,
    stopped: Callable[[], bool] | None = None,
    waits: bool = True,
    what: str = "",
) -> Program:
    """The program of one flat text, from the cache or the driver's compiler.

    Args:
        device: the device that runs it.
        text: the whole program, with `#line` directives (see `source.flatten`).
        flags: all compiler flags (see `math_flags`).
        sources: the texts that the `#line` directives name, for messages.
        warm: first launches to perform before the binary is kept, so that later runs start at once.
        isolated: compile in a child process, so that a driver that aborts takes only the child with it, and
            an interrupt is answered at once.
        keep: whether a later process may want it.
        on_compile: called with a message, from another thread, if compiling takes more than a moment.
        stopped: asked at least every 20 ms while a child process compiles; it ends the child by answering True.
        waits: whether it is built if it is not loaded yet.
        what: a word for what the program does, for whoever waits.

    Raises:
        KernelBuildError: the program does not compile, with our file, line and an excerpt.
        DeviceError: the driver failed or aborted.
        FileError: there is no room for the driver's files, or the process may write only files that are too small for them.
        Stopped: `stopped` answered True.
        NotReady: it is not loaded, and the caller does not wait.
    """
    start = time.perf_counter()
    text, flags = _as_compiled(device, text, flags)
    key = _key(device, text, flags, warm)
    program = device.loaded.get(key)
    if program is not None:
        return Program(device, program, _milliseconds(start), cached=True)
    if not waits:
        raise NotReady
    _check_file_sizes()
    # Of devices of one kind one compiles, and the others find it in the cache.
    with device.loaded.building, _alone(key, stopped):
        try:
            program, cached = _built(
                device, key, text, flags, warm, isolated, keep, on_compile, stopped, what
            )
        except BuildFailureError as failure:
            from clfractal.device.buildlog import build_error

            raise build_error(str(failure), text, sources or SourceMap(), device.info.name) from None
    device.loaded.keep(key, program)
    return Program(device, program, _milliseconds(start), cached=cached)


def loaded(device: Device, text: str, *, flags: Sequence[str], warm: Sequence[Warm] = ()) -> Program | None:
    """The program of a text, as `build` gives it, if it is loaded already; else None."""
    start = time.perf_counter()
    program = device.loaded.get(_key(device, *_as_compiled(device, text, flags), warm))
    return None if program is None else Program(device, program, _milliseconds(start), cached=True)


def is_kept(device: Device, text: str, *, flags: Sequence[str], warm: Sequence[Warm] = ()) -> bool:
    """Whether the cache on the disk has the program of a text, as `build` gives it; then it counts as used."""
    return cache.load_blob(_key(device, *_as_compiled(device, text, flags), warm)) is not None


def _as_compiled(device: Device, text: str, flags: Sequence[str]) -> tuple[str, Sequence[str]]:
    """The text and the flags that a device's compiler is given."""
    if cannot_run_optimised_code(device.info):
        text, flags = "#define INTERPRETED\n" + text, [*flags, "-cl-opt-disable"]
    if loses_copies_when_unrolling(device.info):
        text = "#define COUNTS_AT_RUN_TIME\n" + text
    if vectorises_what_is_wide(device.info):
        text = "#define __kernel __kernel __attribute__((intel_vec_len_hint(1)))\n" + text
    return text, flags


def _check_file_sizes() -> None:
    """Drivers write their programs into files of their own, and abort where these may not be large enough.

    Raises:
        FileError: the files of this process may not.
    """
    limit = system.file_size_limit()
    if limit is not None and limit < LEAST_FILE_SIZE:
        raise FileError(
            f"allows files of {limit} bytes; the files of compiled programs need {LEAST_FILE_SIZE}",
            Where("ulimit -f"),
        )


@contextmanager
def _alone(key: str, stopped: Callable[[], bool] | None) -> Iterator[None]:
    """One thread at a time for a key.

    Raises:
        Stopped: `stopped` answered True while another thread had its turn.
    """
    with _turns_lock:
        turn = _turns.setdefault(key, threading.Lock())
    while not turn.acquire(timeout=_TURN_SECONDS):
        if stopped is not None and stopped():
            raise Stopped
    try:
        yield
    finally:
        turn.release()


def _built(
    device: Device,
    key: str,
    text: str,
    flags: Sequence[str],
    warm: Sequence[Warm],
    isolated: bool,
    keep: bool,
    on_compile: Callable[[str], None] | None,
    stopped: Callable[[], bool] | None,
    what: str,
) -> tuple[Any, bool]:
    """The program, and whether the cache on the disk had it."""
    binary = cache.load_blob(key)
    if binary is not None:
        program = compiler.load_kept(device, binary, text, flags)
        if program is not None:
            _note(key, binary)
            return program, True
        cache.drop_blob(key)
    doing = " ".join(filter(None, ("compiling", what, "for", device.info.name)))
    remark = threading.Timer(_REMARK_SECONDS, _tell, (on_compile, f"{doing}, once"))
    remark.daemon = True
    remark.start()
    try:
        with activity.doing(doing):
            program, binary = _compile(device, text, flags, warm, isolated=isolated, stopped=stopped)
    finally:
        remark.cancel()
    if binary and keep and cache.store_blob(key, binary):
        _note(key, binary)
    return program, False


def _note(key: str, kept: bytes) -> None:
    if driver_files.is_packed(kept):
        driver_files.note(key, kept)


def _tell(listener: Callable[[str], None] | None, line: str) -> None:
    if listener is not None:
        listener(line)


def _compile(
    device: Device,
    text: str,
    flags: Sequence[str],
    warm: Sequence[Warm],
    *,
    isolated: bool,
    stopped: Callable[[], bool] | None,
) -> tuple[Any, bytes]:
    """The program and what to keep of it, which may be empty."""
    if isolated:
        binary = _compile_in_child(device, text, flags, warm, stopped)
        program = compiler.load_kept(device, binary, text, flags) if binary else None
        if program is not None:
            return program, binary
        # A driver without binaries (or that cannot read its own): the child has shown that compiling is safe.
    return compiler.compile_and_keep(device, text, flags, warm)


def _compile_in_child(
    device: Device,
    text: str,
    flags: Sequence[str],
    warm: Sequence[Warm],
    stopped: Callable[[], bool] | None,
) -> bytes:
    request = {"text": text, "flags": list(flags), "warm": [launch.as_data() for launch in warm]}

    def attempt(folder: Path) -> str | None:
        failure: str | None = isolate.run(
            "clfractal.device.compiler:compile_job",
            device,
            request,
            doing="building a program",
            timeout_s=BUILD_TIMEOUT_S,
            folder=folder,
            stopped=stopped,
        )
        return failure

    with isolate.job_folder() as temporary:
        try:
            failure = attempt(temporary)
        except isolate.DriverAbortedError:
            # Intel's compiler crashes on one text in some ten, at random, and builds it the next time.
            failure = attempt(temporary)
        if failure is not None:
            if _TOLD_BY_COMPILERS not in failure:
                drivers_folder.check_room()
            raise BuildFailureError(failure)
        return (temporary / compiler.BINARY).read_bytes()


def _key(device: Device, text: str, flags: Sequence[str], warm: Sequence[Warm]) -> str:
    # Of the first launches only what the driver generates code for: its arguments' values change from scene to
    # scene.
    launches = [(launch.kernel, launch.local_size) for launch in warm]
    return cache.key_of(_FORMAT, device.info.key, list(flags), launches, _digest(text))


@lru_cache(maxsize=64)
def _digest(text: str) -> str:
    """Of the texts that `source.flatten` keeps, too: they are asked for picture after picture."""
    return hashlib.sha256(text.encode()).hexdigest()


def _milliseconds(start: float) -> float:
    return 1e3 * (time.perf_counter() - start)
