"""What drivers and their compilers do otherwise than others: questions about a device, and what was seen."""

from __future__ import annotations

from clfractal.device.select import DeviceInfo, is_intel_cpu, is_rusticl, is_simulator


def compiles_packets_slowly(info: DeviceInfo) -> bool:
    """Whether a program of packets takes half a minute and more, and is slow.

    rusticl compiles packets number by number, and so do GPUs' compilers: their work-items are the lanes. On an NVIDIA H200
    a march in packets of 4 takes 60 to 75 times as long as one ray to a work-item.
    """
    return is_rusticl(info) or info.kind == "gpu"


def loses_copies_when_unrolling(info: DeviceInfo) -> bool:
    """Whether loops of a constant count must not copy structs; kernels are told by COUNTS_AT_RUN_TIME.

    Mesa 25.0.7's rusticl unrolls short ones and then reads copies that were never written. After
    `struct {float a, b;} z = {x, y}, v;` the loop `for (int i = 0; i < 4; ++i) { v = z; z.a = v.a * v.a - v.b * v.b;
    z.b = 2 * v.a * v.b; }` ends with other numbers than with a count that only the launch knows, or with the fields copied
    one by one. Hints not to unroll do not help.
    """
    return is_rusticl(info)


def cannot_run_optimised_code(info: DeviceInfo) -> bool:
    """Oclgrind's interpreter lacks intrinsics that its own compiler makes; kernels are told by INTERPRETED.

    Then a kernel cannot be created (Oclgrind 21.10): "Undefined external function: llvm.bitreverse.i32" (the
    optimiser, for shuffled bits), "llvm.experimental.noalias.scope.decl" (`always_inline` without
    optimisation), "llvm.vector.reduce.or.v4i32" (a reduction).
    """
    return is_simulator(info)


def vectorises_what_is_wide(info: DeviceInfo) -> bool:
    """Whether a compiler makes one loop of neighbouring work-items whose packets fill the vector unit already.

    Intel's does (2026.22). Of kernels with many branches that takes minutes: `scatter_paths` takes 24 s without it
    and more than 600 with it, all programs of a surface 3 times as long. Packets do the work: pictures of two scenes took
    about as long.
    So its kernels have the attribute `intel_vec_len_hint`, as part of the word `__kernel`.
    """
    return is_intel_cpu(info)


def vectorises_across_work_items(info: DeviceInfo) -> bool:
    """Whether neighbouring work-items share a vector unit even where their loops part ways.

    GPUs do so by construction, Mesa's compiler with masks; PoCL's work-group vectoriser gives up on a loop whose trip count
    differs between work-items (one ray an item runs 6 to 9 times slower there than eight), and Intel's is told to leave it
    (`vectorises_what_is_wide`).
    """
    return info.kind == "gpu" or is_rusticl(info)


def sees_host_writes(info: DeviceInfo) -> bool:
    """Whether a running kernel sees what the host writes into a buffer made of the host's own memory.

    Processors do: their drivers use that memory directly (tried with PoCL 3.0 and 3.1). The standard guarantees nothing,
    so this is only used to ask kernels to end early.
    """
    return info.kind == "cpu" and not is_simulator(info)
