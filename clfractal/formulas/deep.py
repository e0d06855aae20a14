"""Orbits of a place of any depth: where those of all points around it begin, many applications on.

Near a place orbits stay together for long. With Z_k the place's own state after k applications, and J_k how it changes
with the point, those of points p near it are Z_k + J_k p as long as the map is straight over them. So an orbit begins
at the last k at which that is exact enough, and is applied from there in the device's numbers: by then what is seen in
the picture is some 1e-6 wide in z, which these resolve. (Series for the orbits of Mandelbrot sets: K. I. Martin,
Superfractalthing Maths, 2013. Here it is the formula's own tree that is differentiated, in three dimensions, with the
bound below.)

|p| alone decides where a point's orbit begins, in steps of 4: a table has for each the count, and there Z, J, and the
scalar derivative. The bound: B_k being the second derivatives, what is left out is B_k p p / 2. It is to be at most
`STRAIGHT` of what |p| moves z at most, the largest singular value of J_k; and |J_k p| is to be at most that, too. (Many
maps hardly stretch space in one direction, so their sets are as if drawn along it: what is off by as little there is
beyond the picture.) At conditions, folds and poles the map goes another way: no orbit begins behind one that lies
nearer than 2 |p|.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clfractal.errors import FormulaError, Where
from clfractal.formulas.application import applied, carried_at_start, constant_of, space_to_state
from clfractal.formulas.chain import Chain
from clfractal.formulas.evaluate import evaluate
from clfractal.formulas.events import STRAIGHT, WIDE, PlaceOrbit, Way, spread_and_bend, way_past_events
from clfractal.formulas.jets import Jet, JetBackend, constant_jet, variable_jet
from clfractal.formulas.place import Place

NEAREST = -40
"""Binary exponent of |p| of the nearest points that are told apart, scene units: some 1e-12 of one."""
STEP = 2
"""How many of these exponents share an entry of the table (`PLACE_STEP` in `kernels/formulas/place.h`)."""
FARTHEST = 26
"""That of the farthest points that are told apart: rays and cameras get no farther. Those beyond begin where all may."""
# Orbits of one place are found anew where it is magnified by so many more bits: films share them in between.
_SHARED_BITS = 64
# Digits that values have beyond those of the nearest points.
_BITS_BESIDE = 80
# Of a place within the set, whose orbit stays: what is around it comes apart before, or never.
_MOST_FOLLOWED = 4_000
# So many times smaller gets what passes near a critical point, and nothing else.
_COLLAPSE = 1e6
# mpmath has one precision for all threads.
_EXACT = threading.RLock()
# No orbit begins where it ends.
_WITHIN = 0.999


@dataclass(frozen=True, slots=True)
class Begun:
    """Where orbits of points begin that are up to `reach` from a place; lengths are those of the formula's own space.

    Attributes:
        count: applications behind them.
        state: of the place, z and what is carried beside it.
        slopes: how these change with the point, shape (n, 3).
        growth: the scalar derivative, or 1.
    """

    count: int
    state: tuple[float, ...]
    slopes: NDArray[np.float64]
    growth: float
    reach: float


@dataclass(frozen=True, slots=True)
class BegunAt:
    """Where orbits of some points begin.

    Attributes:
        counts: applications behind them, shape (n,).
        values: the numbers of the state, each of shape (n,).
        slopes: of each its three derivatives by the scene's coordinates, each of shape (n,).
    """

    counts: NDArray[np.int64]
    values: list[NDArray[np.float64]]
    slopes: list[list[NDArray[np.float64]]]


@dataclass(frozen=True, slots=True)
class Orbit:
    """What is known of a place's own orbit.

    Attributes:
        spread: after 0, 1, ... applications, how much these stretch space, over |z|; an infinity before orbits begin.
        drawn_out: how much more they stretch it in one direction than in another, likewise; also an infinity for sheets.
    """

    begun: tuple[Begun, ...]
    spread: tuple[float, ...]
    drawn_out: tuple[float, ...]
    own: PlaceOrbit


def reaches_of(chain: Chain) -> list[float]:
    """How far the points of each entry are at most, in the formula's space: nearer than the next one's."""
    place = chain.place
    assert place is not None
    told_apart = [place.scale * 2.0 ** (exponent + STEP) for exponent in range(NEAREST, FARTHEST, STEP)]
    return [*told_apart, math.inf]


def begin_of(chain: Chain, reach: float) -> Begun:
    """Where orbits begin that are up to `reach` from a chain's place: the last one that is exact enough there."""
    begun = begun_orbits(chain)
    return next((each for each in reversed(begun) if each.reach >= reach), begun[0])


def begins_too_soon(chain: Chain, reach: float) -> bool:
    """Whether what is as far from the place is too narrow in z where orbits begin."""
    return _off(chain, begin_of(chain, reach), reach) < WIDE


def _off(chain: Chain, begun: Begun, reach: float) -> float:
    """How far points are from the place at most in z, where their orbits begin."""
    return float(np.linalg.norm(begun.slopes[: chain.size], 2)) * reach


def way_of(chain: Chain, reach: float) -> Way:
    """The way of points up to `reach` from the place, from where their orbits begin to where that is soon enough."""
    begun = begin_of(chain, reach)
    off = _off(chain, begun, reach)
    if not off < WIDE:
        return Way((), begun.count)
    place = chain.place
    assert place is not None
    return _way_of(
        replace(chain, place=None), place.exact, _depth(place), place.applications, begun.count, off, reach
    )


@lru_cache(maxsize=512)
def _way_of(
    chain: Chain, center: Sequence[Fraction], depth: int, most: int, begin: int, off: float, reach: float
) -> Way:
    import mpmath

    with _EXACT, mpmath.workprec(depth + _BITS_BESIDE), np.errstate(all="ignore"):
        return way_past_events(chain, _found_orbit(chain, center, depth, most).own, begin, off, reach)


def begun_orbits(chain: Chain) -> tuple[Begun, ...]:
    """Where orbits around a chain's place may begin, from the first to the last; each is as exact as those before it."""
    return orbit_of(chain).begun


def begun_at(chain: Chain, points: NDArray[np.float64]) -> BegunAt:
    """Where the orbits of points begin, shape (n, 3), scene units: as kernels read the table, but before any event."""
    place = chain.place
    assert place is not None
    reaches = reaches_of(chain)
    square = np.einsum("ij,ij->i", points, points)
    exponents = np.where(square > 0, np.frexp(square)[1] - 1, 2 * NEAREST)
    index = np.clip((exponents - 2 * NEAREST) // (2 * STEP), 0, len(reaches) - 1)
    starts = [begin_of(chain, reach) for reach in reaches]
    counts = np.array([each.count for each in starts])[index]
    values = np.array([each.state for each in starts])[index].T
    slopes = np.array([each.slopes for each in starts])[index].transpose(1, 2, 0) * place.scale
    return BegunAt(
        counts,
        [own + (by * points.T).sum(axis=0) for own, by in zip(values, slopes, strict=True)],
        list(map(list, slopes)),
    )


def applications_until_apart(chain: Chain) -> int:
    """How many applications it takes until a scene unit around a chain's place is about as large in z as z itself.

    A picture has as much detail at any depth if its iterations are as many more.
    """
    place, spread = chain.place, orbit_of(chain).spread
    assert place is not None
    apart = (n for n, each in enumerate(spread) if math.isfinite(each) and each >= place.magnification)
    return next(apart, len(spread))


def drawn_out(chain: Chain) -> float:
    """How many times longer than thick forms around a chain's place are, that are round in z; infinite for sheets.

    Maps that keep angles, folds and inversions and turns, have 1 at any depth. Powers of other algebras than complex
    numbers draw them out, application by application.
    """
    drawn = orbit_of(chain).drawn_out
    return drawn[min(applications_until_apart(chain), len(drawn) - 1)]


def steps_per_pixel(chain: Chain) -> float:
    """How many steps of float64 wide a pixel around a chain's place is in z, at the least.

    Pixels are thousandths of a scene unit. Where orbits begin too soon, at a fold through the place, or pass near a
    critical point later on, what is seen in the picture is lost.
    """
    place, orbit = chain.place, orbit_of(chain)
    assert place is not None
    spread = min(orbit.spread[way_of(chain, place.scale).count :], default=math.inf)
    most = max((each for each in orbit.spread if math.isfinite(each)), default=0.0)
    if most * place.scale < 1 and most < _COLLAPSE * spread:
        return math.inf  # it all goes one way
    return spread * place.scale / 1000 / float(np.finfo(np.float64).eps)


def orbit_of(chain: Chain) -> Orbit:
    """The orbit of a chain's place."""
    place = chain.place
    assert place is not None
    return _found_orbit(replace(chain, place=None), place.exact, _depth(place), place.applications)


def _depth(place: Place) -> int:
    """Bits behind the point of the nearest points that are told apart."""
    depth = math.ceil(math.log2(place.magnification)) - NEAREST
    return depth + -depth % _SHARED_BITS


@lru_cache(maxsize=16)
def _found_orbit(chain: Chain, center: Sequence[Fraction], depth: int, most: int) -> Orbit:
    try:
        import mpmath
    except ImportError:
        raise FormulaError("needs mpmath: pip install 'clfractal[deep]'", Where(path="deep")) from None
    with _EXACT, mpmath.workprec(depth + _BITS_BESIDE), np.errstate(all="ignore"):
        point = [mpmath.mpf(part.numerator) / part.denominator for part in center]
        return _follow(chain, point, 2.0**-depth, most)


def _follow(chain: Chain, center: Sequence[Any], nearest: float, most: int) -> Orbit:
    backend = JetBackend()
    c = [
        _jet(each)
        for each in space_to_state(
            chain, [variable_jet(value, axis) for axis, value in enumerate(center)], backend
        )
    ]
    beside = [_jet(each) for each in carried_at_start(chain, c, backend)]
    state = [_jet(0.0)] * chain.size if chain.add == "point" else list(c)
    state += beside
    growth, reach = 1.0, math.inf
    first = int(chain.starts_counted)
    begun: list[Begun] = []
    spread: list[float] = []
    drawn: list[float] = []
    states: list[tuple[Any, ...]] = []
    growths: list[float] = []
    for count in range(min(most, _MOST_FOLLOWED) + 1):
        values = tuple(float(each.value) for each in state)
        slopes = np.array([each.slope for each in state])
        away = math.hypot(*values[: chain.size])
        if count > first:
            # (At the first one all may begin.)
            if not away <= _WITHIN * chain.bailout:
                break
            reach = min(reach, _straight(state, chain.size), backend.reach)
        states.append(tuple(each.value for each in state))
        growths.append(growth)
        if count >= first and reach >= nearest:
            begun.append(Begun(count, values, slopes, growth, reach))
        widths = (
            np.linalg.svd(slopes[: chain.size], compute_uv=False)
            if np.isfinite(slopes).all()
            else np.zeros(3)
        )
        stretched = float(widths[0])
        drawn.append(stretched / float(widths[2]) if widths[2] > 0 else math.inf)
        spread.append(stretched / max(away, 1.0) if count >= first and stretched > 0 else math.inf)
        bound = chain.link_at(count).bound
        constant = [_jet(each) for each in constant_of(bound, c)]
        new, names = applied(bound, state, constant, backend, number=count, carried=chain.carried)
        if bound.derivative is not None and count >= first:
            found = evaluate(bound.derivative, {**names, "dr": _jet(growth)}, backend)
            growth = float(found.value if isinstance(found, Jet) else found)
        state = [_jet(each) for each in new]
    own = PlaceOrbit(tuple(c), tuple(states), tuple(growths))
    return Orbit(tuple(begun), tuple(spread), tuple(drawn), own)


def _straight(state: Sequence[Jet], size: int) -> float:
    """How far around the place a state is straight enough."""
    spread, bend = spread_and_bend(state[:size])
    if not 0 < spread < math.inf:
        return 0.0
    # (Where second derivatives vanish by chance, those behind them are small over a small part of z.)
    found = STRAIGHT / spread
    found = min(found, STRAIGHT * spread / bend) if bend > 0 else found
    for each in state[size:]:
        spread, bend = spread_and_bend([each])
        if bend > 0:
            found = min(found, STRAIGHT * spread / bend)
    return found


def _jet(value: Any) -> Jet:
    import mpmath

    return value if isinstance(value, Jet) else constant_jet(mpmath.mpf(value))
