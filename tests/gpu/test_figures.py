"""Figures of kernels: what compilers say of them, how many fit beside each other, and which are worse than others."""

from __future__ import annotations

import pytest

from tests.gpu import record
from tests.gpu.figures import GPUS, Figures, of_amd, of_ptxas

PTXAS = """ptxas info    : 0 bytes gmem, 208 bytes cmem[4]
ptxas info    : Compiling entry function 'first' for 'sm_75'
ptxas info    : Function properties for first
    240 bytes stack frame, 24 bytes spill stores, 32 bytes spill loads
ptxas info    : Used 168 registers, used 1 barriers, 4096 bytes smem, 492 bytes cmem[0]
ptxas info    : Compile time = 12.345 ms
ptxas info    : Compiling entry function 'second' for 'sm_75'
ptxas info    : Function properties for second
    0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads
ptxas info    : Used 18 registers, 400 bytes cmem[0]
"""

AMD = """
	.amdhsa_kernel first
	.amdhsa_kernel second
amdhsa.kernels:
  - .args:
      - .address_space:  global
        .name:           out
        .offset:         0
    .group_segment_fixed_size: 512
    .name:           first
    .private_segment_fixed_size: 136
    .sgpr_spill_count: 25
    .symbol:         first.kd
    .vgpr_count:     195
    .vgpr_spill_count: 3
    .wavefront_size: 32
  - .args:           []
    .group_segment_fixed_size: 0
    .name:           second
    .private_segment_fixed_size: 0
    .vgpr_count:     11
    .vgpr_spill_count: 0
amdhsa.target:   amdgcn-amd-amdhsa--gfx1030
amdhsa.version:
  - 1
  - 1
"""


def test_what_ptxas_says() -> None:
    assert of_ptxas(PTXAS) == {"first": Figures(168, 240, 24, 4096), "second": Figures(18)}


def test_what_stands_in_assembly_for_amd() -> None:
    """A register that is spilled takes four bytes; names of arguments are no kernels."""
    assert of_amd(AMD) == {"first": Figures(195, 136, 12, 512), "second": Figures(11)}


def test_a_kernel_without_metadata_is_noticed() -> None:
    with pytest.raises(ValueError, match="third"):
        of_amd(AMD.replace("\t.amdhsa_kernel second", "\t.amdhsa_kernel second\n\t.amdhsa_kernel third"))


@pytest.mark.parametrize(
    ("name", "registers", "expected"),
    [
        # CUDA's occupancy calculator, of registers alone.
        *(("sm_75", 64, 32), ("sm_75", 65, 28), ("sm_75", 96, 20), ("sm_75", 168, 12), ("sm_75", 255, 8)),
        *(("sm_90", 1, 64), ("sm_90", 32, 64), ("sm_90", 33, 48), ("sm_90", 96, 20), ("sm_90", 255, 8)),
        # What LLVM writes into its assembly, of two SIMDs.
        *(("gfx1030", 64, 32), ("gfx1030", 85, 20), ("gfx1030", 175, 10), ("gfx1030", 256, 8)),
        *(("gfx1100", 96, 32), ("gfx1100", 171, 16), ("gfx1100", 256, 10)),
    ],
)
def test_how_many_fit_beside_each_other(name: str, registers: int, expected: int) -> None:
    (gpu,) = [gpu for gpu in GPUS if gpu.name == name]
    assert gpu.occupancy(Figures(registers)) == expected


def test_local_memory_leaves_room_for_fewer_groups() -> None:
    by_name = {gpu.name: gpu for gpu in GPUS}
    assert by_name["gfx1030"].occupancy(Figures(48, local=16 * 1024)) == 8
    assert by_name["sm_90"].occupancy(Figures(48, local=16 * 1024)) == 28
    assert by_name["sm_75"].occupancy(Figures(255, local=1)) == 8


def test_what_is_worse() -> None:
    old = Figures(96, 0, 0)
    assert not old.worse_than(old)
    assert not Figures(95).worse_than(old)
    assert Figures(97, 8).worse_than(old) == ["registers 97, were 96", "stack 8, were 0"]


@pytest.mark.parametrize(
    ("name", "mine", "old", "said"),
    [
        ("sm_90", Figures(112), Figures(110), []),
        ("sm_90", Figures(129), Figures(112), ["12 warps, were 16 (registers 129, were 112)"]),
        ("sm_75", Figures(129), Figures(128), ["12 warps, were 16 (registers 129, were 128)"]),
        ("gfx1100", Figures(169), Figures(168), ["16 waves, were 18 (registers 169, were 168)"]),
        ("sm_75", Figures(255, 416, 400), Figures(255, 400, 400), []),
        (
            "sm_75",
            Figures(255, 432, 428),
            Figures(255, 400, 400),
            ["stack 432, were 400", "spilled 428, were 400"],
        ),
        ("gfx1030", Figures(256, 17), Figures(250), ["stack 17, were 0"]),
        (
            "sm_75",
            Figures(18, local=40000),
            Figures(18, local=30000),
            ["2 warps, were 4 (local 40000, were 30000)"],
        ),
    ],
)
def test_what_a_gpu_loses(name: str, mine: Figures, old: Figures, said: list[str]) -> None:
    """Fewer warps or waves at a time, or more memory than compilers' chance makes of it."""
    (gpu,) = (each for each in GPUS if each.name == name)
    assert record.losses(gpu, mine, old) == said
