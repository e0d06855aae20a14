"""What our language wants to know of a fragment's formula: how fast it grows, and where its surface is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from clfractal.errors import ClfractalError, FileError, Where
from clfractal.exchange.frag_formula import FAR

if TYPE_CHECKING:
    from clfractal.formulas.chain import Chain

DIRECTIONS = 140
NEAREST, STEP = 0.02, 1.2
NEAR = 0.08
"""Of a place's distance from the origin: how near a surface must be that is looked for between directions."""
MARGIN = 1.3
LEAST_DEGREE = 1.5
LOOKED_AT = 24
"""Applications after which the surface is taken to be where it is."""
STRAIGHT = 26
"""Directions along axes and diagonals."""
MUCH = 100_000
"""Characters of a formula times applications, from which on fewer directions are looked into."""


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

    if formula["bailout"] != FAR:
        _set_degree(formula)
    chain = resolve({"inline": formula})
    far = 2 * math.hypot(*eye) + 20
    # Beyond it orbits have not begun.
    far = min(far, chain.bailout)
    count = math.ceil(math.log(far / NEAREST) / math.log(STEP))
    radii = far * STEP ** np.arange(-count, 1)
    directions = _directions()
    work = len(str(formula)) * min(iterations, LOOKED_AT)
    if work > MUCH:
        directions = directions[: max(STRAIGHT, len(directions) * MUCH // work)]
    points = (radii[:, None, None] * directions[None]).reshape(-1, 3)
    found = _distances(chain, points, min(iterations, LOOKED_AT)).reshape(len(radii), -1)
    near = ~(found >= NEAR * radii[:, None]).all(axis=1)
    largest = radii[np.nonzero(near)[0].max()] if near.any() else radii[-1]
    formula["bounds"] = {"center": [0, 0, 0], "radius": float(f"{min(MARGIN * largest, far):.4g}")}


def _distances(chain: Chain, points: Any, iterations: int) -> Any:
    """The formula's own distance at points of shape (n, 3)."""
    import numpy as np

    from clfractal.formulas.backends import NumpyBackend
    from clfractal.formulas.evaluate import evaluate
    from clfractal.formulas.nodes import names_in
    from clfractal.formulas.reference import apply, start

    backend = NumpyBackend()
    size, bound = chain.size, chain.first
    with np.errstate(all="ignore"):
        state, point = start(chain, points, backend)
        alive = _square(state[:size]) <= chain.distance_bailout**2
        for application in range(iterations):
            if not alive.any():
                break
            after = apply(bound, state, point, backend, number=application, carried=chain.carried)
            state = [np.where(alive, new, old) for new, old in zip(after, state, strict=True)]
            alive &= _square(state[:size]) <= chain.distance_bailout**2
        names: dict[str, Any] = {name: float(value) for name, value in bound.values.items()}
        names.update(zip((*bound.formula.variables, *chain.carried), state, strict=True))
        for name, node in bound.formula.let:
            if name not in names and names_in(node) <= names.keys():
                names[name] = evaluate(node, names, backend)
        assert bound.formula.distance is not None
        return np.broadcast_to(evaluate(bound.formula.distance, names, backend), len(points))


def _square(state: Sequence[Any]) -> Any:
    return sum((part * part for part in state[1:]), start=state[0] * state[0])


def _set_degree(formula: dict[str, Any]) -> None:
    """The degree: a number, or the parameter that it is."""
    degree = _degree(formula)
    if degree < LEAST_DEGREE:
        return
    formula["degree"] = degree
    for name, parameter in formula.get("parameters", {}).items():
        if parameter["default"] != degree:
            continue
        changed = {
            **parameter,
            "default": degree + 1,
            "maximum": max(parameter.get("maximum", 0), degree + 1),
        }
        if _degree({**formula, "parameters": {**formula["parameters"], name: changed}}) == degree + 1:
            formula["degree"] = f"max({name}, 1)"
            return


def _degree(formula: dict[str, Any]) -> float:
    """The power by which |z| grows far outside in the first application, in the middle of many directions."""
    import numpy as np

    from clfractal.formulas.backends import NumpyBackend
    from clfractal.formulas.catalog import resolve
    from clfractal.formulas.reference import apply, carried_at_start, space_to_state

    chain = resolve({"inline": formula})
    directions = _directions()
    backend = NumpyBackend()
    lengths = []
    for size in (1e5, 1e6):
        point = space_to_state(chain, list(size * directions.T), backend)
        with np.errstate(all="ignore"):
            beside = carried_at_start(chain, point, backend)
            found = apply(chain.first, [*point, *beside], point, backend, carried=chain.carried)[: chain.size]
            lengths.append(np.sqrt(sum(np.broadcast_to(part, len(directions)) ** 2 for part in found)))
    with np.errstate(all="ignore"):
        slopes = np.log10(lengths[1] / lengths[0])
    slopes = slopes[np.isfinite(slopes)]
    middle = float(np.median(slopes)) if len(slopes) else 1.0
    whole = round(middle)
    near = float(whole) if abs(middle - whole) < 0.02 else round(middle, 2)
    return min(max(near, 1.0), 64.0)


def _directions() -> Any:
    """Directions of length 1, of shape (n, 3): along axes and diagonals, and others."""
    import numpy as np

    generator = np.random.default_rng(1)
    directions = generator.normal(size=(DIRECTIONS, 3))
    # Thin parts lie along axes, and diagonals of planes and cubes, rather than anywhere.
    straight = np.array(
        [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z]
    )
    directions = np.concatenate([straight, directions]).astype(float)
    return directions / np.linalg.norm(directions, axis=1)[:, None]
