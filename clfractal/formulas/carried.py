"""Which carried numbers go with z over dual numbers, and which of them have partials."""

from __future__ import annotations

from typing import Literal

from clfractal.formulas.blocks import flat_behind, trimmed
from clfractal.formulas.chain import Chain
from clfractal.formulas.definition import Formula
from clfractal.formulas.names import APPLICATION
from clfractal.formulas.nodes import Node, names_in


def carried_over_duals(chain: Chain) -> dict[str, Literal["real", "dual"]]:
    """The type of each number that z, or what tells the last solid, depends on in later applications."""
    needed = _needed(chain)
    flat = _flat(chain)
    return {name: "real" if name in flat else "dual" for name in chain.carried if name in needed}


def names_at_end(formula: Formula, node: Node) -> frozenset[str]:
    """What an expression of the last z depends on, names of `let` filled in."""
    let = dict(formula.let)
    found: set[str] = set()
    pending = list(names_in(node))
    while pending:
        name = pending.pop()
        if name not in found:
            found.add(name)
            pending += names_in(let[name]) if name in let else ()
    return frozenset(found)


def _needed(chain: Chain) -> frozenset[str]:
    carried = frozenset(chain.carried)
    needed: frozenset[str] = frozenset()
    for index in chain.may_tell_solid(ruled=False):
        formula = chain.links[index].bound.formula
        node = formula.distance if chain.rule_index is not None else formula.shape
        assert node is not None
        needed |= names_at_end(formula, node) & carried
    while True:
        grown = needed
        for link in chain.links:
            formula = link.bound.formula
            if formula.steps:
                grown |= trimmed(formula.steps, needed | {*formula.variables})[1] & carried
        if grown == needed:
            return needed
        needed = grown


def _flat(chain: Chain) -> frozenset[str]:
    flat = set()
    for name in chain.carried:
        index, start = chain.begins(name)
        if names_in(start) <= chain.links[index].bound.values.keys():
            flat.add(name)
    while True:
        after = frozenset(flat)
        for link in chain.links:
            formula = link.bound.formula
            if formula.steps:
                known = frozenset({*link.bound.values, APPLICATION, *flat}) - {*formula.variables}
                own = {each.name for each in formula.state}
                after &= flat_behind(formula.steps, known) | (after - own)
        if after == flat:
            return after
        flat = set(after)
