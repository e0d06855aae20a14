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
from collections.abc import Iterator, Sequence
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
from clfractal.formulas.jets import Jet, JetBackend, constant_jet, coordinate_jet, full_bend

STRAIGHT = 2.0**-20
"""What linear orbits may be off, as a part of the distance from the place."""
NEAREST = -40
"""Binary exponent of |p| of the nearest points that are told apart, scene units: some 1e-12 of one."""
STEP = 2
"""How many of these exponents share an entry of the table (`PLACE_STEP` in `kernels/formulas/place.h`)."""
FARTHEST = 8
"""How much farther than the set itself the farthest are, as an exponent."""
HEAD = 6
"""Numbers before the entries."""
# Orbits of one place are found anew where it is magnified by so many more bits: films share them in between.
_SHARED_BITS = 64
# Digits that values have beyond those of the nearest points.
_BITS_BESIDE = 80
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

    def numbers(self) -> Iterator[float]:
        """An entry of the table: `place.h` has what stands where."""
        yield float(self.count)
        yield self.growth
        for value, slopes in zip(self.state, self.slopes, strict=True):
            yield value
            yield from map(float, slopes)


def table_of(chain: Chain) -> tuple[float, ...]:
    """The table of a placed chain as kernels read it: a head of six numbers, its entries, and z of the place's own orbit.

    Raises:
        FormulaError: mpmath is not there; the path says where.
    """
    place = chain.place
    assert place is not None
    farthest = math.dist(chain.center, (0.0, 0.0, 0.0)) + chain.radius
    highest = max(math.ceil(math.log2(max(farthest, 1.0))) + FARTHEST, NEAREST + STEP)
    begun = begun_orbits(chain)
    numbers: list[float] = []
    exponents = range(NEAREST, highest + STEP, STEP)
    for exponent in exponents:
        # Points of this entry are nearer than the next one's.
        most = place.scale * 2.0 ** (exponent + STEP)
        numbers += (next((each for each in reversed(begun) if each.reach >= most), begun[0])).numbers()
    width = len(numbers) // len(exponents)
    head = (2 * NEAREST, len(exponents), width, place.scale, HEAD + len(numbers), begun[0].count)
    own = (value for each in begun for value in each.state[: chain.size])
    return (*map(float, head), *numbers, *own)


def begun_orbits(chain: Chain) -> tuple[Begun, ...]:
    """Where orbits around a chain's place may begin, from the first to the last; each is as exact as those before it."""
    return _orbit(chain).begun


def begun_at(chain: Chain, points: NDArray[np.float64]) -> BegunAt:
    """Where the orbits of points begin, shape (n, 3), scene units: as kernels read the table."""
    table = np.array(table_of(chain))
    lowest, count, width, scale = table[:4]
    square = np.einsum("ij,ij->i", points, points)
    exponents = np.where(square > 0, np.frexp(square)[1] - 1, lowest)
    index = np.clip((exponents - lowest) // (2 * STEP), 0, count - 1).astype(int)
    entries = table[HEAD : HEAD + int(count * width)].reshape(int(count), -1)[index]
    numbers = entries[:, 2:].reshape(len(points), -1, 4).transpose(1, 2, 0)
    moved = points.T * scale
    values = [
        own + slopes[0] * moved[0] + slopes[1] * moved[1] + slopes[2] * moved[2] for own, *slopes in numbers
    ]
    return BegunAt(
        entries[:, 0].astype(np.int64), values, [[s * scale for s in slopes] for _, *slopes in numbers]
    )


def applications_until_apart(chain: Chain) -> int:
    """How many applications it takes until a scene unit around a chain's place is about as large in z as z itself.

    A picture has as much detail at any depth if its iterations are as many more.
    """
    place, spread = chain.place, _orbit(chain).spread
    assert place is not None
    apart = (n for n, each in enumerate(spread) if math.isfinite(each) and each >= place.magnification)
    return next(apart, len(spread))


def steps_per_pixel(chain: Chain) -> float:
    """How many steps of float64 wide a pixel around a chain's place is in z, at the least.

    Pixels are thousandths of a scene unit. Where orbits begin too soon, at a fold through the place, or pass near a
    critical point later on, what is seen in the picture is lost.
    """
    place, orbit = chain.place, _orbit(chain)
    assert place is not None
    begun = next((each for each in reversed(orbit.begun) if each.reach >= place.scale), orbit.begun[0])
    spread = min(orbit.spread[begun.count :], default=math.inf)
    return spread * place.scale / 1000 / float(np.finfo(np.float64).eps)


def drawn_out(chain: Chain) -> float:
    """How many times longer than thick forms around a chain's place are, that are round in z; infinite for sheets.

    Maps that keep angles, folds and inversions and turns, have 1 at any depth. Powers of other algebras than complex
    numbers draw them out, application by application.
    """
    drawn = _orbit(chain).drawn_out
    return drawn[min(applications_until_apart(chain), len(drawn) - 1)]


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
class _Orbit:
    """What is known of a place's own orbit.

    Attributes:
        spread: after 0, 1, ... applications, how much these stretch space, over |z|; an infinity before orbits begin.
        drawn_out: how much more they stretch it in one direction than in another, likewise; also an infinity for sheets.
    """

    begun: tuple[Begun, ...]
    spread: tuple[float, ...]
    drawn_out: tuple[float, ...]


def _orbit(chain: Chain) -> _Orbit:
    place = chain.place
    assert place is not None
    depth = math.ceil(math.log2(place.magnification)) - NEAREST
    depth += -depth % _SHARED_BITS
    return _orbit_of(replace(chain, place=None), place.exact, depth, place.applications)


@lru_cache(maxsize=16)
def _orbit_of(chain: Chain, center: Sequence[Fraction], depth: int, most: int) -> _Orbit:
    try:
        import mpmath
    except ImportError:
        raise FormulaError("needs mpmath: pip install 'clfractal[deep]'", Where(path="deep")) from None
    with mpmath.workprec(depth + _BITS_BESIDE), np.errstate(all="ignore"):
        point = [mpmath.mpf(part.numerator) / part.denominator for part in center]
        return _follow(chain, point, 2.0**-depth, most)


def _follow(chain: Chain, center: Sequence[Any], nearest: float, most: int) -> _Orbit:
    backend = JetBackend()
    c = [_jet(each) for each in space_to_state(chain, list(map(coordinate_jet, center, range(3))), backend)]
    beside = [_jet(each) for each in carried_at_start(chain, c, backend)]
    state = [_jet(0.0)] * chain.size if chain.add == "point" else list(c)
    state += beside
    growth, reach = 1.0, math.inf
    first = int(chain.starts_counted)
    begun: list[Begun] = []
    spread: list[float] = []
    drawn: list[float] = []
    for count in range(most + 1):
        values = tuple(float(each.value) for each in state)
        slopes = np.array([each.slope for each in state])
        away = math.hypot(*values[: chain.size])
        if count > first:
            # (At the first one all may begin.)
            if not away <= _WITHIN * chain.bailout:
                break
            reach = min(reach, _straight(state, chain.size), backend.reach)
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
    return _Orbit(tuple(begun), tuple(spread), tuple(drawn))


def _straight(state: Sequence[Jet], size: int) -> float:
    """How far around the place a state is straight enough."""
    slopes = np.array([each.slope for each in state[:size]])
    bends = np.array([full_bend(each.bend) for each in state[:size]])
    if not (np.isfinite(slopes).all() and np.isfinite(bends).all()):
        return 0.0
    most = float(np.linalg.norm(slopes, 2))
    if most == 0:
        return 0.0
    # (Where second derivatives vanish by chance, those behind them are small over a small part of z.)
    found = STRAIGHT / most
    off = float(np.linalg.norm(bends)) / (2 * most)
    found = min(found, STRAIGHT / off) if off > 0 else found
    for each in state[size:]:
        bend, slope = float(np.linalg.norm(full_bend(each.bend))), float(np.linalg.norm(each.slope))
        if bend > 0:
            found = min(found, 2 * STRAIGHT * slope / bend)
    return found


def _jet(value: Any) -> Jet:
    import mpmath

    return value if isinstance(value, Jet) else constant_jet(mpmath.mpf(value))
