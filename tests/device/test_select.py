"""Which device is taken, and what is said when none fits; several devices, and parts of one."""

from __future__ import annotations

import ctypes
import dataclasses
import struct
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyopencl as cl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.device import cache, choice, quirks, select, unknown_cpu
from clfractal.device.choice import choose_all
from clfractal.device.select import (
    ENVIRONMENT_VARIABLE,
    Device,
    DeviceInfo,
    Properties,
    choose,
    devices,
    is_pocl,
)
from clfractal.device.select import devices as all_devices
from clfractal.device.subdevices import without_parts
from clfractal.device.unknown_cpu import nearest_known, place_of_name, processor_features
from clfractal.errors import DeviceError
from tests.calls import failure
from tests.halves import halves_of, index_of
from tests.shell import python, works

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


_ALL_KINDS = (_POCL, _NEWER_POCL, _INTEL, _GPU)


@pytest.mark.parametrize(
    ("infos", "spec", "chosen"),
    [
        # A GPU goes before a processor.
        ((_INTEL, _POCL, _GPU), None, _GPU),
        ((_INTEL, _POCL, _GPU), "cpu", _INTEL),
        ((_INTEL, _POCL, _GPU), "gpu", _GPU),
        # Runtimes for processors by experience.
        ((_POCL, _OCLGRIND, _NEWER_POCL, _INTEL), None, _INTEL),
        ((_POCL, _OCLGRIND, _NEWER_POCL), None, _NEWER_POCL),
        ((_NEWER_POCL, _POCL_10, _POCL), None, _POCL_10),
        # By a part of a name in any case.
        (_ALL_KINDS, "nvidia", _GPU),
        (_ALL_KINDS, "h200", _GPU),
        (_ALL_KINDS, "INTEL", _INTEL),
        (_ALL_KINDS, "portable computing", _NEWER_POCL),
        (_ALL_KINDS, "debian", _NEWER_POCL),  # the version, where no name fits
        (_ALL_KINDS, "0:0", _POCL),
    ],
)
def test_what_is_chosen(
    there: pytest.MonkeyPatch, infos: tuple[DeviceInfo, ...], spec: str | None, chosen: DeviceInfo
) -> None:
    _let_there_be(there, *infos)
    assert choose(spec).info == chosen


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


def test_the_environment_variable_counts_less_than_the_flag(there: pytest.MonkeyPatch) -> None:
    _let_there_be(there, _POCL, _INTEL, _GPU)
    there.setenv(select.ENVIRONMENT_VARIABLE, "intel")
    assert choose().info == _INTEL
    assert choose("gpu").info == _GPU


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("quantum", "unknown device 'quantum'; available: 0:0 pthread-Some Processor (Portable"),
        ("NVIDA", "unknown device 'NVIDA'; did you mean 'NVIDIA', in 0:0 pthread-Some"),
        ("7:0", "no device '7:0'; available: 0:0 pthread"),
        ("accelerator", "no device 'accelerator'; available: 0:0 pthread"),
    ],
)
def test_what_does_not_exist_is_told(there: pytest.MonkeyPatch, spec: str, message: str) -> None:
    _let_there_be(there, _POCL, _GPU)
    assert str(failure(DeviceError, choose, spec)).startswith(message)


def test_no_device_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
    monkeypatch.delenv(select.ENVIRONMENT_VARIABLE, raising=False)
    lines = works(python(code, extra={"OCL_ICD_VENDORS": str(tmp_path)})).out.splitlines()
    assert len(lines) == 4
    assert all(line.startswith("3 no OpenCL device; install a driver") for line in lines)
    assert all("pip install pocl-binary-distribution" in line for line in lines)


def test_quirks() -> None:
    assert select.is_simulator(_OCLGRIND)
    assert not any(select.is_simulator(info) for info in (_POCL, _INTEL, _GPU))
    assert [info for info in (_POCL, _INTEL, _GPU) if quirks.vectorises_across_work_items(info)] == [_GPU]
    assert [info for info in (_POCL, _INTEL, _GPU) if quirks.vectorises_what_is_wide(info)] == [_INTEL]
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


# --- several devices by their names, and parts of one ---


@given(st.text(max_size=20), st.lists(st.integers(0, 999), min_size=1, max_size=5))
def test_parts_are_read(name: str, counts: list[int]) -> None:
    spec = f"{name}/{'+'.join(map(str, counts))}"
    assert without_parts(spec) == (name.strip(), tuple(counts))


@given(st.text(max_size=30).filter(lambda text: "/" not in text))
def test_other_names_have_no_parts(name: str) -> None:
    assert without_parts(name) == (name, ())


def test_halves(device: Device) -> None:
    spec = halves_of(device)
    parts = choose_all([spec])
    assert [part.info.index for part in parts] == [f"{spec}#1", f"{spec}#2"]
    assert sum(part.info.compute_units for part in parts) == device.info.compute_units
    assert [int(part.cl_device.max_compute_units) for part in parts] == [
        part.info.compute_units for part in parts
    ]
    assert {part.info.key for part in parts} == {device.info.key}
    assert choose_all([spec]) == parts  # with the contexts that they have


def test_one_part_is_one_device(device: Device) -> None:
    halves_of(device)
    assert choose(f"{device.info.index}/1").info.compute_units == 1


def test_the_variable_may_name_several(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, halves_of(device))
    assert len(choose_all()) == 2
    with pytest.raises(DeviceError, match="--device: names several devices, but this work takes one"):
        choose()


def test_all_has_one_driver_of_the_processor(device: Device) -> None:
    found = choose_all(["all"])
    assert sum(each.info.kind == "cpu" for each in found) <= 1
    assert len({each.info.index for each in found}) == len(found)
    assert found[0].info == choose("").info


@pytest.mark.parametrize(
    ("specs", "message"),
    [
        (
            ["{0}", "{0}"],
            "--device: {0} is named twice; parts of a device are named together, such as {0}/1+1",
        ),
        (["{0}", "{kind}"], "--device: {0} and {kind} are the same device, {0}"),
        (["{0}/1", "{0}"], "--device: {0}/1 and {0} share the device {0}; name its parts together"),
        (["{0}", "all"], "--device: all stands alone: it names every device"),
        (["{0}", "no such device"], "unknown device 'no such device'; available: "),
        (["{0}/1000"], "has {units} compute units, but 1000 are wanted"),
        (["{0}/0+1"], "a part needs at least 1 compute unit, got 0+1"),
        (["all/1"], "--device: names several devices"),
    ],
)
def test_wrong_names(specs: list[str], message: str, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    halves_of(device)
    # `cpu` names the best one, which need not be the one under test.
    monkeypatch.setattr(choice, "choose", lambda spec: device if spec == device.info.kind else choose(spec))
    facts = {"kind": device.info.kind, "units": device.info.compute_units}
    index = index_of(device)
    assert message.format(index, **facts) in str(
        failure(DeviceError, choose_all, [spec.format(index, **facts) for spec in specs])
    )


# --- processors that PoCL's wheel does not know get the name of one that it does ---


TRIPLE = b"x86_64-unknown-linux-gnu"


class Memory:
    """A record of pointers to texts, at addresses of its own."""

    def __init__(self, *texts: bytes | int) -> None:
        self.parts: dict[int, bytes] = {}
        pointers = []
        for place, text in enumerate(texts):
            if isinstance(text, int):
                pointers.append(text)
                continue
            pointers.append(0x10000 + 0x100 * place)
            self.parts[pointers[-1]] = text + b"\0" + b"rest"
        self.parts[0x1000] = struct.pack(f"<{len(pointers)}Q", *pointers)

    def read(self, address: int, size: int) -> bytes:
        return self.parts.get(address, b"")[:size]


def test_the_name_beside_the_triple_is_found() -> None:
    memory = Memory(7, b"pthread", b"generic", 0, TRIPLE, b"generic", 2**63)
    assert place_of_name(0x1000, memory.read) == 0x1000 + 5 * 8


def test_the_name_of_an_older_processor_is_wrong_for_one_with_wide_vectors() -> None:
    memory = Memory(b"pthread", TRIPLE, b"znver3")
    assert place_of_name(0x1000, memory.read) is None
    assert place_of_name(0x1000, memory.read, best=True) == 0x1000 + 2 * 8


def test_the_record_of_a_neighbour_is_not_looked_at() -> None:
    memory = Memory(*[b"text"] * 100, TRIPLE, b"generic")
    assert place_of_name(0x1000, memory.read) is None


@pytest.mark.parametrize(
    "texts",
    [
        (b"pthread", TRIPLE, b"skylake-avx512", b"generic"),
        (b"generic", b"nvptx64-nvidia", b"generic"),
        (b"pthread", TRIPLE),
        (),
    ],
)
def test_other_records_stay_as_they_are(texts: tuple[bytes, ...]) -> None:
    assert place_of_name(0x1000, Memory(*texts).read) is None


def test_a_processor_gets_the_best_name_whose_instructions_it_has() -> None:
    old, wide = {"sse2", "fpu"}, {"avx2", "fma", "bmi1", "bmi2", "movbe", "f16c", "abm", "adx"}
    widest = wide | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
    assert [nearest_known(each) for each in (set(), old, wide, widest)] == [
        b"x86-64",
        b"x86-64",
        b"haswell",
        b"skylake-avx512",
    ]


def test_features_are_read_where_linux_tells_them(tmp_path: Path) -> None:
    told = tmp_path / "cpuinfo"
    told.write_text("processor\t: 0\nflags\t\t: fpu avx2 fma\nprocessor\t: 1\nflags\t\t: other\n")
    assert processor_features(told) == {"fpu", "avx2", "fma"}
    assert processor_features(tmp_path / "none") == frozenset()


@pytest.mark.skipif(sys.platform != "linux", reason="reads Linux's file of a process's memory")
def test_memory_of_the_process_itself_is_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unknown_cpu, "processor_features", frozenset)
    monkeypatch.setattr(unknown_cpu, "_texts", {})
    texts = [ctypes.create_string_buffer(text) for text in (b"pthread", TRIPLE, b"generic")]
    record = (ctypes.c_uint64 * 512)(*(ctypes.addressof(text) for text in texts))
    assert unknown_cpu.name_processor(ctypes.addressof(record)) == b"x86-64"
    assert ctypes.string_at(record[2]) == b"x86-64"
    assert unknown_cpu.name_processor(ctypes.addressof(record)) == b"x86-64"
    assert unknown_cpu.name_processor(8) is None  # where there is no memory


def test_every_pocl_device_compiles() -> None:
    """In a process of its own each, with nothing but what the program does when it looks for devices."""
    program = (
        "import sys, pyopencl as cl; from clfractal.device.select import devices\n"
        "device = next(each for each in devices() if each.index == sys.argv[1])\n"
        "from clfractal.device.select import choose\n"
        "chosen = choose(device.index)\n"
        "cl.Program(chosen.context, '__kernel void a(__global float *x) { x[0] = sin(x[0]); }').build()\n"
    )
    found = [info.index for info in all_devices() if is_pocl(info)]
    for index in found:
        works(python(program, index))
