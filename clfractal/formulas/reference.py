"""The oracle of tests: counts, distances, orbits and Jacobians by NumPy, and by mpmath at any precision.

Written for clarity, straight from the definitions in the design: what the kernels compute is compared with
this.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import count, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clfractal.formulas.backends import (
    Dual,
    DualBackend,
    MpmathBackend,
    NumpyBackend,
    constant_dual,
    seeded,
)
from clfractal.formulas.blocks import run
from clfractal.formulas.carried import names_at_end
from clfractal.formulas.chain import Chain
from clfractal.formulas.definition import BoundFormula, point_name
from clfractal.formulas.evaluate import Backend, evaluate, evaluate_constant
from clfractal.formulas.names import APPLICATION

__all__ = [
    "DualBackend",
    "MpmathBackend",
    "NumpyBackend",
    "apply",
    "distance",
    "escape",
    "evaluate",
    "evaluate_constant",
    "mp_escape",
    "mp_jacobian",
    "mp_orbit",
]

Float = NDArray[np.float64]

# Applications beyond the limit, for points outside that have not reached the distance bailout at the limit.
EXTRA_APPLICATIONS = 64


def apply(
    bound: BoundFormula,
    state: Sequence[Any],
    constant: Sequence[Any],
    backend: Backend,
    *,
    number: int = 0,
    carried: Sequence[str] | None = None,
) -> list[Any]:
    """One application: the map with its repeats, then C (`constant`) added unless nothing is to be.

    Args:
        state: the numbers of z, and behind them those that are carried.
        number: the application's, from 0.
        carried: the names of the latter; None: those of the formula.
    """
    return applied(bound, state, constant, backend, number=number, carried=carried)[0]


def applied(
    bound: BoundFormula,
    state: Sequence[Any],
    constant: Sequence[Any],
    backend: Backend,
    *,
    number: int = 0,
    carried: Sequence[str] | None = None,
) -> tuple[list[Any], dict[str, Any]]:
    """The same, and the values of all names that a scalar rule for the derivative may use."""
    formula = bound.formula
    size = len(formula.variables)
    if carried is None:
        carried = [each.name for each in formula.state]
    if formula.steps:
        return _apply_steps(bound, state, constant, backend, number, carried)
    fixed = {name: float(value) for name, value in bound.values.items()}
    names: dict[str, Any] = {
        APPLICATION: float(number),
        **fixed,
        **{point_name(v): c for v, c in zip(formula.variables, constant, strict=True)},
    }
    state, beside = list(state[:size]), list(state[size:])
    for _ in range(bound.repeat):
        names.update(zip(formula.variables, state, strict=True))
        for name, node in formula.let:
            names[name] = evaluate(node, names, backend)
        state = [evaluate(node, names, backend) for node in formula.map]
    return [*_added(bound, state, constant, backend), *beside], names


def _added(bound: BoundFormula, state: Sequence[Any], constant: Sequence[Any], backend: Backend) -> list[Any]:
    if bound.add == "none":
        return list(state)
    return [backend.call("add", [z, c]) for z, c in zip(state, constant, strict=True)]


def _apply_steps(
    bound: BoundFormula,
    state: Sequence[Any],
    constant: Sequence[Any],
    backend: Backend,
    number: int,
    carried: Sequence[str],
) -> tuple[list[Any], dict[str, Any]]:
    """An application of a formula that is told in statements."""
    formula = bound.formula
    own = {each.name for each in formula.state}
    names: dict[str, Any] = {
        APPLICATION: float(number),
        **{name: float(value) for name, value in bound.values.items()},
        **{point_name(v): c for v, c in zip(formula.variables, constant, strict=True)},
        **dict(zip(formula.variables, state, strict=False)),
    }
    beside = dict(zip(carried, state[len(formula.variables) :], strict=True))
    names.update({name: value for name, value in beside.items() if name in own})
    run(formula.steps, names, backend)
    z = _added(bound, [names[name] for name in formula.variables], constant, backend)
    return [*z, *(names[name] if name in own else value for name, value in beside.items())], names


def carried_at_start(chain: Chain, point: Sequence[Any], backend: Backend) -> list[Any]:
    """The numbers that go on beside z, before the first application."""
    found = []
    for name in chain.carried:
        index, node = chain.begins(name)
        bound = chain.links[index].bound
        values = {name: float(value) for name, value in bound.values.items()}
        values.update(zip(bound.formula.variables[:3], point, strict=False))
        found.append(evaluate(node, values, backend))
    return found


def space_to_state(chain: Chain, point: Sequence[Any], backend: Backend) -> list[Any]:
    """A point in space as a state: with the slice's fourth coordinate for four variables."""
    if chain.size == 3:
        return list(point)
    formula = chain.first.formula
    if formula.slice is None:
        return [*point, 0.0]
    names = {**chain.first.values, **dict(zip(formula.variables, point, strict=False))}
    return [*point, evaluate(formula.slice, names, backend)]


def constant_of(bound: BoundFormula, point: Sequence[Any]) -> Sequence[Any]:
    """C: the Julia constant, or the point in space as a state."""
    return list(bound.julia) if bound.julia is not None else point


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
        alive = _norm(state[:size]) <= radius
        for application in range(iterations):
            index = np.flatnonzero(alive)
            if not len(index):
                break
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
    raw = space_to_state(chain, list(columns), backend)
    point = [np.array(np.broadcast_to(p, columns[0].shape), dtype=float) for p in raw]
    state = [np.zeros_like(p) if chain.add == "point" else p.copy() for p in point]
    beside = carried_at_start(chain, point, backend)
    state += [np.array(np.broadcast_to(each, columns[0].shape), dtype=float) for each in beside]
    return state, point


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
    point = [_full(p, shape) for p in space_to_state(chain, seeded(list(columns)), backend)]
    zero = _full(0.0, shape)
    state = [zero] * chain.size if chain.add == "point" else list(point)
    state += [_full(each, shape) for each in carried_at_start(chain, point, backend)]
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
        state = [_select(alive, _full(n, shape), z) for n, z in zip(new, state, strict=True)]
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
    c = [number(p) for p in space_to_state(chain, list(point), backend)]
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
