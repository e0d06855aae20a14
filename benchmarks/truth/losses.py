"""Losses: rays that pass through the set and do not see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.truth.picture import Seen
from benchmarks.truth.rays import Floats, Mask, Rays
from benchmarks.truth.solid import Inside

THICK = 3.0
"""Widths of a pixel: an inside stretch of a ray that is as long must not be missed."""
LATE = 4.0
"""Widths of a pixel: how far behind the start of such a stretch a hit may lie."""
# Samples of a pixel's width where a stretch is looked at closely.
_FINE = 8
# How much of a ray is looked at closely at once, widths of a pixel; neighbouring parts overlap.
_PART, _OVERLAP = 12, 4
# Nearer to an eye than this part of the way to the end pixels are too narrow to matter.
_NEAREST = 0.01
_BATCH = 1 << 20


@dataclass(frozen=True, slots=True)
class Loss:
    """A ray that passes through the set before what the picture shows, if anything.

    Attributes:
        x, y: the pixel.
        start: where the inside stretch begins, distance along the ray, scene units.
        late: how far behind that the hit lies, widths of a pixel; inf if nothing was hit.
    """

    x: int
    y: int
    start: float
    late: float


@dataclass(frozen=True, slots=True)
class Losses:
    """Rays that were tried, and those that were lost."""

    tried: int
    lost: tuple[Loss, ...]

    @property
    def met(self) -> bool:
        """Whether the target is met: none is lost."""
        return not self.lost


def measure_losses(seen: Seen, solid: Inside, count: int, random: np.random.Generator) -> Losses:
    """Tries `count` rays that meet the bounds: half of them anywhere, half where the depth jumps from pixel to pixel."""
    meets = seen.rays.near < seen.rays.far
    edges = np.flatnonzero(meets & _edges(seen))
    some = random.choice(edges, min(count // 2, len(edges)), replace=False)
    rest = np.setdiff1d(np.flatnonzero(meets), some)
    chosen = np.sort(
        np.concatenate([some, random.choice(rest, min(count - len(some), len(rest)), replace=False)])
    )
    rays, t = seen.rays[chosen], seen.t[chosen]
    hit = np.isfinite(t)
    # A stretch that matters ends a pixel's width before the hit at the latest.
    end = np.where(hit, t - (LATE - THICK) * rays.width(np.where(hit, t, 0.0)), rays.far)
    near = np.maximum(rays.near, np.where(rays.spread > 0, _NEAREST * end, -np.inf))
    start = first_stretch(solid, rays, near, end)
    width = rays.width(np.where(np.isnan(start), 0.0, start))
    late = np.where(hit, (t - start) / np.maximum(width, 1e-300), np.inf)
    lost = np.flatnonzero(~np.isnan(start) & (late > LATE))
    found = [
        Loss(int(seen.x[chosen[i]]), int(seen.y[chosen[i]]), float(start[i]), float(late[i])) for i in lost
    ]
    return Losses(len(chosen), tuple(found))


def _edges(seen: Seen) -> Mask:
    """Pixels whose neighbour to the right or below lies elsewhere: shape (height * width,)."""
    t = np.where(np.isfinite(seen.t), seen.t, 1e300).reshape(seen.framebuffer.height, seen.framebuffer.width)
    wide = np.where(
        t < 1e300, seen.rays.width(np.where(np.isfinite(seen.t), seen.t, 0.0)).reshape(t.shape), 0.0
    )
    edge = np.zeros(t.shape, np.bool_)
    for axis in (0, 1):
        low = [slice(None), slice(None)]
        high = [slice(None), slice(None)]
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        a, b = tuple(low), tuple(high)
        jump = np.abs(t[a] - t[b]) > 8 * np.maximum(wide[a], wide[b])
        edge[a] |= jump
        edge[b] |= jump
    return edge.ravel()


def first_stretch(solid: Inside, rays: Rays, near: Floats, end: Floats) -> Floats:
    """Where the first inside stretch of at least THICK widths begins on each ray; NaN if there is none.

    All of each ray between the distances `near` and `end`, shape (n,), is sampled: first every width, and where two
    neighbours are inside, _FINE times as finely.
    """
    start = np.full(len(rays), np.nan)
    spread, wide = rays.spread, rays.width(near)
    length = np.where(
        spread > 0,
        np.log1p(np.maximum(end - near, 0) * spread / wide) / np.log1p(np.maximum(spread, 1e-300)),
        (end - near) / wide,
    )
    steps = np.maximum(np.floor(length), 0).astype(int)
    # Rays of about the same length together, as many as fit into a batch.
    order = np.argsort(steps)
    first = 0
    while first < len(order):
        rows = max(1, _BATCH // (steps[order[first:]][: _BATCH // 64].max(initial=0) + 2))
        some = order[first : first + rows]
        start[some] = _coarse(solid, rays[some], near[some], end[some], steps[some])
        first += rows
    return start


def _coarse(solid: Inside, rays: Rays, near: Floats, end: Floats, steps: npt.NDArray[np.int_]) -> Floats:
    """As `first_stretch`, for rays of some whole numbers of steps."""
    start = np.full(len(rays), np.nan)
    column = np.arange(steps.max(initial=0) + 2)
    real = column[None, :] <= steps[:, None]
    t = rays.along(near, column.astype(float))
    inside = np.zeros(real.shape, np.bool_)
    inside[real] = solid.inside(rays.at(t)[real])
    both = inside[:, :-1] & inside[:, 1:]
    rows, columns = np.nonzero(both)
    # Parts to look at, from one width before the first pair: where the last part of the ray did not reach.
    parts: list[tuple[int, int]] = []
    for row, place in zip(rows.tolist(), columns.tolist(), strict=True):
        if not parts or parts[-1][0] != row or place + _OVERLAP > parts[-1][1] + _PART:
            parts.append((row, max(place - 1, 0)))
    fine = np.arange(_PART * _FINE + 1) / _FINE
    while parts:
        tried = list(dict(reversed(parts)).items())
        index = np.array([row for row, _ in tried])
        begin = rays[index].along(near[index], np.array([[float(place)] for _, place in tried]))[:, 0]
        close = rays[index].along(begin, fine)
        inside_there = solid.inside(rays[index].at(close)) & (close <= end[index, None])
        found = run_start(inside_there, round(THICK * _FINE) + 1)
        start[index] = np.where(found >= 0, close[np.arange(len(index)), found], np.nan)
        done = set(index[found >= 0].tolist())
        left = set(tried)
        parts = [part for part in parts if part[0] not in done and part not in left]
    return start


def run_start(inside: Mask, length: int) -> npt.NDArray[np.intp]:
    """By row: where the first run of `length` true values begins, -1 if there is none. Shape (n, k) gives (n,)."""
    total = np.concatenate([np.zeros((len(inside), 1), int), np.cumsum(inside, axis=1)], axis=1)
    if total.shape[1] <= length:
        return np.full(len(inside), -1)
    whole = total[:, length:] - total[:, :-length] == length
    return np.where(whole.any(axis=1), whole.argmax(axis=1), -1)
