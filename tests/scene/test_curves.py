"""Curves through keys against what defines them: their keys, no overshoot, no corners, the sphere, the even flight."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from clfractal.scene.animation import EASES
from clfractal.scene.curves import Monotone, Path, Spans, apart, eased, straight, turned, unit
from clfractal.scene.flight import Around, Distance, EvenTarget

NUMBERS = st.floats(-100, 100, allow_subnormal=False)


@st.composite
def rising(draw: st.DrawFn, least: int = 1) -> list[float]:
    steps = draw(st.lists(st.floats(0.01, 50), min_size=least - 1, max_size=7))
    return [float(time) for time in np.cumsum([draw(st.floats(0, 10)), *steps])]


@st.composite
def numbers(draw: st.DrawFn) -> tuple[list[float], list[float]]:
    times = draw(rising())
    return times, draw(st.lists(NUMBERS, min_size=len(times), max_size=len(times)))


@st.composite
def places(draw: st.DrawFn, least: int = 1) -> tuple[list[float], list[tuple[float, ...]]]:
    times = draw(rising(least))
    rows = draw(st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=len(times), max_size=len(times)))
    return times, list(rows)


@given(numbers())
def test_a_number_meets_its_keys_and_stays_between_neighbours(keys: tuple[list[float], list[float]]) -> None:
    times, values = keys
    curve = Monotone(times, values)
    assert [curve.number(time) for time in times] == values
    assert curve.number(times[0] - 5) == values[0]
    assert curve.number(times[-1] + 5) == values[-1]
    for index in range(len(times) - 1):
        low, high = sorted(values[index : index + 2])
        for share in np.linspace(0, 1, 21):
            found = curve.number(times[index] + share * (times[index + 1] - times[index]))
            assert low - 1e-9 <= found <= high + 1e-9


@given(numbers())
def test_a_number_has_no_corner(keys: tuple[list[float], list[float]]) -> None:
    times, values = keys
    curve = Monotone(times, values)
    step = 1e-6 * min([1.0, *(after - before for before, after in pairwise(times))])
    steepest = max([0.0, *(abs(b - a) for a, b in pairwise(values))]) / (1e6 * step)
    for index, time in enumerate(times[1:-1], start=1):
        before = (values[index] - curve.number(time - step)) / step
        after = (curve.number(time + step) - values[index]) / step
        # A rounding of a value up to 100, and the curvature within a step.
        assert abs(before - after) < 1e-4 * steepest + 1e-13 / step


def test_a_number_is_the_parabola_where_that_is_monotone() -> None:
    times = [0.0, 1.0, 2.5, 4.0]
    curve = Monotone(times, [(time + 1) ** 2 for time in times])
    for time, slope in zip(times, curve.slopes, strict=True):
        assert slope == pytest.approx(2 * (time + 1))
    assert curve.number(1.7) == pytest.approx(2.7**2)


def test_a_ring_of_numbers_has_no_seam() -> None:
    curve = Monotone([0, 3, 5, 8], [1.0, 4.0, 2.0, 1.0], closed=True)
    assert curve.slopes[0] == curve.slopes[-1]
    rising_through = Monotone([0, 2, 4], [1.0, 2.0, 1.0], closed=True)
    assert rising_through.slopes[0] == 0


@given(places())
def test_a_path_meets_its_places(keys: tuple[list[float], list[tuple[float, ...]]]) -> None:
    times, rows = keys
    path = Path(times, rows)
    for time, row in zip(times, rows, strict=True):
        assert apart(path.at(time), row) < 1e-6
    assert path.at(times[0] - 1) == pytest.approx(rows[0])


@given(rising(least=3), st.data())
def test_a_path_along_a_line_never_turns_back(times: list[float], data: st.DataObject) -> None:
    steps = data.draw(st.lists(st.floats(0.01, 100), min_size=len(times), max_size=len(times)))
    along = np.cumsum(steps)
    path = Path(times, [(float(x), 2 * float(x), 0.0) for x in along])
    found = [path.at(float(time))[0] for time in np.linspace(times[0], times[-1], 200)]
    assert (np.diff(found) >= -1e-9 * along[-1]).all()


def test_a_path_has_no_corner_and_rests_at_equal_places() -> None:
    times = [0.0, 1.0, 2.0, 4.0, 5.0]
    rows = [(0.0, 0.0, 0.0), (1.0, 2.0, 0.0), (3.0, 2.0, 1.0), (3.0, 2.0, 1.0), (5.0, -1.0, 0.0)]
    path = Path(times, rows)
    step = 1e-6
    for time in (1.0, 2.0, 4.0):
        before = np.subtract(path.at(time), path.at(time - step)) / step
        after = np.subtract(path.at(time + step), path.at(time)) / step
        np.testing.assert_allclose(before, after, atol=1e-4)
    assert all(path.at(time) == rows[2] for time in (2.0, 2.7, 4.0))


def test_a_closed_path_has_no_seam() -> None:
    angles = np.linspace(0, 2 * np.pi, 9)
    rows = [(math.cos(angle), math.sin(angle), 0.0) for angle in angles[:-1]]
    path = Path([float(i) for i in range(9)], [*rows, rows[0]], closed=True)
    step = 1e-6
    before = np.subtract(path.at(8.0), path.at(8.0 - step)) / step
    after = np.subtract(path.at(step), path.at(0.0)) / step
    np.testing.assert_allclose(before, after, atol=1e-5)
    # Eight points make a circle to a hundredth.
    radii = [math.hypot(*path.at(float(time))) for time in np.linspace(0, 8, 100)]
    assert 0.98 < min(radii) <= max(radii) < 1.01


DIRECTIONS = st.tuples(NUMBERS, NUMBERS, NUMBERS).filter(lambda row: max(map(abs, row)) > 1e-3).map(unit)


@given(DIRECTIONS, DIRECTIONS, st.floats(0, 1))
def test_a_turn_is_even_and_stays_on_the_sphere(
    a: tuple[float, ...], b: tuple[float, ...], share: float
) -> None:
    found = turned(a, b, share)
    assert math.sqrt(sum(x * x for x in found)) == pytest.approx(1)
    angle = math.acos(min(max(float(np.dot(a, b)), -1), 1))
    assume(angle < 3.14)
    turn = 2 * math.asin(min(apart(a, found) / 2, 1))
    assert turn == pytest.approx(share * angle, abs=1e-6)


@pytest.mark.parametrize("a", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), unit((1.0, -2.0, 0.5))])
def test_opposite_directions_are_turned_into_each_other(a: tuple[float, ...]) -> None:
    b = tuple(-x for x in a)
    found = [turned(a, b, float(share)) for share in np.linspace(0, 1, 11)]
    assert apart(found[0], a) < 1e-7
    assert apart(found[-1], b) < 1e-7
    steps = [apart(one, other) for one, other in pairwise(found)]
    assert max(steps) - min(steps) < 1e-6


@pytest.mark.parametrize("word", sorted(EASES))
def test_eases_go_from_0_to_1(word: str) -> None:
    handles = EASES[word]
    values = [eased(handles, float(share)) for share in np.linspace(0, 1, 101)]
    assert values[0] == 0
    assert values[-1] == 1
    assert (np.diff(values) > 0).all()
    first, last = values[1] / 0.01, (1 - values[-2]) / 0.01
    assert (first < 0.05) == (word in ("ease", "ease_in"))
    assert (last < 0.05) == (word in ("ease", "ease_out"))


@given(st.floats(0, 1), st.floats(-2, 2), st.floats(0, 1), st.floats(-2, 2), st.floats(0.001, 0.999))
def test_a_bezier_curve_is_where_its_time_is(
    x1: float, y1: float, x2: float, y2: float, share: float
) -> None:
    found = eased((x1, y1, x2, y2), share)
    s = np.linspace(0, 1, 200_001)
    x = 3 * (1 - s) ** 2 * s * x1 + 3 * (1 - s) * s**2 * x2 + s**3
    y = 3 * (1 - s) ** 2 * s * y1 + 3 * (1 - s) * s**2 * y2 + s**3
    near = np.abs(x - share) < 2e-5
    assert y[near].min() - 1e-4 <= found <= y[near].max() + 1e-4


def test_spans_go_their_own_ways() -> None:
    times, values = [0.0, 1.0, 2.0, 3.0], [(0.0,), (4.0,), (8.0,), (8.5,)]
    smooth = Monotone(times, [0, 4, 8, 8.5])
    curve = Spans(times, values, [(), EASES["linear"], None], lambda time: (smooth.number(time),), straight)
    assert curve.at(0.999) == (0.0,)
    assert curve.at(1.25) == (5.0,)
    assert 8 < curve.at(2.5)[0] < 8.5
    assert [curve.at(time) for time in times] == values


def test_a_dive_nears_its_target_by_the_same_factor_each_second() -> None:
    around = Around([0.0, 10.0], [(0.0, -3.0, 0.0), (0.0, -3e-6, 0.0)], [(0.0, 0.0, 0.0)] * 2)
    found = [apart(around.at(float(time)), (0.0, 0.0, 0.0)) for time in range(11)]
    factors = np.divide(found[1:], found[:-1])
    np.testing.assert_allclose(factors, 10**-0.6, rtol=1e-9)


def test_a_target_moves_by_the_same_part_of_the_picture_each_second() -> None:
    times = [0.0, 4.0, 10.0]
    distance = Distance(times, [2.0, 0.1, 0.001])
    target = EvenTarget(times, [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.52, 0.0, 0.0)], distance)
    step = 1e-4
    moments = np.linspace(0.1, 9.9, 50)
    speeds = np.array(
        [apart(target.at(m + step), target.at(m - step)) / (2 * step) / distance.number(m) for m in moments]
    )
    # In scene units the speed falls by a factor of hundreds; in pictures it is continuous and nearly even.
    assert speeds.max() < 4 * speeds.min()
    assert np.abs(np.diff(speeds)).max() < 0.15 * speeds.max()
    assert target.at(4.0) == pytest.approx((0.5, 0.0, 0.0))
    assert target.at(10.0) == pytest.approx((0.52, 0.0, 0.0))


@pytest.mark.parametrize("least", [1e-3, 1e-6, 1e-9])
def test_a_steep_dive_meets_its_target(least: float) -> None:
    """The distance falls by equal factors, so the target's way is known: as far as the distance has fallen."""
    times = [0.0, 239.0]
    distance = Distance(times, [3.0, least])
    target = EvenTarget(times, [(0.0, 0.0, 0.0), (0.65, 0.0, 0.0)], distance)
    for time in (1.0, 100.0, 200.3, 230.0, 238.0, 238.9):
        now = distance.number(time)
        left = 0.65 - target.at(time)[0]
        assert left == pytest.approx(0.65 * (now - least) / (3 - least), abs=1e-4 * now + 1e-15)


def test_a_flight_round_a_still_target_keeps_its_distance() -> None:
    rows = [(3.0, 0.0, 0.0), (0.0, 3.0, 0.0), (-3.0, 0.0, 1e-9)]
    around = Around([0.0, 1.0, 2.0], rows, [(0.0, 0.0, 0.0)] * 3)
    for time in np.linspace(0, 2, 41):
        assert apart(around.at(float(time)), (0.0, 0.0, 0.0)) == pytest.approx(3)
