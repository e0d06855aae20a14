"""A struct declared once: C text, NumPy layout and the device's layout are the same thing."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest
from pyopencl.tools import match_dtype_to_c_struct

from clfractal.device.program import build, math_flags
from clfractal.device.select import Device, has_float64
from clfractal.device.structs import Field, Precision, Struct
from clfractal.errors import DeviceError
from tests.device.struct_layout import verify

pytestmark = pytest.mark.conformance

_MIXED = Struct(
    "Mixed",
    [
        Field("first", "int", meaning="a count"),
        Field("eye", "real", 3, "scene units"),
        Field("second", "uint"),
        Field("exact", "double"),
        Field("few", "float", 5),
        Field("last", "int"),
    ],
)
_PLAIN = Struct("Plain", [Field("a", "real"), Field("b", "int", 2)])


def _precisions(device: Device) -> list[Precision]:
    return ["float32", "float64"] if has_float64(device.info) else ["float32"]


def test_c_text() -> None:
    assert _PLAIN.c_text("float64") == "typedef struct Plain {\n    double a;\n    int b[2];\n} Plain;\n"
    assert "    scalar eye[3];  // scene units\n" in _MIXED.c_text()
    assert "    float eye[3];  // scene units\n" in _MIXED.c_text("float32")


def test_layout_is_that_of_c() -> None:
    dtype = _MIXED.dtype("float32")
    assert dtype.fields is not None
    assert [dtype.fields[name][1] for name in dtype.names or ()] == [0, 4, 16, 24, 32, 52]
    assert dtype.itemsize == 56
    assert _MIXED.dtype("float64").itemsize == 72


def test_the_device_agrees(device: Device, empty_cache: Path) -> None:
    for precision in _precisions(device):
        verify(device, [_PLAIN, _MIXED], precision)


def test_pyopencl_agrees(device: Device) -> None:
    for precision in _precisions(device):
        dtype, _ = match_dtype_to_c_struct(device.cl_device, "mixed_t", _MIXED.dtype(precision))
        assert dtype.fields == _MIXED.dtype(precision).fields


def test_another_layout_is_refused(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed = np.dtype([("a", "float32"), ("b", "int32", (2,)), ("hidden", "int32")])
    monkeypatch.setattr(Struct, "dtype", lambda self, precision: packed)
    with pytest.raises(DeviceError, match="lays out structs differently from C") as caught:
        verify(device, [_PLAIN], "float32")
    assert caught.value.status == 3
    assert caught.value.details.endswith("expected sizes and offsets [16, 0, 4, 12], found [12, 0, 4, 0]")


def test_values_arrive(device: Device, empty_cache: Path) -> None:
    """Every field of every record of a buffer, read by a kernel that knows the C text only."""
    records = _MIXED.array(
        "float32",
        [
            {"first": -1, "eye": (0.5, 1.5, 2.5), "second": 7, "exact": 0.1, "few": range(5), "last": 9},
            {"first": 2, "eye": (-0.5, 8, 9), "second": 1 << 31, "exact": -3, "few": [2] * 5, "last": -4},
        ],
    )
    if not has_float64(device.info):
        records = records[[]]
    text = (
        "#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n"
        + _MIXED.c_text("float32")
        + "__kernel void sum(__global float *out, __global const struct Mixed *in) {\n"
        "    const __global struct Mixed *m = in + get_global_id(0);\n"
        "    float sum = m->first + m->second + (float)m->exact + m->last;\n"
        "    for (int i = 0; i < 3; ++i) sum += m->eye[i];\n"
        "    for (int i = 0; i < 5; ++i) sum += m->few[i];\n"
        "    out[get_global_id(0)] = sum;\n"
        "}\n"
    )
    if len(records) == 0:
        return
    kernel = build(device, text, flags=math_flags("float32")).kernel("sum")
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    out = device.buffer(8, "sums")
    source = cl.Buffer(device.context, flags, hostbuf=records.view(np.uint8))
    kernel.set_args(out, source)
    cl.enqueue_nd_range_kernel(device.queue, kernel, (2,), (1,))
    sums = np.empty(2, np.float32)
    cl.enqueue_copy(device.queue, sums, out)
    np.testing.assert_allclose(
        sums, [-1 + 4.5 + 7 + 0.1 + 10 + 9, 2 + 16.5 + 2.0**31 - 3 + 10 - 4], rtol=1e-6
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"b": None}, "missing or unknown fields: b"),
        ({"c": 1}, "missing or unknown fields: c"),
        ({"b": [1, 2, 3]}, r"Plain\.b: wrong shape \(3,\)"),
        ({"a": [1.0]}, r"Plain\.a: wrong shape \(1,\)"),
    ],
)
def test_values_that_do_not_fit(change: dict[str, object], message: str) -> None:
    values: dict[str, object] = {"a": 1.0, "b": [1, 2], **change}
    values = {name: value for name, value in values.items() if value is not None}
    with pytest.raises(ValueError, match=message):
        _PLAIN.value("float32", values)


def test_field_names_differ() -> None:
    with pytest.raises(ValueError, match="different names"):
        Struct("S", [Field("a", "int"), Field("a", "real")])
    with pytest.raises(dataclasses.FrozenInstanceError):
        _PLAIN.name = "x"  # type: ignore[misc]
