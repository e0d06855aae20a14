"""One application of a formula, and what stands before the first, with any kind of number."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from clfractal.formulas.blocks import run
from clfractal.formulas.chain import Chain
from clfractal.formulas.definition import BoundFormula, point_name
from clfractal.formulas.evaluate import Backend, evaluate
from clfractal.formulas.names import APPLICATION


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
