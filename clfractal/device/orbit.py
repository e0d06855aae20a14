"""The limits of an orbit, as the kernels read them (`kernels/orbit.h`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clfractal.device.structs import Field, Precision, Struct
from clfractal.device.watched import CANCELLED
from clfractal.formulas.language import Chain

Record = np.ndarray[Any, np.dtype[np.void]]

ORBIT = Struct(
    "Orbit",
    [
        Field("iterations", "int", 0, "most applications of the formula"),
        Field("longest", "int", 0, "applications allowed to get from the bailout to the distance bailout"),
        Field("bailout_square", "real", 0, "|z|^2 beyond which a point has escaped"),
        Field("distance_square", "real", 0, "|z|^2 beyond which distances are exact enough"),
        Field("log_bailout", "real", 0, "natural logarithm of the bailout"),
        Field("log_distance_bailout", "real", 0, "natural logarithm of the distance bailout"),
        Field("log2_degree", "real", 0, "binary logarithm of the degree of one application"),
        Field("solid_radius", "real", 0, "radius in z that holds the last solid, for degree 1"),
        Field(CANCELLED, "int", 0, "1: the work was cancelled, and long orbits end at once"),
    ],
)

MOST_APPLICATIONS = 2_000_000_000
"""The largest iteration limit of escape counts, which are 32-bit numbers. Distances take no limit that large."""

# Applications past the iteration limit that get a lane from the bailout to the distance bailout. Degree 2 needs four
# from 4 to 1000, degree 1.1 in a chain some twenty.
EXTRA_APPLICATIONS = 24


def orbit_record(chain: Chain, iterations: int, precision: Precision, bailout: float | None = None) -> Record:
    """The limits of an orbit; `bailout` replaces the formula's own."""
    inner = bailout if bailout is not None else chain.bailout
    outer = max(inner, chain.distance_bailout)
    # Linear maps measure the solid of exactly `iterations` applications; one more would be a smaller solid.
    linear = chain.degree <= 1
    values = {
        "iterations": iterations,
        "longest": iterations if linear or outer == inner else iterations + EXTRA_APPLICATIONS,
        "bailout_square": inner**2,
        "distance_square": outer**2,
        "log_bailout": math.log(inner),
        "log_distance_bailout": math.log(outer),
        "log2_degree": math.log2(chain.degree) / chain.cycle_length if chain.degree > 1 else 0.0,
        "solid_radius": chain.solid_radius,
        CANCELLED: 0,
    }
    return ORBIT.value(precision, values)
