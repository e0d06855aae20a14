"""Finds OpenCL devices, knows their peculiarities, and chooses one.

`Device` wraps a device with its context and queue, so that only code that owns buffers has to import
pyopencl.
"""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache as cache_of_calls
from functools import cached_property
from typing import Any, Literal

import pyopencl as cl

from clfractal.device import ahead, bundled, cache, drivers_folder
from clfractal.device.advice import install_hint
from clfractal.device.driver_errors import error_code, is_out_of_memory
from clfractal.device.forked import use_opencl
from clfractal.device.loaded import LoadedPrograms
from clfractal.device.subdevices import divided, without_parts
from clfractal.device.unknown_cpu import name_processor
from clfractal.errors import (
    STATUS_BAD_INPUT,
    STATUS_DEVICE_FAILED,
    DeviceError,
    UntriedError,
    Where,
    unknown_name,
)
from clfractal.errors.arguments import plain, shown

# pyopencl's own cache holds only how arguments are passed. It lies in the home folder, where one may not be able to
# write, and reading it takes longer than making its contents anew (15 ms of a start, instead of 10).
cl._PYOPENCL_NO_CACHE = True

ENVIRONMENT_VARIABLE = "CLFRACTAL_DEVICE"
ALL = "all"
"""Names every device."""
SPEEDS = "speeds"  # section of the cache: rays per second or the like, by `DeviceInfo.key`

Kind = Literal["cpu", "gpu", "accelerator"]

Properties = Sequence[tuple[Any, Any]]
"""Of a context, beside its platform: pairs of `cl.context_properties`, or their numbers, and values."""


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """The data of a device that are known without opening it. Memory is in bytes."""

    index: str
    """Platform and device number as in `--device 0:0`, both counted from 0 in the loader's order; of a part of a device
    also how it is divided, and which part it is, counted from 1: `0:0/1+1#2`."""
    name: str
    platform: str
    version: str
    """The platform's version text, which for CPU runtimes names the compiler too."""
    driver: str
    kind: Kind
    memory: int
    max_alloc: int
    has_float64: bool
    gl_sharing: bool
    """Whether it can share textures with an OpenGL context that it draws for."""
    compute_units: int
    target: str
    """The device's own version text; PoCL names the processor it generates code for in it."""

    @property
    def key(self) -> str:
        """Names this device with this driver in caches: a new driver or processor gives a new key."""
        return " | ".join((self.platform, self.version, self.name, self.target, self.driver))


class Device:
    """An OpenCL device with a context of its own, made when it is first needed, as its two queues are.

    Threads that need them first at the same time get the same ones: what is made in one context is of no use in another.
    `loaded` keeps programs of this context, and goes with it.

    Args:
        info: what is known of it.
        cl_device: pyopencl's device.
        properties: of its context, added to the platform, such as those that let it share textures with an OpenGL
            context.
        make_context: makes the context from the device and the properties, where pyopencl would refuse them.
    """

    def __init__(
        self,
        info: DeviceInfo,
        cl_device: cl.Device,
        properties: Properties = (),
        make_context: Callable[[cl.Device, Properties], cl.Context] | None = None,
    ) -> None:
        self.info = info
        self.cl_device = cl_device
        self.properties = tuple(properties)
        self._make_context = make_context
        self._parts: dict[tuple[int, ...], tuple[Device, ...]] = {}
        self.loaded = LoadedPrograms()
        # From Python 3.12 on threads may compute a cached property at the same time, each its own.
        self._opening = threading.RLock()

    def __repr__(self) -> str:
        return f"Device({self.info.index} {self.info.name!r})"

    @property
    def context(self) -> cl.Context:
        with self._opening:
            return self._context

    @property
    def queue(self) -> cl.CommandQueue:
        """For kernels: in order, profiling on."""
        with self._opening:
            return self._queue

    @property
    def transfers(self) -> cl.CommandQueue:
        """For what is read while kernels run: in their queue it would wait for the launch before or after."""
        with self._opening:
            return self._transfers

    @cached_property
    def _context(self) -> cl.Context:
        with self.failures("opening the device"):
            if self._make_context is not None:
                return self._make_context(self.cl_device, self.properties)
            if not self.properties:
                return cl.Context([self.cl_device])
            platform = (cl.context_properties.PLATFORM, self.cl_device.platform)
            wanted: Any = [platform, *self.properties]
            return cl.Context([self.cl_device], properties=wanted)

    @cached_property
    def _queue(self) -> cl.CommandQueue:
        with self.failures("opening the device"):
            return cl.CommandQueue(self._context, properties=cl.command_queue_properties.PROFILING_ENABLE)

    @cached_property
    def _transfers(self) -> cl.CommandQueue:
        with self.failures("opening the device"):
            return cl.CommandQueue(self._context)

    def reopened(
        self,
        properties: Properties = (),
        make_context: Callable[[cl.Device, Properties], cl.Context] | None = None,
    ) -> Device:
        """The same device with another context, whose buffers and programs are its own."""
        return Device(self.info, self.cl_device, properties, make_context)

    def divided(self, counts: tuple[int, ...]) -> tuple[Device, ...]:
        """Parts with so many compute units, each a device with a context of its own; the same ones at every call.

        Raises:
            DeviceError: see `subdevices.divided`.
        """
        if counts not in self._parts:
            index = f"{self.info.index}/{'+'.join(map(str, counts))}"
            found = divided(self.cl_device, counts, f"{self.info.index} {self.info.name}")
            self._parts[counts] = tuple(
                Device(
                    replace(self.info, index=f"{index}#{number}", compute_units=units, gl_sharing=False), part
                )
                for number, (units, part) in enumerate(zip(counts, found, strict=True), 1)
            )
        return self._parts[counts]

    def buffer(self, nbytes: int, what: str, *, read_only: bool = False) -> cl.Buffer:
        """Allocate `nbytes` of device memory for `what` (used in the message).

        Raises:
            DeviceError: status 2, with the memory needed and available, when it does not fit.
        """
        self.check_memory(nbytes, what, largest=nbytes)
        flags = cl.mem_flags.READ_ONLY if read_only else cl.mem_flags.READ_WRITE
        with self.failures(f"allocating {what}", need=nbytes):
            return cl.Buffer(self.context, flags, max(int(nbytes), 16))

    def check_memory(self, total: int, what: str, *, largest: int = 0) -> None:
        """Refuse work whose buffers, with `total` bytes and the `largest` one, do not fit on the device.

        Raises:
            DeviceError: status 2, with the memory needed and available.
        """
        for need, have, limit in (
            (total, self.info.memory, "memory"),
            (largest, self.info.max_alloc, "memory for one buffer"),
        ):
            if need > have:
                raise DeviceError(
                    f"{what} needs {shown_size(need)} of device memory, "
                    f"{self.info.name} has {shown_size(have)} of {limit}",
                    status=STATUS_BAD_INPUT,
                )

    @contextmanager
    def failures(self, doing: str, *, need: int | None = None) -> Iterator[None]:
        """Turn pyopencl's exceptions into DeviceError: status 2 if memory is missing, else 3."""
        use_opencl()
        try:
            yield
        except cl.Error as error:
            name = self.info.name
            if is_out_of_memory(error):
                wanted = f"{shown_size(need)} are needed, " if need is not None else ""
                raise DeviceError(
                    f"{name}: out of device memory while {doing}: "
                    f"{wanted}{shown_size(self.info.memory)} are available",
                    details=str(error),
                    status=STATUS_BAD_INPUT,
                ) from error
            raise DeviceError(
                f"{name}: the device failed while {doing}: {error_code(error)}", details=str(error)
            ) from error


def devices() -> list[DeviceInfo]:
    """Every OpenCL device, in the loader's order; an empty list if there is none."""
    return [device.info for device in _found()]


def choose(spec: str | None = None, *, properties: Properties = ()) -> Device:
    """The device that `spec` names, else the environment variable CLFRACTAL_DEVICE, else the best one.

    `spec` is `cpu`, `gpu`, `accelerator`, indices `PLATFORM:DEVICE`, or part of a device's or platform's name
    (of its version, if no name fits), in any case of letters. Where several fit, the best is taken. With `/N` behind it
    it is N compute units of that device.

    Without `properties` the context is one that the process shares: what was compiled for an earlier picture is still
    loaded. With them (see `Device`) it is a new one.

    Raises:
        DeviceError: status 2 if nothing fits `spec`, or the variable POCL_CACHE_DIR keeps PoCL from working; status 3 if
            there is no device at all.
        FileError: no folder for the cache can be written, not even a temporary one.
    """
    if spec is not None and not isinstance(spec, str):
        message = f"must be text such as cpu, gpu, 0:0 or part of a name, got {shown(plain(spec))}"
        raise DeviceError(message, Where(path="device"), status=STATUS_BAD_INPUT)
    found = _found()
    if not found:
        raise drivers_folder.problem() or DeviceError(install_hint())
    spec, counts = without_parts(
        (spec if spec is not None else os.environ.get(ENVIRONMENT_VARIABLE, "")).strip()
    )
    if spec.casefold() == ALL or len(counts) > 1:
        raise DeviceError(
            "names several devices, but this work takes one", Where("--device"), status=STATUS_BAD_INPUT
        )
    fitting = _fitting(found, spec)
    if not fitting:
        raise drivers_folder.problem() or _nothing_fits(found, spec)
    speeds = cache.recall(SPEEDS)
    if any(device.info.key not in speeds for device in fitting):
        speeds = {}  # speeds count only if all these devices were measured
    best = max(fitting, key=lambda device: _score(device.info, speeds))
    wrong = drivers_folder.problem() if is_pocl(best.info) else None
    if wrong is not None:
        raise wrong
    if counts:
        best = best.divided(counts)[0]
    return best.reopened(properties) if properties else best


def by_key(index: str, key: str) -> Device:
    """The device with that `DeviceInfo.key`, the one at `index` if several are alike; UntriedError if it is gone."""
    alike = [device for device in _found() if device.info.key == key]
    if not alike:
        raise UntriedError(f"the device {index} was removed or has changed")
    return next((device for device in alike if device.info.index == index), alike[0])


def is_simulator(info: DeviceInfo) -> bool:
    """Oclgrind interprets every instruction, some 10,000 times slower: only taken when asked for by name."""
    return "oclgrind" in f"{info.platform} {info.name}".casefold()


def is_pocl(info: DeviceInfo) -> bool:
    """PoCL's CPU and GPU devices."""
    return info.platform == "Portable Computing Language"


def is_intel_cpu(info: DeviceInfo) -> bool:
    """Intel's CPU runtime, which prefixes its platform and devices alike with `Intel(R)`."""
    return info.kind == "cpu" and info.platform.startswith("Intel(R)")


def is_rusticl(info: DeviceInfo) -> bool:
    """Mesa's OpenCL, for AMD's and Intel's GPUs and, as llvmpipe, for processors."""
    return info.platform.casefold() == "rusticl"


def has_float64(info: DeviceInfo) -> bool:
    """Whether `double` works: its capabilities are non-zero, or the extension is named."""
    return info.has_float64


def _found() -> list[Device]:
    use_opencl()
    return _find()


@cache_of_calls
def _find() -> list[Device]:
    """Once for a process: the devices whose contexts are shared by all who ask for no context of their own."""
    ahead.wait()
    bundled.offer()
    with drivers_folder.given_to_drivers():
        return _look()


def _look() -> list[Device]:
    found: list[Device] = []
    seen: set[int] = set()
    try:
        platforms = cl.get_platforms()
    except cl.Error:  # PLATFORM_NOT_FOUND_KHR: the loader found no driver
        return []
    for platform_index, platform in enumerate(platforms):
        try:
            cl_devices = platform.get_devices()
        except cl.Error:  # a driver without its hardware
            continue
        for device_index, cl_device in enumerate(cl_devices):
            # The same driver may be registered twice (the wheel's PoCL by itself and through OCL_ICD_VENDORS).
            if cl_device.int_ptr not in seen:
                seen.add(cl_device.int_ptr)
                info = _describe(f"{platform_index}:{device_index}", platform, cl_device)
                processor = name_processor(cl_device.int_ptr) if is_pocl(info) else None
                if processor is not None:  # what was measured under the wrong name does not count
                    info = replace(info, driver=f"{info.driver}, {processor.decode()}")
                found.append(Device(info, cl_device))
    return found


def _describe(index: str, platform: cl.Platform, device: cl.Device) -> DeviceInfo:
    extensions = set(device.extensions.split())
    return DeviceInfo(
        index=index,
        name=_tidy(device.name),
        platform=_tidy(platform.name),
        version=_tidy(platform.version),
        driver=_tidy(device.driver_version),
        kind=_kind(device),
        memory=int(device.global_mem_size),
        max_alloc=int(device.max_mem_alloc_size),
        has_float64=_double_capabilities(device) != 0 or "cl_khr_fp64" in extensions,
        gl_sharing="cl_khr_gl_sharing" in extensions,
        compute_units=int(device.max_compute_units),
        target=_tidy(device.version),
    )


def _kind(device: cl.Device) -> Kind:
    # Oclgrind says it is every type at once, so the processor is asked for first.
    if int(device.type) & int(cl.device_type.CPU):
        return "cpu"
    return "gpu" if int(device.type) & int(cl.device_type.GPU) else "accelerator"


def _double_capabilities(device: cl.Device) -> int:
    try:
        return int(device.double_fp_config)
    except (cl.Error, AttributeError):  # the question is unknown to OpenCL 1.1 drivers
        return 0


def _tidy(text: str) -> str:
    return " ".join(text.replace("\0", " ").split())


def _fitting(found: list[Device], spec: str) -> list[Device]:
    wanted = spec.casefold()
    if not wanted:
        return [device for device in found if not is_simulator(device.info)]
    if re.fullmatch(r"\d+:\d+", wanted):
        return [device for device in found if device.info.index == wanted]
    if wanted in ("cpu", "gpu", "accelerator"):
        return [device for device in found if device.info.kind == wanted and not is_simulator(device.info)]
    for text in (_names, _versions):
        fitting = [device for device in found if wanted in text(device.info).casefold()]
        if fitting:
            return fitting
    return []


def _names(info: DeviceInfo) -> str:
    return f"{info.name}\n{info.platform}"


def _versions(info: DeviceInfo) -> str:
    return f"{info.version}\n{info.target}\n{info.driver}"


def _nothing_fits(found: list[Device], spec: str) -> DeviceError:
    there = "; ".join(f"{device.info.index} {device.info.name} ({device.info.platform})" for device in found)
    if not spec:
        return DeviceError(
            f"{install_hint()}; only a simulator was found: {there}", status=STATUS_DEVICE_FAILED
        )
    if re.fullmatch(r"\d+:\d+", spec) or spec.casefold() in ("cpu", "gpu", "accelerator"):
        return DeviceError(f"no device {spec!r}; available: {there}", status=STATUS_BAD_INPUT)
    words = {word for device in found for word in _names(device.info).split()}
    guess = unknown_name("device", spec, words)
    if "did you mean" in guess:
        return DeviceError(f"{guess.rstrip('?')}, in {there}?", status=STATUS_BAD_INPUT)
    return DeviceError(f"unknown device {spec[:60]!r}; available: {there}", status=STATUS_BAD_INPUT)


def _score(info: DeviceInfo, speeds: dict[str, Any]) -> tuple[Any, ...]:
    """Larger is better: GPU, then measured speed, then what was fastest where it was measured."""
    measured = speeds.get(info.key)
    speed = float(measured) if isinstance(measured, (int, float)) else 0.0
    runtime = 2 if is_intel_cpu(info) else 1 if is_pocl(info) else 0
    return (
        not is_simulator(info),
        {"gpu": 2, "cpu": 1, "accelerator": 0}[info.kind],
        speed,
        runtime,
        _version_numbers(info.version),
        info.compute_units,
    )


def _version_numbers(version: str) -> tuple[int, ...]:
    """The runtime's own version: `OpenCL 3.0 PoCL 3.1+debian` gives (3, 1), `OpenCL 3.1 LINUX` too."""
    match = re.search(r"PoCL (\d+(?:\.\d+)*)", version) or re.search(r"OpenCL (\d+(?:\.\d+)*)", version)
    return tuple(int(number) for number in match.group(1).split(".")) if match else ()


def shown_size(nbytes: int) -> str:
    """A size in bytes for messages, such as `1.5 GiB`."""
    return f"{nbytes / 2**30:.1f} GiB" if nbytes >= 2**30 else f"{nbytes / 2**20:.1f} MiB"
