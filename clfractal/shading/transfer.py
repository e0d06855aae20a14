"""Transfer functions as tables: what kernels need of values, and its bounds in bricks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from clfractal.scene.volume import Transfer
from clfractal.schema.base import Vector

TRANSFER_SIZE = 1024
# What is opaque still has a depth, of which its own light comes and into which paths go.
MOST_OPACITY = 0.9999
# How often, at least, a ray stops per side of a voxel to see what shines there.
SHINING_RATE = 0.25

Floats = npt.NDArray[np.float32]


def extinction(values: npt.NDArray[np.float64], transfer: Transfer) -> npt.NDArray[np.float64]:
    """Extinction per side of a voxel where a voxel has these values; an opacity of 1 counts as MOST_OPACITY."""
    assert transfer.opacity is not None
    opacity = mixed(values, [(stop.at, (stop.opacity,)) for stop in transfer.opacity])[:, 0]
    return -np.log1p(-np.minimum(opacity, MOST_OPACITY))


def medium_table(transfer: Transfer, limits: tuple[float, float], color: Vector) -> Floats:
    """What paths need of values between `limits`; shape (TRANSFER_SIZE, 4 or 7).

    The columns are the extinction per side of a voxel, the colour, and the light that a side adds, if anything shines.

    Args:
        color: where the transfer function has none, linear Rec. 709.
    """
    values = np.linspace(*limits, TRANSFER_SIZE)
    parts = [extinction(values, transfer)[:, None], np.broadcast_to(color, (TRANSFER_SIZE, 3))]
    if transfer.color is not None:
        parts[1] = mixed(values, [(stop.at, stop.color) for stop in transfer.color])
    if transfer.emission is not None:
        parts.append(mixed(values, [(stop.at, stop.emission) for stop in transfer.emission]))
    return np.ascontiguousarray(np.hstack(parts), np.float32)


def value_limits(transfer: Transfer, otherwise: Sequence[float]) -> tuple[float, float]:
    """The values between which the table lies: those of its stops, or others where it has none."""
    stops = [stop.at for part in (transfer.opacity, transfer.color, transfer.emission) for stop in part or ()]
    low, high = min(stops or otherwise), max(stops or otherwise)
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def mixed(
    values: npt.NDArray[np.float64], stops: Sequence[tuple[float, Sequence[float]]]
) -> npt.NDArray[np.float64]:
    """What stops say at values, linear between two of them; shape (len(values), numbers of a stop)."""
    at = [place for place, _ in stops]
    columns = zip(*(numbers for _, numbers in stops), strict=True)
    return np.stack([np.interp(values, at, column) for column in columns], axis=1)


def table_bounds(most: npt.NDArray[np.float64], ranges: Floats, low: float, scale: float) -> Floats:
    """Bounds of a table's numbers in bricks, a little above the largest number between two values.

    Args:
        most: a number for each of TRANSFER_SIZE values.
        ranges: the least and the largest value of each brick, shape (n, 2).
        low, scale: the first value of the table, and one over the width of its values.
    """
    # An entry further either way, for what rounding does to a place in the table.
    with np.errstate(invalid="ignore", over="ignore"):
        places = (ranges.astype(np.float64) - low) * scale * (TRANSFER_SIZE - 1)
    places = np.clip(np.nan_to_num(places, posinf=np.inf, neginf=-np.inf), 0, TRANSFER_SIZE - 1)
    first = np.maximum(np.floor(places[:, 0]).astype(int) - 1, 0)
    last = np.minimum(np.ceil(places[:, 1]).astype(int) + 1, TRANSFER_SIZE - 1)
    # The largest of 2^k entries from each on; two of these cover any range.
    levels = [most]
    while 2 ** len(levels) <= TRANSFER_SIZE:
        half = 2 ** (len(levels) - 1)
        before = levels[-1]
        levels.append(np.maximum(before, np.append(before[half:], np.full(half, before[-1]))))
    last = np.maximum(last, first)
    level = np.log2(last - first + 1).astype(int)
    stacked = np.stack(levels)
    bounds = np.maximum(stacked[level, first], stacked[level, last + 1 - 2**level])
    return np.asarray(bounds * (1 + 1e-5), np.float32)
