"""Statements of a formula's `do`: assignments, conditions, loops; what they do with any kind of number."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

from clfractal.formulas.evaluate import Backend, call_any, evaluate
from clfractal.formulas.nodes import Call, Node, names_in


@dataclass(frozen=True, slots=True)
class Assign:
    """Names that get new values, all at once: each expression is of the values before."""

    names: tuple[str, ...]
    nodes: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class When:
    """Statements that count where a condition holds, and others that count elsewhere."""

    condition: Node
    then: Block
    otherwise: Block


@dataclass(frozen=True, slots=True)
class Loop:
    """Statements that are repeated.

    Attributes:
        turns: how often, of parameters alone; what is no whole number is rounded down, to 0 and `most`.
        turn: the name of the turn's number, from 0, within the body.
        until: before each turn: who leaves the loop; None: nobody does before its end.
    """

    turns: Node
    most: int
    turn: str
    until: Node | None
    body: Block


Statement: TypeAlias = Assign | When | Loop
Block: TypeAlias = tuple[Statement, ...]


def assigned(block: Block) -> tuple[str, ...]:
    """The names that get values somewhere in a block, in the order in which they first do."""
    found: dict[str, None] = {}
    for statement in block:
        if isinstance(statement, Assign):
            found.update(dict.fromkeys(statement.names))
        elif isinstance(statement, When):
            found.update(dict.fromkeys((*assigned(statement.then), *assigned(statement.otherwise))))
        else:
            found.update(dict.fromkeys(assigned(statement.body)))
    return tuple(found)


def nodes_of(block: Block) -> Iterator[Node]:
    """All expressions and conditions of a block."""
    for statement in block:
        if isinstance(statement, Assign):
            yield from statement.nodes
        elif isinstance(statement, When):
            yield statement.condition
            yield from nodes_of(statement.then)
            yield from nodes_of(statement.otherwise)
        else:
            yield statement.turns
            if statement.until is not None:
                yield statement.until
            yield from nodes_of(statement.body)


def turns_in(block: Block) -> Iterator[Node]:
    """What decides which statements are done: the conditions, and the turns of loops."""
    for statement in block:
        if isinstance(statement, When):
            yield statement.condition
            yield from turns_in(statement.then)
            yield from turns_in(statement.otherwise)
        elif isinstance(statement, Loop):
            yield statement.turns
            yield from turns_in(statement.body)


def trimmed(block: Block, wanted: frozenset[str]) -> tuple[Block, frozenset[str]]:
    """The block without statements whose results nobody wants behind it, and the names that it then needs."""
    kept: list[Statement] = []
    for statement in reversed(block):
        if isinstance(statement, Assign):
            pairs = [pair for pair in zip(statement.names, statement.nodes, strict=True) if pair[0] in wanted]
            if pairs:
                wanted = wanted.difference(name for name, _ in pairs)
                wanted = wanted.union(*(names_in(node) for _, node in pairs))
                kept.append(Assign(tuple(name for name, _ in pairs), tuple(node for _, node in pairs)))
            continue
        if wanted.isdisjoint(assigned((statement,))):
            continue
        if isinstance(statement, When):
            then, in_then = trimmed(statement.then, wanted)
            otherwise, in_otherwise = trimmed(statement.otherwise, wanted)
            wanted = in_then | in_otherwise | names_in(statement.condition)
            kept.append(When(statement.condition, then, otherwise))
            continue
        inner = wanted | (names_in(statement.until) if statement.until is not None else frozenset())
        while True:
            body, needs = trimmed(statement.body, inner)
            if needs <= inner | {statement.turn}:
                break
            inner |= needs - {statement.turn}
        wanted = inner | names_in(statement.turns)
        kept.append(Loop(statement.turns, statement.most, statement.turn, statement.until, body))
    return tuple(reversed(kept)), wanted


def turns_of(value: Any, most: int) -> int:
    """How many turns a loop has whose expression has this value."""
    return min(max(math.floor(value), 0), most) if math.isfinite(value) else 0


def run(block: Block, names: dict[str, Any], backend: Backend | None = None) -> None:
    """Gives `names` the values that they have behind the block, in numbers of the backend or as Python floats."""
    for statement in block:
        if isinstance(statement, Assign):
            values = [evaluate(node, names, backend) for node in statement.nodes]
            names.update(zip(statement.names, values, strict=True))
        elif isinstance(statement, When):
            _when(statement, names, backend)
        else:
            _loop(statement, names, backend)


def _when(statement: When, names: dict[str, Any], backend: Backend | None) -> None:
    condition = evaluate(statement.condition, names, backend)
    if isinstance(condition, bool):
        run(statement.then if condition else statement.otherwise, names, backend)
        return
    then, otherwise = dict(names), dict(names)
    run(statement.then, then, backend)
    run(statement.otherwise, otherwise, backend)
    for name in assigned((statement,)):
        if name in then and name in otherwise:
            names[name] = _chosen(condition, then[name], otherwise[name], backend)


def _loop(statement: Loop, names: dict[str, Any], backend: Backend | None) -> None:
    carried = [name for name in assigned(statement.body) if name in names]
    going: Any = True
    for turn in range(turns_of(evaluate(statement.turns, names, backend), statement.most)):
        inner = {**names, statement.turn: float(turn)}
        if statement.until is not None:
            leaves = evaluate(statement.until, inner, backend)
            going = call_any("and", [going, call_any("not", [leaves], backend)], backend)
            if going is False:
                return
        run(statement.body, inner, backend)
        for name in carried:
            names[name] = inner[name] if going is True else _chosen(going, inner[name], names[name], backend)


def _chosen(condition: Any, yes: Any, no: Any, backend: Backend | None) -> Any:
    return yes if yes is no else call_any("where", [condition, yes, no], backend)


# Functions whose slope is 0 wherever they have one.
_LEVEL = frozenset(("sign", "floor"))


def is_flat(node: Node, flat: frozenset[str]) -> bool:
    """Whether an expression has slope 0 everywhere; `flat`: the names that have."""
    if not isinstance(node, Call):
        return names_in(node) <= flat
    if node.function in _LEVEL:
        return True
    parts = node.arguments[1:] if node.function == "where" else node.arguments
    return all(is_flat(part, flat) for part in parts)


def flat_behind(block: Block, flat: frozenset[str]) -> frozenset[str]:
    """The names with slope 0 behind a block; `flat`: those before it. What a condition chooses is of no account."""
    for statement in block:
        if isinstance(statement, Assign):
            level = [n for n, e in zip(statement.names, statement.nodes, strict=True) if is_flat(e, flat)]
            flat = flat.difference(statement.names).union(level)
        elif isinstance(statement, When):
            flat = flat_behind(statement.then, flat) & flat_behind(statement.otherwise, flat)
        else:
            while True:
                after = flat & flat_behind(statement.body, flat | {statement.turn})
                if after == flat:
                    break
                flat = after
    return flat


def leaves_in(block: Block) -> dict[str, frozenset[str]]:
    """Of each name that gets values all names, assigned ones too, that any of its values may depend on."""
    uses: dict[str, set[str]] = {}
    _uses(block, frozenset(), uses)
    while True:
        grown = {name: used.union(*(uses.get(each, ()) for each in used)) for name, used in uses.items()}
        if grown == uses:
            return {name: frozenset(used) for name, used in uses.items()}
        uses = grown


def _uses(block: Block, around: frozenset[str], uses: dict[str, set[str]]) -> None:
    """`around`: the names in conditions that surround the block."""
    for statement in block:
        if isinstance(statement, Assign):
            for name, node in zip(statement.names, statement.nodes, strict=True):
                uses.setdefault(name, set()).update(names_in(node), around)
        elif isinstance(statement, When):
            inner = around | names_in(statement.condition)
            _uses(statement.then, inner, uses)
            _uses(statement.otherwise, inner, uses)
        else:
            inner = around | names_in(statement.turns)
            inner |= names_in(statement.until) if statement.until is not None else frozenset()
            uses.setdefault(statement.turn, set()).add(statement.turn)
            _uses(statement.body, inner, uses)
