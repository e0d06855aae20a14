"""Follows a fragment's distance: what is before its orbit's loop, in a turn of it, and behind it.

The loop that is the orbit's is the one around which there is no other, and which does most. Its turns become applications
of a formula: they are followed once, from names for what the turn before has left.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from clfractal.errors import FileError
from clfractal.exchange.glsl_run import Flow, GlslRun, Kept
from clfractal.exchange.glsl_symbols import leaves_of, rebuilt
from clfractal.exchange.glsl_tree import Expression, Statement
from clfractal.exchange.glsl_walk import all_of, assigned
from clfractal.exchange.symbols import COMPARISONS, Symbol, Value

MAX_COUNT = 10_000
TURN = "n"
"""The name of a turn's number."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """A number that a turn leaves to the next one: `start` before the first, `end` after a turn, from those before it."""

    start: Value
    end: Value


@dataclass(frozen=True, slots=True)
class Orbit:
    """The orbit's loop.

    Attributes:
        count: its turns.
        leaves: what turns leave to the next one, by the names of symbols.
        exit: whether a turn is the last one, from what is before it; 0: there are always `count`.
        enters: whether there is a first turn.
        groups: of each variable the names of its numbers.
        ends: of each variable its numbers after a turn.
    """

    count: int
    leaves: dict[str, Leaf]
    exit: Value
    enters: Value
    groups: dict[str, list[str]]
    ends: dict[str, list[Value]]


@dataclass
class OrbitRun(GlslRun):
    """A run that knows the orbit's loop.

    Attributes:
        loop: the orbit's; None: there is none.
        orbit: what was found in it.
    """

    loop: Statement | None = None
    orbit: Orbit | None = None

    def turns(self, statement: Statement) -> None:
        if statement is self.loop and self.orbit is None and not self.within:
            _Loop(self, statement).follow()
        else:
            super().turns(statement)


class _Loop:
    """Follows the orbit's loop."""

    def __init__(self, run: OrbitRun, statement: Statement) -> None:
        self.run, self.statement = run, statement
        where = statement.where
        known = [name for name in sorted(assigned([statement], run.code)) if run.scope_of(name) is not None]
        self.returns = any(each.kind == "return" for each in all_of([statement]))
        self.before = run.kept()
        self.starts = {name: run.variable(name, where).value for name in known}
        self.groups = {
            name: [f"{name} {place}" for place in range(len(leaves_of(start)))]
            for name, start in self.starts.items()
        }
        self.first = {
            symbol: value
            for name, symbols in self.groups.items()
            for symbol, value in zip(symbols, leaves_of(self.starts[name]), strict=True)
        }
        self.heads: dict[str, Value] = {each: run.symbols.name(each) for each in self.first}
        self.bounds: list[Expression] = []
        self.stop: Value = 0.0

    def follow(self) -> None:
        run, first = self.run, self.first
        ends = self.turn()
        while True:
            same = {each for each in ends if each in first and ends[each] is self.heads[each]}
            same = {each for each in same if self.heads[each] is run.symbols.name(each)}
            if not same:
                break
            self.heads |= {each: first[each] for each in same}
            ends = self.turn()
        counters = self.counters(ends)
        count = self.count(counters)
        for each, step in counters.items():
            grown = run.symbols.call("*", step, run.symbols.name(TURN))
            self.heads[each] = run.symbols.call("+", first[each], grown)
        ends = self.turn()
        leaving = run.symbols.either(self.stop, run.symbols.opposite(self.rest()))
        changing = [each for each in first if each in counters or self.heads[each] is run.symbols.name(each)]
        leaves = {each: Leaf(first[each], ends[each]) for each in changing}
        leaves |= {each: Leaf(0.0, ends[each]) for each in ends if each not in first}
        whole = {name: [ends[each] for each in symbols] for name, symbols in self.groups.items()}
        run.restore(_copied(self.before))
        run.flow = Flow()
        enters = 1.0 if self.statement.late else self.rest()
        run.orbit = Orbit(count, leaves, leaving, enters, self.groups, whole)
        # What is behind the loop begins with what its last turn has left.
        run.restore(_copied(self.before))
        final: dict[str, Value] = {}
        for each in first:
            start = first[each]
            known = each in counters and leaving == 0.0 and isinstance(start, float)
            if known and isinstance(start, float):
                final[each] = start + counters[each] * count
            else:
                final[each] = run.symbols.name(each) if each in leaves else start
        self.set(final)
        run.flow = Flow()
        if self.returns:
            run.flow.returned = run.symbols.condition(run.symbols.name("returned"))
            run.flow.value = run.symbols.name("return")

    def set(self, values: dict[str, Value]) -> None:
        """Gives all variables that the loop changes their numbers."""
        for name, symbols in self.groups.items():
            self.run.set(
                name, rebuilt(self.starts[name], [values[each] for each in symbols]), self.statement.where
            )

    def turn(self) -> dict[str, Value]:
        """The numbers after a turn, from `heads` before it; `stop` is whether it leaves the loop by itself."""
        run, statement = self.run, self.statement
        run.restore(_copied(self.before))
        self.set(self.heads)
        run.flow = Flow()
        if self.returns:
            run.flow.value = run.symbols.name("return")
        run.loops += 1
        run.within += 1
        if statement.values and not statement.late:
            run.condition(statement.values[0])
        run.turn(statement)
        run.loops -= 1
        run.within -= 1
        ends: dict[str, Value] = {}
        for name, symbols in self.groups.items():
            found = leaves_of(run.variable(name, statement.where).value)
            ends |= zip(symbols, found, strict=True)
        if self.returns:
            ends["returned"] = run.plain(run.flow.returned)
            ends["return"] = run.scalar_of(run.flow.value)
        self.stop = run.symbols.either(run.flow.left, run.flow.returned)
        run.flow = Flow()
        return ends

    def rest(self) -> Value:
        """What the loop's condition asks for beside its count, from what is there now."""
        found: Value = 1.0
        for part in _joined(self.statement.values):
            if not any(part is each for each in self.bounds):
                found = self.run.symbols.both(found, self.run.condition(part))
        return found

    # --- counting

    def counters(self, ends: dict[str, Value]) -> dict[str, float]:
        """The numbers that grow evenly as long as the loop is not left, and by how much."""
        found: dict[str, float] = {}
        leaving = set(_parts(self.stop))
        for each, end in ends.items():
            if each not in self.first or not isinstance(self.first[each], float):
                continue
            while isinstance(end, Symbol) and end.operation == "where" and end.parts[0] in leaving:
                end = end.parts[2]
            step = self.step(end, self.run.symbols.name(each))
            if step:
                found[each] = step
        return found

    def step(self, end: Value, symbol: Symbol) -> float:
        """How much is added to a symbol; 0: that is not what is done."""
        if not isinstance(end, Symbol) or end.operation not in ("+", "-") or end.parts[0] is not symbol:
            return 0.0
        by = end.parts[1]
        return (by if end.operation == "+" else -by) if isinstance(by, float) else 0.0

    def count(self, counters: dict[str, float]) -> int:
        """The turns that the condition allows.

        Raises:
            FixError: parameters say it.
            FileError: nothing limits them, or there are too many.
        """
        run = self.run
        run.restore(_copied(self.before))
        self.set(self.heads)
        found: int | None = None
        for part in _joined(self.statement.values):
            holds = run.condition(part)
            if not isinstance(holds, Symbol) or holds.operation not in COMPARISONS:
                continue
            each = next(
                (name for name in counters if any(p is run.symbols.name(name) for p in holds.parts)), None
            )
            if each is None:
                continue
            place = 0 if holds.parts[0] is run.symbols.name(each) else 1
            bound = holds.parts[1 - place]
            if not isinstance(bound, float):
                run.fix(bound)
                continue
            self.bounds.append(part)
            turns = self.turns_to(holds.operation, place, bound, self.first[each], counters[each])
            found = turns if found is None else min(found, turns)
        run.here = self.statement.where
        if found is None:
            run.refuse("a loop whose turns no number limits")
        return found

    def turns_to(self, sign: str, place: int, bound: float, start: Value, step: float) -> int:
        """How many turns a comparison of what counts allows."""
        assert isinstance(start, float)
        here, turns = start, 0
        late = self.statement.late
        while turns <= MAX_COUNT:
            pair = (here, bound) if place == 0 else (bound, here)
            if not (late and turns == 0) and not self.run.call(sign, *pair):
                return turns
            here += step
            turns += 1
        raise FileError(f"a loop has more than {MAX_COUNT:,} turns", self.statement.where)


def _joined(values: Sequence[Expression]) -> list[Expression]:
    """The parts of a condition that all must hold."""
    found: list[Expression] = []
    stack = [*values]
    while stack:
        part = stack.pop(0)
        if part.kind == "operator" and part.name == "&&":
            stack = [*part.parts, *stack]
        else:
            found.append(part)
    return found


def _parts(condition: Value) -> Iterator[Value]:
    """A condition, and what it is joined of."""
    yield condition
    if isinstance(condition, Symbol) and condition.operation in ("or", "and"):
        for part in condition.parts:
            yield from _parts(part)


def _copied(kept: Kept) -> Kept:
    flow = kept.flow
    return Kept(
        dict(kept.outer),
        [dict(scope) for scope in kept.scopes],
        Flow(flow.left, flow.continued, flow.returned, flow.value),
    )
