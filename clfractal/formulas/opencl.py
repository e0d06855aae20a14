"""Writes a chain of formulas as OpenCL C over packets: the functions that `orbit.h` iterates.

The text depends on the expressions, and on two facts that follow from values: whether the degree is above 1, and whether
f(0) is a finite number. Everything else is in `constants`, the values of the kernel argument `k`: parameters, and the turns
of a chain. So a text is written once for all values of its parameters, and changing one needs no compilation. Where values
choose between ways to compute, an application is written twice: for the usual values, which are literals then, and for any.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from clfractal.formulas.chain_ends import Leaf, passed
from clfractal.formulas.chain_writer import ChainWriter, DualMap
from clfractal.formulas.costs import OPERATIONS, count_of_operations
from clfractal.formulas.evaluate import as_function, finite
from clfractal.formulas.functions import Facts, link_name
from clfractal.formulas.language import Chain

__all__ = ["DualMap", "FormulaText", "Leaf", "forget_texts", "operations_per_application", "write_formula"]


@dataclass(frozen=True, slots=True)
class FormulaText:
    """A chain in OpenCL C.

    Attributes:
        text: the definitions that `orbit.h` expects before it; of a leaf its functions alone. Equal texts are one
            object.
        constants: values of the run-time array `k`, in order; never empty.
    """

    text: str
    constants: tuple[float, ...]
    facts: Facts

    @property
    def has_derivative(self) -> bool:
        """Every link carries a scalar rule, so marching needs no Jacobian."""
        return self.facts.has_derivative


@lru_cache(maxsize=16)
def write_formula(
    chain: Chain, *, scalar_rule: bool = True, dual_map: DualMap = "cheapest", leaf: Leaf | None = None
) -> FormulaText:
    """The chain's functions over `real` and `dual`; as a leaf, under names of its own.

    `scalar_rule=False` leaves out the formulas' own derivative, so that marching uses the Jacobian throughout.
    A map that uses the point (`point_x`) is always written operation by operation.

    Writing takes milliseconds, so texts are kept: for other parameter values only the constants are computed.
    """
    chain = chain.as_written
    if chain.place is not None and chain.degree > 1:
        # A rule of one number takes the map for one that keeps angles. After as many applications it does not.
        scalar_rule = False
    asked = _Asked((chain.structure, chain.facts), chain)
    return _written(asked, scalar_rule, dual_map, leaf).filled(chain)


def forget_texts() -> None:
    """Forgets all kept texts."""
    write_formula.cache_clear()
    _written.cache_clear()


@dataclass(frozen=True, slots=True)
class _Asked:
    """A chain whose text is asked for: chains of one structure, whatever their parameters' values are, are one question."""

    structure: tuple[object, ...]
    chain: Chain = field(compare=False)


@dataclass(frozen=True, slots=True)
class _Written:
    """A text for all values of its parameters.

    Attributes:
        owners: of each run-time constant whose it is, its value by the link's parameters (None: it is no expression), and
            whether it must be a finite number.
    """

    text: str
    facts: Facts
    owners: tuple[tuple[object, Callable[[Mapping[str, float]], Any] | None, bool], ...]

    def filled(self, chain: Chain) -> FormulaText:
        """The text with the chain's constants."""
        constants = []
        for owner, function, strict in self.owners:
            if function is None:
                assert isinstance(owner, tuple)
                constants.append(passed(chain, *owner, behind=len(self.owners)))
            else:
                assert isinstance(owner, int)
                value = function(chain.links[owner].bound.values)
                constants.append(finite(value) if strict else float(value))
        if chain.turns_are_data:
            constants += map(float, chain.table[0])
        if chain.place is not None:
            from clfractal.formulas.deep_table import table_of  # which asks for many digits

            constants += table_of(chain)
        return FormulaText(self.text, tuple(constants) or (0.0,), self.facts.of(chain))


@lru_cache(maxsize=512)
def _one(text: str) -> str:
    """One object for equal texts, so that comparing them takes no time."""
    return text


@lru_cache(maxsize=64)
def _written(asked: _Asked, scalar_rule: bool, dual_map: DualMap, leaf: Leaf | None) -> _Written:
    text, facts, constants = ChainWriter(asked.chain, scalar_rule, dual_map, leaf).write()
    owners = (
        (owner, as_function(node) if node is not None else None, slot in constants.strict)
        for slot, (owner, node) in enumerate(constants.owners)
    )
    return _Written(_one(text), facts, tuple(owners))


def operations_per_application(chain: Chain) -> float:
    """Arithmetic operations of one application as rays march by it, averaged over the chain's cycle.

    A fused multiply-add counts as two, a root or a division as one; comparisons and selections do not count.
    """
    chain = chain.as_written
    formula = write_formula(chain)
    prefix = "derivative" if formula.has_derivative else "dual"
    prefix = prefix if chain.rule_index is None else "real"
    usual = all(link.bound.has_usual_values for link in chain.links)
    total = 0.0
    for index in chain.spans[-1].members:
        link = chain.links[index]
        name = link_name(prefix, index, usual and bool(link.bound.formula.shaping))
        body = formula.text.partition(f" {name}(")[2].partition("\n}")[0]
        total += link.count * link.bound.repeat * count_of_operations(body, OPERATIONS)
    return total / chain.cycle_length
