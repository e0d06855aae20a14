"""The structs that kernels read have the same layout on the host and on the device."""

from __future__ import annotations

import pyopencl as cl
import pytest
from pyopencl.tools import match_dtype_to_c_struct

from clfractal.device.select import choose, has_float64
from clfractal.device.structs import Precision, Struct
from clfractal.integrators.declarations import STRUCTS
from tests.device.struct_layout import verify

pytestmark = pytest.mark.conformance

PRECISIONS: tuple[Precision, ...] = ("float32", "float64")


@pytest.mark.parametrize("precision", PRECISIONS)
def test_every_struct_is_laid_out_as_on_the_host(precision: Precision) -> None:
    device = choose()
    if precision == "float32" or has_float64(device.info):
        verify(device, STRUCTS, precision)


@pytest.mark.parametrize("struct", STRUCTS, ids=lambda struct: str(struct.name))
def test_pyopencl_agrees(struct: Struct) -> None:
    """Its own question to the device, with a text of its own."""
    cl_device: cl.Device = choose().cl_device
    dtype = struct.dtype("float32")
    matched, _ = match_dtype_to_c_struct(cl_device, struct.name, dtype)
    assert matched == dtype
