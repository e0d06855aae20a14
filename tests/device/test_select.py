"""Which device is taken, and what is said when none fits."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyopencl as cl
import pytest

from clfractal.device import cache, select
from clfractal.device.select import Device, DeviceInfo, Properties, choose, devices
from clfractal.errors import DeviceError

_BASE = DeviceInfo(
    index="0:0",
    name="pthread-Some Processor",
    platform="Portable Computing Language",
    version="OpenCL 3.0 PoCL 3.0-rc2 Linux, Release, LLVM 14.0.6",
    driver="3.0-rc2",
    kind="cpu",
    memory=8 << 30,
    max_alloc=2 << 30,
    has_float64=True,
    gl_sharing=False,
    compute_units=2,
    target="OpenCL 3.0 PoCL HSTR: pthread-x86_64",
)
_POCL = _BASE
_NEWER_POCL = dataclasses.replace(
    _BASE, index="1:0", version="OpenCL 3.0 PoCL 3.1+debian Linux", driver="3.1"
)
_POCL_10 = dataclasses.replace(_BASE, index="5:0", version="OpenCL 3.0 PoCL 10.0 Linux", driver="10.0")
_INTEL = dataclasses.replace(
    _BASE,
    index="2:0",
    name="Intel(R) Xeon(R)",
    platform="Intel(R) OpenCL",
    version="OpenCL 3.1 LINUX",
    driver="2026",
)
_OCLGRIND = dataclasses.replace(
    _BASE, index="3:0", name="Oclgrind Simulator", platform="Oclgrind", version="OpenCL 1.2 (Oclgrind 21.10)"
)
_GPU = dataclasses.replace(
    _BASE, index="4:0", name="NVIDIA H200", platform="NVIDIA CUDA", version="OpenCL 3.0 CUDA", kind="gpu"
)


@pytest.fixture
def there(monkeypatch: pytest.MonkeyPatch, empty_cache: Path) -> pytest.MonkeyPatch:
    monkeypatch.delenv(select.ENVIRONMENT_VARIABLE, raising=False)
    return monkeypatch


def _let_there_be(monkeypatch: pytest.MonkeyPatch, *infos: DeviceInfo) -> None:
    found = [Device(info, None) for info in infos]  # type: ignore[arg-type]
    monkeypatch.setattr(select, "_find", lambda: found)


def test_the_device_here_is_described() -> None:
    found = devices()
    assert found
    for info in found:
        assert info.name
        assert info.platform
        assert info.memory > 0
        assert info.max_alloc > 0
        assert info.compute_units >= 1
        assert "\0" not in info.key
    assert len({info.index for info in found}) == len(found)


def test_every_listed_device_can_be_chosen_by_its_index() -> None:
    for info in devices():
        assert choose(info.index).info == info
        assert select.by_key(info.index, info.key).info == info


def test_gpu_goes_before_cpu(there: pytest.MonkeyPatch) -> None:
    _let_there_be(there, _INTEL, _POCL, _GPU)
    assert choose().info == _GPU
    assert choose("cpu").info == _INTEL
    assert choose("gpu").info == _GPU


def test_cpu_runtimes_by_experience(there: pytest.MonkeyPatch) -> None:
    _let_there_be(there, _POCL, _OCLGRIND, _NEWER_POCL, _INTEL)
    assert choose().info == _INTEL
    _let_there_be(there, _POCL, _OCLGRIND, _NEWER_POCL)
    assert choose().info == _NEWER_POCL
    _let_there_be(there, _NEWER_POCL, _POCL_10, _POCL)
    assert choose().info == _POCL_10


def test_measured_speed_goes_before_experience_where_all_are_measured(there: pytest.MonkeyPatch) -> None:
    _let_there_be(there, _INTEL, _NEWER_POCL)
    cache.remember(select.SPEEDS, _NEWER_POCL.key, 2e7)
    assert choose().info == _INTEL
    cache.remember(select.SPEEDS, _INTEL.key, 1e7)
    assert choose().info == _NEWER_POCL


def test_a_simulator_is_only_taken_by_name(there: pytest.MonkeyPatch) -> None:
    _let_there_be(there, _OCLGRIND, _POCL)
    assert choose().info == _POCL
    assert choose("oclgrind").info == _OCLGRIND
    _let_there_be(there, _OCLGRIND)
    with pytest.raises(
        DeviceError, match=r"pip install pocl-binary-distribution.*only a simulator"
    ) as caught:
        choose()
    assert caught.value.status == 3
    with pytest.raises(DeviceError, match="no device 'cpu'"):
        choose("cpu")


def test_by_part_of_a_name_in_any_case(there: pytest.MonkeyPatch) -> None:
    _let_there_be(there, _POCL, _NEWER_POCL, _INTEL, _GPU)
    assert choose("nvidia").info == _GPU
    assert choose("h200").info == _GPU
    assert choose("INTEL").info == _INTEL
    assert choose("portable computing").info == _NEWER_POCL
    assert choose("debian").info == _NEWER_POCL, "the version, where no name fits"
    assert choose("0:0").info == _POCL


def test_the_environment_variable_counts_less_than_the_flag(there: pytest.MonkeyPatch) -> None:
    _let_there_be(there, _POCL, _INTEL, _GPU)
    there.setenv(select.ENVIRONMENT_VARIABLE, "intel")
    assert choose().info == _INTEL
    assert choose("gpu").info == _GPU


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("quantum", r"^unknown device 'quantum'; available: 0:0 pthread-Some Processor \(Portable"),
        ("NVIDA", r"^unknown device 'NVIDA'; did you mean 'NVIDIA', in 0:0 pthread-Some"),
        ("7:0", r"^no device '7:0'; available: 0:0 pthread"),
        ("accelerator", r"^no device 'accelerator'; available: 0:0 pthread"),
    ],
)
def test_what_does_not_exist_is_told(there: pytest.MonkeyPatch, spec: str, message: str) -> None:
    _let_there_be(there, _POCL, _GPU)
    with pytest.raises(DeviceError, match=message) as caught:
        choose(spec)
    assert caught.value.status == 2
    assert "\n" not in str(caught.value)


def test_no_device_at_all(tmp_path: Path) -> None:
    """The wheel's loader looks in PYOPENCL_HOME as well, which pyopencl sets when it is imported."""
    code = (
        "import os, pyopencl; os.environ['PYOPENCL_HOME'] = os.environ['OCL_ICD_VENDORS']\n"
        "from clfractal.device.select import choose, devices\n"
        "from clfractal.errors import DeviceError\n"
        "assert devices() == []\n"
        "for spec in (None, 'cpu', '0:0', 'nvidia'):\n"
        "    try: choose(spec)\n"
        "    except DeviceError as error: print(error.status, error)\n"
    )
    environment = {**os.environ, "OCL_ICD_VENDORS": str(tmp_path)}
    environment.pop(select.ENVIRONMENT_VARIABLE, None)
    result = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    lines = result.stdout.splitlines()
    assert len(lines) == 4
    assert all(line.startswith("3 no OpenCL device; install a driver") for line in lines)
    assert all("pip install pocl-binary-distribution" in line for line in lines)


def test_quirks() -> None:
    assert select.is_simulator(_OCLGRIND)
    assert not any(select.is_simulator(info) for info in (_POCL, _INTEL, _GPU))
    assert [info for info in (_POCL, _INTEL, _GPU) if select.vectorises_across_work_items(info)] == [
        _INTEL,
        _GPU,
    ]
    assert not select.has_float64(dataclasses.replace(_POCL, has_float64=False))


def test_keys_tell_drivers_apart() -> None:
    keys = {info.key for info in (_POCL, _NEWER_POCL, _INTEL, _GPU)}
    assert len(keys) == 4
    assert _POCL.key == dataclasses.replace(_POCL, index="9:9").key, (
        "a place in the list is no part of a device"
    )
    assert _POCL.key != dataclasses.replace(_POCL, target="pthread-x86_64-haswell").key


def test_threads_that_open_a_device_at_the_same_time_share_its_context(device: Device) -> None:
    opened: list[cl.Context] = []

    def open_slowly(cl_device: cl.Device, properties: Properties) -> cl.Context:
        time.sleep(0.05)  # a GPU takes longer still
        opened.append(cl.Context([cl_device]))
        return opened[-1]

    shared = Device(device.info, device.cl_device, make_context=open_slowly)
    with ThreadPoolExecutor(4) as pool:
        queues = list(pool.map(lambda number: (shared.queue, shared.transfers)[number % 2], range(4)))
    assert len(opened) == 1
    assert len({queue.int_ptr for queue in queues}) == 2
    assert all(queue.context == opened[0] for queue in queues)


def test_memory_that_is_not_there_is_told_before(device: Device) -> None:
    with pytest.raises(DeviceError, match=r"^the grid needs \d+\.\d GiB of device memory, .* has") as caught:
        device.buffer(device.info.memory + (1 << 30), "the grid")
    assert caught.value.status == 2
    smaller = dataclasses.replace(device.info, max_alloc=1 << 20)
    with pytest.raises(
        DeviceError, match=r"^the grid needs 2\.0 MiB .* has 1\.0 MiB of memory for one buffer$"
    ):
        Device(smaller, device.cl_device).buffer(2 << 20, "the grid")
    device.check_memory(device.info.memory, "the grid", largest=device.info.max_alloc)


@pytest.mark.parametrize(
    "code",
    [
        cl.status_code.MEM_OBJECT_ALLOCATION_FAILURE,
        cl.status_code.OUT_OF_RESOURCES,
        cl.status_code.OUT_OF_HOST_MEMORY,
    ],
)
def test_a_device_out_of_memory_is_status_2(device: Device, code: int) -> None:
    with (
        pytest.raises(
            DeviceError, match=r"out of device memory while rendering: 512\.0 MiB are needed"
        ) as caught,
        device.failures("rendering", need=512 << 20),
    ):
        raise cl.MemoryError(cl._cl._ErrorRecord(msg="", code=int(code), routine="clCreateBuffer"))
    assert caught.value.status == 2


def test_a_device_that_fails_is_status_3(device: Device) -> None:
    """A real failure: reading beyond the end of a buffer."""
    buffer = device.buffer(64, "a little")
    expected = pytest.raises(DeviceError, match=r"the device failed while reading: cl\w+: INVALID_VALUE")
    with expected as caught, device.failures("reading"):
        cl.enqueue_copy(device.queue, bytearray(1 << 20), buffer)
    assert caught.value.status == 3
