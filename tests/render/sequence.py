"""The sequence of random points of `sampling.h`, written down a second time with NumPy.

Digits are those of 32-bit numbers, held in arrays of uint64.
"""

from __future__ import annotations

import math

import numpy as np

from tests.render.sampler import Array


def hashed(a: Array) -> Array:
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        a = (a ^ (a >> shift)) * factor % 2**32
    return a


def mirrored(a: Array) -> Array:
    """The 32 digits of a in reverse."""
    result = np.zeros_like(a)
    for digit in range(32):
        result |= (a >> digit & 1) << (31 - digit)
    return result


def scrambled(a: Array, seed: Array) -> Array:
    """Digits of a, highest first, each flipped by a function of those before it."""
    a = mirrored(a)
    a = ((a ^ (a * 0x3D20ADEA)) + seed) % 2**32 * (seed >> 16 | 1) % 2**32
    a = (a ^ (a * 0x05526C56)) % 2**32
    return mirrored((a ^ (a * 0x53A22864)) % 2**32)


def sobol(index: Array) -> Array:
    """Sobol's second dimension: digit i is the sum of the index's bits j, each times binomial(j, i)."""
    result = np.zeros_like(index)
    for i in range(32):
        for j in range(i, 32):
            if math.comb(j, i) % 2:
                result ^= (index >> j & 1) << (31 - i)
    return result


def truth(x: Array, y: Array, index: Array, seed: int, purpose: int) -> tuple[Array, Array, Array]:
    """The two numbers of 32 digits, and the pixel's seed."""
    x, y, index = (a.astype(np.uint64) for a in (x, y, index))
    golden = 0x9E3779B9
    key = hashed((np.uint64(seed) + hashed(np.array([(purpose + golden) % 2**32], np.uint64))) % 2**32)
    other = hashed(2**32 - 1 - key)
    pixel = hashed((hashed((x + key) % 2**32) + hashed((y + other) % 2**32)) % 2**32)
    place = scrambled(index, hashed(pixel))
    return (
        scrambled(mirrored(place), hashed((pixel + golden) % 2**32)),
        scrambled(sobol(place), hashed((pixel + 2 * golden) % 2**32)),
        pixel,
    )


def unit_squares(width: int, height: int, count: int, seed: int, purpose: int = 0) -> tuple[Array, Array]:
    """The first `count` points of each pixel of a picture, in float64, two arrays of shape (height, width, count)."""
    y, x, index = np.indices((height, width, count))
    first, second, _ = truth(x, y, index, seed, purpose)
    return (first >> 9) / 2.0**23 + 2.0**-24, (second >> 9) / 2.0**23 + 2.0**-24


def stochastic_points(x: Array, y: Array, count: int, seed: int) -> tuple[Array, Array]:
    """Pixels' points: one in each strip, a golden section further along it than the last; strips upright or level, mirrored
    or not. Pixels right and down from the centre, shape (..., count)."""
    pixel = truth(x, y, np.zeros_like(x), seed, 1)[2][..., None]
    golden, digits, point = 0x9E3779B9, 2**32, np.arange(count, dtype=np.uint64)
    first = hashed(pixel)
    turn = hashed(first)
    within = hashed((pixel + golden * (point + 1)) % digits)
    along = (digits - 1) // count * point + within // count
    along = np.where(turn & 1, digits - 1 - along, along)
    other = (first + golden * point) % digits
    level = (turn >> 1 & 1).astype(bool)
    places = [np.where(level, other, along), np.where(level, along, other)]
    across, below = ((place >> 9) / 2.0**23 + 2.0**-24 - 0.5 for place in places)
    return across, below
