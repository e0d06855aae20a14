"""What the tree of a fragment's code holds: what it changes, and which of its loops is the orbit's."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from clfractal.exchange.glsl_tree import Code, Expression, Function, Statement

LEAST_TURNS = 3
"""Of the orbit's loop; others of so few turns are followed turn by turn."""


def assigned(statements: Iterable[Statement], code: Code) -> set[str]:
    """The variables that statements may change, with those that functions they call may change outside of themselves."""
    found: set[str] = set()
    called: set[str] = set()
    for expression in expressions_of(statements):
        if expression.kind in ("assign", "before", "after"):
            found.add(_root(expression.parts[0]))
        elif expression.kind == "call" and expression.name in code.functions:
            for function in code.functions[expression.name]:
                outs = zip(function.arguments, expression.parts, strict=False)
                found |= {_root(part) for argument, part in outs if argument.out}
            called.add(expression.name)
    # Functions change variables outside of functions alone.
    seen: set[str] = set()
    while called - seen:
        name = min(called - seen)
        seen.add(name)
        for function in code.functions[name]:
            for expression in expressions_of(function.body):
                if expression.kind in ("assign", "before", "after"):
                    found.add(_root(expression.parts[0]))
                elif expression.kind == "call" and expression.name in code.functions:
                    called.add(expression.name)
    return found


def all_of(statements: Iterable[Statement]) -> Iterator[Statement]:
    """Statements, and those within them."""
    stack = [*statements]
    while stack:
        statement = stack.pop()
        yield statement
        stack += (each for block in statement.blocks for each in block)


def expressions_of(statements: Iterable[Statement]) -> Iterator[Expression]:
    """The expressions of statements, and those within them."""
    stack = [value for statement in all_of(statements) for value in statement.values]
    while stack:
        expression = stack.pop()
        yield expression
        stack += expression.parts


def _root(target: Expression) -> str:
    while target.kind in ("member", "item"):
        target = target.parts[0]
    return target.name


def orbit_loop(function: Function, code: Code, values: Mapping[str, tuple[float, ...]]) -> Statement | None:
    """The loop of a function, or of those that it calls, that is in no other one, and does most; None: there is none.

    Args:
        values: those of the uniforms.
    """
    numbers = {name: found[0] for name, found in values.items() if len(found) == 1}
    for statement in code.statements:
        if statement.type == "int" and statement.values and statement.values[0].kind == "number":
            numbers.setdefault(statement.name, statement.values[0].number)
    best: tuple[float, Statement | None] = (0.0, None)
    seen: set[str] = set()
    pending: list[Sequence[Statement]] = [function.body]
    while pending:
        for loop, called in _outer(pending.pop()):
            if loop is None:
                if called in code.functions and called not in seen:
                    seen.add(called)
                    pending += [each.body for each in code.functions[called]]
                continue
            turns = _turns(loop, numbers)
            work = turns * _size(loop.blocks[2], code)
            if turns >= LEAST_TURNS and work > best[0]:
                best = (work, loop)
    return best[1]


def _outer(statements: Iterable[Statement]) -> Iterator[tuple[Statement | None, str]]:
    """Loops that are in no other one, and the names of what is called outside of loops."""
    stack = list(statements)
    while stack:
        statement = stack.pop()
        if statement.kind == "loop":
            yield statement, ""
            continue
        yield from ((None, name) for name in _called(statement.values))
        stack += [each for block in statement.blocks for each in block]


def _called(expressions: Iterable[Expression]) -> Iterator[str]:
    stack = list(expressions)
    while stack:
        expression = stack.pop()
        if expression.kind == "call":
            yield expression.name
        stack += expression.parts


def _turns(loop: Statement, numbers: Mapping[str, float]) -> float:
    """About how many turns a loop has: the largest number that its counter may be compared with."""
    found = 0.0
    stack = [*loop.values]
    while stack:
        expression = stack.pop()
        if expression.kind == "name":
            found = max(found, numbers.get(expression.name, 0.0))
        elif expression.kind == "number" and expression.whole:
            found = max(found, expression.number)
        stack += expression.parts
    return found


def _size(statements: Sequence[Statement], code: Code) -> int:
    """How much is done in statements, with the functions that they call once each."""
    found = 0
    seen: set[str] = set()
    pending = [statements]
    while pending:
        for expression in expressions_of(pending.pop()):
            found += 1
            if (
                expression.kind == "call"
                and expression.name in code.functions
                and expression.name not in seen
            ):
                seen.add(expression.name)
                pending += [function.body for function in code.functions[expression.name]]
    return found
