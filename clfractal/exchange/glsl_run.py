"""Follows the statements of a fragment's code; what depends on conditions becomes choices.

Of its loops one, the orbit's, is followed once, for any of its turns: `glsl_orbit` does that. All others are followed
turn by turn.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from clfractal.errors import FileError
from clfractal.exchange.glsl_tree import Expression, Function, Statement
from clfractal.exchange.glsl_values import GlslValues, Scope
from clfractal.exchange.symbols import Value, names_in

MAX_STEPS = 30_000
MAX_TURNS = 64
MAX_CALLS = 20


@dataclass
class Flow:
    """How far a function is left: conditions, and what it returns."""

    left: Value = 0.0
    continued: Value = 0.0
    returned: Value = 0.0
    value: object = None


@dataclass
class Kept:
    """Everything that a branch may change."""

    outer: Scope
    scopes: list[Scope]
    flow: Flow


class FixError(Exception):
    """Parameters must be numbers: loops end by them."""

    def __init__(self, names: set[str]) -> None:
        super().__init__()
        self.names = names


@dataclass
class GlslRun(GlslValues):
    """A text that is being followed.

    Attributes:
        parameters: the names of what the user may choose.
        steps: how many statements were followed.
        loops: how many loops of the function are around the statement.
        within: how many loops of all functions are.
    """

    parameters: frozenset[str] = frozenset()
    flow: Flow = field(default_factory=Flow)
    steps: int = 0
    loops: int = 0
    within: int = 0
    calls: int = 0

    # --- branches

    def kept(self) -> Kept:
        flow = self.flow
        return Kept(
            dict(self.outer),
            [dict(scope) for scope in self.scopes],
            Flow(flow.left, flow.continued, flow.returned, flow.value),
        )

    def restore(self, kept: Kept) -> None:
        self.outer, self.scopes, self.flow = kept.outer, kept.scopes, kept.flow

    def branch(self, condition: Value, yes: Callable[[], None], no: Callable[[], None] | None = None) -> None:
        """Goes two ways, and chooses between what is there after them."""
        if isinstance(condition, float):
            if condition:
                yes()
            elif no is not None:
                no()
            return
        other = self.kept()
        yes()
        one = self.kept()
        self.restore(other)
        if no is not None:
            no()
        self.mix(condition, one)

    def mix(self, condition: Value, one: Kept) -> None:
        """Chooses between what a branch left, where the condition holds, and what is there."""
        for mine, theirs in zip((self.outer, *self.scopes), (one.outer, *one.scopes), strict=True):
            for name, variable in mine.items():
                other = theirs.get(name, variable)
                if other is not variable and other.value is not variable.value:
                    mixed = self.mixed(condition, other.value, variable.value)
                    mine[name] = type(variable)(variable.type, variable.size, mixed)
        picked = self.symbols.picked
        flow = self.flow
        flow.left = picked(condition, one.flow.left, flow.left)
        flow.continued = picked(condition, one.flow.continued, flow.continued)
        flow.value = self.mixed(condition, one.flow.value, flow.value)
        flow.returned = picked(condition, one.flow.returned, flow.returned)

    def stopped(self) -> Value:
        """Whether nothing behind is done."""
        either = self.symbols.either
        return either(either(self.flow.left, self.flow.continued), self.flow.returned)

    # --- statements

    def block(self, statements: Sequence[Statement]) -> None:
        """Follows statements; what they declare is known within them only."""
        self.scopes.append({})
        self.follow(statements)
        self.scopes.pop()

    def follow(self, statements: Sequence[Statement]) -> None:
        for place, statement in enumerate(statements):
            self.here = statement.where
            self.steps += 1
            if self.steps > MAX_STEPS:
                raise FileError("has too many steps", statement.where)
            getattr(self, f"_statement_{statement.kind}")(statement)
            stop = self.stopped()
            if stop == 1.0:
                return
            rest = statements[place + 1 :]
            if not isinstance(stop, float) and rest:
                self.guarded(stop, rest)
                return

    def guarded(self, stop: Value, rest: Sequence[Statement]) -> None:
        """Follows what is behind a condition by which a block was left."""

        def go() -> None:
            self.flow.left = self.flow.continued = self.flow.returned = 0.0
            self.follow(rest)

        self.branch(self.symbols.opposite(stop), go)

    def _statement_block(self, statement: Statement) -> None:
        self.block(statement.blocks[0])

    def _statement_do(self, statement: Statement) -> None:
        self.value(statement.values[0])

    def _statement_declare(self, statement: Statement) -> None:
        value = self.value(statement.values[0]) if statement.values else None
        self.here = statement.where
        if value is None:
            value = self.empty(statement.type, statement.size)
        self.declare(statement.name, statement.type, statement.size, value)

    def _statement_if(self, statement: Statement) -> None:
        condition = self.condition(statement.values[0])
        yes, no = statement.blocks
        self.branch(condition, lambda: self.block(yes), lambda: self.block(no))

    def _statement_leave(self, statement: Statement) -> None:
        if not self.loops:
            self.refuse(f"{statement.name} outside of a loop")
        if statement.name == "break":
            self.flow.left = 1.0
        else:
            self.flow.continued = 1.0

    def _statement_return(self, statement: Statement) -> None:
        self.flow.value = self.value(statement.values[0]) if statement.values else None
        self.flow.returned = 1.0

    def _statement_switch(self, statement: Statement) -> None:
        chosen = self.number(statement.values[0])
        if not isinstance(chosen, float):
            self.fix(chosen)
        cases = statement.blocks[0]
        labels = [[self.number(label) for label in case.values] for case in cases]
        first = next((i for i, each in enumerate(labels) if chosen in each), None)
        if first is None:
            first = next((i for i, each in enumerate(labels) if not each), len(cases))
        self.loops += 1
        outer, self.flow.left = self.flow.left, 0.0
        self.block([each for case in cases[first:] for each in case.blocks[0]])
        self.flow.left = outer
        self.loops -= 1

    def _statement_loop(self, statement: Statement) -> None:
        self.scopes.append({})
        self.follow(statement.blocks[0])
        self.turns(statement)
        self.scopes.pop()

    def turns(self, statement: Statement) -> None:
        """Follows a loop turn by turn."""
        before, self.flow.left = self.flow.left, 0.0
        self.loops += 1
        self.within += 1
        self.turns_from(statement, 0)
        self.loops -= 1
        self.within -= 1
        self.flow.left = before

    def turns_from(self, statement: Statement, turn: int) -> None:
        """A turn of a loop, and those behind it: within each it is known that the one before was not the last."""
        condition = self.head(statement, first=turn == 0)
        going = self.symbols.both(self.symbols.opposite(self.stopped()), condition)
        if going == 0.0:
            return
        if turn == MAX_TURNS:
            self.fix(going)
            raise FileError(f"a loop has more than {MAX_TURNS} turns", statement.where)

        def go() -> None:
            self.turn(statement)
            self.turns_from(statement, turn + 1)

        self.branch(going, go)

    def head(self, statement: Statement, *, first: bool) -> Value:
        """Whether a loop goes on."""
        if not statement.values or (statement.late and first):
            return 1.0
        found = self.condition(statement.values[0])
        if not isinstance(found, float) and names_in([found]) <= self.parameters:
            self.fix(found)
        return found

    def turn(self, statement: Statement) -> None:
        """A turn of a loop, with its step."""
        self.flow.left = self.flow.continued = self.flow.returned = 0.0
        self.block(statement.blocks[2])
        self.flow.continued = 0.0
        step = statement.blocks[1]
        stop = self.stopped()
        if isinstance(stop, float):
            if not stop:
                self.follow(step)
            return
        self.guarded(stop, step)

    def fix(self, value: Value) -> None:
        """Asks for the numbers of the parameters that a value depends on."""
        found = names_in([value]) & self.parameters
        if found:
            raise FixError(found)

    # --- calls

    def called(self, function: Function, values: list[object], expression: Expression) -> object:
        self.calls += 1
        if self.calls > MAX_CALLS:
            raise FileError("functions call each other too deep", expression.where)
        outer = self.scopes, self.flow, self.loops
        inner: Scope = {}
        self.scopes, self.flow, self.loops = [inner], Flow(), 0
        for argument, value in zip(function.arguments, values, strict=True):
            given = value if argument.given else self.empty(argument.type, argument.size)
            self.declare(argument.name, argument.type, argument.size, given)
        depth = self.depth
        self.block(function.body)
        self.depth = depth
        result = self.flow.value
        changed = [(argument, self.scopes[0][argument.name].value) for argument in function.arguments]
        self.scopes, self.flow, self.loops = outer
        self.calls -= 1
        for (argument, value), part in zip(changed, expression.parts, strict=True):
            if argument.out:
                self.store(part, value)
        self.here = expression.where
        if result is None and function.type != "void":
            self.refuse(f"{function.name[:60]}, which returns nothing,")
        return result
