"""A camera's flight round its target, and towards it, that looks even.

Distances are interpolated in the logarithm, and directions on the sphere: each second brings the target nearer by the same
factor. A target that moves meanwhile goes as far as the distance lets it: by the same part of the picture each second,
wherever the camera is (van Wijk and Nuij 2003, Smooth and efficient zooming and panning, whose measure of a movement this
is).
"""

from collections.abc import Sequence
from itertools import accumulate
from math import exp, log

from clfractal.scene.curves import Curve, Monotone, Path, Values, apart, span_of, turned, unit

_PANELS = 32  # of Simpson's rule, between two keys


class Distance:
    """A distance above 0 that follows monotone cubics in the logarithm."""

    def __init__(self, times: Sequence[float], distances: Sequence[float], *, closed: bool = False) -> None:
        self._logarithm = Monotone(times, [log(each) for each in distances], closed=closed)

    def number(self, time: float) -> float:
        """The distance at a time."""
        return exp(self._logarithm.number(time))


class EvenTarget:
    """Where a camera looks that comes nearer or goes away meanwhile: so far that the picture moves evenly.

    Args:
        times: of the keys, rising.
        targets: one for each, scene units.
        distance: of the camera from its target.
    """

    def __init__(
        self, times: Sequence[float], targets: Sequence[Values], distance: Distance, *, closed: bool = False
    ) -> None:
        self._times, self._distance = tuple(times), distance
        parts = [self._area(times[i], times[i + 1]) for i in range(len(times) - 1)]
        self._whole = sum(parts)
        self._ends = [0.0, *(part / self._whole for part in accumulate(parts))] if parts else [0.0]
        self._path = Path(self._ends, targets, closed=closed)

    def _area(self, begin: float, end: float) -> float:
        """The integral of the distance over a time, by Simpson's rule."""
        step = (end - begin) / _PANELS
        inner = sum((4 if i % 2 else 2) * self._distance.number(begin + i * step) for i in range(1, _PANELS))
        return (self._distance.number(begin) + inner + self._distance.number(end)) * step / 3

    def at(self, time: float) -> Values:
        """As a `Curve`."""
        index, share = span_of(self._times, time)
        if share in (0.0, 1.0):
            return self._path.at(self._ends[min(index + int(share), len(self._ends) - 1)])
        return self._path.at(self._ends[index] + self._area(self._times[index], time) / self._whole)


class Around:
    """A camera's place, by direction and distance from a target that may move.

    Args:
        times: of the keys, rising.
        places: the camera's, one for each; none of them is at the target.
        target: where the camera looks.
    """

    def __init__(
        self, times: Sequence[float], places: Sequence[Values], target: Curve, *, closed: bool = False
    ) -> None:
        seen = [target.at(time) for time in times]
        self.target = target
        self.distance = Distance(times, distances(places, seen), closed=closed)
        directions = [
            unit(tuple(x - y for x, y in zip(place, at, strict=True)))
            for place, at in zip(places, seen, strict=True)
        ]
        self._direction = Path(times, directions, turned, closed=closed)

    def at(self, time: float) -> Values:
        """As a `Curve`."""
        distance = self.distance.number(time)
        seen, direction = self.target.at(time), self._direction.at(time)
        return tuple(x + distance * y for x, y in zip(seen, direction, strict=True))


def distances(places: Sequence[Values], targets: Sequence[Values]) -> list[float]:
    """How far each place is from its target."""
    return [apart(place, target) for place, target in zip(places, targets, strict=True)]
