"""What a kernel needs of a GPU, read from what its compilers write, and how many of its work-items fit side by side."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal

Maker = Literal["NVIDIA", "AMD"]


@dataclass(frozen=True, slots=True)
class Figures:
    """Of one kernel on one GPU. Of each of them less is better.

    `registers`: of 32 bits, for a work-item. `stack`: bytes of private memory for a work-item, spilled registers
    included. `spilled`: bytes written there because there were too few registers. `local`: bytes for a work-group.
    """

    registers: int
    stack: int = 0
    spilled: int = 0
    local: int = 0

    def worse_than(self, other: Figures) -> list[str]:
        """Names and values of what is larger than the other's: `registers 97, were 96`."""
        pairs = [
            (field.name, getattr(self, field.name), getattr(other, field.name)) for field in fields(self)
        ]
        return [f"{name} {mine}, were {old}" for name, mine, old in pairs if mine > old]


@dataclass(frozen=True, slots=True)
class Gpu:
    """An architecture, by the name that compilers have for it, and what decides how many warps or waves it keeps.

    Sources: NVIDIA, CUDA C++ Programming Guide, "Compute Capabilities"; LLVM, User Guide for AMDGPU, "Target Features"
    and the GCNSubtarget's numbers of registers. `registers`: of 32 bits for a lane, of one part of a multiprocessor (a
    quarter: NVIDIA) or compute unit (a half, a SIMD: AMD); a warp or wave gets them by `granule`. `local`: bytes
    of the whole.
    """

    name: str
    maker: Maker
    registers: int
    granule: int
    parts: int
    most: int
    local: int

    @property
    def word(self) -> str:
        """What its 32 lanes that run together are called."""
        return "warps" if self.maker == "NVIDIA" else "waves"

    def occupancy(self, figures: Figures) -> int:
        """Warps in a multiprocessor, or waves in a compute unit, with work-groups of two."""
        each = max(-(-figures.registers // self.granule) * self.granule, self.granule)
        by_registers = min(self.registers // each, self.most) * self.parts
        return min(by_registers, _GROUP * (self.local // figures.local)) if figures.local else by_registers


_GROUP = 2  # warps or waves of the usual work-group of 64
GPUS = (
    Gpu("sm_75", "NVIDIA", 512, 8, 4, 8, 64 * 1024),
    Gpu("sm_90", "NVIDIA", 512, 8, 4, 16, 227 * 1024),
    Gpu("gfx1030", "AMD", 1024, 16, 2, 16, 64 * 1024),
    Gpu("gfx1100", "AMD", 1536, 24, 2, 16, 64 * 1024),
)

_PTXAS = re.compile(
    r"Compiling entry function '(?P<kernel>\w+)'.*?(?P<stack>\d+) bytes stack frame, (?P<spilled>\d+) bytes spill stores"
    r".*?Used (?P<registers>\d+) registers(?P<rest>[^\n]*)",
    re.DOTALL,
)
_SHARED = re.compile(r"(\d+) bytes smem")
_BEGINS = re.compile(r"^\s*\.amdhsa_kernel (\w+)$", re.MULTILINE)


def of_ptxas(said: str) -> dict[str, Figures]:
    """By kernel, from what `ptxas -v` says."""
    found = {}
    for match in _PTXAS.finditer(said):
        shared = _SHARED.search(match["rest"])
        found[match["kernel"]] = Figures(
            int(match["registers"]),
            int(match["stack"]),
            int(match["spilled"]),
            int(shared[1]) if shared else 0,
        )
    return found


def of_amd(assembly: str) -> dict[str, Figures]:
    """By kernel, from the metadata at the end of AMD's assembly (LLVM, User Guide for AMDGPU, "Code Object Metadata")."""
    metadata = assembly.partition("amdhsa.kernels:")[2].partition("amdhsa.target:")[0]
    found = {}
    for part in re.split(r"^  - ", metadata, flags=re.MULTILINE)[1:]:
        values = dict(re.findall(r"^ {4}\.(\w+): +(\S+)$", "    " + part, re.MULTILINE))
        found[values["name"]] = _of_metadata(values)
    missing = set(_BEGINS.findall(assembly)) - set(found)
    if missing:
        raise ValueError(f"kernels without metadata: {', '.join(sorted(missing))}")
    return found


def _of_metadata(values: Mapping[str, str]) -> Figures:
    return Figures(
        int(values["vgpr_count"]),
        int(values["private_segment_fixed_size"]),
        4 * int(values["vgpr_spill_count"]),
        int(values["group_segment_fixed_size"]),
    )
