"""`kernels/shading/environment.h`: what light comes from where, and directions chosen by brightness.

The references are written in NumPy from the definitions: where a direction lies in the picture, what a linear
blend is, and that the cells of the tables have equal density per steradian.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import stats

from clfractal.device.structs import Precision
from clfractal.scene.environment import EnvironmentMap, read_map
from clfractal.scene.lighting import Environment
from clfractal.shading.environment import COLUMNS, ROWS, PackedEnvironment, pack_environment, packed_map
from tests.devices import check_usable
from tests.environment_maps import blended, place
from tests.render.environment_kernel import ask, every_variant, settings_of
from tests.small_kernels import Floats

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def a_map(height: int = 16, seed: int = 3) -> npt.NDArray[np.float32]:
    """Random light, darker and brighter, with one very bright pixel at the seam."""
    pixels = np.random.default_rng(seed).random((height, 2 * height, 3)).astype(np.float32) ** 6
    pixels[height // 5, -1] = (60, 40, 20)
    return pixels


def spots(height: int = 16) -> npt.NDArray[np.float32]:
    """Black but for three pixels: at a pole, at the seam, and among black ones."""
    pixels = np.zeros((height, 2 * height, 3), np.float32)
    pixels[0, 3] = pixels[height // 2, 0] = pixels[height // 4, height] = (1, 2, 3)
    return pixels


# Of pictures that were no maps: square, higher than wide, wider, and with more rows than tables have.
STRETCHED = tuple(
    np.random.default_rng(7).random((*size, 3)).astype(np.float32) ** 6
    for size in ((20, 20), (31, 7), (5, 40), (600, 30))
)


def random_directions(count: int, seed: int) -> Floats:
    """Uniform on the sphere, with the poles, the seam, the axes and their neighbourhood among them."""
    found = np.random.default_rng(seed).normal(size=(count, 3))
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    tiny = np.array([[1e-7, -1, 0], [-1e-7, -1, 0], [0, -1e-9, 1], [1e-12, 0, -1], [0.0, -0.0, -1]])
    found[:11] = np.concatenate([axes, tiny])
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def cells(packed: PackedEnvironment) -> tuple[Floats, Floats]:
    """The density of each cell, shape (rows, columns), and the cells' areas in steradians, shape (rows, 1)."""
    rows, columns = packed.rows, packed.columns
    start = 2 * (rows + 1) + rows * (columns + 1)
    density = packed.data[start : start + rows * columns].reshape(rows, columns).astype(float)
    borders = np.cos(np.pi * np.arange(rows + 1) / rows)
    return density, ((borders[:-1] - borders[1:]) * 2 * np.pi / columns)[:, None]


def toward(across: Floats, below: Floats) -> Floats:
    """Directions to places of the picture."""
    longitude, latitude = (np.asarray(across) - 0.5) * 2 * np.pi, (0.5 - np.asarray(below)) * np.pi
    level = np.cos(latitude)
    return np.stack([level * np.sin(longitude), level * np.cos(longitude), np.sin(latitude)], axis=-1)


@every_variant
def test_light_is_blended_between_pixels(precision: Precision, lanes: int) -> None:
    check_usable(precision, lanes)
    pixels, directions = a_map(), random_directions(5000, 1)
    settings = settings_of(rotation=-37.5, intensity=1.7)
    found = ask(pack_environment(pixels), directions, settings=settings, precision=precision, lanes=lanes)
    expected = 1.7 * blended(pixels.astype(float), *place(directions, -37.5))
    # At a pole every longitude is right.
    usual = np.hypot(directions[:, 0], directions[:, 1]) > 1e-6
    np.testing.assert_allclose(
        found.color[usual], expected[usual], atol=2e-3 if precision == "float32" else 1e-5
    )
    assert np.isfinite(found.color).all()


@pytest.mark.parametrize(
    "directions", [[[0.0, 0.0, 0.0]], [[math.nan, 0.0, 1.0]], [[math.nan] * 3], [[math.inf] * 3]]
)
def test_no_direction_reads_past_the_map(directions: list[list[float]]) -> None:
    found = ask(pack_environment(np.ones((2, 4, 3), np.float32)), np.array(directions))
    np.testing.assert_allclose(found.color, 1)
    np.testing.assert_allclose(found.density, 1 / (4 * np.pi), rtol=1e-5)


@pytest.mark.parametrize(
    "pixels", [a_map(), spots(), a_map(1), a_map(5), np.ones((8, 16, 3), np.float32), *STRETCHED]
)
def test_the_density_is_one_over_the_sphere(pixels: npt.NDArray[np.float32]) -> None:
    """By midpoints of parts of cells, which are exact for steps."""
    packed = pack_environment(pixels)
    rows, columns = 3 * packed.rows, 3 * packed.columns
    across, below = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    found = ask(packed, toward(across, below).reshape(-1, 3)).density.reshape(rows, columns).astype(float)
    borders = np.cos(np.pi * np.arange(rows + 1) / rows)
    area = (borders[:-1] - borders[1:])[:, None] * 2 * np.pi / columns
    assert (found * area).sum() == pytest.approx(1, abs=2e-6)


@every_variant
def test_samples_follow_the_density(precision: Precision, lanes: int) -> None:
    """Chi-square over quarters of cells: the choice of a cell, and the even spread within it."""
    check_usable(precision, lanes)
    packed = pack_environment(a_map(8))
    numbers = np.random.default_rng(11).random((400_000, 2))
    found = ask(packed, None, numbers, precision=precision, lanes=lanes)
    np.testing.assert_allclose(np.linalg.norm(found.sample, axis=1), 1, atol=1e-6)
    across, below = place(found.sample.astype(float))
    density, area = cells(packed)
    borders = np.cos(np.pi * np.arange(packed.rows + 1) / packed.rows)
    row = np.minimum((below * packed.rows).astype(int), packed.rows - 1)
    upper = found.sample[:, 2] > (borders[row] + borders[row + 1]) / 2
    column = np.minimum((across * 2 * packed.columns).astype(int), 2 * packed.columns - 1)
    counts = np.bincount(
        (2 * row + upper) * 2 * packed.columns + column, minlength=4 * packed.rows * packed.columns
    )
    expected = np.repeat(np.repeat(density * area / 4, 2, axis=0), 2, axis=1).reshape(-1) * len(numbers)
    enough = expected > 8
    assert expected[enough].sum() > 0.99 * len(numbers)
    chi = ((counts[enough] - expected[enough]) ** 2 / expected[enough]).sum()
    assert stats.chi2.sf(chi, enough.sum() - 1) > 1e-4
    assert stats.chi2.sf(chi, enough.sum() - 1) < 1 - 1e-4


@every_variant
def test_a_sample_knows_its_density(precision: Precision, lanes: int) -> None:
    check_usable(precision, lanes)
    packed = pack_environment(a_map())
    settings = settings_of(rotation=200.0)
    numbers = np.random.default_rng(2).random((20_000, 2))
    last = 1 - 1e-9
    numbers[:4] = np.array([[0, 0], [last, last], [0, last], [last, 0]])
    options: dict[str, Any] = {"settings": settings, "precision": precision, "lanes": lanes}
    found = ask(packed, None, numbers, **options)
    assert (found.sample_density > 0).all()
    assert np.isfinite(found.sample).all()
    again = ask(packed, found.sample, None, **options)
    # Rounding may carry one at a border into the next cell.
    assert (again.density == found.sample_density).mean() > 0.999


@pytest.mark.parametrize("pixels", [spots(), a_map(), spots(700), *STRETCHED])
def test_where_light_is_there_is_density(pixels: npt.NDArray[np.float32]) -> None:
    """Else its weight would be infinite; and no weight is much above the whole light."""
    packed = pack_environment(pixels)
    rows, columns = np.nonzero(pixels.sum(axis=-1))
    source = np.random.default_rng(8)
    height, width, _ = pixels.shape
    # Around the pixels that shine, out to where their light ends.
    picked = source.integers(0, len(rows), 50_000)
    across = (columns[picked] + 0.5 + source.uniform(-1.1, 1.1, len(picked))) / width % 1
    below = np.clip((rows[picked] + 0.5 + source.uniform(-1.1, 1.1, len(picked))) / height, 1e-6, 1 - 1e-6)
    found = ask(packed, toward(across, below))
    light = found.color @ LUMINANCE
    assert (light > 0).mean() > 0.5
    seen = light > 1e-5 * light.max()
    assert (found.density[seen] > 0).all()
    density, area = cells(packed)
    whole = (density * area).sum()
    assert whole == pytest.approx(1, abs=1e-5)
    total = (pixels @ LUMINANCE * np.sin(np.pi * (np.arange(height) + 0.5) / height)[:, None]).sum()
    total *= 2 * np.pi**2 / (height * width)
    assert (light[seen] / found.density[seen]).max() < 40 * total


def test_an_environment_of_no_light_is_chosen_evenly() -> None:
    found = ask(
        pack_environment(np.zeros((4, 8, 3), np.float32)),
        random_directions(100, 3),
        np.random.default_rng(1).random((100, 2)),
    )
    np.testing.assert_allclose(found.density, 1 / (4 * np.pi), rtol=1e-6)
    np.testing.assert_allclose(found.sample_density, 1 / (4 * np.pi), rtol=1e-6)
    assert not found.color.any()


def test_large_maps_have_small_tables() -> None:
    pixels = np.full((COLUMNS // 2 + 10, COLUMNS + 20, 3), 0.5, np.float32)
    packed = pack_environment(pixels)
    assert (packed.columns, packed.rows) == (COLUMNS, ROWS)
    assert packed.data.size - pixels.size < 3 * COLUMNS * ROWS
    density, _ = cells(packed)
    np.testing.assert_allclose(density, 1 / (4 * np.pi), rtol=1e-5)


def test_means_and_maxima_of_cells() -> None:
    """Cells that do not fit the pixels, compared with a fine sum over the blended light."""
    from clfractal.shading import environment

    pixels = a_map(9)
    mean_bounds = (0.999, 1.02)
    rows, columns, finer = 7, 11, 60
    across = (np.arange(columns * finer) + 0.5) / (columns * finer)
    below = (np.arange(rows * finer) + 0.5) / (rows * finer)
    grid = np.meshgrid(across, below)
    light = blended(pixels.astype(float), grid[0].reshape(-1), grid[1].reshape(-1)) @ LUMINANCE
    fine = light.reshape(rows, finer, columns, finer)
    expected = np.sqrt(fine.mean(axis=(1, 3)) * fine.max(axis=(1, 3)))
    found = environment._brightness(pixels, columns, rows)
    ratio = found / expected
    assert ratio.min() > mean_bounds[0]
    assert np.median(ratio) < mean_bounds[1]
    assert ratio.max() < 1.6


def test_a_map_that_comes_along_is_packed_once_for_a_process() -> None:
    """Otherwise every call of `clfractal.render` would pack it again. A user's map goes with its scene."""
    studio, again = (read_map(Environment.checked({"name": "studio"}), Path()) for _ in range(2))
    packed = packed_map(studio)
    assert packed_map(again) is packed
    own = EnvironmentMap(studio.pixels)
    assert packed_map(own) is not packed_map(own)
    assert np.array_equal(packed_map(own).data, packed.data)
    with pytest.raises(ValueError, match="read-only"):
        packed.data[0] = 0.0
