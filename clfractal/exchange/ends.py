"""Orbits of the Pseudo Kleinian that stand still: theirs end there, with what they carry.

Theirs apply no more formulas once z has moved by less than a tenth over the bailout, as a part of its length, or is
beyond the bailout. Ours go on to the last application, and a number tells that an orbit has ended.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

DISCS = (103, 104, 117)
"""Formulas of the Pseudo Kleinian."""
BAILOUT = 100.0
"""Of these formulas, where a file gives none of its own."""
ENDED = "ended"


def ending(formula: Mapping[str, Any], bailout: float, *, checks: bool) -> dict[str, Any]:
    """A formula whose orbits end.

    Args:
        formula: with `state`, and not one that adds the point.
        checks: whether they may end at it; else it only lets what has ended be.
    """
    variables = formula["variables"]
    after = {name: f"next_{name}" for name in variables}
    let = dict(formula.get("let", {}))
    for name, part in zip(variables, formula["map"], strict=True):
        let[after[name]] = f"where({ENDED} > 0, {name}, {part})"
    state = {
        name: {"start": each["start"], "next": f"where({ENDED} > 0, {name}, {each['next']})"}
        for name, each in formula["state"].items()
    }
    following = ENDED
    if checks:
        moved = " + ".join(f"({after[name]} - {name})*({after[name]} - {name})" for name in variables)
        long = " + ".join(f"{after[name]}*{after[name]}" for name in variables)
        let["moved"], let["long"] = moved, long
        still = f"moved < {(0.1 / bailout) ** 2:.9g}*long"
        following = f"where({still}, 1, where(long > {bailout * bailout:.9g}, 1, {ENDED}))"
    state[ENDED] = {"start": 0, "next": following}
    return {**formula, "let": let, "map": list(after.values()), "state": state}
