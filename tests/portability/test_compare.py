"""The comparison forgives roundings and a few pixels at fine details, and sees what a bad compiler does."""

from __future__ import annotations

import numpy as np
import pytest

from tests.portability.compare import LIMITS, Picture, difference
from tests.portability.pictures import CHANNELS, PARTS, cases, cases_of


@pytest.fixture
def picture() -> Picture:
    random = np.random.default_rng(1)
    result = random.random((len(CHANNELS), 72, 96)).astype(np.float32)
    result[CHANNELS.index("Z"), :, :40] = np.inf  # nothing hit there
    return result


def _changed(picture: Picture, channel: str, share: float, by: float) -> Picture:
    result = picture.copy()
    plane = result[CHANNELS.index(channel)].reshape(-1)
    plane[-round(share * plane.size) :] += np.float32(by)
    return result


def test_a_picture_is_like_itself(picture: Picture) -> None:
    found = difference(picture, picture.copy(), "float64")
    assert (found.fault, found.share) == ("", 0.0)


def test_roundings_are_forgiven(picture: Picture) -> None:
    assert difference(picture, picture * np.float32(1 + 1e-6), "float64").share == 0


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("channel", ["R", "A", "Z", "N.X", "P.Z", "iterations", "steps"])
def test_the_share_of_changed_pixels_decides(picture: Picture, channel: str, precision: str) -> None:
    limit = LIMITS[precision]
    assert difference(picture, _changed(picture, channel, 0.5 * limit, 0.5), precision).fault == ""
    fault = difference(picture, _changed(picture, channel, 3 * limit, 0.5), precision).fault
    assert "of the pixels differ" in fault


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_one_colour_that_is_no_number_is_a_fault(picture: Picture, value: float) -> None:
    broken = picture.copy()
    broken[1, 3, 4] = value
    found = difference(picture, broken, "float32")
    assert found.fault == "colours that are no numbers"
    assert found.pixels[3, 4]
    both = difference(broken, broken.copy(), "float32")
    assert both.fault, "also where both implementations agree on it"


def test_a_hit_against_a_miss_is_a_difference(picture: Picture) -> None:
    other = picture.copy()
    other[CHANNELS.index("Z"), :, :2] = 3.0
    assert difference(picture, other, "float32").fault


def test_a_tiny_picture_may_differ_in_one_pixel(picture: Picture) -> None:
    tiny = picture[:, :8, -12:]
    assert difference(tiny, _changed(tiny, "R", 1 / 96, 0.5), "float32").fault == ""
    assert difference(tiny, _changed(tiny, "R", 2 / 96, 0.5), "float32").fault


@pytest.mark.parametrize("kind", PARTS)
def test_the_parts_have_every_picture_once(kind: str) -> None:
    parts = [case for part in range(PARTS[kind]) for case in cases_of(kind, part)]
    assert sorted(parts) == sorted(cases(kind))
