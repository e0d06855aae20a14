"""Reads a formula's `do`: a list of assignments, conditions and loops, every error with its place."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from clfractal.errors import FormulaError, Where
from clfractal.formulas.blocks import Assign, Block, Loop, Statement, When, assigned
from clfractal.formulas.definition import Parameter, inside
from clfractal.formulas.names import check_keys, check_name
from clfractal.formulas.nodes import Call, Name, Node, Number, names_in, walk
from clfractal.formulas.parser import Names, OwnFunction, parse, parse_operand
from clfractal.formulas.sharing import Sharing
from clfractal.formulas.vectors import COMPONENTS, Vector, described

MAX_STATEMENTS = 2_000
MAX_BLOCKS = 16
MAX_TURNS = 64
# Numbers, names and operations of a whole block as it is written, and of an application with all turns.
MAX_WRITTEN = 40_000
MAX_DONE = 400_000
# Loops of so few turns, and so little in them all together, are written turn by turn.
_UNROLLED_TURNS, _UNROLLED_NODES = 8, 800

_WHEN, _LOOP = ("when", "do", "else"), ("loop", "as", "until", "most", "do")
_WORDS = frozenset(("when", "do", "loop", "until", "most"))


class BlockReader:
    """Reads the statements of one formula.

    Args:
        parameters: the formula's.
        fixed: names that a statement may use and cannot change: those of parameters and of what is added.
        moving: names that are not the same for all points and applications.
        functions: the formula's own.
        sharing: gives parts of expressions names.
        where: the place of the list.
    """

    def __init__(
        self,
        parameters: Collection[Parameter],
        fixed: Collection[str],
        moving: Collection[str],
        functions: Mapping[str, OwnFunction],
        sharing: Sharing,
        where: Where,
    ) -> None:
        self.functions, self.sharing = functions, sharing
        self.parameters = {parameter.name: parameter for parameter in parameters}
        self.fixed = frozenset(fixed)
        self.moving = set(moving)
        self.where = where
        self.statements = self.written = self.done = 0
        # The exponents that must be the same everywhere, and their places.
        self.exponents: list[tuple[frozenset[str], str, Where]] = []
        # Of each part that has got a name what it is made of.
        self.parts: dict[str, frozenset[str]] = {}

    def read(self, data: object, known: Collection[str]) -> Block:
        """The block; `known`: the names that have values before it."""
        return self._block(data, set(known), self.where, 1, 1)[0]

    def _block(
        self, data: object, known: set[str], where: Where, depth: int, turns: int
    ) -> tuple[Block, set[str]]:
        if not isinstance(data, (list, tuple)):
            raise FormulaError("must be a list of statements, such as `- x: abs(x)`", where)
        if depth > MAX_BLOCKS:
            raise FormulaError(f"conditions and loops are nested more than {MAX_BLOCKS} deep", where)
        block: list[Statement] = []
        for index, each in enumerate(data):
            here = inside(where, str(index))
            self.statements += 1
            if self.statements > MAX_STATEMENTS:
                raise FormulaError(f"has more than {MAX_STATEMENTS:,} statements", self.where)
            if not isinstance(each, Mapping) or not each:
                raise FormulaError("must be `name: expression`, `when: condition` or `loop: turns`", here)
            if "when" in each:
                statements, known = self._when(each, known, here, depth, turns)
                block += statements
            elif "loop" in each:
                block += self._loop(each, known, here, depth, turns)
            else:
                block += self._assign(each, known, here, depth, turns)
                known = {*known, *assigned(tuple(block[-1:]))}
        return tuple(block), known

    def _assign(
        self, data: Mapping[Any, Any], known: set[str], where: Where, depth: int, turns: int
    ) -> list[Statement]:
        pairs: list[tuple[str, Node]] = []
        for target, text in data.items():
            here = inside(where, str(target))
            names = self._target(target, known, here)
            value = parse_operand(text, names=self._names(known), where=here)
            parts = value.parts if isinstance(value, Vector) else (value,)
            if names is None:
                names = (
                    [f"{target}.{letter}" for letter in COMPONENTS[: len(parts)]]
                    if len(parts) > 1
                    else [target]
                )
            if len(names) != len(parts):
                wanted = f"a vector of {len(names)}" if len(names) > 1 else "a number"
                raise FormulaError(f"{target!r} is {wanted}, but gets {described(value)}", here)
            pairs += zip(names, parts, strict=True)
            if len({name for name, _ in pairs}) < len(pairs):
                raise FormulaError(f"{target!r} is given two values in one statement", here)
        last = inside(where, str(next(reversed(data))))
        shared = self._shared(last, depth, turns)
        for _, node in pairs:
            self._count(node, last, turns)
        self._moves(pairs, depth)
        return [*shared, Assign(tuple(name for name, _ in pairs), tuple(node for _, node in pairs))]

    def _target(self, target: object, known: Collection[str], where: Where) -> list[str] | None:
        """The names that an assignment gives values; None for a name that is new."""
        if target in _WORDS:
            before = {"do": "`when` or `loop`", "until": "`loop`", "most": "`loop`"}.get(
                str(target), f"`{target}`"
            )
            raise FormulaError(f"{target!r} belongs to a statement with {before}", where)
        name, dot, letters = str(target).partition(".")
        if name in self.fixed or f"{name}.x" in self.fixed:
            raise FormulaError(f"{name!r} cannot be given a value here; use another name", where)
        whole = [f"{name}.{letter}" for letter in COMPONENTS if f"{name}.{letter}" in known]
        if not dot:
            if name in known:
                return [name]
            if not whole:
                check_name(target, (), where)
            return whole or None
        names = [f"{name}.{letter}" for letter in letters]
        if not whole or not set(names) <= set(whole) or len(set(names)) < len(names) or not names:
            raise FormulaError(f"{str(target)[:60]!r} is no part of a vector that has a value", where)
        return names

    def _moves(self, pairs: Collection[tuple[str, Node]], depth: int) -> None:
        """Tells names that are the same everywhere from others."""
        moves = [depth > 1 or not names_in(node).isdisjoint(self.moving) for _, node in pairs]
        for (name, _), moving in zip(pairs, moves, strict=True):
            (self.moving.add if moving else self.moving.discard)(name)

    def _shared(self, where: Where, depth: int, turns: int) -> list[Statement]:
        """Assignments of the parts that expressions use several times."""
        found: list[Statement] = []
        for name, node in self.sharing.taken():
            self._count(node, where, turns)
            # (A part is given a value once, before it is used: in a loop, too, it is the same if what it is of is.)
            self._moves([(name, node)], 1)
            self.parts[name] = self._made_of(names_in(node))
            found.append(Assign((name,), (node,)))
        return found

    def _made_of(self, names: frozenset[str]) -> frozenset[str]:
        return frozenset(each for name in names for each in self.parts.get(name, (name,)))

    def _names(self, known: Collection[str], *, shares: bool = True) -> Names:
        return Names(known, self.functions, self.sharing.share if shares else None)

    def _condition(
        self, text: object, known: Collection[str], where: Where, turns: int, *, shares: bool
    ) -> Node:
        if not isinstance(text, str):
            raise FormulaError("must be a condition, such as x > 0", where)
        node = parse(text, names=self._names(known, shares=shares), where=where, condition=True)
        self._count(node, where, turns)
        return node

    def _when(
        self, data: Mapping[Any, Any], known: set[str], where: Where, depth: int, turns: int
    ) -> tuple[list[Statement], set[str]]:
        check_keys(data, _WHEN, where)
        if "do" not in data:
            raise FormulaError("lacks the key 'do': what is done where the condition holds", where)
        at = inside(where, "when")
        condition = self._condition(data["when"], known, at, turns, shares=True)
        before = self._shared(at, depth, turns)
        then, in_then = self._block(data["do"], known, inside(where, "do"), depth + 1, turns)
        other, in_other = self._block(data.get("else", ()), known, inside(where, "else"), depth + 1, turns)
        return [*before, When(condition, then, other)], known | (in_then & in_other)

    def _loop(
        self, data: Mapping[Any, Any], known: set[str], where: Where, depth: int, turns: int
    ) -> list[Statement]:
        check_keys(data, _LOOP, where)
        if "do" not in data:
            raise FormulaError("lacks the key 'do': what is repeated", where)
        count, most = self._turns(data, where)
        turn = f"turn {depth}"
        if "as" in data:
            turn = data["as"]
            check_name(turn, known, inside(where, "as"))
        inner = {*known, turn}
        self.moving.add(turn)
        until = None
        if "until" in data:
            until = self._condition(data["until"], inner, inside(where, "until"), turns * most, shares=False)
        first, written = len(self.exponents), self.written
        body, _ = self._block(data["do"], inner, inside(where, "do"), depth + 1, turns * max(most, 1))
        if turn in assigned(body):
            raise FormulaError(f"{turn!r} counts the turns and cannot be given a value", where)
        changed = frozenset(assigned(body)).intersection(known)
        for names, function, place in self.exponents[first:]:
            if names & changed:
                raise _moving_exponent(function, min(names & changed), place)
        size = (self.written - written) * most
        if (
            isinstance(count, Number)
            and until is None
            and most <= _UNROLLED_TURNS
            and size <= _UNROLLED_NODES
        ):
            self.written += size
            return [
                each for number in range(most) for each in (Assign((turn,), (Number(float(number)),)), *body)
            ]
        return [Loop(count, most, turn, until, body)]

    def _turns(self, data: Mapping[Any, Any], where: Where) -> tuple[Node, int]:
        here = inside(where, "loop")
        count = parse(data["loop"], names=self.parameters, where=here, parameters_only=True)
        self._count(count, here, 1)
        most = data.get("most")
        if isinstance(count, Number):
            if count.value != int(count.value):
                raise FormulaError(f"must be a whole number, got {count.value:g}", here)
            most = int(count.value)
        elif most is None and isinstance(count, Name):
            maximum = self.parameters[count.name].maximum
            most = None if maximum is None else int(maximum)
        if most is None:
            message = (
                f"needs the key 'most', a number up to {MAX_TURNS}: its turns are no number and no parameter "
                "with a maximum"
            )
            raise FormulaError(message, where)
        if isinstance(most, bool) or not isinstance(most, int) or not 0 <= most <= MAX_TURNS:
            raise FormulaError(f"must have 0 to {MAX_TURNS} turns, got {str(most)[:20]}", here)
        return count, most

    def _count(self, node: Node, where: Where, turns: int) -> None:
        """Counts what is written and done, and looks at exponents of complex powers."""
        size = 0
        for part in walk(node):
            size += 1
            if isinstance(part, Call) and part.function in ("cpow_re", "cpow_im"):
                names = names_in(part.arguments[2])
                moving = names & self.moving
                if moving:
                    raise _moving_exponent(part.function, min(moving), where)
                self.exponents.append((self._made_of(names), part.function, where))
        self.written += size
        self.done += size * turns
        if self.written > MAX_WRITTEN:
            raise FormulaError(
                f"has more than {MAX_WRITTEN:,} numbers, names and operations altogether", self.where
            )
        if self.done > MAX_DONE:
            raise FormulaError(
                f"does more than {MAX_DONE:,} operations in an application; repeat less", self.where
            )


def _moving_exponent(function: str, name: str, where: Where) -> FormulaError:
    return FormulaError(f"the exponent of {function} must be constant, but uses {name!r}", where)
