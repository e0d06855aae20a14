"""Arguments of the operations: awkward and random ones, in any neighbourhood of a packet."""

from __future__ import annotations

import itertools
import math
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.structs import Precision
from tests.numbers.operations import Operation

Floats = npt.NDArray[np.floating[Any]]

# Argument tuples of every operation; a multiple of the largest lane count.
COUNT = 448


def _awkward(dtype: npt.DTypeLike) -> list[float]:
    """Zeros, the ends of the range and of [-1, 1], denormals, infinities, NaN, and every kind between."""
    info = np.finfo(dtype)
    one: Any = np.dtype(dtype).type(1)
    sizes = [
        *(
            0.0,
            float(info.smallest_subnormal),
            float(info.tiny),
            float(info.tiny) * 1.5,
            float(info.eps),
            1e-10,
        ),
        *(0.3, 0.5, float(np.nextafter(one, 0 * one)), 1.0, float(np.nextafter(one, 2 * one)), 2.0, 2.5, 3.0),
        *(100.0, 1e5, 3e6, 1e12, 1e25, float(info.max) / 2, float(info.max), math.inf),
    ]
    return [*sizes, *(-size for size in sizes), math.nan]


def _of_one(dtype: npt.DTypeLike) -> list[tuple[float, ...]]:
    """For functions of one number also neighbours of quarter turns, and where exp leaves the range."""
    half_pi = [k * math.pi / 2 for k in (1, 2, 3, 4, 5, 100, 4001, 10**6 + 1)]
    limits = [math.log(float(np.finfo(dtype).max)), math.log(float(np.finfo(dtype).tiny))]
    values = np.array([*half_pi, *limits, 1e4, 1e5, 1.1e5], dtype)
    with np.errstate(all="ignore"):
        around = [
            values,
            np.nextafter(values, np.inf, dtype=dtype),
            np.nextafter(values, -np.inf, dtype=dtype),
        ]
    special = [float(v) for part in around for v in part]
    return [(v,) for v in (*_awkward(dtype), *special, *(-v for v in special))]


def _of_two(dtype: npt.DTypeLike) -> list[tuple[float, ...]]:
    info = np.finfo(dtype)
    few = [0.0, -0.0, float(info.tiny), -float(info.tiny), 0.5, -1.0, 1.0, 2.0, -3.0, 2.5, -1e5, 1e12]
    few += [float(info.max), -float(info.max), math.inf, -math.inf, math.nan, float(info.smallest_subnormal)]
    pairs: list[tuple[float, ...]] = list(itertools.product(few, few))
    # Quotients that are whole, and pairs of equal size.
    pairs += [(k * 0.1, 0.1) for k in range(-6, 7)] + [(k * 0.7, k * 0.7) for k in (-3, 1, 2)]
    return pairs


def _of_three(dtype: npt.DTypeLike) -> list[tuple[float, ...]]:
    few = [0.0, -0.0, 1.0, -2.0, math.inf, -math.inf, math.nan]
    return list(itertools.product(few, few, few))


def arguments(operation: Operation, precision: Precision) -> Floats:
    """COUNT tuples (a, b, c), shape (3, COUNT), shuffled so that any kinds stand side by side in a packet."""
    dtype = np.dtype(precision)
    # Not `hash`: it differs from run to run.
    random = np.random.default_rng(zlib.crc32(operation.name.encode()))
    awkward = {1: _of_one, 2: _of_two, 3: _of_three}[operation.arity](dtype)
    # All three are always numbers: unused ones may be part of a call that ignores them.
    columns = np.full((COUNT, 3), 1.0)
    columns[: len(awkward), : operation.arity] = awkward
    rest = COUNT - len(awkward)
    usual = random.normal(scale=1.5, size=(rest, 3))
    wide = np.exp(random.normal(scale=6.0, size=(rest, 3))) * random.choice([-1.0, 1.0], (rest, 3))
    columns[len(awkward) :] = np.where(random.random((rest, 1)) < 0.6, usual, wide)
    random.shuffle(columns, axis=0)
    with np.errstate(all="ignore"):
        return np.ascontiguousarray(columns.T.astype(dtype))


def partials(precision: Precision) -> Floats:
    """Partials of the duals A, B and C, three of each, shape (9, COUNT): about 1, some of them 0."""
    random = np.random.default_rng(5)
    size = random.uniform(0.5, 2.0, (9, COUNT)) * random.choice([-1.0, 1.0], (9, COUNT))
    size[random.random((9, COUNT)) < 0.1] = 0.0
    result: Floats = size.astype(precision)
    return result
