"""What a kernel needs of an environment map: its pixels, and tables to choose directions by brightness.

The buffer's layout stands at the head of kernels/environment.h. Directions are chosen cell by cell of a grid
of latitudes and longitudes, at most COLUMNS x ROWS, and uniformly on the sphere within a cell: the density
per steradian is constant there.

A cell's density is proportional to sqrt(mean * maximum) of the luminance in it, of the very light that the
kernel shows: blended linearly between pixels. It is the root mean square where one spot of a cell shines and
the rest is black, hence nearly the density of least variance (Pharr, Jakob, Humphreys, Physically Based
Rendering, 3rd ed., 13.10); and it is above 0 wherever light comes from, so that no sample's weight is infinite.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clfractal.device.threads import in_threads
from clfractal.scene.lighting import Environment

if TYPE_CHECKING:
    from clfractal.scene.environment import EnvironmentMap
    from clfractal.scene.sun import Sun

COLUMNS, ROWS = 1024, 512
"""Largest grid of the tables: 4 MB, and cells smaller than the sun."""

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # ITU-R BT.709-6, item 3.2
_LEAST = 1e-6  # of the mean brightness, wherever there is light: no cell is too rare for float32
_PIXELS_AT_ONCE = 1 << 16

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PackedEnvironment:
    """The buffer for the kernel (one-dimensional float32), sizes of the map and of its tables, and its mean luminance."""

    data: Floats
    width: int
    height: int
    columns: int
    rows: int
    mean: float


def packed_map(found: EnvironmentMap) -> PackedEnvironment:
    """A map as the kernel reads it; of one that comes with the program it is made once for a process."""
    return _packed_once(found) if found.is_shipped else pack_environment(found.pixels, found.sun)


@cache
def _packed_once(found: EnvironmentMap) -> PackedEnvironment:
    packed = pack_environment(found.pixels)
    packed.data.flags.writeable = False
    return packed


def pack_environment(pixels: Floats, sun: Sun | None = None) -> PackedEnvironment:
    """Puts tables, pixels and the sun's numbers into one buffer.

    Args:
        pixels: shape (height, width, 3), linear Rec. 709, finite and not negative.
        sun: the disc before them.
    """
    height, width, _ = pixels.shape
    columns, rows = min(width, COLUMNS), min(height, ROWS)
    brightness = _brightness(pixels, columns, rows)
    borders = np.cos(np.linspace(0.0, math.pi, rows + 1))
    areas = (borders[:-1] - borders[1:]) * (2 * math.pi / columns)  # of a cell, steradians
    shares = brightness * areas[:, None]
    total = shares.sum()
    if total > 0:
        density = brightness / total
    else:  # all black: whatever is chosen has no light
        density = np.full((rows, columns), 1 / (4 * math.pi))
        shares = np.broadcast_to(areas[:, None], (rows, columns))
    by_column, by_row = _cumulative(shares), _cumulative(shares.sum(axis=1))
    parts = [borders, by_row, by_column, density, pixels]
    around = np.cos(np.linspace(0.0, math.pi, height + 1))
    of_rows = np.einsum("rck,k->r", pixels, _LUMINANCE / width)
    mean = float(of_rows @ (around[:-1] - around[1:]) / 2)
    if sun is not None:
        of_sun = float(_LUMINANCE @ sun.irradiance) / (4 * math.pi)
        parts.append(_sun_numbers(sun, of_sun / max(mean + of_sun, 1e-30)))
        mean += of_sun
    data = np.concatenate([np.asarray(part).reshape(-1) for part in parts], dtype=np.float32)
    return PackedEnvironment(data, width, height, columns, rows, mean)


def _sun_numbers(sun: Sun, share: float) -> Doubles:
    """See the head of kernels/shading/sun.h; `share`: the part of directions that are chosen in its disc."""
    # Here, because only skies need it.
    from clfractal.scene.sun import LIMB, SPREAD

    parts = (*sun.toward, *sun.light, *sun.fade, *sun.bend, *LIMB, sun.horizon, SPREAD, share)
    return np.array(parts)


def material_fields(environment: Environment | None, packed: PackedEnvironment | None) -> Mapping[str, Any]:
    """The fields of `layout.MATERIAL` that tell the kernel of the map; zeros without one."""
    angle = math.radians(environment.rotation) if environment else 0.0
    return {
        "environment_intensity": environment.intensity if environment else 0.0,
        "environment_turn": (math.cos(angle), math.sin(angle)),
        "environment_width": packed.width if packed else 0,
        "environment_sun": int(packed is not None and environment is not None and environment.has_sun),
        "environment_height": packed.height if packed else 0,
        "environment_columns": packed.columns if packed else 0,
        "environment_rows": packed.rows if packed else 0,
    }


def _cumulative(shares: Doubles) -> Doubles:
    """Sums along the last axis from 0 to exactly 1; equal steps where there is nothing to share."""
    sums = np.zeros((*shares.shape[:-1], shares.shape[-1] + 1))
    np.cumsum(shares, axis=-1, out=sums[..., 1:])
    total = sums[..., -1:]
    return np.where(total > 0, sums / np.where(total > 0, total, 1.0), np.linspace(0.0, 1.0, sums.shape[-1]))


def _brightness(pixels: Floats, columns: int, rows: int) -> Doubles:
    """sqrt(mean * maximum) of the luminance blended between pixels, for each cell, shape (rows, columns)."""
    height, width, _ = pixels.shape
    means = np.empty((height, columns))
    maxima = np.empty((height, columns))
    band = max(1, _PIXELS_AT_ONCE // width)

    def reduce(first: int) -> None:
        some = slice(first, first + band)
        luminance = np.einsum("rck,k->rc", pixels[some], _LUMINANCE)
        around = np.concatenate([luminance[:, -1:], luminance, luminance[:, :1]], axis=1)
        means[some], maxima[some] = _means(around, columns), _maxima(around, columns)

    in_threads(reduce, range(0, height, band))
    # A bound is enough: the largest of the sums is at most the sum of the largest.
    mean, maximum = in_threads(
        lambda part: (
            part[0](np.ascontiguousarray(np.concatenate([part[1][:1], part[1], part[1][-1:]]).T), rows).T
        ),
        [(_means, means), (_maxima, maxima)],
    )
    brightness: Doubles = np.sqrt(mean * maximum)
    return np.where(maximum > 0, np.maximum(brightness, _LEAST * brightness.mean()), 0.0)


def _means(values: Doubles, cells: int) -> Doubles:
    """Means, in each of `cells` equal parts of a row, of straight lines between pixels' middles.

    `values` has the pixels of a row, and one more at either end, along its last axis.
    """
    left, part, start, step = _borders(values, cells)
    # Exact integrals of the lines: whole ones by sums, and what is left of the last.
    whole = np.zeros_like(values)
    np.cumsum((values[..., :-1] + values[..., 1:]) / 2, axis=-1, out=whole[..., 1:])
    integral = whole[..., left] + part * (start + 0.5 * part * step)
    return np.asarray(np.maximum(np.diff(integral, axis=-1), 0.0) * (cells / (values.shape[-1] - 2)))


def _maxima(values: Doubles, cells: int) -> Doubles:
    """Maxima of the same."""
    left, part, start, step = _borders(values, cells)
    at_borders = start + part * step
    # Every cell holds the middle of a pixel, since there are no more cells than pixels.
    if values.shape[-1] - 2 == 2 * cells:  # of a sky
        inside = np.maximum(values[..., 1:-1:2], values[..., 2:-1:2])
    else:
        first = left[:-1] + (part[:-1] > 0)
        inside = np.maximum.reduceat(values[..., :-1], first, axis=-1)
    return np.asarray(np.maximum(inside, np.maximum(at_borders[..., :-1], at_borders[..., 1:])))


def _borders(values: Doubles, cells: int) -> tuple[npt.NDArray[np.int64], Doubles, Doubles, Doubles]:
    """Where parts of a row begin and end: after which value, how far, that value, and the step to the next one."""
    count = values.shape[-1] - 2
    borders = np.arange(cells + 1) * (count / cells) + 0.5  # the middle of values[i] lies at i
    left = np.minimum(np.floor(borders).astype(np.int64), count)
    start = values[..., left]
    return left, borders - left, start, values[..., left + 1] - start
