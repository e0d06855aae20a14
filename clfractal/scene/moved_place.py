"""The centre of a place of any depth on its way from key to key, in exact arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from math import isfinite, log
from typing import TypeAlias

from clfractal.scene.curves import Monotone, Values, eased, span_of
from clfractal.scene.deeper import decimal_places, decimal_text

Texts: TypeAlias = tuple[str, ...]

# Magnifications whose logarithms differ by less are the same: then the centre goes by the time.
_ALIKE = 1e-6


class MovedPlace:
    """A centre that moves so that the picture does evenly, whatever the magnification is meanwhile.

    From a key with the centre A to one with B, magnified by m0 and m1, it is at a magnification m

        B + (A - B) (1/m - 1/m1) / (1/m0 - 1/m1),

    which leaves one point of the picture where it is. With m0 = m1 it goes straight from A to B by the time.

    Args:
        times: of the keys, rising.
        centers: one for each, as decimal text.
        ways: for each span as `Spans` takes it; where the magnification changes, only whether it rests.
        magnification: by time.
    """

    def __init__(
        self,
        times: Sequence[float],
        centers: Sequence[Texts],
        ways: Sequence[Values | None],
        magnification: Callable[[float], float],
    ) -> None:
        self.times, self.centers, self.ways = tuple(times), tuple(centers), tuple(ways)
        self._exact = [tuple(map(Fraction, each)) for each in centers]
        self._magnification = magnification
        self._smooth = Monotone(times, [float(number) for number in range(len(times))]) if times[1:] else None

    def at(self, time: float, magnification: float) -> Texts:
        """The centre at a time at which it is so much magnified."""
        if len(self.times) == 1:
            return self.centers[0]
        index, share = span_of(self.times, time)
        before, after = self.centers[index], self.centers[index + 1]
        way = self.ways[index]
        if share == 0.0 or before == after or way == ():
            return before if share < 1.0 else after
        if share == 1.0:
            return after
        left = self._left(index, time, share, magnification)
        places = decimal_places(magnification)
        return tuple(
            decimal_text(to + (start - to) * left, places)
            for start, to in zip(self._exact[index], self._exact[index + 1], strict=True)
        )

    def _left(self, index: int, time: float, share: float, magnification: float) -> Fraction:
        """How much of the way is left, 0 to 1."""
        first, last = (self._magnification(each) for each in self.times[index : index + 2])
        if not all(isfinite(each) and each > 0 for each in (first, last, magnification)):
            return Fraction(1) - Fraction(share)  # which the check of the magnification tells
        if abs(log(first / last)) < _ALIKE:
            way = self.ways[index]
            if way is None:
                assert self._smooth is not None
                return Fraction(1 + index) - Fraction(self._smooth.number(time))
            x1, y1, x2, y2 = way
            return Fraction(1) - Fraction(eased((x1, y1, x2, y2), share))
        one, other, here = (1 / Fraction(each) for each in (first, last, magnification))
        return min(max((here - other) / (one - other), Fraction(0)), Fraction(1))
