"""What our language wants to know of a fragment's formula: how fast it grows, and where its surface is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from clfractal.errors import ClfractalError, FileError, Where
from clfractal.exchange.frag_formula import FAR
from clfractal.exchange.measure import degree_of, directions_of

DIRECTIONS = 140
NEAREST, STEP = 0.02, 1.2
NEAR = 0.08
"""Of a place's distance from the origin: how near a surface must be that is looked for between directions."""
MARGIN = 1.3
LEAST_DEGREE = 1.5
LOOKED_AT = 24
"""Applications after which the surface is taken to be where it is."""


def measure(formula: dict[str, Any], iterations: int, eye: Sequence[float], file: str) -> None:
    """Fills in a formula's degree and bounds.

    Raises:
        FileError: our language does not take the formula.
    """
    try:
        _measure(formula, iterations, eye)
    except ClfractalError as error:
        raise FileError(f"has no counterpart: {error.message}", Where(file)) from error


def _measure(formula: dict[str, Any], iterations: int, eye: Sequence[float]) -> None:
    import numpy as np

    from clfractal.formulas.catalog import resolve
    from clfractal.formulas.reference import own_distance

    if formula["bailout"] != FAR:
        _set_degree(formula)
    far = 2 * math.hypot(*eye) + 20
    count = math.ceil(math.log(far / NEAREST) / math.log(STEP))
    radii = far * STEP ** np.arange(-count, 1)
    directions = directions_of(DIRECTIONS)
    points = (radii[:, None, None] * directions[None]).reshape(-1, 3)
    chain = resolve({"inline": formula})
    found = own_distance(chain, points, min(iterations, LOOKED_AT)).reshape(len(radii), -1)
    near = (found < NEAR * radii[:, None]).any(axis=1)
    largest = radii[np.nonzero(near)[0].max()] if near.any() else radii[-1]
    formula["bounds"] = {"center": [0, 0, 0], "radius": float(f"{min(MARGIN * largest, far):.4g}")}


def _set_degree(formula: dict[str, Any]) -> None:
    """The degree: a number, or the parameter that it is."""
    directions = directions_of(DIRECTIONS)
    degree = degree_of(formula, directions)
    if degree < LEAST_DEGREE:
        return
    formula["degree"] = degree
    for name, parameter in formula.get("parameters", {}).items():
        if parameter["default"] != degree:
            continue
        changed = {**parameter, "default": degree + 1, "maximum": max(parameter.get("maximum", 0), degree + 1)}
        trial = {**formula, "parameters": {**formula["parameters"], name: changed}}
        if degree_of(trial, directions) == degree + 1:
            formula["degree"] = f"max({name}, 1)"
            return
