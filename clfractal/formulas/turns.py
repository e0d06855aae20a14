"""Whose turn it is in a chain: members take turns, each `count` times, from its `start` until its `stop`.

Applications are numbered from 0. A member takes part in the applications n with start <= n < stop. Where it does not take
part it is passed over: the next member has its turn at once, so no application is lost. A member whose `stop` comes within
its turn ends the turn. Between two places where a member starts or stops the turns are periodic; a `Span` is such a part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from clfractal.errors import FormulaError, Where

MAX_START = 1_000_000


class Member(Protocol):
    """What decides a member's turns."""

    @property
    def count(self) -> int:
        """Applications in a row."""

    @property
    def start(self) -> int:
        """The first application that it may have."""

    @property
    def stop(self) -> int | None:
        """The first application after that which it may not have; None: it goes on for ever."""


@dataclass(frozen=True, slots=True)
class Span:
    """Applications `begin` to `end` - 1 (None: for ever), where the same members take part.

    A *place* is a number within the turns of all members: the first has the places 0 to its count - 1, and so on.

    Attributes:
        offset: what is added to an application before the remainder by `cycle` is taken.
        cycle: the applications of one turn of each member that takes part.
        members: the numbers of these members.
        skipped: (first place, count) of each other member, in order.
    """

    begin: int
    end: int | None
    offset: int
    cycle: int
    members: tuple[int, ...]
    skipped: tuple[tuple[int, int], ...]

    def place(self, application: int) -> int:
        """The place that an application of this span has."""
        place = (application + self.offset) % self.cycle
        for first, count in self.skipped:
            if place >= first:
                place += count
        return place


def spans_of(members: Sequence[Member]) -> tuple[Span, ...]:
    """The spans of a chain, in order; the last one has no end.

    Raises:
        FormulaError: no member takes part in some application.
    """
    edges = {0, *(m.start for m in members), *(m.stop for m in members if m.stop is not None)}
    begins = sorted(edges)
    ends = [*begins[1:], None]
    found: list[Span] = []
    following = 0  # the place after that of the last application
    for begin, end in zip(begins, ends, strict=True):
        active = [m.start <= begin and (m.stop is None or begin < m.stop) for m in members]
        if not any(active):
            what = _applications(begin, end)
            raise FormulaError(f"no formula takes part {what}: start and stop leave a gap", Where())
        span = _span(members, active, begin, end, following)
        found.append(span)
        following = span.place(end - 1) + 1 if end is not None else 0
    return tuple(found)


def _applications(begin: int, end: int | None) -> str:
    if end is None:
        return f"from application {begin} on"
    return f"in application {begin}" if end == begin + 1 else f"in applications {begin} to {end - 1}"


def _span(members: Sequence[Member], active: list[bool], begin: int, end: int | None, following: int) -> Span:
    """The span from `begin` on, where the turn is that of the place `following`, or of the next that takes part."""
    skipped = []
    place = local = 0
    offset = None
    for member, takes_part in zip(members, active, strict=True):
        if takes_part:
            if offset is None and following < place + member.count:
                offset = local + max(following - place, 0)
            local += member.count
        else:
            skipped.append((place, member.count))
        place += member.count
    numbers = tuple(index for index, takes_part in enumerate(active) if takes_part)
    # Past the last member that takes part the first one's turn comes.
    return Span(begin, end, ((offset or 0) - begin) % local, local, numbers, tuple(skipped))


def turn_lines(spans: Sequence[Span]) -> list[str]:
    """`turn`: the place that application `n` has in the turns of all links."""
    if len(spans) == 1:
        return [f"const int turn = n % {spans[0].cycle};"]
    lines = ["int turn;"]
    for span in spans:
        condition = f"if (n < {span.end}) " if span.end is not None else ""
        lines.append(f"{'} else ' if span is not spans[0] else ''}{condition}{{")
        lines.append(f"    turn = (n + {span.offset}) % {span.cycle};")
        lines += [f"    if (turn >= {first}) turn += {count};" for first, count in span.skipped]
    return [*lines, "}"]
