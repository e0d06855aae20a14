"""How coarse moving pictures are: as the time for a frame wants it, with what was learned from the frames before."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.viewer.pacing import SHOWN_AFTER, Pacing, Schedule


def settled(seconds_per_pixel: float, overhead: float, pixels: int = 1280 * 720, **settings: float) -> Pacing:
    """After many frames of a picture with these costs."""
    pacing = Pacing(**settings)  # type: ignore[arg-type]
    for _ in range(60):
        rendered = pixels / pacing.divider(pixels) ** 2
        kernel = rendered * seconds_per_pixel
        pacing.learn(int(rendered), kernel, kernel + overhead)
    return pacing


@given(st.floats(1e-9, 3e-5), st.floats(0, 0.01), st.sampled_from([15.0, 30.0, 60.0]))
def test_frames_keep_the_rate(cost: float, overhead: float, rate: float) -> None:
    pixels = 1280 * 720
    pacing = settled(cost, overhead, rate=rate, coarsest=64)
    divider = pacing.divider(pixels)
    frame = pixels / divider**2 * cost + overhead
    if divider < 64 and overhead < 0.3 / rate:
        assert frame <= 1 / rate
    if divider > 1:
        # One step finer would not leave the time that showing needs.
        finer = pixels / (divider - 1) ** 2 * cost + overhead
        assert finer > 0.15 / rate


@given(st.floats(1e-9, 1e-3), st.integers(1, 64), st.integers(1, 10**8))
def test_the_divider_is_within_its_limits(cost: float, coarsest: int, pixels: int) -> None:
    divider = Pacing(coarsest=coarsest, seconds_per_pixel=cost).divider(pixels)
    assert 1 <= divider <= coarsest


@given(st.lists(st.floats(1e-8, 1e-5), min_size=2, max_size=2, unique=True))
def test_what_costs_more_is_coarser(costs: list[float]) -> None:
    cheap, dear = sorted(costs)
    assert settled(cheap, 0.002).divider(10**6) <= settled(dear, 0.002).divider(10**6)


def test_it_learns_slowness_faster_than_speed() -> None:
    up, down = Pacing(seconds_per_pixel=1e-6), Pacing(seconds_per_pixel=1e-5)
    up.learn(10**5, 1.0, 1.0)
    down.learn(10**5, 0.1, 0.1)
    assert up.seconds_per_pixel > 0.6e-5
    assert down.seconds_per_pixel > 0.5e-5


@given(st.floats(0, 1e4), st.floats(0, 1e4), st.integers(0, 10**7))
def test_nothing_spoils_it(kernel: float, more: float, pixels: int) -> None:
    """A grid that was filled, a compiler that ran: seconds without rays count little, and are forgotten."""
    pacing = Pacing()
    pacing.learn(pixels, kernel, kernel + more)
    assert 0 <= pacing.fixed <= 0.02
    assert pacing.seconds_per_pixel >= 0
    for _ in range(80):
        pacing.learn(10**5, 0.01, 0.012)
    assert pacing.seconds_per_pixel == pytest.approx(1e-7, rel=0.05)
    assert pacing.estimate(10**6) == pytest.approx(0.102, rel=0.05)


def test_a_growing_picture_is_shown_when_it_is_due() -> None:
    schedule = Schedule(100.0)
    shown = [at for at in (step / 100 for step in range(1, 901)) if schedule.due(100.0 + at + 1e-6)]
    assert shown == pytest.approx([*SHOWN_AFTER, 4.0, 6.0, 8.0])


def test_a_late_look_is_due_once() -> None:
    schedule = Schedule(0.0)
    assert not schedule.due(0.05)
    assert schedule.due(0.6)
    assert not schedule.due(0.9)
    assert schedule.due(1.0)
