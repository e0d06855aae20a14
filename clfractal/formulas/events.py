"""The way of orbits past events: applications where a map is not straight over all that is seen of a place.

A fold may pass through the picture at the first applications, or the place's orbit near a critical point at a late one.
There the application is done operation by operation (`recorder.py`); before, between and behind them the map is
straight, and the way of a point that is off by d is A d + B p. Each way goes on for as long as the bound of `deep.py`
holds: lengths that variables may have are the units in which it is followed, so that a reach of 1 is all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clfractal.formulas.application import applied, constant_of
from clfractal.formulas.backends import MpmathBackend
from clfractal.formulas.chain import Chain
from clfractal.formulas.jets import Jet, JetBackend, constant_jet, full_bend, variable_jet
from clfractal.formulas.near_codes import MOST_SLOTS
from clfractal.formulas.recorder import Program, program_of

Floats = NDArray[np.float64]

STRAIGHT = 2.0**-20
"""What linear orbits may be off, as a part of the distance from the place; and as far as they go in z."""
WIDE = 2.0**-30
"""What is as wide in z is told apart by the device's numbers: no event is followed behind."""
MOST_EVENTS = 24


@dataclass(frozen=True, slots=True)
class PlaceOrbit:
    """A place's own orbit, of a chain without a place.

    Attributes:
        c: what applications add, numbers that change with the point.
        states: after 0, 1, ... applications, mpmath numbers.
        growths: the scalar derivative there.
    """

    c: tuple[Jet, ...]
    states: tuple[tuple[Any, ...], ...]
    growths: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Event:
    """An application that is followed operation by operation, and the straight way behind it.

    Attributes:
        told: what the place has of each operation.
        factor: of the scalar derivative on the way.
        by_state, by_point: matrices of shape (n, n) and (n, 3).
        state: of the place behind it.
    """

    program: Program
    told: tuple[float, ...]
    factor: float
    by_state: Floats
    by_point: Floats
    state: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Way:
    """Events one after the other, and the count to which they lead."""

    events: tuple[Event, ...]
    count: int


def way_past_events(chain: Chain, orbit: PlaceOrbit, begin: int, off: float, reach: float) -> Way:
    """The way of points up to `reach` from a place, which at `begin` are up to `off` from it in z.

    Within mpmath's precision of the orbit. There are no events where orbits may begin, or where none is found that helps.
    """
    events: list[Event] = []
    count, last, first = begin, len(orbit.states) - 1, off
    while off < WIDE and count < last and len(events) < MOST_EVENTS:
        program = program_of(chain, chain.index_at(count), chain.number_counts(count))
        if max(program.slots) >= MOST_SLOTS:
            break
        inputs = [*orbit.states[count], *(each.value for each in orbit.c), orbit.growths[count]]
        told = program.values(inputs, MpmathBackend())
        if not np.isfinite(told).all():
            break
        behind = _behind(chain, orbit, count, off, reach)
        if not behind <= STRAIGHT:
            break
        end, slopes = _straight_way(chain, orbit, count + 1, behind, reach)
        scale = np.array([behind] * (slopes.shape[1] - 3) + [reach] * 3)
        matrix = slopes / scale
        state = tuple(float(each) for each in orbit.states[end])
        factor = orbit.growths[end] / orbit.growths[count + 1]
        events.append(Event(program, tuple(told), factor, matrix[:, :-3], matrix[:, -3:], state))
        off = _wide(slopes[: chain.size])
        count = end
    # Where space has shrunk, as around a cycle that attracts, it was for nothing.
    return Way(tuple(events), count) if off > first else Way((), begin)


def _straight_way(
    chain: Chain, orbit: PlaceOrbit, begin: int, off: float, reach: float
) -> tuple[int, Floats]:
    """The last count to which a way from `begin` is straight, and the slopes there in units of `off` and `reach`."""
    backend = JetBackend(chain.size + len(chain.carried) + 3)
    state = _seeds(orbit, begin, off)
    c = _constants(orbit, reach, backend.variables)
    count, slopes = begin, np.array([each.slope for each in state])
    while count + 1 < len(orbit.states):
        state = _next(chain, orbit, count, state, c, backend)
        spread, bend = spread_and_bend(state[: chain.size])
        if not (backend.reach >= 1 and bend <= STRAIGHT * spread and spread <= STRAIGHT):
            break
        count += 1
        slopes = np.array([each.slope for each in state])
    return count, slopes


def _behind(chain: Chain, orbit: PlaceOrbit, count: int, off: float, reach: float) -> float:
    """How far points are from the place in z at most behind the application `count`."""
    backend = JetBackend(chain.size + len(chain.carried) + 3)
    state, c = _seeds(orbit, count, off), _constants(orbit, reach, backend.variables)
    return sum(spread_and_bend(_next(chain, orbit, count, state, c, backend)[: chain.size]))


def _seeds(orbit: PlaceOrbit, count: int, off: float) -> list[Jet]:
    width = len(orbit.states[count])
    return [
        variable_jet(value, number, unit=off, variables=width + 3)
        for number, value in enumerate(orbit.states[count])
    ]


def _constants(orbit: PlaceOrbit, reach: float, variables: int) -> list[Jet]:
    found = []
    for each in orbit.c:
        jet = constant_jet(each.value, variables)
        jet.slope[-3:] = each.slope * reach
        found.append(jet)
    return found


def _next(
    chain: Chain, orbit: PlaceOrbit, count: int, state: Sequence[Jet], c: Sequence[Jet], backend: JetBackend
) -> list[Jet]:
    bound = chain.link_at(count).bound
    # (The place's own numbers are known: they are not found anew.)
    state = [Jet(value, jet.slope, jet.bend) for value, jet in zip(orbit.states[count], state, strict=True)]
    constant = [backend.lifted(each) for each in constant_of(bound, c)]
    new, _ = applied(bound, state, constant, backend, number=count, carried=chain.carried)
    return [backend.lifted(each) for each in new]


def spread_and_bend(state: Sequence[Jet]) -> tuple[float, float]:
    """How much a state changes at most over a unit of the variables, and how much of that is not straight."""
    slopes = np.array([each.slope for each in state])
    bends = np.array([full_bend(each) for each in state])
    if not (np.isfinite(slopes).all() and np.isfinite(bends).all()):
        return float("inf"), float("inf")
    return _wide(slopes), float(np.linalg.norm(bends)) / 2


def _wide(slopes: Floats) -> float:
    return float(np.linalg.norm(slopes, 2))
