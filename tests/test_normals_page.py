"""docs/normals.md against what its script measures: on a ball, and on figure 13 at one size.

Both ways of eight triangles have the same normal, so one of them is measured; and on the ball, where each takes a program
that nothing else needs, the worst and the most usual one: the others are combinations. The times on the page are those of
one machine, and are not compared.
"""

from __future__ import annotations

import re

import pytest
from PIL import Image

from clfractal.device.select import choose, has_float64
from tests.makers import DOCS, maker, pictured

NORMALS = ("one_triangle", "eight_triangles_shading", "eight_triangles_normal", "least_squares", "gradient")
# Of the printed figure, for its two digits and another device's rounding; and degrees.
RELATIVE, ABSOLUTE = 0.15, 0.006
SIZE = 512
MEASURED = tuple(name for name in NORMALS if name != "eight_triangles_shading")


def printed(heading: str) -> dict[str, list[float]]:
    """The table under a heading of the page: the numbers of each normal."""
    page = (DOCS / "normals.md").read_text("utf-8")
    part = page.split(f"### {heading}\n")[1].split("###")[0]
    rows = re.findall(r"^\| `(\w+)` \| ([\d. |]+) \|$", part, re.MULTILINE)
    return {name: [float(cell) for cell in cells.split("|")] for name, cells in rows}


@pytest.mark.parametrize(
    "normal",
    [
        "one_triangle",
        "least_squares",
        *(
            pytest.param(name, marks=pytest.mark.combination)
            for name in ("eight_triangles_normal", "gradient")
        ),
    ],
)
def test_errors_on_a_ball(normal: str) -> None:
    errors = list(maker("make_normals").ball_errors(normal).values())
    assert printed("On a ball")[normal] == pytest.approx(errors, rel=RELATIVE, abs=ABSOLUTE)


def test_errors_on_the_mandelbulb() -> None:
    if not has_float64(choose().info):
        return  # nothing true to compare with
    true, whole = maker("make_normals").true_normals(SIZE)
    assert whole.mean() > 0.9
    table = printed("On the Mandelbulb")
    place = 2 * maker("make_normals").SIZES.index(SIZE)
    for normal in MEASURED:
        errors = maker("make_normals").fractal_errors(normal, SIZE, true, whole)
        assert table[normal][place : place + 2] == pytest.approx(errors, rel=RELATIVE, abs=ABSOLUTE)


@pictured
def test_the_page_is_whole() -> None:
    page = (DOCS / "normals.md").read_text("utf-8")
    assert maker("make_normals").NORMALS == NORMALS
    for heading in ("On a ball", "On the Mandelbulb"):
        table = printed(heading)
        assert tuple(table) == NORMALS
        assert table["eight_triangles_shading"] == table["eight_triangles_normal"]
    times = printed("Time")
    assert times["one_triangle"][0] > 1
    for normal in NORMALS:
        assert f"](pictures/normals_{normal}.webp)" in page
        with Image.open(DOCS / "pictures" / f"normals_{normal}.webp") as picture:
            assert picture.size == maker("make_normals").CROP[2:]


def test_numbers_have_two_digits() -> None:
    number = maker("make_normals").number
    assert [number(value) for value in (0.0, 0.0004, 0.00512, 0.0351, 0.298, 2.54, 12.4)] == [
        "0", "0", "0.005", "0.035", "0.30", "2.5", "12",
    ]  # fmt: skip
