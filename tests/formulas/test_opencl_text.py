"""What the generated text contains, and what it depends on."""

from __future__ import annotations

import re
from typing import Any

import mpmath
import numpy as np
import pytest

from clfractal.formulas import catalog
from clfractal.formulas.opencl import write_formula
from tests.formulas.opencl_batch import numbered
from tests.formulas.orbits import FAR, orbit, points_of

TRIGONOMETRY = re.compile(
    r"\b(?:real|dual)_(?:sin|cos|tan|asin|acos|atan|atan2|exp|log|pow|pow_real|power_\w+)\b"
)


def text_of(name: str, parameters: dict[str, float] | None = None, **options: Any) -> str:
    return write_formula(catalog.load_chain(name, parameters), **options).text


@pytest.mark.parametrize("power", range(2, 33))
def test_whole_mandelbulb_powers_need_no_trigonometry(power: int) -> None:
    text = text_of("mandelbulb", {"power": power})
    assert TRIGONOMETRY.findall(text) == []
    assert "real_apply_0" in text
    turned = text_of("mandelbulb", {"power": power, "theta_phase": 0.4, "phi_phase": -1.1})
    assert TRIGONOMETRY.findall(turned) == []


def test_an_exponent_is_written_once_as_a_literal_and_once_as_data() -> None:
    usual, general = (
        text_of("mandelbulb", {"power": 2.5}).partition(f"INLINE state real_{way}_0(")[2].partition("\n}")[0]
        for way in ("usual", "apply")
    )
    assert "raised" not in usual
    assert "complex_raised_root(" in general


@pytest.mark.parametrize("name", ["hast", "mandelbox", "menger_sponge", "quaternion_julia", "tetrabrot"])
def test_algebraic_formulas_need_none_at_all(name: str) -> None:
    assert TRIGONOMETRY.findall(text_of(name)) == []


def trigonometric_rule(point: list[float], power: int, applications: int) -> list[Any]:
    """White's rule with products, in spherical coordinates, as it is printed."""
    x, y, z = (mpmath.mpf(v) for v in point)
    cx, cy, cz = x, y, z
    for _ in range(applications - 1):
        r = mpmath.sqrt(x * x + y * y + z * z)
        theta, phi = mpmath.atan2(mpmath.hypot(x, y), z), mpmath.atan2(y, x)
        across = r**power * mpmath.sin(power * theta)
        x = across * mpmath.cos(power * phi) + cx
        y = across * mpmath.sin(power * phi) + cy
        z = r**power * mpmath.cos(power * theta) + cz
    return [x, y, z]


@pytest.mark.parametrize("applications", [2, 3])
def test_they_equal_the_trigonometric_rule_to_rounding(applications: int) -> None:
    points = points_of(catalog.load_chain("mandelbulb"))
    got = orbit("mandelbulb", "operations", "float32").values[applications - 1].T
    compared = 0
    with mpmath.workdps(40):
        for point, value in zip(points.tolist(), got.tolist(), strict=True):
            exact = [float(v) for v in trigonometric_rule(point, 8, applications)]
            size = float(np.linalg.norm(exact))
            if size > FAR:
                continue
            # The eighth power multiplies relative errors by 8 with every application.
            np.testing.assert_allclose(
                value, exact, rtol=0, atol=1e-6 * 8 ** (applications - 1) * max(size, 1.0)
            )
            compared += 1
    assert compared >= 12


RUN_TIME = [
    ("mandelbox", {"scale": 2.0}, {"scale": -1.5}),
    ("mandelbox", {"min_radius": 0.5}, {"min_radius": 0.25}),
    ("kaleidoscopic_ifs", {"turn_before": 0.3}, {"turn_before": 0.7}),
    ("mandelbulb", {"theta_phase": 0.5}, {"theta_phase": 0.9}),
    ("quaternion_mandelbrot", {"offset": 0.2}, {"offset": 0.3}),
    ("mandelbulb", {"power": 8.0}, {"power": 3.5}),
    ("hast", {"power": 2.0}, {"power": 8.0}),
    ("polyhedral_ifs", {"order": 3.0}, {"order": 5.0}),
]


@pytest.mark.parametrize(("name", "first", "second"), RUN_TIME)
def test_what_people_drag_does_not_change_the_text(
    name: str, first: dict[str, float], second: dict[str, float]
) -> None:
    one, other = (write_formula(catalog.load_chain(name, p)) for p in (first, second))
    assert one.text == other.text
    assert len(one.constants) == len(other.constants)
    assert one.constants != other.constants


def test_a_julia_constant_is_passed_at_run_time() -> None:
    one, other = (
        write_formula(catalog.load_chain({"name": "mandelbulb", "julia": [x, 0.5, 0.25]})) for x in (0.1, 0.2)
    )
    assert one.text == other.text
    assert 0.1 in one.constants
    assert 0.2 in other.constants


@pytest.mark.parametrize("name", catalog.names())
def test_the_text_is_the_same_every_time(name: str) -> None:
    assert write_formula(catalog.load_chain(name)) == write_formula(catalog.load_chain(name))


@pytest.mark.parametrize("name", catalog.names())
def test_marching_without_the_rule_leaves_it_out(name: str) -> None:
    formula = write_formula(catalog.load_chain(name), scalar_rule=False)
    assert not formula.has_derivative
    assert "#define HAS_DERIVATIVE 0" in formula.text
    assert "derivative_apply" not in formula.text


def test_numbers_in_the_text_are_those_of_the_formula() -> None:
    inline = {
        "title": "Numbers",
        "reference": "none",
        "variables": ["x", "y", "z"],
        "map": ["x + 0.1", "y*1e-7", "z/3"],
        "add": "none",
        "degree": 1,
        "bounds": {"center": [0, 0, 0], "radius": 1},
        "bailout": 2,
    }
    text = write_formula(catalog.load_chain({"inline": inline})).text
    for number in (0.1, 1e-7, 1 / 3):
        assert f"R({number!r})" in text


def test_numbering_renames_every_definition() -> None:
    text = text_of("bulbox")
    renamed = numbered(text, 7)
    for name in re.findall(r"^INLINE \w+ (\w+)\(", text, re.MULTILINE):
        assert not re.search(rf"\b{name}\b", renamed)
        assert f"{name}_f7(" in renamed
