"""The table of begun orbits as kernels read it (`kernels/formulas/place.h`)."""

from __future__ import annotations

from collections.abc import Iterator

from clfractal.formulas.chain import Chain
from clfractal.formulas.deep import (
    NEAREST,
    STEP,
    Begun,
    begin_of,
    begins_too_soon,
    orbit_of,
    reaches_of,
    way_of,
)
from clfractal.formulas.events import Event, Way
from clfractal.formulas.near_codes import CODES
from clfractal.formulas.recorder import Program

HEAD, _ENTRY = 6, 3
"""Numbers at the table's beginning, and of an entry before its state."""
# Events are those of so many entries together, found for the farthest; nearer points have those of the exponent -10, too,
# as their pixels are no finer.
_TOGETHER, _FINEST = 3, -10
# Most numbers of a table with lists: every device has 64 KB for constants, and a formula has some of its own.
_MOST_NUMBERS = 7_500


def table_of(chain: Chain) -> tuple[float, ...]:
    """The table of a placed chain.

    Raises:
        FormulaError: mpmath is not there; the path says where.
    """
    place, orbit, reaches = chain.place, orbit_of(chain), reaches_of(chain)
    assert place is not None
    c = [number for each in orbit.own.c for number in (float(each.value), *each.slope)]
    width = _ENTRY + 4 * len(orbit.begun[0].state)
    behind = HEAD + len(c) + width * len(reaches)
    own = [value for each in orbit.begun for value in each.state[: chain.size]]
    lists = _Lists(behind + len(own))
    entries: list[float] = []
    for number, reach in enumerate(reaches):
        begun, way = _way_on(chain, reach, reaches[_together(number, len(reaches))])
        at = lists.place(way)
        entries += _entry(begun, way.count if at else begun.count, at)
    head = (2 * NEAREST, len(reaches), width, place.scale, behind, orbit.begun[0].count)
    return (*map(float, head), *map(float, c), *entries, *own, *lists.numbers)


def _together(number: int, count: int) -> int:
    """The entry whose events are those of an entry."""
    number = max(number, (_FINEST - NEAREST) // STEP)
    # (The last one is of all that is beyond.)
    return min(number // _TOGETHER * _TOGETHER + _TOGETHER, max(count - 1, number + 1)) - 1


def _way_on(chain: Chain, reach: float, most: float) -> tuple[Begun, Way]:
    """Where orbits begin that are up to `reach` from the place, and their way on, which is good up to `most`."""
    if begins_too_soon(chain, reach):
        way = way_of(chain, most)
        if way.events:
            return begin_of(chain, most), way
    begun = begin_of(chain, reach)
    return begun, Way((), begun.count)


class _Lists:
    """Lists of events, and the programs that these name, each once."""

    def __init__(self, begin: int) -> None:
        self.begin = begin
        self.numbers: list[float] = []
        self._programs: dict[Program, int] = {}
        # (Equal ways are one object.)
        self._ways: dict[int, tuple[Way, int]] = {}

    def place(self, way: Way) -> int:
        """Where the list of a way stands; 0 for one without events, or where there is no room for it."""
        if not way.events:
            return 0
        if id(way) not in self._ways:
            new = {event.program for event in way.events} - self._programs.keys()
            room = sum(7 * len(each.operations) for each in new) + sum(
                len(each.told) + 40 for each in way.events
            )
            if self.begin + len(self.numbers) + room > _MOST_NUMBERS:
                return 0
            for event in way.events:
                if event.program not in self._programs:
                    self._programs[event.program] = self._append(_program(event.program))
            self._ways[id(way)] = way, self._append(self._way(way))
        return self._ways[id(way)][1]

    def _append(self, numbers: Iterator[float]) -> int:
        at = self.begin + len(self.numbers)
        self.numbers += numbers
        return at

    def _way(self, way: Way) -> Iterator[float]:
        yield float(len(way.events))
        for event in way.events:
            yield from _event(event, self._programs[event.program])


def _entry(begun: Begun, count: int, events: int) -> Iterator[float]:
    yield from map(float, (count, begun.growth, events))
    for value, slopes in zip(begun.state, begun.slopes, strict=True):
        yield value
        yield from map(float, slopes)


def _program(program: Program) -> Iterator[float]:
    slots = program.slots
    yield float(len(program.operations))
    yield from (float(slots[each]) for each in program.outputs)
    operations = zip(program.operations, program.constants, strict=True)
    for number, ((code, operands), constant) in enumerate(operations, start=program.inputs):
        padded = (*operands, *[0] * (3 - len(operands)))
        exponent = constant if CODES[code] == "pow" else 0.0
        yield from map(float, (slots[number], code, *(slots[each] for each in padded), exponent))


def _event(event: Event, program: int) -> Iterator[float]:
    yield float(program)
    yield from event.told
    yield event.factor
    for value, by_point, by_state in zip(event.state, event.by_point, event.by_state, strict=True):
        yield value
        yield from map(float, by_point)
        yield from map(float, by_state)
