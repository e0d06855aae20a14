"""Colours of black bodies."""

from functools import lru_cache
from math import exp, expm1

from clfractal.schema.base import Vector

# h c / k, nanometres times kelvin.
_SECOND_RADIATION = 1.438776877e7


def _lobe(wavelength: float, middle: float, below: float, above: float) -> float:
    t = (wavelength - middle) * (below if wavelength < middle else above)
    return exp(-0.5 * t * t)


def matching(wavelength: float) -> Vector:
    """The CIE 1931 colour matching functions x, y, z at a wavelength in nanometres (Wyman, Sloan, Shirley 2013)."""
    at = wavelength
    return (
        0.362 * _lobe(at, 442.0, 0.0624, 0.0374)
        + 1.056 * _lobe(at, 599.8, 0.0264, 0.0323)
        - 0.065 * _lobe(at, 501.1, 0.0490, 0.0382),
        0.821 * _lobe(at, 568.8, 0.0213, 0.0247) + 0.286 * _lobe(at, 530.9, 0.0613, 0.0322),
        1.217 * _lobe(at, 437.0, 0.0845, 0.0278) + 0.681 * _lobe(at, 459.0, 0.0385, 0.0725),
    )


@lru_cache(maxsize=256)
def chromaticity(temperature: float) -> tuple[float, float]:
    """CIE 1931 x and y of a black body; `temperature` in kelvin."""
    sums = [0.0, 0.0, 0.0]
    for wavelength in range(360, 831, 2):
        # Planck's law, scaled so that it neither overflows nor vanishes.
        power = (560 / wavelength) ** 5 / expm1(_SECOND_RADIATION / (wavelength * temperature))
        for index, value in enumerate(matching(wavelength)):
            sums[index] += power * value
    whole = sum(sums)
    return sums[0] / whole, sums[1] / whole


def black_body(temperature: float) -> Vector:
    """A black body's colour in linear Rec. 709 of luminance 1; what lies outside its gamut is cut off first.

    Args:
        temperature: kelvin, 1000 to 40000.
    """
    x, y = chromaticity(temperature)
    big_x, big_z = x / y, (1 - x - y) / y
    red = max(3.2404542 * big_x - 1.5371385 - 0.4985314 * big_z, 0.0)
    green = max(-0.9692660 * big_x + 1.8760108 + 0.0415560 * big_z, 0.0)
    blue = max(0.0556434 * big_x - 0.2040259 + 1.0572252 * big_z, 0.0)
    luminance = 0.2126729 * red + 0.7151522 * green + 0.0721750 * blue
    return red / luminance, green / luminance, blue / luminance
