"""Formulas applied in turn; a single formula is a chain of one link."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

from clfractal.errors import FormulaError, Where
from clfractal.formulas.definition import Add, BoundFormula
from clfractal.formulas.nodes import Node
from clfractal.formulas.place import Place
from clfractal.formulas.turns import MAX_START, Span, spans_of

MAX_LINKS = 64
MAX_COUNT = 1000
# Applications until turns that are data repeat themselves; those of longer ones are in the text. The tables of all
# formulas of a scene fit in the constant memory that every device has.
MAX_TABLE = 768
# So many turns are in the table even if they repeat themselves before: a remainder costs as much as part of an application.
USUAL_TABLE = 128
# An application that no orbit gets to.
NEVER = 2**31 - 1


@dataclass(frozen=True, eq=False)
class Link:
    """A formula and how often it is applied, each time with repeats and addition, before the next link.

    It takes part in applications `start` to `stop` - 1, counted from 0; with no `stop` it goes on for ever. See
    `turns.py`.
    """

    bound: BoundFormula
    count: int = 1
    start: int = 0
    stop: int | None = None

    @property
    def structure(self) -> tuple[object, ...]:
        """What its text depends on beside values of parameters."""
        return (self.bound.formula, self.bound.add, self.turns)

    @property
    def turns(self) -> tuple[int, int, int | None]:
        """What decides its turns."""
        return (self.count, self.start, self.stop)


@dataclass(frozen=True, eq=False)
class Chain:
    """Links applied in turn, from the first again after the last.

    Radii and bounds follow from the links unless they are given. Chains are equal that give the same picture.

    Attributes:
        bounds_override: (centre, radius) of a sphere that holds the set, in scene units.
        source: a mapping (`name`, `inline` or `chain` with what goes with it) that `catalog.resolve` turns
        into an
            equal chain on any machine with this version of the library.
        order: the links' numbers in the order of their turns; None: as they stand.
        place: where the scene's space lies in the formula's; None: they are the same.
    """

    links: tuple[Link, ...]
    bounds_override: tuple[tuple[float, float, float], float] | None = None
    bailout_override: float | None = None
    distance_bailout_override: float | None = None
    step_scale_override: float | None = None
    title: str = ""
    source: Mapping[str, Any] | None = None
    order: tuple[int, ...] | None = None
    place: Place | None = None

    def __post_init__(self) -> None:
        if not 1 <= len(self.links) <= MAX_LINKS:
            raise FormulaError(f"a chain has 1 to {MAX_LINKS} formulas, got {len(self.links)}", Where())
        sizes = {len(link.bound.formula.variables) for link in self.links}
        if len(sizes) > 1:
            raise FormulaError("the formulas of a chain must have equally many variables", Where())
        for link in self.links:
            if not 1 <= link.count <= MAX_COUNT:
                raise FormulaError(f"count must be 1 to {MAX_COUNT}, got {link.count}", Where())
            if not 0 <= link.start <= MAX_START or (link.stop is not None and link.stop <= link.start):
                raise FormulaError(f"start must be 0 to {MAX_START} and below stop", Where())
        _ = self.spans  # refuses turns with a gap

    @cached_property
    def key(self) -> tuple[object, ...]:
        """All that a picture of the chain depends on."""
        links = tuple((link.bound.key, link.turns) for link in self.links)
        radii = (self.bailout_override, self.distance_bailout_override, self.step_scale_override)
        return (links, self.order, self.bounds_override, radii, self.place)

    @cached_property
    def _hash(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Chain) and self.key == other.key)

    def __hash__(self) -> int:
        return self._hash

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone: the hash is another one in another process."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def spans(self) -> tuple[Span, ...]:
        """The parts of an orbit in which the same links take part."""
        order = self.turn_order
        found = spans_of([self.links[number] for number in order])
        return tuple(replace(span, members=tuple(order[each] for each in span.members)) for span in found)

    @property
    def turn_order(self) -> Sequence[int]:
        """The links' numbers in the order of their turns."""
        return range(len(self.links)) if self.order is None else self.order

    @cached_property
    def as_written(self) -> Chain:
        """The same chain with its links in an order that does not depend on their turns: that of its text."""
        links = range(len(self.links))
        if not self.turns_are_data:
            return self
        order = sorted(links, key=lambda number: self.links[number].bound.content)
        if order == [*links]:
            return self
        turns = tuple(order.index(number) for number in self.turn_order)
        return replace(self, links=tuple(self.links[number] for number in order), order=turns)

    @cached_property
    def first_index(self) -> int:
        """The number of the link of application 0."""
        return self.index_at(0)

    @property
    def first(self) -> BoundFormula:
        """The formula of application 0: it decides where iteration starts and slices a space of four."""
        return self.links[self.first_index].bound

    @property
    def alone(self) -> bool:
        """Whether the set is empty; see `Formula`."""
        return self.first.formula.alone

    @property
    def size(self) -> int:
        """Components of z, 3 or 4."""
        return len(self.first.formula.variables)

    @property
    def add(self) -> Add:
        """How iteration starts: at z = 0 with count 0 for `point`, else at the point with count 0."""
        return self.first.add

    @cached_property
    def lasting(self) -> tuple[Link, ...]:
        """The links that have no `stop`: those that decide how |z| grows in the end."""
        return tuple(self.links[index] for index in self.spans[-1].members)

    @property
    def repeats_from(self) -> int:
        """The application from which on equal z have equal futures, with the period `cycle_length`; it may be `NEVER`."""
        if self.carried or any(link.bound.formula.numbered for link in self.links):
            return NEVER
        return self.spans[-1].begin

    @cached_property
    def structure(self) -> tuple[object, ...]:
        """What its text depends on beside values of parameters, and beside `facts`."""
        placed = self.place is not None
        if not self.turns_are_data:
            return (placed, self.order, *(link.structure for link in self.links))
        members = tuple((link.bound.formula, link.bound.add) for link in self.links)
        return (placed, members, self.first_index, self.shape_index, self.rule_index)

    @property
    def facts(self) -> tuple[object, ...]:
        """What its text depends on that follows from values; where turns are data of all links: each may be the first."""
        if not self.turns_are_data:
            return (self.degree > 1, self.first.begins)
        return tuple((link.bound.degree > 1, link.bound.begins) for link in self.links)

    @property
    def starts_at_zero(self) -> bool:
        """Whether iteration starts at z = 0, because f(0) is not a finite number or depends on the point."""
        return self.first.begins == "zero"

    @property
    def starts_counted(self) -> bool:
        """Whether iteration starts after the first application."""
        return self.first.begins == "after"

    @property
    def period(self) -> int:
        """A number of applications after which equal z have equal futures, where they ever have."""
        return 1 if self.repeats_from == NEVER else self.cycle_length

    @cached_property
    def turns_are_data(self) -> bool:
        """Whether whose turn it is stands in no text."""
        return len(self.links) > 1 and self.spans[-1].begin + self.spans[-1].cycle <= MAX_TABLE

    @cached_property
    def carried(self) -> tuple[str, ...]:
        """The numbers that are carried beside z: those of one name are one number, whichever members have it."""
        names = (each.name for link in self.links for each in link.bound.formula.state)
        return tuple(dict.fromkeys(names))

    def starts_of(self, name: str) -> dict[int, Node]:
        """What the links say that a carried number is before the first application."""
        return {
            index: each.start
            for index, link in enumerate(self.links)
            for each in link.bound.formula.state
            if each.name == name
        }

    def begins(self, name: str) -> tuple[int, Node]:
        """A carried number's value before the first application: the link that says it, and the expression."""
        starts = self.starts_of(name)
        index = next(each for each in (self.first_index, *self.turn_order) if each in starts)
        return index, starts[index]

    def begun(self, name: str) -> int | None:
        """The link that says what a carried number begins with; None: what the first application has made of it."""
        own = any(each.name == name for each in self.first.formula.state)
        return None if self.starts_counted and own else self.begins(name)[0]

    @cached_property
    def table(self) -> tuple[tuple[int, ...], int]:
        """The links of applications 0, 1, ..., and how many of them at the end come again and again."""
        last = self.spans[-1]
        cycles = max(-(-(USUAL_TABLE - last.begin) // last.cycle), 1)
        one = [self.index_at(n) for n in range(last.begin + last.cycle)]
        return (*one, *(one[last.begin :] * (cycles - 1))), last.cycle

    @property
    def cycle_length(self) -> int:
        """Applications of one turn of each lasting link."""
        return self.spans[-1].cycle

    def number_counts(self, application: int) -> int:
        """An application's number, or 0 where its formula is the same for all."""
        return application if self.link_at(application).bound.formula.numbered else 0

    def link_at(self, application: int) -> Link:
        """The link of an application, counted from 0."""
        return self.links[self.index_at(application)]

    def index_at(self, application: int) -> int:
        """The number of the link of an application, counted from 0."""
        span = next(span for span in self.spans if span.end is None or application < span.end)
        place = span.place(application)
        for index in self.turn_order:
            if place < self.links[index].count:
                return index
            place -= self.links[index].count
        raise AssertionError("a place in the turns belongs to a link")

    @cached_property
    def degree(self) -> float:
        """Growth of |z| over one cycle: the product of the lasting links' degrees (at most 1e300); 1 means linear."""
        if len(self.lasting) == 1 and self.lasting[0].count == 1:
            return self.lasting[0].bound.degree
        exponent = sum(link.count * math.log(link.bound.degree) for link in self.lasting)
        return math.exp(min(exponent, 690.0))

    @cached_property
    def rule_index(self) -> int | None:
        """The number of the link whose `distance` rays march by: the last lasting one's, if all links have one."""
        ruled = all(link.bound.formula.distance is not None for link in self.links)
        return self.spans[-1].members[-1] if ruled else None

    @cached_property
    def shape_index(self) -> int | None:
        """For degree 1: the number of the last lasting link if its `shape`, or `distance`, tells the last solid."""
        if self.rule_index is not None:
            return self.rule_index if self.degree <= 1 else None
        index = self.spans[-1].members[-1]
        has_shape = self.links[index].bound.formula.shape is not None
        return index if has_shape and self.degree <= 1 else None

    @property
    def has_solid(self) -> bool:
        """Whether a shape, or a distance that the formulas tell themselves, is what rays march by."""
        return self.rule_index is not None or self.shape_index is not None

    def may_tell_solid(self, *, ruled: bool) -> tuple[int, ...]:
        """The links whose shape, or own distance, may tell the last solid: where turns are data, whoever has the last one.

        Args:
            ruled: for rays that march by the formulas' own distances, which they do for any degree.
        """
        found = self.rule_index if ruled else self.shape_index
        if not self.turns_are_data:
            return () if found is None else (found,)
        told = [self.rule_index is not None or link.bound.formula.shape is not None for link in self.links]
        return tuple(
            number
            for number, link in enumerate(self.links)
            if told[number] and (ruled or link.bound.degree <= 1)
        )

    @cached_property
    def bailout(self) -> float:
        """|z| beyond which a point has escaped, for counts and inside tests."""
        return self.bailout_override or max(link.bound.bailout for link in self.links)

    @cached_property
    def distance_bailout(self) -> float:
        """|z| at which iteration for a distance stops, at least the bailout."""
        wanted = self.distance_bailout_override or min(link.bound.distance_bailout for link in self.links)
        return max(wanted, self.bailout)

    @cached_property
    def center(self) -> tuple[float, float, float]:
        """Centre of the bounding sphere, in scene units: that of the link with the largest one."""
        own = self._own_ball[0]
        return own if self.place is None else self.place.seen(own)

    @cached_property
    def radius(self) -> float:
        """Radius of the bounding sphere, in scene units: it holds every link's."""
        return self.own_radius if self.place is None else self.own_radius * self.place.magnification

    def placed(self, place: Place) -> Chain:
        """The same formulas, of whose space a scene shows a place."""
        known = self.__dict__.setdefault("_placed", {})
        if place not in known:
            known.clear()
            known[place] = replace(self, place=place)
        found: Chain = known[place]
        return found

    @property
    def own_radius(self) -> float:
        """The same in the formula's own space."""
        return self._own_ball[1]

    @cached_property
    def _own_ball(self) -> tuple[tuple[float, float, float], float]:
        if self.bounds_override:
            return self.bounds_override
        bounds = [link.bound for link in self.links]
        center = max(bounds, key=lambda bound: bound.radius).center
        return center, max(math.dist(bound.center, center) + bound.radius for bound in bounds)

    @property
    def solid_radius(self) -> float:
        """For degree 1: the last solid is the ball |z| <= solid_radius, the same that inside tests use."""
        return self.bailout

    @cached_property
    def step_scale(self) -> float:
        """Part of an estimated distance that is safe to step: the links' smallest."""
        return self.step_scale_override or min(link.bound.step_scale for link in self.links)


def single(bound: BoundFormula, source: Mapping[str, Any] | None = None) -> Chain:
    """A chain of one formula."""
    return Chain((Link(bound),), title=bound.formula.title, source=source)
