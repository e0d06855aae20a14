"""The oracle of tests: counts, distances, orbits and Jacobians by NumPy, and by mpmath at any precision.

Written for clarity, straight from the definitions in the design: what the kernels compute is compared with
this.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import count, islice
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from clfractal.formulas.application import (
    apply,
    carried_at_start,
    constant_of,
    space_to_state,
)
from clfractal.formulas.backends import (
    Dual,
    DualBackend,
    MpmathBackend,
    NumpyBackend,
    constant_dual,
    seeded,
)
from clfractal.formulas.carried import names_at_end
from clfractal.formulas.chain import Chain
from clfractal.formulas.evaluate import Backend, evaluate, evaluate_constant

if TYPE_CHECKING:
    from clfractal.formulas.deep import BegunAt

__all__ = [
    "DualBackend",
    "MpmathBackend",
    "NumpyBackend",
    "apply",
    "carried_at_start",
    "constant_of",
    "distance",
    "escape",
    "evaluate",
    "evaluate_constant",
    "mp_escape",
    "mp_jacobian",
    "mp_orbit",
    "space_to_state",
]

Float = NDArray[np.float64]

# Applications beyond the limit, for points outside that have not reached the distance bailout at the limit.
EXTRA_APPLICATIONS = 64


def escape(
    chain: Chain, points: Float, iterations: int, bailout: float | None = None
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Escape counts of points, shape (n, 3), in scene units.

    Returns:
        The number of applications until |z| > bailout (at most `iterations`), and whether it never was.
    """
    radius = chain.bailout if bailout is None else bailout
    backend = NumpyBackend()
    size = chain.size
    with np.errstate(all="ignore"):
        state, point = start(chain, points, backend)
        count = np.zeros(len(points), dtype=np.int64)
        begun = _begun(chain, points)
        alive = _norm(state[:size]) <= radius
        for application in range(iterations):
            if not alive.any():
                break
            index = np.flatnonzero(alive & (begun <= application))
            count += alive & (begun > application)
            bound = chain.link_at(application).bound
            here = [p[index] for p in point]
            before = [z[index] for z in state]
            new = apply(
                bound, before, constant_of(bound, here), backend, number=application, carried=chain.carried
            )
            for component, value in zip(state, new, strict=True):
                component[index] = value
            count[index] += 1
            # A NaN is no small number: such a point has escaped.
            alive[index] = _norm([z[index] for z in state[:size]]) <= radius
    return count, alive


def distance(chain: Chain, points: Float, iterations: int) -> tuple[Float, Float]:
    """Estimated distance to the solid (0 inside), in scene units, and the gradient of the surface.

    The solid is the set of points with |z| <= bailout after `iterations` applications. With J the Jacobian of
    the last z and g = |J^T z/|z||: for a degree above 1 |z| log|z| / (2 g) times two factors (docs/formulas.md, Distances),
    for degree 1 (|z| - R) / g with R the chain's `solid_radius`, or the last lasting formula's `shape` over its
    own gradient. Iteration stops beyond the distance bailout. No step scale is applied.

    The gradient is J^T z, too, but of no z after `iterations` applications: the solid's surface is a level set of that one.

    Returns:
        Distances of shape (n,); gradients of shape (n, 3), which point out of the solid and are not
        normalised.
    """
    backend = DualBackend(NumpyBackend())
    with np.errstate(all="ignore"):
        last, shown, count, inside = _dual_orbit(chain, points, iterations, backend)
        state, shown = last[: chain.size], shown[: chain.size]
        radius = _norm([z.value for z in state])
        growth = np.linalg.norm(_gradient(state, radius), axis=1)
        gradient = _gradient(shown, _norm([z.value for z in shown]))
        if chain.shape_index is not None:
            solid = constant_dual(_solid(chain, chain.shape_index, last, backend), 3)
            gradient = np.stack([np.broadcast_to(p, radius.shape) for p in solid.partials], axis=1)
            inside = solid.value <= 0
            growth = np.linalg.norm(gradient, axis=1)
            result = np.where(growth > 0, solid.value / growth, 0.0)
        elif chain.degree > 1:
            # The solid of few iterations is the level set of the potential at the bailout.
            left = (iterations - count) / chain.cycle_length
            height = np.log(radius)
            level = math.log(chain.bailout) * chain.degree**-left / height
            far = height * chain.degree ** (-count / chain.cycle_length)
            share = (1 - level**2) / (1 + far / 2 + far**2 / 12)
            result = 0.5 * radius * height * share / growth
        else:
            result = (radius - chain.solid_radius) / growth
        result = np.where(inside | ~(result > 0), 0.0, result)
    return result, gradient


def own_distance(chain: Chain, points: Float, iterations: int) -> Float:
    """The distance that the formulas tell themselves (`distance`), in scene units; 0 inside."""
    assert chain.rule_index is not None
    backend = NumpyBackend()
    with np.errstate(all="ignore"):
        dual = DualBackend(backend)
        last, _, _, inside = _dual_orbit(chain, points, iterations, dual)
        result = np.asarray(_solid(chain, chain.rule_index, [z.value for z in last], backend), float)
        if chain.degree <= 1:
            inside = result <= 0
        return np.where(inside | ~(result > 0), 0.0, np.broadcast_to(result, inside.shape))


def _solid(chain: Chain, index: int, last: Sequence[Any], backend: Backend) -> Any:
    """A link's `distance`, or its `shape`, of the last state."""
    bound = chain.links[index].bound
    formula = bound.formula
    names: dict[str, Any] = {name: float(value) for name, value in bound.values.items()}
    names.update(zip(chain.carried, last[chain.size :], strict=True))
    names.update(zip(formula.variables, last, strict=False))
    node = formula.shape if chain.rule_index is None else formula.distance
    assert node is not None
    needed = names_at_end(formula, node)
    for name, each in formula.let:
        if name in needed:
            names[name] = evaluate(each, names, backend)
    return evaluate(node, names, backend)


def start(chain: Chain, points: Float, backend: Backend) -> tuple[list[Float], list[Float]]:
    """The state before the first application and the point as a state."""
    columns = np.array(points, dtype=float).reshape(-1, 3).T
    raw = space_to_state(chain, _in_formula(chain, list(columns), backend, float), backend)
    point = [np.array(np.broadcast_to(p, columns[0].shape), dtype=float) for p in raw]
    if chain.place is not None:
        return _begun_at(chain, points).values, point
    state = [np.zeros_like(p) if chain.add == "point" else p.copy() for p in point]
    beside = carried_at_start(chain, point, backend)
    state += [np.array(np.broadcast_to(each, columns[0].shape), dtype=float) for each in beside]
    return state, point


def _in_formula(
    chain: Chain, point: Sequence[Any], backend: Backend, number: Callable[[Any], Any]
) -> list[Any]:
    """A point of the scene in the formula's space; `number` makes a constant of a fraction."""
    place = chain.place
    if place is None:
        return list(point)
    scale = number(1 / Fraction(place.magnification))
    return [
        backend.call("add", [number(center), backend.call("mul", [each, scale])])
        for center, each in zip(place.exact, point, strict=True)
    ]


def _begun(chain: Chain, points: Float) -> NDArray[np.int64]:
    """The applications at which orbits begin; those of a place shown magnified together with all that is around it."""
    return np.zeros(len(points), np.int64) if chain.place is None else _begun_at(chain, points).counts


def _begun_at(chain: Chain, points: Float) -> BegunAt:
    from clfractal.formulas.deep import begun_at  # which few scenes need

    return begun_at(chain, points)


def _norm(state: Sequence[Float]) -> Float:
    return np.sqrt(sum((z * z for z in state[1:]), start=state[0] * state[0]))


def _gradient(state: Sequence[Any], radius: Float) -> Float:
    """J^T z/|z|, shape (n, 3)."""
    return np.stack([sum(z.value / radius * z.partials[j] for z in state) for j in range(3)], axis=1)


def _dual_orbit(
    chain: Chain, points: Float, iterations: int, backend: DualBackend
) -> tuple[list[Any], list[Any], NDArray[np.int64], NDArray[np.bool_]]:
    """Orbits over duals until |z| > distance bailout: last states, those at the limit, counts, and which are inside."""
    columns = np.array(points, dtype=float).reshape(-1, 3).T
    shape = columns[0].shape
    own = _in_formula(chain, seeded(list(columns)), backend, float)
    point = [_full(p, shape) for p in space_to_state(chain, own, backend)]
    zero = _full(0.0, shape)
    state = [zero] * chain.size if chain.add == "point" else list(point)
    state += [_full(each, shape) for each in carried_at_start(chain, point, backend)]
    begun = _begun(chain, columns.T)
    if chain.place is not None:
        found = _begun_at(chain, columns.T)
        state = [Dual(value, tuple(slopes)) for value, slopes in zip(found.values, found.slopes, strict=True)]
    size = chain.size
    count = np.zeros(shape, dtype=np.int64)
    inside = np.zeros(shape, dtype=bool)
    alive = _norm([z.value for z in state[:size]]) <= chain.distance_bailout
    # For degree 1 the distance is good at any |z|; going on would measure a smaller solid.
    extra = EXTRA_APPLICATIONS if chain.degree > 1 else 1
    shown = state
    for application in range(iterations + extra):
        if application >= iterations:
            # Only points that have left the bailout go on.
            in_set = alive & (_norm([z.value for z in state[:size]]) <= chain.bailout)
            if application == iterations:
                inside = in_set
            alive &= ~in_set & (chain.degree > 1)
        if application <= iterations:
            shown = state
        if not alive.any():
            break
        bound = chain.link_at(application).bound
        constant = constant_of(bound, point)
        new = apply(bound, state, constant, backend, number=application, carried=chain.carried)
        goes_on = alive & (begun <= application)
        state = [_select(goes_on, _full(n, shape), z) for n, z in zip(new, state, strict=True)]
        count += alive
        alive = alive & (_norm([z.value for z in state[:size]]) <= chain.distance_bailout)
    return state, shown, count, inside


def _full(value: Any, shape: tuple[int, ...]) -> Dual:
    """A dual whose value and partials are arrays."""
    dual = constant_dual(value, 3)
    parts = tuple(np.array(np.broadcast_to(p, shape), dtype=float) for p in dual.partials)
    return Dual(np.array(np.broadcast_to(dual.value, shape), dtype=float), parts)


def _select(mask: NDArray[np.bool_], yes: Dual, no: Dual) -> Dual:
    pairs = zip(yes.partials, no.partials, strict=True)
    return Dual(np.where(mask, yes.value, no.value), tuple(np.where(mask, p, q) for p, q in pairs))


# --- mpmath ---


def mp_orbit(
    chain: Chain, point: Sequence[Any], applications: int, digits: int = 40
) -> list[tuple[Any, ...]]:
    """The states after 0, 1, ... applications, as mpmath numbers computed with `digits` digits."""
    import mpmath

    with mpmath.workdps(digits):
        states = _mp_states(chain, map(mpmath.mpf, point), MpmathBackend(), mpmath.mpf)
        return [tuple(state) for state in islice(states, applications + 1)]


def mp_escape(chain: Chain, point: Sequence[Any], iterations: int, digits: int = 40) -> tuple[int, bool]:
    """One point's escape count and whether it never escapes, with `digits` digits."""
    import mpmath

    with mpmath.workdps(digits):
        limit = mpmath.mpf(chain.bailout) ** 2
        states = _mp_states(chain, map(mpmath.mpf, point), MpmathBackend(), mpmath.mpf)
        for application, state in enumerate(islice(states, iterations + 1)):
            if not mpmath.fsum(z * z for z in state[: chain.size]) <= limit:
                return application, False
    return iterations, True


def mp_jacobian(chain: Chain, point: Sequence[Any], applications: int, digits: int = 40) -> list[list[Any]]:
    """dz_i/dp_j after some applications, by the point's three coordinates, exact but for rounding."""
    import mpmath

    with mpmath.workdps(digits):
        here = seeded([mpmath.mpf(p) for p in point])
        *_, state = islice(_mp_states(chain, here, DualBackend(MpmathBackend()), _mp_dual), applications + 1)
        return [list(z.partials) for z in state]


def _mp_states(
    chain: Chain, point: Iterable[Any], backend: Backend, number: Callable[[Any], Any]
) -> Iterator[list[Any]]:
    """The states after 0, 1, ... applications, without end; `number` makes a constant one of theirs."""
    import mpmath

    own = _in_formula(chain, list(point), backend, lambda part: mpmath.mpf(part.numerator) / part.denominator)
    c = [number(p) for p in space_to_state(chain, own, backend)]
    state = [number(0.0)] * chain.size if chain.add == "point" else list(c)
    state += [number(each) for each in carried_at_start(chain, c, backend)]
    for application in count():
        yield state
        bound = chain.link_at(application).bound
        constant = [number(p) for p in constant_of(bound, c)]
        new = apply(bound, state, constant, backend, number=application, carried=chain.carried)
        state = [number(z) for z in new]


def _mp_dual(value: Any) -> Dual:
    import mpmath

    dual = constant_dual(value, 3)
    return Dual(mpmath.mpf(dual.value), tuple(mpmath.mpf(p) for p in dual.partials))
