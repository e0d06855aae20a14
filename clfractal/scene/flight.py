"""A camera's flight round its target, and towards it, that looks even.

Distances are interpolated in the logarithm, and directions on the sphere: each second brings the target nearer by the same
factor. A target that moves meanwhile goes as far as the distance lets it: by the same part of the picture each second,
wherever the camera is (van Wijk and Nuij 2003, Smooth and efficient zooming and panning, whose measure of a movement this
is).
"""

from collections.abc import Sequence
from itertools import accumulate, pairwise
from math import exp, log

from clfractal.scene.curves import Monotone, Path, Values, apart, span_of, turned, unit

_PANELS = 256  # of Simpson's rule, between two keys


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
        self._distance = distance
        edges = [times[0]]
        for before, after in pairwise(times):
            edges += [before + (after - before) * panel / _PANELS for panel in range(1, _PANELS)] + [after]
        self._edges = edges
        self._areas = [0.0, *accumulate(self._area(before, after) for before, after in pairwise(edges))]
        self._path = Path(self._areas[::_PANELS], targets, closed=closed)

    def _area(self, begin: float, end: float) -> float:
        """The integral of the distance over a short time, by Simpson's rule."""
        first, middle, last = (self._distance.number(time) for time in (begin, 0.5 * (begin + end), end))
        return (first + 4 * middle + last) * (end - begin) / 6

    def at(self, time: float) -> Values:
        """As a `Curve`."""
        if len(self._edges) == 1:
            return self._path.at(0.0)
        index, share = span_of(self._edges, time)
        if share in (0.0, 1.0):
            return self._path.at(self._areas[index + int(share)])
        return self._path.at(self._areas[index] + self._area(self._edges[index], time))


class Around:
    """Where a camera is from its target: a direction and a distance.

    Args:
        times: of the keys, rising.
        places: the camera's, one for each; none of them is at the target.
        targets: where it looks then.
    """

    def __init__(
        self,
        times: Sequence[float],
        places: Sequence[Values],
        targets: Sequence[Values],
        *,
        closed: bool = False,
    ) -> None:
        offsets = [
            tuple(x - y for x, y in zip(place, target, strict=True))
            for place, target in zip(places, targets, strict=True)
        ]
        self._at_keys = dict(zip(times, offsets, strict=True))
        self.distance = Distance(times, distances(places, targets), closed=closed)
        self._direction = Path(times, [unit(offset) for offset in offsets], turned, closed=closed)

    def at(self, time: float) -> Values:
        """The way from the target to the camera."""
        if time in self._at_keys:
            return self._at_keys[time]
        distance = self.distance.number(time)
        return tuple(distance * x for x in self._direction.at(time))


def distances(places: Sequence[Values], targets: Sequence[Values]) -> list[float]:
    """How far each place is from its target."""
    return [apart(place, target) for place, target in zip(places, targets, strict=True)]
