"""Hits: is the set within a pixel of where a picture says that it is?"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.truth.picture import Seen
from benchmarks.truth.solid import Estimated, Floats, Inside, Mask

PLACES = 4096
"""Random places in each ball."""
SHARE = 0.98
"""Of the hits, at least so many have an inside point within a pixel's width."""
_FIRST = 256
_BALLS = (1.0, 1.5, 3.0, 6.0)
# Places that tell how much of a ball is inside, and the share below which the set is thin there.
_FILLED, _THIN = 1000, 0.002
# From how many places of a pixel's ball a descent begins where random places find nothing, and how far it goes.
_DESCENTS, _DOWN = 24, 40


@dataclass(frozen=True, slots=True)
class Hits:
    """What was found around some hits; distances in widths of a pixel.

    Attributes:
        tested: hits that were looked at.
        within: shares of them with an inside point among the random places within 1, 1.5 and 3 widths.
        nearest: median distance of the nearest inside point that was found; inf if that is none.
        stray: share without any within 6 widths, in thick sets hits of something that is not there.
        reached: share with an inside point within 1 width, found at random or by a descent along the gradient.
        fill: median share of the ball of 1 width around the nearest inside point that is inside.
        thin: share of hits where that is below _THIN, or where only descents find any of it.
        floating: (column, row) of hits without one.
    """

    tested: int
    within: tuple[float, float, float]
    nearest: float
    stray: float
    reached: float
    fill: float
    thin: float
    floating: tuple[tuple[int, int], ...]

    @property
    def fat(self) -> bool:
        """Whether the set fills so much space that random places can tell where it is."""
        return self.thin <= 1 - SHARE

    @property
    def met(self) -> bool:
        """Whether the target is met: by random places, or for thin sets with descents too."""
        return self.tested == 0 or (self.within[0] if self.fat else self.reached) >= SHARE


def measure_hits(seen: Seen, solid: Estimated, count: int, random: np.random.Generator) -> Hits:
    """Looks around `count` hits of a picture, or all of them if they are fewer."""
    hit = np.flatnonzero(np.isfinite(seen.t))
    chosen = np.sort(random.choice(hit, min(count, len(hit)), replace=False))
    if not len(chosen):
        return Hits(0, (0.0, 0.0, 0.0), math.inf, 0.0, 0.0, 0.0, 0.0, ())
    rays, t = seen.rays[chosen], seen.t[chosen]
    points, width = rays.at(t), rays.width(t)
    nearest, place = np.full(len(points), math.inf), points.copy()
    for radius in _BALLS:
        _look(points, width, nearest, place, radius, solid, in_ball(random, PLACES))
    fill = solid.inside(place[:, None] + width[:, None, None] * in_ball(random, _FILLED)).mean(axis=1)
    within = [float((nearest <= radius).mean()) for radius in _BALLS[:3]]
    near, reached = nearest <= 1, nearest <= 1
    if within[0] < SHARE:
        missing = np.flatnonzero(~near)
        reached[missing] = _descended(points[missing], width[missing], solid, random)
    thin = np.where(np.isfinite(nearest), fill < _THIN, reached)
    floating = [
        (int(x), int(y)) for x, y in zip(seen.x[chosen][~reached], seen.y[chosen][~reached], strict=True)
    ]
    return Hits(
        len(points),
        (within[0], within[1], within[2]),
        float(np.median(nearest)),
        float(np.isinf(nearest).mean()),
        float(reached.mean()),
        float(np.median(fill)),
        float(thin.mean()),
        tuple(floating),
    )


def in_ball(random: np.random.Generator, count: int) -> Floats:
    """Places spread evenly in the unit ball, shape (count, 3)."""
    direction = random.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    places: Floats = direction * np.cbrt(random.random((count, 1)))
    return places


def _look(
    points: Floats,
    width: Floats,
    nearest: Floats,
    place: Floats,
    radius: float,
    solid: Inside,
    places: Floats,
) -> None:
    """Puts into `nearest` how far inside points lie, and where into `place`, for points that have none so far.

    First among few places, then among many.
    """
    for part in (places[:_FIRST], places[_FIRST:]):
        left = np.flatnonzero(np.isinf(nearest))
        away = radius * np.linalg.norm(part, axis=1)
        for some in np.array_split(left, max(1, len(left) * len(part) >> 20)):
            around = points[some, None] + radius * width[some, None, None] * part
            distance = np.where(solid.inside(around), away, math.inf)
            best = distance.argmin(axis=1)
            nearest[some] = distance[np.arange(len(some)), best]
            place[some] = around[np.arange(len(some)), best]


def _descended(points: Floats, width: Floats, solid: Estimated, random: np.random.Generator) -> Mask:
    """Whether a way down the distance's gradient, from some place within a pixel's width, ends inside within the width."""
    starts = np.concatenate([np.zeros((1, 3)), in_ball(random, _DESCENTS - 1)])
    place = (points[:, None] + width[:, None, None] * starts).reshape(-1, 3)
    home, reach = np.repeat(points, _DESCENTS, axis=0), np.repeat(width, _DESCENTS)
    owner = np.repeat(np.arange(len(points)), _DESCENTS)
    found = np.zeros(len(points), np.bool_)
    for turn in range(_DOWN):
        open_ = ~found[owner]
        place, home, reach, owner = place[open_], home[open_], reach[open_], owner[open_]
        if not len(place):
            break
        known = solid.distances(place)
        # A little farther than the estimate, by turns, so that rounding does not end the way before the surface.
        step = np.minimum(known.full * (1.0, 1.05, 1.5)[turn % 3], reach)
        place = place - step[:, None] * known.normal
        there = solid.inside(place) & (np.linalg.norm(place - home, axis=1) <= reach)
        found[owner[there]] = True
    return found
