"""What statements of a formula's text cost, so that of two ways to write a map the cheaper one is taken."""

from collections.abc import Sequence

# What operations cost beside an addition, roughly, on the vector units of today's processors.
_COSTS = {
    "real_div": 8, "real_sqrt": 10, "real_rsqrt": 8, "real_exp": 25, "real_log": 25, "real_pow": 60,
    "real_sin": 30, "real_cos": 30,
    "real_tan": 40, "real_asin": 30, "real_acos": 30, "real_atan": 30, "real_atan2": 45, "real_mod": 12,
    "real_power_slope": 60, "real_power_log": 30, "real_arc_slope": 20,
    "dual_add": 4, "dual_sub": 4, "dual_neg": 4, "dual_mul": 7, "dual_square": 5, "dual_mul_real": 4, "dual_where": 4,
    "dual_chain": 3, "dual_chain2": 6, "dual_chain3": 9, "dual_chain4": 12, "dual_div": 23, "dual_div_real": 12,
    "real_div_dual": 20, "real_sub_dual": 4, "dual_sqrt": 22, "dual_rsqrt": 14, "dual_abs": 6, "dual_min": 5, "dual_max": 5,
    "dual_clamp": 10, "dual_exp": 28, "dual_log": 37, "dual_sin": 63, "dual_cos": 63, "dual_tan": 45, "dual_asin": 53,
    "complex_raised": 30, "complex_raised_root": 30, "dual_complex_raised": 60,
    "real_raised": 20, "real_raised_slope": 25, "dual_raised": 48, "dual_acos": 53,
    "dual_atan": 41, "dual_atan2": 62, "dual_mod": 18, "dual_pow": 150, "dual_pow_real": 123,
}  # fmt: skip


def cost_of(lines: Sequence[str]) -> int:
    """Cost of statements of the form `... = function(...);`."""
    return sum(_COSTS.get(line.partition("= ")[2].partition("(")[0], 1) for line in lines)
