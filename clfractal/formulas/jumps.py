"""Where an application has no slope: the conditions of z in it, and functions that jump."""

from __future__ import annotations

from clfractal.formulas.blocks import leaves_in, nodes_of
from clfractal.formulas.definition import Formula, point_name
from clfractal.formulas.nodes import COMPARISONS, Call, Node, names_in, to_text, walk

_JUMPING = frozenset(("floor", "mod", "sign"))
_LONGEST = 60


def jumps_of(formula: Formula) -> tuple[str, ...]:
    """Conditions, and functions, whose value may jump where z moves a little: as texts, in the order of the formula."""
    moving = {*formula.variables, *map(point_name, formula.variables), *(each.name for each in formula.state)}
    nodes: list[Node]
    if formula.steps:
        moving |= {name for name, leaves in leaves_in(formula.steps).items() if leaves & moving}
        nodes = list(nodes_of(formula.steps))
    else:
        for name, node in formula.let:
            moving |= {name} if names_in(node) & moving else set()
        nodes = [*(node for _, node in formula.let), *formula.map]
    found: dict[str, None] = {}
    for node in nodes:
        for part in walk(node):
            jumps = isinstance(part, Call) and (part.function in COMPARISONS or part.function in _JUMPING)
            if jumps and names_in(part) & moving:
                text = to_text(part)
                found[text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."] = None
    return tuple(found)
