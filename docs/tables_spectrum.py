"""Colours of light of one wavelength, and of one wavenumber: what sums over the spectrum are weighed by."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clfractal.shading.scattering import WAVES

Doubles = npt.NDArray[np.float64]

SEEN = (380.0, 720.0)


def seen_colors(nanometres: Doubles) -> Doubles:
    """Linear Rec. 709 of light of one wavelength, none below 0, each with the same sum over all wavelengths."""
    return np.asarray(np.maximum(_matched(nanometres), 0.0) / _SUMS)


def wave_colors() -> Doubles:
    """Weights of linear Rec. 709 at even steps of the wavenumber, each colour's with the sum 1; shape (WAVES, 3).

    They may be below 0, as many colours of one wave are outside of what Rec. 709 can show; those of a film are seldom.
    """
    shortest, longest = SEEN
    nanometres = 1 / np.linspace(1 / longest, 1 / shortest, WAVES)
    weights = _matched(nanometres) * np.square(nanometres)[:, None]
    return np.asarray(weights / weights.sum(axis=0))


def _matched(nanometres: Doubles) -> Doubles:
    """By Wyman, Sloan and Shirley 2013, Simple Analytic Approximations to the CIE XYZ Color Matching Functions."""

    def lobe(height: float, middle: float, before: float, after: float) -> Doubles:
        width = np.where(nanometres < middle, before, after)
        return np.asarray(height * np.exp(-0.5 * ((nanometres - middle) / width) ** 2))

    x = lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2)
    y = lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1)
    z = lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8)
    matrix = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    return np.asarray(np.stack([x, y, z], axis=-1) @ np.array(matrix).T)


# Sums over wavelengths of the three colours as they are seen, so that light of all wavelengths alike is white.
_SUMS = np.maximum(_matched(np.linspace(*SEEN, 2001)), 0.0).sum(axis=0) / 1000
