"""Few choices that hold every pair of values: a mistake needs one feature, or two that meet (Cohen et al. 1997, AETG)."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Set
from itertools import combinations

Pair = frozenset[tuple[str, str]]
"""Two factors, each with one of its values."""


def covering(factors: Mapping[str, Collection[str]], apart: Set[Pair] = frozenset()) -> list[dict[str, str]]:
    """Choices of one value of each factor, so that any two values of different factors meet in one of them.

    The same for the same factors on every machine. Greedy: each choice begins with a pair that is still missing, and takes
    factor by factor the value that adds most of them.

    Args:
        factors: the values of each factor.
        apart: pairs that never meet. A value must have one of every other factor that it may meet.
    """
    missing = {
        pair: None
        for one, other in combinations(factors, 2)
        for first in factors[one]
        for second in factors[other]
        if (pair := frozenset({(one, first), (other, second)})) not in apart
    }
    order = {name: place for place, name in enumerate(factors)}
    choices = []
    while missing:
        chosen = dict(sorted(next(iter(missing)), key=lambda value: order[value[0]]))
        # Those with many values first: they have the most pairs to add.
        for name in sorted(
            factors.keys() - chosen.keys(), key=lambda name: (-len(factors[name]), order[name])
        ):
            pairs = {value: _with(chosen, name, value) for value in factors[name]}
            gains = {
                value: len(missing.keys() & added) for value, added in pairs.items() if not apart & added
            }
            chosen[name] = max(gains, key=gains.__getitem__)
        for one, other in combinations(chosen.items(), 2):
            missing.pop(frozenset({one, other}), None)
        choices.append({name: chosen[name] for name in factors})
    return choices


def _with(chosen: Mapping[str, str], name: str, value: str) -> set[Pair]:
    """The pairs of a value with all that is chosen."""
    return {frozenset({(name, value), other}) for other in chosen.items()}
