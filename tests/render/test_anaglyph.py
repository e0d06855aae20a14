"""Anaglyphs: matrices against what they promise, and what reaches the wrong eye."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from clfractal.images.anaglyph import IDEAL, LUMINANCE, Glasses, Method, matrices, mix
from tests.ghosting import ghosting, leaking

GLASSES: tuple[Glasses, ...] = ("red_cyan", "green_magenta", "amber_blue")
METHODS: tuple[Method, ...] = ("color", "half_color", "gray", "dubois")


def mixer(method: Method, glasses: Glasses) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    return lambda left, right: mix(left, right, matrices(method, glasses))


@pytest.mark.parametrize("glasses", GLASSES)
@pytest.mark.parametrize("method", METHODS)
def test_equal_grays_stay_what_they_are(method: Method, glasses: Glasses) -> None:
    left, right = matrices(method, glasses)
    assert (left + right).sum(axis=1) == pytest.approx(np.ones(3), abs=1e-12)
    for gray in (0.0, 0.18, 1.0, 7.5):
        pixel = np.full((1, 3), gray, np.float32)
        assert mix(pixel, pixel, (left, right)) == pytest.approx(pixel, rel=1e-6, abs=1e-7)


# Dubois's published figures: rows red, green, blue of the anaglyph; columns left red, green, blue, right red, green, blue.
PUBLISHED: dict[Glasses, list[list[float]]] = {
    "red_cyan": [
        [0.437, 0.449, 0.164, -0.011, -0.032, -0.007],
        [-0.062, -0.062, -0.024, 0.377, 0.761, 0.009],
        [-0.048, -0.050, -0.017, -0.026, -0.093, 1.234],
    ],
    "green_magenta": [
        [-0.062, -0.158, -0.039, 0.529, 0.705, 0.024],
        [0.284, 0.668, 0.143, -0.016, -0.015, -0.065],
        [-0.015, -0.027, 0.021, 0.009, 0.075, 0.937],
    ],
    "amber_blue": [
        [1.062, -0.205, 0.299, -0.016, -0.123, -0.017],
        [-0.026, 0.908, 0.068, 0.006, 0.062, -0.017],
        [-0.038, -0.173, 0.022, 0.094, 0.185, 0.911],
    ],
}


@pytest.mark.parametrize("glasses", GLASSES)
def test_published_least_squares_figures_change_only_in_the_third_digit(glasses: Glasses) -> None:
    """All 18 figures of each pair; their rows have sums of 0.998 to 1.001, and are divided by them."""
    found = np.hstack(matrices("dubois", glasses))
    np.testing.assert_allclose(found, PUBLISHED[glasses], atol=1e-3, rtol=1.5e-3)


@pytest.mark.parametrize("glasses", GLASSES)
@pytest.mark.parametrize("method", METHODS[:3])
def test_each_primary_is_of_the_eye_that_sees_it(method: Method, glasses: Glasses) -> None:
    """Grey if both eyes' pictures are, or of an eye that sees one primary alone."""
    pictures = np.random.default_rng(1).random((2, 50, 3), dtype=np.float32)
    mixed = mixer(method, glasses)(*pictures)
    for picture, passed in zip(pictures, IDEAL[glasses], strict=True):
        grey = method == "gray" or (method == "half_color" and sum(passed) == 1)
        shown = np.repeat((picture @ np.array(LUMINANCE))[:, None], 3, axis=1) if grey else picture
        primaries = np.flatnonzero(passed)
        assert mixed[:, primaries] == pytest.approx(shown[:, primaries], rel=1e-5)


def test_mixing_is_the_matrices_product_and_never_negative() -> None:
    left, right = np.random.default_rng(2).random((2, 9, 11, 3), dtype=np.float32)
    for glasses in GLASSES:
        by = matrices("dubois", glasses)
        plain = np.einsum("ij,yxj->yxi", by[0], left) + np.einsum("ij,yxj->yxi", by[1], right)
        mixed = mix(left, right, by)
        assert (plain < 0).any()
        assert mixed.dtype == np.float32
        assert np.allclose(mixed, np.maximum(plain, 0), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_no_number_makes_trouble(method: Method) -> None:
    odd = np.array([np.nan, np.inf, -np.inf, 3e38, -3e38, 1e-45, 0.0, 1.0], np.float32)
    left, right = (np.stack(np.meshgrid(odd, odd, odd), axis=-1).reshape(-1, 3) for _ in range(2))
    for glasses in GLASSES:
        with np.errstate(all="raise", under="ignore"):
            mixed = mixer(method, glasses)(left, right[::-1])
        assert np.isfinite(mixed).all()
        assert (mixed >= 0).all()
    black = np.zeros((1, 3), np.float32)
    light = np.array([[np.inf, np.nan, 0.5]], np.float32)
    assert mixer("color", "red_cyan")(light, black)[0].tolist() == [np.float32(1e30), 0, 0]
    assert mixer("color", "red_cyan")(black, light)[0].tolist() == [0, 0, 0.5]


def test_ghosting_by_hand() -> None:
    white, black = np.ones((1, 3), np.float32), np.zeros((1, 3), np.float32)
    # Through red, which leaks a tenth of green and blue: own light 0.2126, the other's 0.1 * (0.7152 + 0.0722).
    shares = ghosting(mixer("color", "red_cyan"), white, white, "red_cyan", leaking("red_cyan", 0.1))
    assert shares == pytest.approx((0.07874 / 0.2126, 0.02126 / 0.7874), rel=1e-5)
    assert ghosting(mixer("color", "red_cyan"), white, black, "red_cyan", leaking("red_cyan", 0.1))[0] == 0
    assert ghosting(mixer("color", "red_cyan"), white, black, "red_cyan") == (0, 0)
    assert (
        ghosting(mixer("color", "red_cyan"), white, black, "red_cyan", leaking("red_cyan", 0.1))[1] == np.inf
    )
    # Both eyes see all that is shown if there is no filter.
    bare = ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    assert ghosting(lambda left, right: left + right, white, white, "red_cyan", bare) == pytest.approx((1, 1))
