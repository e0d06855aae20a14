"""Builds a program in this process, and the tiny first launch that makes a driver finish its work.

PoCL generates machine code only when a kernel is first enqueued, once per kernel and local size. A `Warm`
recipe lets that happen at once, in the child, so that what is kept of the program holds the machine code too.
"""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyopencl as cl

from clfractal.device import driver_files, drivers_folder
from clfractal.device.groups import fitting
from clfractal.device.select import Device, by_key, is_pocl
from clfractal.errors import DeviceError

BINARY = "binary"  # the file that `compile_job` leaves

ArgumentKind = Literal["buffer", "scalar", "bytes", "local"]


class BuildFailureError(Exception):
    """The compiler refused the program; the argument is its log."""


@dataclass(frozen=True, slots=True)
class Argument:
    """A kernel's argument for a first launch, as plain data.

    `buffer`: a zero-filled device buffer of `size` bytes; `local`: local memory of `size` bytes; `scalar`:
    the number `value` of NumPy type `dtype`; `bytes`: a struct by value, its bytes in hexadecimal in `dtype`.
    """

    kind: ArgumentKind
    size: int = 0
    dtype: str = ""
    value: float = 0.0


@dataclass(frozen=True, slots=True)
class Warm:
    """A first launch of `kernel`: small, harmless with zero-filled buffers, of the local size used later.

    PoCL also makes different code with and without a global offset (do not use one) and for a global size
    above 65535 in a dimension.
    """

    kernel: str
    global_size: tuple[int, ...]
    local_size: tuple[int, ...] | None
    arguments: tuple[Argument, ...]

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "kernel": self.kernel,
            "global_size": list(self.global_size),
            "local_size": None if self.local_size is None else list(self.local_size),
            "arguments": [[each.kind, each.size, each.dtype, each.value] for each in self.arguments],
        }

    @staticmethod
    def from_data(data: Mapping[str, Any]) -> Warm:
        """The recipe from the result of `as_data`."""
        local = data["local_size"]
        return Warm(
            data["kernel"],
            tuple(data["global_size"]),
            None if local is None else tuple(local),
            tuple(Argument(*each) for each in data["arguments"]),
        )


def compile_source(device: Device, text: str, flags: Sequence[str]) -> Any:
    """Let the driver compile `text`; gives pyopencl's low-level program.

    Raises:
        BuildFailureError: with the compiler's log.
        DeviceError: the driver failed otherwise.
    """
    with device.failures("building a program"):
        # The low-level class: pyopencl's own keeps a second cache and leaves a copy of a failed source
        # behind.
        program = cl._cl._Program(device.context, text)
        return _build(device, program, flags)


def load_binary(device: Device, binary: bytes, flags: Sequence[str]) -> Any | None:
    """The program from a binary that this driver gave earlier; None if the driver refuses it."""
    try:
        program = cl._cl._Program(device.context, [device.cl_device], [binary])
        return _build(device, program, flags)
    except (cl.Error, BuildFailureError):
        return None


def load_kept(device: Device, kept: bytes, text: str, flags: Sequence[str]) -> Any | None:
    """The program from what `compile_and_keep` gave for it; None if the driver refuses it.

    Raises:
        FileError: there is no room for the driver's files.
    """
    if not driver_files.is_packed(kept):
        return load_binary(device, kept, flags)
    binary = driver_files.binary_in(kept)
    try:
        with driver_files.laid_out(kept):
            program = load_binary(device, binary, flags) if binary else compile_source(device, text, flags)
    except (BuildFailureError, DeviceError) as error:
        drivers_folder.check_room()
        if isinstance(error, DeviceError):
            raise
        return None
    if program is None:
        drivers_folder.check_room()
    return program


def compile_and_keep(
    device: Device, text: str, flags: Sequence[str], warm: Sequence[Warm]
) -> tuple[Any, bytes]:
    """The program, after its first launches, and what to keep of it, which may be empty: files of the driver or a binary.

    Of PoCL both are kept, see `driver_files`.

    Raises:
        BuildFailureError: with the compiler's log.
        DeviceError: the driver failed otherwise.
    """
    if not is_pocl(device.info) or os.environ.get("POCL_KERNEL_CACHE", "1") == "0":
        program = _compiled(device, text, flags, warm)
        return program, binary_of(program)
    with driver_files.recorded() as folders:
        program = _compiled(device, text, flags, warm)
    binary = _loadable(device, program, flags, folders)
    return program, driver_files.packed(folders, binary) or binary_of(program)


def _loadable(device: Device, program: Any, flags: Sequence[str], folders: Sequence[str]) -> bytes:
    """The binary that PoCL gives of a program without compiling it again; empty if it cannot load it itself."""
    with driver_files.stand_ins(folders) as found:
        binary = binary_of(program) if found else b""
        return binary if binary and load_binary(device, binary, flags) is not None else b""


def _compiled(device: Device, text: str, flags: Sequence[str], warm: Sequence[Warm]) -> Any:
    program = compile_source(device, text, flags)
    for launch in warm:
        warm_up(device, program, launch)
    return program


def binary_of(program: Any) -> bytes:
    """The driver's binary of a program built for one device; empty if the driver has none."""
    try:
        binaries = program.get_info(cl.program_info.BINARIES)
    except cl.Error:
        return b""
    return bytes(binaries[0]) if binaries else b""


def warm_up(device: Device, program: Any, warm: Warm) -> None:
    """Run the first launch and wait for it.

    Raises:
        DeviceError: the launch failed.
    """
    with device.failures(f"launching {warm.kernel} for the first time"):
        kernel = cl.Kernel(program, warm.kernel)
        values = [_value(device, argument) for argument in warm.arguments]
        for index, value in enumerate(values):
            kernel.set_arg(index, value)  # keeps no reference: `values` must outlive the launch
        local = None if warm.local_size is None else fitting(device, kernel, warm.local_size)
        cl.enqueue_nd_range_kernel(device.queue, kernel, warm.global_size, local).wait()


def compile_job(request: Mapping[str, Any]) -> str | None:
    """Compile and warm up in a child: leaves what to keep in the folder, or returns the compiler's log.

    Raises:
        FileError: there is no room for it.
    """
    device = by_key(*request["device"])
    warm = [Warm.from_data(launch) for launch in request["warm"]]
    try:
        _, kept = compile_and_keep(device, request["text"], request["flags"], warm)
    except BuildFailureError as failure:
        return str(failure)
    try:
        (Path(request["folder"]) / BINARY).write_bytes(kept)
    except OSError as error:
        raise drivers_folder.no_room(error) from error
    return None


def _value(device: Device, argument: Argument) -> Any:
    if argument.kind == "scalar":
        return np.dtype(argument.dtype).type(argument.value)
    if argument.kind == "bytes":
        return bytes.fromhex(argument.dtype)
    if argument.kind == "local":
        return cl.LocalMemory(argument.size)
    zeros = np.zeros(max(argument.size, 16), np.uint8)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    return cl.Buffer(device.context, flags, hostbuf=zeros)


def _build(device: Device, program: Any, flags: Sequence[str]) -> Any:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore"
            )  # pyopencl warns of any compiler output, "1 kernel built" included
            program._build(" ".join(flags).encode(), [device.cl_device])
    except cl.Error as error:
        failure = cl.status_code
        if getattr(error, "code", 0) in (failure.BUILD_PROGRAM_FAILURE, failure.COMPILE_PROGRAM_FAILURE):
            raise BuildFailureError(_log(device, program)) from error
        raise
    return program


def _log(device: Device, program: Any) -> str:
    with contextlib.suppress(cl.Error):
        return str(program.get_build_info(device.cl_device, cl.program_build_info.LOG)).replace("\0", "")
    return ""
