"""`phase.h`: where media scatter light to, against Henyey and Greenstein's closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.render.sampler import samplers
from tests.small_kernels import Floats

COUNT = 1 << 14
NEARLY_EVEN = 0.0005  # taken as 0


def below(cosine: Floats, g: float) -> Floats:
    """The part of light that is scattered to smaller cosines."""
    if abs(g) < 1e-3:
        return (1 + cosine) / 2
    root = np.sqrt(1 + g * g - 2 * g * cosine)
    return np.asarray((1 - g * g) / (2 * g) * (1 / root - 1 / (1 + g)))


@pytest.mark.parametrize("g", [-0.99, -0.6, -0.01, 0.0, NEARLY_EVEN, 0.3, 0.9, 0.99])
def test_cosines_are_those_of_henyey_and_greenstein(g: float) -> None:
    u = (np.arange(COUNT) + 0.5) / COUNT
    axis = np.array([0.48, -0.6, 0.64])
    for sampler in samplers():
        cosine, density, direction = sampler.turns(u, np.roll(u, 5000), axis[:, None], np.array(g))
        exact = sampler.precision == "float64"
        # Rounding counts for less the wider the lobe is.
        assert abs(cosine.mean() - g) < (1e-4 if exact and g != NEARLY_EVEN else 1e-3)
        part = below(cosine, g)
        rising = part if part[-1] > part[0] else 1 - part
        assert np.abs(rising - u).max() < (2e-3 if exact else 0.01)
        step = 1e-6
        inner = np.abs(cosine) < 0.99
        slope = (below(cosine + step, g) - below(cosine - step, g)) / (2 * step)
        assert np.allclose(density[inner], slope[inner] / (2 * math.pi), rtol=2e-3)
        assert np.abs(np.linalg.norm(direction, axis=0) - 1).max() < 1e-5
        assert np.abs(axis @ direction - cosine).max() < 1e-5


def test_lanes_may_differ() -> None:
    """Each lane has a medium of its own."""
    u = np.full(COUNT, 0.25)
    values = np.resize([0.0, 0.5, -0.8, 0.95], COUNT)
    before = np.array([0.0, 0.0, 1.0])[:, None]
    for sampler in samplers():
        cosine = sampler.turns(u, u, before, values)[0]
        for g in np.unique(values):
            alone = sampler.turns(u, u, before, np.array(g))[0]
            assert np.array_equal(cosine[values == g], alone[values == g])
