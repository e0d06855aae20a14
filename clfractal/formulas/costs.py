"""What statements of a formula's text cost, so that of two ways to write a map the cheaper one is taken."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

# What operations cost beside an addition, roughly, on the vector units of today's processors.
_COSTS = {
    "real_div": 8, "real_sqrt": 10, "real_rsqrt": 8, "real_exp": 25, "real_log": 25, "real_pow": 60,
    "real_sin": 30, "real_cos": 30,
    "real_tan": 40, "real_asin": 30, "real_acos": 30, "real_atan": 30, "real_atan2": 45, "real_mod": 12,
    "real_neg": 0, "real_power_slope": 60, "real_power_log": 30, "real_arc_slope": 20, "dual_with": -1,
    "dual_add": 4, "dual_sub": 4, "dual_neg": 4, "dual_mul": 7, "dual_square": 5, "dual_mul_real": 4, "dual_where": 4,
    "dual_chain": 3, "dual_more": 3, "dual_div": 23, "dual_div_real": 12,
    "real_div_dual": 20, "real_sub_dual": 4, "dual_sqrt": 22, "dual_rsqrt": 14, "dual_abs": 6, "dual_min": 5, "dual_max": 5,
    "dual_clamp": 10, "dual_exp": 28, "dual_log": 37, "dual_sin": 63, "dual_cos": 63, "dual_tan": 45, "dual_asin": 53,
    "complex_raised": 30, "complex_raised_root": 30, "dual_complex_raised": 60,
    "real_raised": 20, "real_raised_slope": 25, "dual_raised": 48, "dual_acos": 53,
    "dual_atan": 41, "dual_atan2": 62, "dual_mod": 18, "dual_pow": 150, "dual_pow_real": 123,
}  # fmt: skip

# Operations of an application for which a step of the march, which costs some 500 cycles, may come once more: of the
# Mandelbulb by power 8 they are 51 (0.9 of the time), of quaternions 26 (1.08) and of kaliset 13 (1.05).
WORTH_CARRYING = 40

# Arithmetic of the dual operations that are more than one; what only selects is none.
OPERATIONS = {
    "real_where": 0, "real_sign": 0, "real_abs": 0, "real_min": 0, "real_max": 0, "real_clamp": 0, "dual_where": 0,
    "real_bounded": 0, "real_neg": 0, "real_fma": 2, "real_fms": 2, "real_fnma": 2,
    "dual_constant": 0, "dual_with": -2, "dual_min": 0, "dual_max": 0, "dual_clamp": 0, "dual_abs": 3,
    "dual_add": 4, "dual_sub": 4, "dual_neg": 4, "dual_mul": 10, "dual_square": 5, "dual_mul_real": 4,
    "dual_add_coordinate_x": 2, "dual_add_coordinate_y": 2, "dual_add_coordinate_z": 2,
    "dual_chain": 3, "dual_chain_x": 4, "dual_chain_y": 4, "dual_chain_z": 4, "dual_more": 6,
    "dual_div": 12, "real_div_dual": 5, "dual_sqrt": 5, "dual_rsqrt": 6,
}  # fmt: skip


def cost_of(lines: Sequence[str]) -> int:
    """Cost of statements of the form `... = function(...);`."""
    return sum(_COSTS.get(line.partition("= ")[2].partition("(")[0], 1) for line in lines)


def count_of_operations(body: str, weights: Mapping[str, int]) -> int:
    """How many operations statements do: each call counts 1, or its weight.

    A product that is there by itself, too, is counted once.
    """
    for text, short in (
        (r"\(\(real\)\(k\[(\d+)\]\)\)", r"k\1"),
        (r"R\(([^()]*)\)", r"\1"),
        (r"\(\*growth\)", "growth"),
    ):
        body = re.sub(text, short, body)
    kept = set(re.findall(r"\breal_mul\(([^()]*)\)", body))
    shared = sum(
        factors in kept for factors in re.findall(r"\breal_(?:fma|fms|fnma)\(([^()]*), [^(),]*\)", body)
    )
    return sum(weights.get(call, 1) for call in re.findall(r"\b((?:real|dual)_\w+)\(", body)) - shared
