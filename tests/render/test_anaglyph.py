"""Anaglyphs: matrices against what they promise, and what reaches the wrong eye."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from clfractal.images.anaglyph import IDEAL, LUMINANCE, Glasses, Method, matrices, mix
from tests.ghosting import REAL_RED_CYAN, filtered, ghosting, leaking

GLASSES: tuple[Glasses, ...] = ("red_cyan", "green_magenta", "amber_blue")
METHODS: tuple[Method, ...] = ("color", "half_color", "gray", "dubois")
# Sanders and McAllister 2003: CIE XYZ (rows) of a tube's red, green and blue: bare, behind a red and a cyan filter.
BARE = np.array([[11.6638, 8.3959, 4.65843], [7.10807, 16.6845, 2.45008], [0.527874, 3.79124, 24.0604]])
RED = np.array(
    [[5.42327, 0.807004, 0.047325], [2.70972, 0.50201, 0.0250529], [5.50941e-5, 4.11221e-4, 2.40686e-3]]
)
CYAN = np.array([[0.180431, 1.6395, 2.00309], [0.448214, 6.31551, 1.35757], [0.289201, 2.3925, 11.062]])


def chart(*, dark: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Two pictures of four pixels: every way in which dark and white can meet."""
    left, right = np.array([[dark, dark, 1, 1], [dark, 1, dark, 1]], np.float32)[..., None]
    return left * np.ones(3, np.float32), right * np.ones(3, np.float32)


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
def test_the_projection_keeps_the_picture_of_each_eye_where_its_filter_passes(glasses: Glasses) -> None:
    """Without the published figures: whose filter passes a primary alone gives nearly all of that primary's light."""
    for eye, passed in zip(matrices("dubois", glasses), IDEAL[glasses], strict=True):
        gray = eye @ np.ones(3)
        assert (gray[np.array(passed) == 1] > 0.8).all()
        assert (np.abs(gray[np.array(passed) == 0]) < 0.27).all()


def test_red_cyan_is_near_a_least_squares_projection_of_other_measurements() -> None:
    # Both eyes' bare pictures, 6 numbers, from what the two filters let through of 3: the pseudo-inverse (Dubois 2001).
    wanted = np.kron(np.eye(2), BARE)
    derived = np.linalg.pinv(np.vstack([RED, CYAN])) @ wanted
    derived /= derived.sum(axis=1, keepdims=True)
    # Another display and another pair of glasses than the published figures', so only near.
    assert np.abs(np.hstack(matrices("dubois", "red_cyan")) - derived).max() < 0.07


def test_the_real_filters_are_those_measurements_luminances() -> None:
    for filter_, behind in zip(REAL_RED_CYAN, (RED, CYAN), strict=True):
        assert filter_ == pytest.approx(behind[1] / BARE[1], abs=1e-3)


def test_color_takes_each_primary_from_the_eye_that_sees_it() -> None:
    left, right = np.array([[0.1, 0.2, 0.3]], np.float32), np.array([[0.4, 0.5, 0.6]], np.float32)
    wanted = {"red_cyan": [0.1, 0.5, 0.6], "green_magenta": [0.4, 0.2, 0.6], "amber_blue": [0.1, 0.2, 0.6]}
    for glasses in GLASSES:
        assert (
            mixer("color", glasses)(left, right)[0].tolist() == np.array(wanted[glasses], np.float32).tolist()
        )


def test_half_color_is_gray_for_the_eye_with_one_primary() -> None:
    left, right = np.array([[0.1, 0.2, 0.3]], np.float32), np.array([[0.4, 0.5, 0.6]], np.float32)
    gray_left = 0.2126 * 0.1 + 0.7152 * 0.2 + 0.0722 * 0.3
    gray_right = 0.2126 * 0.4 + 0.7152 * 0.5 + 0.0722 * 0.6
    wanted = {
        "red_cyan": [gray_left, 0.5, 0.6],
        "green_magenta": [0.4, gray_left, 0.6],
        "amber_blue": [0.1, 0.2, gray_right],
    }
    for glasses in GLASSES:
        assert mixer("half_color", glasses)(left, right)[0] == pytest.approx(wanted[glasses], rel=1e-6)


def test_gray_is_each_eyes_luminance() -> None:
    source = np.random.default_rng(1)
    left, right = source.random((2, 50, 3), dtype=np.float32)
    for glasses in GLASSES:
        mixed = mixer("gray", glasses)(left, right)
        for picture, passed in zip((left, right), IDEAL[glasses], strict=True):
            for primary in np.flatnonzero(passed):
                assert mixed[:, primary] == pytest.approx(picture @ np.array(LUMINANCE), rel=1e-5)


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


def test_filters_pass_their_primaries() -> None:
    pixel = np.array([[0.25, 0.5, 0.75]], np.float32)
    assert filtered(pixel, "left", "red_cyan").tolist() == [[0.25, 0, 0]]
    assert filtered(pixel, "right", "red_cyan").tolist() == [[0, 0.5, 0.75]]
    assert filtered(pixel, "right", "green_magenta").tolist() == [[0.25, 0, 0.75]]
    assert filtered(pixel, "left", "amber_blue").tolist() == [[0.25, 0.5, 0]]
    assert leaking("red_cyan", 0.1) == ((1.0, 0.1, 0.1), (0.1, 1.0, 1.0))
    leaky = filtered(pixel, "left", "red_cyan", leaking("red_cyan", 0.1))
    assert leaky[0] == pytest.approx([0.25, 0.05, 0.075])


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


@pytest.mark.parametrize("glasses", GLASSES)
def test_ghosts_through_ideal_filters(glasses: Glasses) -> None:
    for method in METHODS[:3]:
        assert ghosting(mixer(method, glasses), *chart(), glasses) == (0, 0)
    shares = ghosting(mixer("dubois", glasses), *chart(), glasses)
    # What it takes away for filters that leak, ideal ones show as a ghost.
    assert min(shares) > 0
    assert max(shares) < 0.1


def test_least_squares_lessens_the_ghosts_of_real_glasses() -> None:
    plain = ghosting(mixer("color", "red_cyan"), *chart(), "red_cyan", REAL_RED_CYAN)
    least = ghosting(mixer("dubois", "red_cyan"), *chart(), "red_cyan", REAL_RED_CYAN)
    # Nothing is darker than black: before black it can take nothing away. Before dark gray it can.
    assert least[0] < plain[0]
    before_gray = ghosting(mixer("dubois", "red_cyan"), *chart(dark=0.15), "red_cyan", REAL_RED_CYAN)
    assert (
        before_gray[0] < ghosting(mixer("color", "red_cyan"), *chart(dark=0.15), "red_cyan", REAL_RED_CYAN)[0]
    )
