"""Whatever leaves OpenCL 1.2's guarantees, or is known to be missing somewhere, is found."""

from __future__ import annotations

import numpy as np
import pytest

from clfractal.device.orbit import ORBIT
from clfractal.device.structs import Precision
from clfractal.formulas import catalog
from clfractal.formulas.opencl import write_formula
from clfractal.scene.checks import MAX_PLANES
from clfractal.scene.lighting import MAX_LIGHTS
from clfractal.shading.light_records import LIGHT
from tests.gpu import limits

ENTRY = ".entry kernel_a(\n{}\n)\n{{\n}}\n"
CONSTANT = ".param .u64 .ptr .const .align 8 kernel_a_param_{}"
GLOBAL = ".param .u64 .ptr .global .align 4 kernel_a_param_{}"


def entry(*arguments: str) -> str:
    return ENTRY.format(",\n".join(f"\t{each}" for each in arguments))


def test_arguments_are_counted() -> None:
    (found,) = limits.entries(
        entry(*(CONSTANT.format(i) for i in range(3)), GLOBAL.format(3), ".param .u32 kernel_a_param_4")
    )
    assert found == limits.Entry("kernel_a", 3, 36, 0)


def test_what_is_guaranteed_passes() -> None:
    ptx = ".const .align 4 .b8 table[65536];\n.shared .align 4 .b8 rays[32768];\n" + entry(
        *(CONSTANT.format(i) for i in range(8)), *(GLOBAL.format(i) for i in range(8, 128))
    )
    assert not list(limits.broken(ptx))


@pytest.mark.parametrize(
    ("ptx", "told"),
    [
        (entry(*(CONSTANT.format(i) for i in range(9))), "9 constant arguments, 8 are guaranteed"),
        (entry(*(GLOBAL.format(i) for i in range(129))), "1032 bytes of arguments, 1024 are guaranteed"),
        (entry(".param .align 8 .b8 kernel_a_param_0[48]"), "vectors or structs"),
        (".const .align 16 .b8 one[65000];\n.const .align 4 .u32 two[200];\n", "65800 bytes of .const"),
        (".shared .align 4 .f64 rays[4097];\n", "32776 bytes of .shared"),
        ("\tcvta.const.u64 \t%rd1, %rd2;\n", "older drivers"),
        (
            ".func  (.param .b32 func_retval0) f(\n\t.param .b32 f_param_0\n)\n{\n\tcall.uni (retval0), \n\tg, \n\t(\n"
            "\tparam0\n\t);\n}\n.func g(\n)\n{\n\tcall.uni \n\tf, \n\t(\n\t);\n}\n",
            "recursion",
        ),
    ],
)
def test_what_is_not_guaranteed_is_told(ptx: str, told: str) -> None:
    (line,) = limits.broken(ptx)
    assert told in line


@pytest.mark.parametrize(
    "code",
    [
        "printf(1);",
        "goto end;",
        "float3 a;",
        "uchar3 a = vload3(0, p);",
        "half a;",
        "vload_half(0, p);",
        "work_group_reduce_add(a);",
        "sub_group_broadcast(a, 0);",
        "__generic int *p;",
        "barrier(CLK_LOCAL_MEM_FENCE);",
        "atom_add(p, 1l);",
        "__builtin_fma(a, b, c);",
        "write_imagef(shown, at, color);",
        "__write_only image2d_t shown",
        'asm("bar");',
        "float f(__constant const float row[3], int i) { return row[i]; }",
    ],
)
def test_words_that_devices_lack(code: str) -> None:
    assert list(limits.words(code, code))


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_the_longest_lists_fit_constant_memory(precision: Precision) -> None:
    """Lights, and the orbits of the object and of all planes; constants of a formula of the library are few."""
    assert MAX_LIGHTS * LIGHT.dtype(precision).itemsize <= limits.CONSTANT_BYTES
    assert (1 + MAX_PLANES) * ORBIT.dtype(precision).itemsize <= limits.CONSTANT_BYTES
    most = max(len(write_formula(catalog.load_chain(name)).constants) for name in catalog.names())
    assert 0 < 100 * most * np.dtype(precision).itemsize <= limits.CONSTANT_BYTES


def test_words_that_are_no_such_words() -> None:
    code = (
        "float4 a = vload4(0, p); const float half_side = 0.5f; atomic_inc(p); float8 imagery; int printf_ed;"
        "float f(__constant const float *row, float a[3]) { __local float b[4]; return b[0]; }"
    )
    assert not list(limits.words(code, code))


def test_a_program_for_images_may_have_them() -> None:
    code = "write_imagef(shown, at, color);"
    assert not list(limits.words(f"__kernel void show(__write_only image2d_t shown) {{ {code} }}", code))
    assert list(limits.words(f"__kernel void show(__global float4 *shown) {{ {code} }}", code))
