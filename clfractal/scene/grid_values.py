"""Which values a grid holds: their range, and words about it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Values: TypeAlias = npt.NDArray[Any]

_PLANES = 16  # looked at together, so that a grid in a mapped file takes little memory


def finite_range(values: Values) -> tuple[float, float] | None:
    """The least and the largest finite value; None if there is none."""
    low, high = np.inf, -np.inf
    for slab in _slabs(values):
        finite = slab[np.isfinite(slab)] if slab.dtype.kind == "f" else slab
        if finite.size:
            low, high = min(low, float(finite.min())), max(high, float(finite.max()))
    return (low, high) if low <= high else None


def is_finite_somewhere(values: Values) -> bool:
    """Whether there is any finite value; what comes after the first is not looked at."""
    return any(bool(np.isfinite(slab).any()) for slab in _slabs(values))


def lacking(values: Values) -> str:
    """What a grid without a finite value holds instead, as "holds nothing but NaN"."""
    numbers = any(not np.isnan(slab).all() for slab in _slabs(values))
    others = any(bool(np.isnan(slab).any()) for slab in _slabs(values))
    kinds = [name for name, there in (("infinities", numbers), ("NaN", others)) if there]
    return f"holds nothing but {' and '.join(kinds)}"


def in_words(values: Values) -> str:
    """The values of a grid, as "its values are from 0 to 63"."""
    found = finite_range(values)
    if found is None:
        return f"it {lacking(values)}"
    low, high = found
    endless = (
        any(bool(np.isinf(slab).any()) for slab in _slabs(values)) if values.dtype.kind == "f" else False
    )
    told = f"all its{' finite' if endless else ''} values are {low:g}"
    if low < high:
        told = f"its{' finite' if endless else ''} values are from {low:g} to {high:g}"
    return told + (", others are infinite" if endless else "")


def _slabs(values: Values) -> Iterator[Values]:
    for start in range(0, values.shape[0], _PLANES):
        yield np.asarray(values[start : start + _PLANES])
