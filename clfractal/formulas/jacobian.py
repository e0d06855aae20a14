"""A map over dual numbers by its own Jacobian: real statements, and a row of products for each component."""

from __future__ import annotations

from dataclasses import dataclass

from clfractal.formulas.costs import cost_of
from clfractal.formulas.emit import Emitter
from clfractal.formulas.fuse import needed
from clfractal.formulas.partials import Differentiator
from clfractal.formulas.products import Value


@dataclass(frozen=True, slots=True)
class LocalJacobian:
    """Real statements of a map, its values, and their partials by the state.

    Each row is one product of this Jacobian with the J carried along, beginning with the last term: so a coordinate
    that is added needs no operation of its own.
    """

    emitter: Emitter
    mapped: list[Value]
    partials: list[list[Value | None]]

    def rows(self) -> list[str]:
        """A dual expression of each value."""
        return [self.row(i, value.text) for i, value in enumerate(self.mapped)]

    def row(self, i: int, value: str, coordinate: str = "") -> str:
        """The dual expression of component `i`, whose value is `value`, with a coordinate of the point added."""
        terms = [
            f"{partial.text}, z.s{j}" for j, partial in enumerate(self.partials[i]) if partial is not None
        ]
        if not terms:
            return f"dual_coordinate_{coordinate}({value})" if coordinate else f"dual_constant({value})"
        text = f"dual_chain{coordinate and '_' + coordinate}({value}, {terms[-1]})"
        for term in reversed(terms[:-1]):
            text = f"dual_more({text}, {term})"
        return text

    def cost(self) -> int:
        """Of its statements and of the products."""
        terms = sum(partial is not None for row in self.partials for partial in row)
        statements = needed(self.emitter.lines, [f"{row};" for row in self.rows()])[: -len(self.mapped)]
        return cost_of(statements) + terms * cost_of(["= dual_more("])


def local_jacobian(emitter: Emitter, mapped: list[Value], size: int) -> LocalJacobian:
    """The Jacobian of values that an emitter wrote over `real`, by the numbers of the state."""
    differentiator = Differentiator(emitter)
    return LocalJacobian(
        emitter, mapped, [[differentiator.partial(value, j) for j in range(size)] for value in mapped]
    )
