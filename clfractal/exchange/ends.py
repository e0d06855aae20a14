"""How orbits of theirs end: distances that follow from the last place, and orbits that stand still before.

Theirs apply no more formulas of the Pseudo Kleinian once z has moved by less than a tenth over the bailout, as a part of
its length, or is beyond the bailout. Ours go on to the last application, and a number tells that an orbit has ended.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from clfractal.exchange.parameters import Parameters
from clfractal.exchange.translate import carried_name

DISCS = (103, 104, 117)
"""Formulas of the Pseudo Kleinian."""
PLANES = (122,)
"""That of Jos Leys's Kleinian groups."""
BAILOUT = 100.0
"""Of these formulas, where a file gives none of its own."""
ENDED = "ended"


def distance_to_disc(parameters: Parameters) -> str:
    """Knighty's distance to a disc: within a tube about the z axis, and in the plane z = 0."""
    across = "sqrt(x*x + y*y)"
    flat = f"{across}*abs(z)/sqrt(max(x*x + y*y + z*z, 1e-30))"
    return f"max({across} - {_number(parameters, 'analyticDE.scale1'):.9g}, {flat})/{carried_name('DE')}"


def distance_to_planes(parameters: Parameters) -> str:
    """Jos Leys's distance to two planes across the y axis, or to the lower one."""
    height = f"y, {_number(parameters, 'transformCommon.foldingValue'):.9g} - y"
    if not _number(parameters, "transformCommon.spheresEnabled"):
        height = "y"
    most, least = (_number(parameters, f"analyticDE.{name}") for name in ("tweak005", "offset1"))
    return f"min({height}, {most:.9g})/max(abs({carried_name('DE')}), {least:.9g})"


def distance_to_middle(size: int, *, powers: bool) -> str:
    """By how long z is, and how fast that grew, wherever the orbit ends: of powers by the logarithm."""
    square = " + ".join(f"{name}*{name}" for name in "xyzw"[:size])
    length = f"sqrt({square})"
    grown = f"max(abs({carried_name('DE')}), 1e-30)"
    return f"0.25*{length}*log(max({square}, 1))/{grown}" if powers else f"{length}/{grown}"


def _number(parameters: Parameters, name: str) -> float:
    found = parameters.value(name)
    assert isinstance(found, float)
    return found


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
