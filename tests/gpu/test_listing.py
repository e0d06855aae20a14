"""Pairs of features: all of them meet, in few programs, and always in the same ones."""

from __future__ import annotations

from itertools import combinations

from tests.gpu import listing
from tests.gpu.pairs import Pair, covering

FACTORS = {
    "a": ("1", "2", "3"),
    "b": ("1", "2"),
    "c": ("1", "2", "3", "4"),
    **{f"d{i}": ("no", "yes") for i in range(8)},
}


def met(choices: list[dict[str, str]]) -> set[Pair]:
    return {frozenset(pair) for chosen in choices for pair in combinations(chosen.items(), 2)}


def every_pair() -> set[Pair]:
    return {
        frozenset({(one, first), (other, second)})
        for one, other in combinations(FACTORS, 2)
        for first in FACTORS[one]
        for second in FACTORS[other]
    }


def test_all_pairs_meet_in_few_choices() -> None:
    choices = covering(FACTORS)
    assert met(choices) == every_pair()
    # The least is 3 * 4; all combinations are 6144.
    assert 12 <= len(choices) <= 18
    assert covering(FACTORS) == choices


def test_what_must_not_meet_does_not() -> None:
    apart = {frozenset({("a", "1"), ("c", "2")}), frozenset({("b", "2"), ("d0", "yes")})}
    assert met(covering(FACTORS, apart)) == every_pair() - apart


def test_names_tell_programs_apart() -> None:
    programs = listing.unlike(listing.paired())
    assert len({each.name for each in programs}) == len(programs)
    assert len({(each.text.text, each.precision) for each in programs}) == len(programs)
    assert {each.precision for each in programs} == {"float32", "float64"}
