"""The limits of an orbit, as the kernels read them (`kernels/formulas/orbit.h`)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from clfractal.device.source import kinds
from clfractal.device.structs import Field, Precision, Struct
from clfractal.device.watched import CANCELLED
from clfractal.formulas.language import Chain

Record = np.ndarray[Any, np.dtype[np.void]]

SHAPE_KINDS = kinds("elements/shapes")
"""Shapes, of solids and of objects."""
SOLID_KINDS = {"formula": 0, **SHAPE_KINDS}
BODY_OPAQUE = 255
"""The number of what light does not go through, among those of bodies: above all."""
JOINS = {"union": 0, "smooth_union": 1, "cut": 2, "intersection": 3}

ORBIT = Struct(
    "Orbit",
    [
        Field("iterations", "int", 0, "most applications of the formula"),
        Field(
            "gradient_limit",
            "int",
            0,
            "applications after which the surface's gradient is that of no later z",
        ),
        Field("longest", "int", 0, "applications allowed to get from the bailout to the distance bailout"),
        Field("bailout_square", "real", 0, "|z|^2 beyond which a point has escaped"),
        Field("distance_square", "real", 0, "|z|^2 beyond which distances are exact enough"),
        Field("log_bailout", "real", 0, "natural logarithm of the bailout"),
        Field("log_distance_bailout", "real", 0, "natural logarithm of the distance bailout"),
        Field("log2_degree", "real", 0, "binary logarithm of the degree of one application"),
        Field("solid_radius", "real", 0, "radius in z that holds the last solid, for degree 1"),
        Field("unit", "real", 0, "one unit of the scene in the formula's space"),
        # What texts of several formulas, joined or applied in turn, read here.
        Field("first_count", "int", 0, "FIRST_COUNT of this formula, LOGARITHMIC and HAS_SHAPE"),
        Field("logarithmic", "int", 0, ""),
        Field("has_shape", "int", 0, ""),
        Field("cycle", "int", 0, "applications after which whose turn it is repeats itself ..."),
        Field("repeats_from", "int", 0, "... and the first one from which on it does"),
        # Of one of several solids that are joined (`kernels/formulas/solids.h`); else 0.
        Field("kind", "int", 0, "one of SOLID_KINDS"),
        Field("join", "int", 0, "one of JOINS"),
        Field("solids", "int", 0, "how many there are"),
        Field("flows", "int", 0, "1: some of them flow together"),
        Field("first", "int", 0, "of a formula: where its constants begin"),
        Field("object", "int", 0, "the number of the object, from 1; 0: the scene's own formula"),
        Field("middle", "real", 3, "its middle, or a point of a plane, scene units"),
        Field("own_x", "real", 3, "from scene units to its own ones"),
        Field("own_y", "real", 3, ""),
        Field("own_z", "real", 3, ""),
        Field("sides", "real", 3, "of simple solids: half of them, scene units"),
        Field("form", "real", 3, "of shapes: numbers of their own"),
        Field("scale", "real", 0, "from a distance of the formula's own to what rays may go in the scene"),
        Field("step_scale", "real", 0, "how much of its own distance that is"),
        Field("ball", "real", 3, "centre of a ball that holds the formula's set, scene units"),
        Field("ball_radius", "real", 0, "its radius, scene units"),
        Field("reach", "real", 0, "how far around the ball its surface may matter to others, scene units"),
        Field("potential_share", "real", 0, "this radius over that of all that is searched"),
        Field("smoothness", "real", 0, "width of a smooth union, scene units"),
        Field("body", "int", 0, "which body it is of that light goes through, or BODY_OPAQUE"),
        Field("bare", "int", 0, "1: the walls of what it cuts belong to that"),
        Field("planes", "int", 0, "how many planes open it alone; their records follow all solids"),
        Field("first_plane", "int", 0, "how many records after this one they begin"),
        # Of the first one of a list.
        Field(
            "next_list",
            "int",
            0,
            "how many records after this one the next list begins, of one body alone; 0: there is none",
        ),
        Field(CANCELLED, "int", 0, "1: the work was cancelled, and long orbits end at once"),
    ],
    kinds=[
        ("SOLID_FORMULA", SOLID_KINDS["formula"]),
        ("BODY_OPAQUE", BODY_OPAQUE),
        *((f"JOIN_{join.split('_')[0].upper()}", number) for join, number in JOINS.items()),
    ],
)

MOST_APPLICATIONS = 2_000_000_000
"""The largest iteration limit of escape counts, which are 32-bit numbers. Distances take no limit that large."""

# Applications past the iteration limit that get a lane from the bailout to the distance bailout. Degree 2 needs four
# from 4 to 1000, degree 1.1 in a chain some twenty.
EXTRA_APPLICATIONS = 24


# A formula by itself: its own space is the scene's.
_ALONE: dict[str, object] = {
    **dict.fromkeys(
        (
            "kind",
            "join",
            "flows",
            "first",
            "object",
            "body",
            "bare",
            "planes",
            "first_plane",
            "next_list",
        ),
        0,
    ),
    "solids": 1,
    **dict.fromkeys(("ball_radius", "reach", "potential_share", "smoothness"), 0.0),
    **dict.fromkeys(("middle", "sides", "form", "ball"), (0.0, 0.0, 0.0)),
    "own_x": (1.0, 0.0, 0.0),
    "own_y": (0.0, 1.0, 0.0),
    "own_z": (0.0, 0.0, 1.0),
    "scale": 1.0,
    "step_scale": 1.0,
}


def orbit_record(
    chain: Chain,
    iterations: int,
    precision: Precision,
    bailout: float | None = None,
    *,
    potential: bool = False,
    joined: Mapping[str, object] | None = None,
) -> Record:
    """The limits of an orbit.

    Args:
        bailout: in the place of the formula's own.
        potential: whether normals are of the last z, however many applications that takes.
        joined: values of the fields that say which of several solids this is; see `clfractal/geometry/solids.py`.
    """
    inner = bailout if bailout is not None else chain.bailout
    outer = max(inner, chain.distance_bailout)
    # Linear maps measure the solid of exactly `iterations` applications; one more would be a smaller solid.
    linear = chain.degree <= 1
    values = {
        "iterations": iterations,
        "gradient_limit": -1 if potential else iterations,
        "longest": iterations if linear or outer == inner else iterations + EXTRA_APPLICATIONS,
        "bailout_square": inner**2,
        "distance_square": outer**2,
        "log_bailout": math.log(inner),
        "log_distance_bailout": math.log(outer),
        "log2_degree": math.log2(chain.degree) / chain.cycle_length if chain.degree > 1 else 0.0,
        "solid_radius": chain.solid_radius,
        "unit": 1.0 if chain.place is None else chain.place.scale,
        "first_count": int(chain.starts_counted),
        "logarithmic": int(not linear),
        "has_shape": int(chain.has_solid),
        "cycle": chain.period,
        "repeats_from": chain.repeats_from,
        CANCELLED: 0,
        **_ALONE,
        **(joined or {}),
    }
    return ORBIT.value(precision, values)
