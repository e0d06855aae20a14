"""Curves through keys: numbers, places in space and directions as functions of time.

Numbers follow monotone cubics (Steffen 1990, A simple method for monotonic interpolation in one dimension): between two
keys a curve never leaves their values, and beside a flat stretch it comes to rest. Places follow centripetal Catmull-Rom
curves (Yuksel, Schaefer and Keyser 2011, Parameterization and applications of Catmull-Rom curves), directions the same on
the sphere. How far along such a curve a time is, is again a monotone cubic. So no curve swings beyond its ends.
"""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from itertools import pairwise
from math import acos, dist, isclose, sin, sqrt
from typing import Protocol, TypeAlias

Values: TypeAlias = tuple[float, ...]
Mix: TypeAlias = Callable[[Values, Values, float], Values]
"""A value between two, or beyond them: the first at 0, the second at 1."""

_BISECTIONS = 60
# Directions nearer to each other than this, or to opposite ones, have no great circle that numbers could tell, radians.
_TINY_ANGLE = 1e-7


class Curve(Protocol):
    """A value for each time; before the first key it is that of the first, after the last key that of the last."""

    def at(self, time: float) -> Values:
        """The value at a time."""


def span_of(knots: Sequence[float], at: float) -> tuple[int, float]:
    """The number of the span between two of the rising `knots` that holds a place, and how far in it that is, 0 to 1."""
    if len(knots) == 1 or at <= knots[0]:
        return 0, 0.0
    if at >= knots[-1]:
        return len(knots) - 2, 1.0
    index = bisect_right(knots, at) - 1
    return index, (at - knots[index]) / (knots[index + 1] - knots[index])


class Monotone:
    """A number that follows monotone cubics; `closed`: the last key is the first one again, with no corner there."""

    def __init__(self, times: Sequence[float], numbers: Sequence[float], *, closed: bool = False) -> None:
        self.times, self.numbers = tuple(times), tuple(numbers)
        self.slopes = _slopes(self.times, self.numbers, closed)

    def number(self, time: float) -> float:
        """The value at a time."""
        index, share = span_of(self.times, time)
        if share == 0.0:
            return self.numbers[index]
        if share == 1.0:
            return self.numbers[index + 1]
        first, last = self.numbers[index], self.numbers[index + 1]
        width = self.times[index + 1] - self.times[index]
        start, end = width * self.slopes[index], width * self.slopes[index + 1]
        rise = last - first
        cubic = (start + end - 2 * rise) * share + 3 * rise - 2 * start - end
        return first + share * (start + share * cubic)


def _slopes(times: Values, numbers: Values, closed: bool) -> Values:
    """The slope at each key (Steffen 1990, Eq. 11)."""
    widths = [after - before for before, after in pairwise(times)]
    rises = [
        (after - before) / width for (before, after), width in zip(pairwise(numbers), widths, strict=True)
    ]
    if not rises:
        return (0.0,)
    inner = [_slope(*each) for each in zip(pairwise(rises), pairwise(widths), strict=True)]
    if closed:
        seam = _slope((rises[-1], rises[0]), (widths[-1], widths[0]))
        return (seam, *inner, seam)
    if len(rises) == 1:
        return (rises[0], rises[0])
    return (_end(rises[:2], widths[:2]), *inner, _end(rises[:-3:-1], widths[:-3:-1]))


def _slope(rises: tuple[float, float], widths: tuple[float, float]) -> float:
    """The slope between two spans: that of the parabola through three keys, if it is not too steep for a monotone curve."""
    if rises[0] * rises[1] <= 0:
        return 0.0
    parabola = (rises[0] * widths[1] + rises[1] * widths[0]) / (widths[0] + widths[1])
    least = min(abs(rises[0]), abs(rises[1]), 0.5 * abs(parabola))
    return 2 * least if rises[0] > 0 else -2 * least


def _end(rises: Sequence[float], widths: Sequence[float]) -> float:
    """The slope at an end: that of the parabola through three keys, from a half of the span's own slope to twice that.

    Steffen lets it become 0, at which a movement that gets faster would begin from rest.
    """
    share = widths[0] / (widths[0] + widths[1])
    parabola = rises[0] * (1 + share) - rises[1] * share
    if rises[0] == 0:
        return 0.0
    return rises[0] * min(max(parabola / rises[0], 0.5), 2.0)


def straight(a: Values, b: Values, share: float) -> Values:
    """The place at a part of the way from `a` to `b`."""
    return tuple(x + share * (y - x) for x, y in zip(a, b, strict=True))


def turned(a: Values, b: Values, share: float) -> Values:
    """The direction at a part of the turn from `a` to `b`, all of length 1 (Shoemake 1985).

    Opposite directions are turned into each other about an axis of their own choice.
    """
    cosine = min(max(sum(x * y for x, y in zip(a, b, strict=True)), -1.0), 1.0)
    angle = acos(cosine)
    if angle < _TINY_ANGLE:
        return unit(straight(a, b, share))
    if angle > 3.141592653589793 - _TINY_ANGLE:
        middle = _across(a)
        return turned(a, middle, 2 * share) if share < 0.5 else turned(middle, b, 2 * share - 1)
    first, second = sin((1 - share) * angle), sin(share * angle)
    return unit(tuple((first * x + second * y) / sin(angle) for x, y in zip(a, b, strict=True)))


def unit(a: Values) -> Values:
    """The vector of length 1 in a direction that is not 0."""
    largest = max(abs(x) for x in a)
    scaled = [x / largest for x in a]
    size = sqrt(sum(x * x for x in scaled))
    return tuple(x / size for x in scaled)


def apart(a: Values, b: Values) -> float:
    """The distance between two places."""
    return dist(a, b)


def _across(a: Values) -> Values:
    """A direction across another one: level, where that is possible."""
    x, y, z = a
    return unit((-y, x, 0.0)) if abs(z) < 0.99 else unit((0.0, -z, y))


class Path:
    """Places, or directions, on a centripetal Catmull-Rom curve, by Barry and Goldman's scheme.

    Args:
        times: of the keys, rising.
        places: one for each; equal ones in a row are a rest.
        mix: `straight` for places, `turned` for directions of length 1.
        closed: the last key is the first one again, and there is no corner there.
    """

    def __init__(
        self, times: Sequence[float], places: Sequence[Values], mix: Mix = straight, *, closed: bool = False
    ) -> None:
        knots, kept = [0.0], [places[0]]
        for place in places[1:]:
            knots.append(knots[-1] + sqrt(apart(place, kept[-1])))
            if knots[-1] > knots[-2]:
                kept.append(place)
        self._mix = mix
        self._progress = Monotone(times, knots, closed=closed and len(kept) > 1)
        self._knots = sorted(set(knots))
        self._places = kept
        self._around = _with_ends(self._knots, kept, mix, closed)

    def at(self, time: float) -> Values:
        """As a `Curve`."""
        if len(self._places) == 1:
            return self._places[0]
        along = self._progress.number(time)
        index, share = span_of(self._knots, along)
        if share in (0.0, 1.0):
            return self._places[index + int(share)]
        knots, places = self._around
        c, p, mix = knots[index : index + 4], places[index : index + 4], self._mix

        def between(first: int, last: int, a: Values, b: Values) -> Values:
            return mix(a, b, (along - c[first]) / (c[last] - c[first]))

        before, here, after = (between(i, i + 1, p[i], p[i + 1]) for i in range(3))
        return between(1, 2, between(0, 2, before, here), between(1, 3, here, after))


def _with_ends(
    knots: Sequence[float], places: Sequence[Values], mix: Mix, closed: bool
) -> tuple[list[float], list[Values]]:
    """Knots and places with one more before and after: of a closed curve those that follow, else on a line."""
    if len(places) < 2:
        return list(knots), list(places)
    first, last = knots[1] - knots[0], knots[-1] - knots[-2]
    if closed:
        ends = (knots[0] - last, places[-2]), (knots[-1] + first, places[1])
    else:
        ends = (
            (knots[0] - first, mix(places[0], places[1], -1.0)),
            (knots[-1] + last, mix(places[-2], places[-1], 2.0)),
        )
    return [ends[0][0], *knots, ends[1][0]], [ends[0][1], *places, ends[1][1]]


def eased(handles: tuple[float, float, float, float], share: float) -> float:
    """How far a value is at a part of the time between two keys, by a cubic Bezier curve from (0, 0) to (1, 1).

    Args:
        handles: x and y of the two inner points, time and value; the x are 0 to 1, so that each time has one value.
        share: part of the time, 0 to 1.
    """
    x1, y1, x2, y2 = handles
    if share <= 0 or share >= 1 or (x1 == y1 and x2 == y2):
        return min(max(share, 0.0), 1.0)
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _bezier(x1, x2, middle) < share else (low, middle)
    return _bezier(y1, y2, 0.5 * (low + high))


def _bezier(first: float, second: float, s: float) -> float:
    return 3 * (1 - s) * (1 - s) * s * first + 3 * (1 - s) * s * s * second + s * s * s


def same(a: Values, b: Values) -> bool:
    """Whether two values are equal but for rounding."""
    return all(isclose(x, y, rel_tol=1e-9, abs_tol=1e-12) for x, y in zip(a, b, strict=True))


class Spans:
    """A curve that is a smooth one between some keys, and between others rests, or goes its own way to the next key.

    Args:
        times: of the keys, rising.
        values: one for each.
        ways: for each span between two keys the handles of `eased`; None: `smooth` leads there; an empty tuple:
            the value stays that of the first key.
        smooth: the curve through all keys.
        mix: from one key to the next, where there are handles.
    """

    def __init__(
        self,
        times: Sequence[float],
        values: Sequence[Values],
        ways: Sequence[Values | None],
        smooth: Callable[[float], Values],
        mix: Mix,
    ) -> None:
        self.times, self.values, self.ways = tuple(times), tuple(values), tuple(ways)
        self.smooth, self.mix = smooth, mix

    def at(self, time: float) -> Values:
        """As a `Curve`."""
        index, share = span_of(self.times, time)
        if share == 0.0:
            return self.values[index]
        if share == 1.0:
            return self.values[index + 1]
        way = self.ways[index]
        if way is None:
            return self.smooth(time)
        if not way:
            return self.values[index]
        x1, y1, x2, y2 = way
        return self.mix(self.values[index], self.values[index + 1], eased((x1, y1, x2, y2), share))
