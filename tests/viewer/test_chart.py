"""The alignment chart: its circles are round, its rims complete, and the eyes' charts equal but for the marks."""

from __future__ import annotations

import numpy as np
import pytest

from clfractal.files.srgb import encode8
from clfractal.viewer import chart as charts
from clfractal.viewer.chart import Eye, chart, circles, grid_cell, marks

SIZES = [(1280, 720), (1281, 721), (960, 1080), (1920, 1080), (720, 1280), (500, 500), (2560, 1440)]
TINY = [(1, 1), (2, 1), (3, 2), (7, 40), (319, 400), (400, 199), (320, 200), (321, 900)]


@pytest.mark.parametrize("size", SIZES + TINY)
@pytest.mark.parametrize("eye", ["left", "right"])
def test_it_has_the_size_and_a_white_opaque_rim_of_one_pixel(size: tuple[int, int], eye: Eye) -> None:
    picture = chart(size, eye)
    assert picture.shape == (size[1], size[0], 4)
    assert picture.dtype == np.uint8
    assert (picture[..., 3] == 255).all()
    for rim in (picture[0], picture[-1], picture[:, 0], picture[:, -1]):
        assert (rim == 255).all()
    if min(size) > 100:
        # A rim of two pixels would hide that one is missing.
        for inner in (picture[1, 1:-1], picture[-2, 1:-1], picture[1:-1, 1], picture[1:-1, -2]):
            assert (inner[..., :3] < 200).mean() > 0.9


@pytest.mark.parametrize("size", SIZES)
def test_the_eyes_differ_inside_the_marks_alone(size: tuple[int, int]) -> None:
    different = (chart(size, "left") != chart(size, "right")).any(axis=-1)
    inside = np.zeros(different.shape, bool)
    for left, top, right, bottom in marks(size):
        assert 0 <= left < right <= size[0]
        assert 0 <= top < bottom <= size[1]
        # The letters are in different corners; each mark is really there.
        assert different[top:bottom, left:right].any()
        inside[top:bottom, left:right] = True
    assert not (different & ~inside).any()
    assert inside.mean() < 0.13


@pytest.mark.parametrize("size", SIZES)
def test_each_eye_has_its_letter_on_its_side(size: tuple[int, int]) -> None:
    boxes = marks(size)[:2]
    for number, eye in enumerate(("left", "right")):
        picture = chart(size, eye)  # type: ignore[arg-type]
        bright = [int((picture[top:bottom, left:right, 0] > 230).sum()) for left, top, right, bottom in boxes]
        assert bright[number] > 20 + bright[1 - number]
    assert boxes[0][2] <= size[0] / 2 <= boxes[1][0]


@pytest.mark.parametrize("size", SIZES)
def test_circles_are_round(size: tuple[int, int]) -> None:
    """Along many directions the line is brightest at the same distance; it is met in at least nine of ten of them."""
    gray = chart(size, "left")[..., 0].astype(float)
    height, width = gray.shape
    for x, y, radius in circles(size):
        assert radius <= x <= width - radius
        assert radius <= y <= height - radius
        met = 0
        angles = np.linspace(0, 2 * np.pi, 400, endpoint=False) + 0.01
        for angle in angles:
            column, row = x + radius * np.cos(angle), y + radius * np.sin(angle)
            # The pixel that holds the place, and its neighbours: the line is two pixels wide.
            part = gray[max(int(row) - 1, 0) : int(row) + 2, max(int(column) - 1, 0) : int(column) + 2]
            met += part.max() >= 150
        assert met >= 0.9 * len(angles)
        # An ellipse whose sides differ by three pixels would miss the line where nothing else is drawn.
        off = [gray[int(y + (radius - 6) * np.sin(a)), int(x + (radius - 6) * np.cos(a))] for a in angles]
        assert np.median(off) < 40


@pytest.mark.parametrize("size", [(1280, 720), (1281, 721), (640, 480)])
def test_lines_are_the_same_from_both_sides(size: tuple[int, int]) -> None:
    """Grid, circles, cross and ruler are symmetric to the picture's middle; what is written there is not."""
    gray = chart(size, "left")[..., 0].astype(int)
    plain = np.ones(gray.shape, bool)
    cell = grid_cell(size)
    blocks = [*marks(size), charts.ramp_box(size), charts.bars_box(size), charts.gamma_box(size)]
    middle = size[1] // 2
    # Numbers below the ruler, and the size above the bars.
    blocks += [(0, middle - 2 * cell, size[0], middle + 2 * cell), (0, 0, size[0], middle - 2 * cell)]
    for left, top, right, bottom in blocks:
        plain[top:bottom, left:right] = False
    both = plain & plain[:, ::-1]
    assert both.mean() > 0.2
    assert (np.abs(gray - gray[:, ::-1])[both] <= 1).all()
    rows = gray[:, [1, 2, cell // 2, size[0] // 4]]
    assert (np.abs(rows - rows[::-1])[2 * cell : -2 * cell] <= 1).mean() > 0.95


@pytest.mark.parametrize("size", SIZES)
def test_the_ramp_has_sixteen_even_steps(size: tuple[int, int]) -> None:
    left, top, right, bottom = charts.ramp_box(size)
    row = chart(size, "right")[(top + bottom) // 2, left:right]
    assert (row[:, 0] == row[:, 1]).all()
    values, counts = np.unique(row[:, 0], return_counts=True)
    assert values.tolist() == [17 * number for number in range(16)]
    assert len(set(counts.tolist())) == 1
    assert (np.diff(row[:, 0].astype(int)) >= 0).all()


@pytest.mark.parametrize("size", SIZES)
def test_stripes_send_out_as_much_light_as_the_plain_patch(size: tuple[int, int]) -> None:
    left, top, right, bottom = charts.gamma_box(size)
    part = chart(size, "left")[top:bottom, left:right, 0]
    stripes = part[:, 2]
    assert set(stripes.tolist()) == {0, 255}
    assert (np.diff(stripes.astype(int)) != 0).all()
    assert (part[:, part.shape[1] // 2] == charts.HALF_LIGHT).all()
    # IEC 61966-2-1: half of white's light is 188 of 255.
    half = encode8(np.full((1, 64, 3), 0.5, np.float32))
    assert round(float(half.mean())) == charts.HALF_LIGHT


def test_bars_have_the_screen_s_own_colours() -> None:
    size = (1280, 720)
    left, top, right, bottom = charts.bars_box(size)
    row = chart(size, "left")[(top + bottom) // 2, left:right, :3]
    seen = {tuple(color) for color in row.tolist()}
    assert seen == {tuple(bytes.fromhex(color[1:])) for color in charts.BARS}


def test_ticks_of_the_ruler_are_ten_pixels_apart() -> None:
    size = (1280, 720)
    row = chart(size, "left")[size[1] // 2 + 4, :, 0].astype(int)
    found = np.flatnonzero(row > 100)
    # Each tick lies between two pixels of a picture of even width.
    places = {round((place + 0.5 - size[0] / 2) / 10) for place in found}
    assert set(range(-39, 40)) <= places
    offsets = [place + 0.5 - size[0] / 2 for place in found]
    assert all(abs(off - 10 * round(off / 10)) <= 1.5 for off in offsets)
