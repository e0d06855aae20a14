"""Colours of lights by temperature, against published chromaticities of black bodies."""

import pytest

from clfractal.elements.lights.point import PointLight
from clfractal.elements.lights.rectangle import RectangleLight
from clfractal.errors import SceneError
from clfractal.schema.temperature import black_body, chromaticity


# Points of the Planckian locus (CIE 1931, 2 degrees); illuminant A is the one of 2856 K.
@pytest.mark.parametrize(
    ("kelvin", "x", "y"),
    [(2000, 0.5267, 0.4133), (2856, 0.4476, 0.4074), (6500, 0.3135, 0.3237), (10000, 0.2807, 0.2884)],
)
def test_chromaticity_is_on_the_planckian_locus(kelvin: float, x: float, y: float) -> None:
    found = chromaticity(kelvin)
    assert found == pytest.approx((x, y), abs=0.006)


@pytest.mark.parametrize("kelvin", [1000, 3000, 6500, 40000])
def test_luminance_is_one(kelvin: float) -> None:
    red, green, blue = black_body(kelvin)
    assert 0.2126729 * red + 0.7151522 * green + 0.0721750 * blue == pytest.approx(1)
    assert (red > blue) == (kelvin < 6500 + 1e-9)


def test_one_of_color_and_temperature() -> None:
    with pytest.raises(SceneError, match="give one of color or temperature"):
        PointLight.checked({"position": [0, 0, 0], "color": [1, 0, 0], "temperature": 3000})


def test_up_along_direction_is_refused() -> None:
    with pytest.raises(SceneError, match="must not be along direction"):
        RectangleLight.checked({"type": "rectangle", "position": [0, 0, 0], "up": [0, 0, 2]})
