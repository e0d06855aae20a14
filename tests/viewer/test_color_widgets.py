"""Colours of panels: what the picker shows, and what it changes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("imgui_bundle")

from clfractal.viewer.panels import color_button

pytestmark = pytest.mark.usefixtures("drawing_context")


colors = st.lists(st.floats(0, 1e3), min_size=3, max_size=3)


@given(colors)
def test_a_colour_survives_the_picker(color: list[float]) -> None:
    codes, gain = color_button.shown(color)
    assert all(0 <= each <= 1 for each in codes)
    assert color_button.linear(codes, gain) == pytest.approx(color, rel=1e-5, abs=1e-9 * gain)


def test_the_picker_shows_srgb() -> None:
    codes, _ = color_button.shown([0.5, 0.5, 0.5])
    assert codes[0] == pytest.approx(188 / 255, abs=0.5 / 255)
    assert color_button.hexadecimal(codes) == "#bcbcbc"
    assert color_button.linear([1.0, 0.0, 0.5]) == pytest.approx([1.0, 0.0, 0.214041], abs=1e-6)


@given(colors)
def test_brightness_beyond_the_screen_is_kept_while_a_hue_is_picked(color: list[float]) -> None:
    codes, gain = color_button.shown(color)
    turned = color_button.linear((codes[1], codes[2], codes[0]), gain)
    assert max(turned) == pytest.approx(max(color), rel=1e-5, abs=1e-6)
