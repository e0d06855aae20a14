"""Lane counts are compared in rounds: what disturbs some of them decides nothing, and what disturbs all is told."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import count

import pytest

from clfractal.integrators.rounds import FEWEST, MOST, NEARLY, agree, compared, widest

QUIET = {8: 10.0, 16: 6.0}


class Machine:
    """Gives the times of a quiet machine, times what a turn is disturbed by; turns are counted from 0."""

    def __init__(self, disturbed: Callable[[int], float] = lambda turn: 1.0) -> None:
        self.disturbed = disturbed
        self.asked: list[int] = []

    def measure(self, lanes: int) -> float:
        self.asked.append(lanes)
        return QUIET[lanes] * self.disturbed(len(self.asked) - 1)


def rising() -> Iterator[float]:
    """No two of its numbers are near each other."""
    return (2.0**number for number in count())


def test_on_a_quiet_machine() -> None:
    machine = Machine()
    assert compared([8, 16], machine.measure) == (QUIET, True)
    assert len(machine.asked) == 2 * FEWEST


def test_all_take_turns_back_and_forth_in_either_half() -> None:
    machine = Machine()
    compared([8, 16], machine.measure)
    rounds = [tuple(machine.asked[first : first + 2]) for first in range(0, len(machine.asked), 2)]
    for half in (rounds[::2], rounds[1::2]):
        assert set(half) == {(8, 16), (16, 8)}


@pytest.mark.parametrize("busy", [range(3), range(2, 5), range(3, 6), [0, 3, 4, 7]])
def test_a_busy_moment_decides_nothing(busy: range | list[int]) -> None:
    """Even one in which a lane count has looked slower in each turn but one of either half."""
    machine = Machine(lambda turn: 3.0 if turn in busy else 1.0)
    least, is_steady = compared([8, 16], machine.measure)
    assert widest(least) == 16
    assert (least, is_steady) == (QUIET, True)


def test_it_goes_on_until_the_halves_agree() -> None:
    """Here a machine is busy, ever less, for the first five rounds."""
    machine = Machine(lambda turn: max(1.0, 4.0 - 0.3 * turn))
    assert compared([8, 16], machine.measure) == (QUIET, True)
    assert 2 * FEWEST < len(machine.asked) < 2 * MOST


def test_a_machine_that_is_never_quiet_is_told() -> None:
    """One of the lane counts, which would be taken, has another time in each half."""
    machine = Machine(lambda turn: 1.0 if turn // 2 % 2 else 1.3)
    least, is_steady = compared([8, 16], machine.measure)
    assert not is_steady
    assert len(machine.asked) == 2 * MOST
    assert least == QUIET

    numbers = rising()
    assert not compared([16], lambda lanes: next(numbers))[1]


def test_a_slow_device_has_a_round_for_each_half() -> None:
    machine = Machine()
    assert compared([8, 16], machine.measure, lambda: len(machine.asked) > 1) == (QUIET, True)
    assert len(machine.asked) == 4
    busy = Machine(lambda turn: 1.0 if turn // 2 % 2 else 1.3)
    assert compared([8, 16], busy.measure, lambda: len(busy.asked) > 4) == (QUIET, False)
    assert len(busy.asked) == 8


def test_halves_agree_where_nothing_hangs_on_what_differs() -> None:
    """One lane takes five times as long, or seven times: that decides nothing."""
    assert agree({1: 50, 8: 11, 16: 10}, {1: 70, 8: 11, 16: 10})
    # A count that is fastest, or would be taken, by either.
    assert not agree({8: 10, 16: 12}, {8: 10, 16: 10.5})
    assert not agree({8: 10, 16: 10.5}, {8: 9, 16: 10.5})
    # Near the margin it may be either: what that costs is less than the margin.
    near = 10 * NEARLY
    assert widest({8: 10, 16: near - 0.1}) != widest({8: 10, 16: near + 0.1})
    assert agree({8: 10, 16: near - 0.1}, {8: 10, 16: near + 0.1})


def test_the_widest_of_those_that_are_nearly_the_fastest() -> None:
    assert widest({1: 10, 8: 10.9, 16: 11.1}) == 8
    assert widest({1: 10, 8: 10.9, 16: 10.99}) == 16
    assert widest({16: 20, 8: 10, 1: 30}) == 8
