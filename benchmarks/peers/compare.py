"""How alike two pictures' silhouettes and depths are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Likeness:
    """Of one picture to another.

    Attributes:
        covered: the part of theirs that shows something.
        union: pixels of both silhouettes to those of either, but those near an outline; 1 if there is none.
        middle, ninth: relative differences of depth, half and nine tenths of which are below; nan without any in both.
    """

    covered: float
    union: float
    middle: float
    ninth: float


def outlines(shape: Mask, within: int = 1) -> Mask:
    """Pixels within some pixels of where a silhouette changes, along rows, columns and diagonals."""
    padded = np.pad(shape, within, mode="edge")
    height, width = shape.shape
    parts = [
        padded[y : y + height, x : x + width] for y in range(2 * within + 1) for x in range(2 * within + 1)
    ]
    found: Mask = np.any(parts, axis=0) & ~np.all(parts, axis=0)
    return found


def likeness(theirs: Floats, ours: Floats) -> Likeness:
    """Of depths, inf where nothing is, shape (height, width)."""
    one, other = theirs != np.inf, np.isfinite(ours)
    kept = ~(outlines(one) | outlines(other))
    both, either = (one & other & kept).sum(), ((one | other) & kept).sum()
    shared = one & other & kept & np.isfinite(theirs)
    off = np.abs(ours[shared] - theirs[shared]) / np.maximum(theirs[shared], 1e-30)
    middle, ninth = (
        (float(each) for each in np.quantile(off, (0.5, 0.9))) if off.size else (float("nan"),) * 2
    )
    return Likeness(float(one.mean()), float(both / either) if either else 1.0, middle, ninth)
