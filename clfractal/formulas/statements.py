"""Writes a block of statements by an `Emitter`: names get new values; branches, selections and loops.

A condition of parameters, of the application's number and of turns is the same for all lanes, and becomes a branch. Any
other chooses between the values of both arms.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from clfractal.errors import FormulaError, Where
from clfractal.formulas.blocks import Assign, Block, Loop, When, assigned, trimmed
from clfractal.formulas.costs import cost_of
from clfractal.formulas.evaluate import evaluate_constant
from clfractal.formulas.fuse import needed
from clfractal.formulas.nodes import Call, Name, Node, Number, is_condition, names_in, substitute, walk
from clfractal.formulas.products import Value, literal
from clfractal.formulas.scopes import Kind, ScopedEmitter

# An arm of a condition of z that costs as much is done only where a lane of the packet takes it.
_WORTH_A_BRANCH = 60
# A constant of more operations is computed by the kernel, of what the host passes; so is what is the same for all lanes.
_MOST_CLOSED = 150

_OPERATORS = {
    "add": "+",
    "sub": "-",
    "mul": "*",
    "div": "/",
    "lt": "<",
    "le": "<=",
    "gt": ">",
    "ge": ">=",
    "eq": "==",
    "ne": "!=",
    "and": "&&",
    "or": "||",
}
_CALLED = {"abs": "fabs", "floor": "floor", "min": "fmin", "max": "fmax"}


@dataclass(slots=True)
class BlockWriter:
    """Writes blocks over an emitter's number type.

    Attributes:
        jumps: whether there are branches or loops in what was written: these are differentiated by dual numbers alone.
        uniform: of names that are the same for all lanes what they stand for, in terms of parameters and of `counts`.
        counts: the C text of whole numbers that are the same for all lanes: the application's, and those of turns.
    """

    emitter: ScopedEmitter
    jumps: bool = False
    uniform: dict[str, Node] = field(default_factory=dict)
    counts: dict[str, str] = field(default_factory=dict)

    def count(self, name: str, text: str) -> None:
        """A name for a whole number that is the same for all lanes."""
        key = f"{name} {text}"
        self.counts[key] = text
        self.uniform[name] = Name(key)
        self.emitter.bindings[name] = Value(f"((real)((scalar){text}))", "flat")

    def write(self, block: Block, wanted: frozenset[str]) -> None:
        """Writes what `wanted` names need; their values are among the emitter's bindings then."""
        self._block(trimmed(block, wanted)[0])

    def _block(self, block: Block) -> None:
        for statement in block:
            if isinstance(statement, Assign):
                self._assign(statement)
            elif isinstance(statement, When):
                self._when(statement)
            else:
                self._loop(statement)

    # --- assignments ---

    def _assign(self, statement: Assign) -> None:
        values = [self._limited(self.emitter.emit(node)) for node in statement.nodes]
        uniform = [self._same_for_all(node) for node in statement.nodes]
        for name, value, same in zip(statement.names, values, uniform, strict=True):
            self._bind(name, value, same)

    def _bind(self, name: str, value: Value, same: Node | None = None) -> None:
        self.emitter.rebind(name, value)
        if same is None:
            self.uniform.pop(name, None)
        else:
            self.uniform[name] = same

    def _limited(self, value: Value) -> Value:
        """A constant whose expression has become too large to be one any more is only a number."""
        large = value.number is None and value.node is not None and _size(value.node) > _MOST_CLOSED
        return Value(value.text, "flat") if large else value

    def _same_for_all(self, node: Node) -> Node | None:
        """An expression of `counts` and parameters, with names filled in; None of any other, and of parameters alone."""
        names = names_in(node)
        if names.isdisjoint(self.uniform):
            return None
        values: dict[str, Node] = {}
        for name in names:
            if name in self.uniform:
                values[name] = self.uniform[name]
            elif self.emitter.is_constant(name):
                value = self.emitter.bindings[name].node
                if value is not None:
                    values[name] = value
            else:
                return None
        filled = substitute(node, values)
        return filled if _size(filled) <= _MOST_CLOSED else None

    def _scalar(self, node: Node) -> str | None:
        """C text of a plain number, or of a truth, that is the same for all lanes; None if it needs a function of lanes."""
        names = names_in(node)
        if not names:
            return None if is_condition(node) else f"S({evaluate_constant(node, {})!r})"
        if names.isdisjoint(self.counts):
            passed = self.emitter.passed(node)
            return f"({passed} > S(0.5))" if is_condition(node) else passed
        if isinstance(node, Name):
            return f"((scalar){self.counts[node.name]})"
        assert isinstance(node, Call)
        parts = [self._scalar(argument) for argument in node.arguments]
        if any(part is None for part in parts):
            return None
        if node.function in _OPERATORS:
            return f"({parts[0]} {_OPERATORS[node.function]} {parts[1]})"
        if node.function in _CALLED:
            return f"{_CALLED[node.function]}({', '.join(map(str, parts))})"
        if node.function == "mod":
            return f"({parts[0]} - {parts[1]} * floor({parts[0]} / {parts[1]}))"
        return {"neg": f"(-{parts[0]})", "not": f"(!{parts[0]})"}.get(node.function)

    def _uniform_condition(self, condition: Node) -> str | None:
        """C text of a condition that is the same for all lanes, else None."""
        same = self._same_for_all(condition)
        if same is None:
            return None
        text = self._scalar(same)
        if text is None:
            mask = self.emitter.condition(condition)
            text = str(int(mask)) if isinstance(mask, bool) else f"any_lane({mask})"
        return text

    # --- conditions ---

    def _when(self, statement: When) -> None:
        condition = self._folded(statement.condition)
        if isinstance(condition, bool):
            self._block(statement.then if condition else statement.otherwise)
            return
        statement = When(condition, statement.then, statement.otherwise)
        closed = self.emitter.closed(condition)
        head = self._uniform_condition(condition)
        if closed is not None:
            head = f"{self.emitter.passed(closed)} > S(0.5)"
        if head is not None:
            self._branch(head, statement)
            return
        mask = self.emitter.condition(statement.condition)
        if isinstance(mask, bool):
            self._block(statement.then if mask else statement.otherwise)
        else:
            self._selection(self.emitter.mask(mask), statement)

    def _folded(self, condition: Node) -> Node | bool:
        """A condition without the parts that are known now, or its truth."""
        closed = self.emitter.closed(condition)
        if closed is not None and not names_in(closed):
            return bool(evaluate_constant(closed, {}))
        assert isinstance(condition, Call)
        if condition.function == "not":
            inner = self._folded(condition.arguments[0])
            return (not inner) if isinstance(inner, bool) else Call("not", (inner,))
        if condition.function not in ("and", "or"):
            return condition
        decisive = condition.function == "or"
        left, right = map(self._folded, condition.arguments)
        for part, other in ((left, right), (right, left)):
            if isinstance(part, bool):
                return part if part is decisive else other
        assert not isinstance(left, bool)
        assert not isinstance(right, bool)
        return Call(condition.function, (left, right))

    def _arm(self, block: Block) -> _Arm:
        """Writes an arm by itself."""
        emitter, uniform = self.emitter, dict(self.uniform)
        scope = emitter.enter()
        jumped, self.jumps = self.jumps, False
        self._block(block)
        arm = _Arm(emitter.lines, emitter.bindings, self.uniform, self.jumps)
        self.jumps = self.jumps or jumped
        emitter.leave(scope)
        self.uniform = uniform
        return arm

    def _branch(self, head: str, statement: When) -> None:
        self.jumps = True
        arms = [self._arm(block) for block in (statement.then, statement.otherwise)]
        results: list[tuple[str, Value, list[str]]] = []
        for name in assigned((statement,)):
            values = [arm.bindings.get(name) for arm in arms]
            yes, no = values
            if yes is None or no is None:
                continue
            if yes.text == no.text:
                self._bind(name, yes, arms[0].uniform.get(name))
                continue
            result = self.emitter.variable(_kind(yes, no))
            results.append((name, result, [self.emitter.full(value, result) for value in (yes, no)]))
        lines = [f"if ({head}) {{"]
        for at, arm in enumerate(arms):
            inner = [*arm.lines, *(f"{result.text} = {texts[at]};" for _, result, texts in results)]
            if at and inner:
                lines.append("} else {")
            lines += [f"    {line}" for line in inner]
        if results:
            self.emitter.lines += [*lines, "}"]
        for name, result, _ in results:
            self._bind(name, result)

    def _selection(self, mask: str, statement: When) -> None:
        for chosen, block in ((mask, statement.then), (f"(~{mask})", statement.otherwise)):
            if block:
                self._masked(chosen, block, statement)

    def _masked(self, mask: str, block: Block, statement: When) -> None:
        """An arm's values in the lanes of a mask."""
        names = assigned(block)
        both = {*assigned(statement.then)} & {*assigned(statement.otherwise)}
        before = {name: self.emitter.bindings.get(name) for name in names}
        arm = self._arm(block)
        results = []
        for name in names:
            new, old = arm.bindings.get(name), before[name]
            if new is None or (old is None and name not in both):
                continue
            # Of a name that both arms give a value first there is nothing to keep.
            results.append((name, new, old if old is not None else new))
        lines = needed(arm.lines, [f"{new.text};" for _, new, _ in results])
        if arm.jumps or cost_of(lines) >= _WORTH_A_BRANCH:
            self._guarded(mask, arm.lines, results)
            return
        self.emitter.lines += arm.lines
        for name, new, old in results:
            self._bind(name, self.emitter.select(mask, new, old))

    def _guarded(self, mask: str, lines: list[str], results: list[tuple[str, Value, Value]]) -> None:
        self.jumps = True
        found: list[tuple[str, Value]] = []
        inner = []
        for name, new, old in results:
            result = self.emitter.variable(_kind(new, old), literal(0.0) if old is new else old)
            found.append((name, result))
            text = self.emitter.full(new, result)
            inner.append(
                f"{result.text} = {text};" if old is new else self.emitter.picked(result, mask, text)
            )
        body = [f"    {line}" for line in (*lines, *inner)]
        self.emitter.lines += [f"if (any_lane({mask})) {{", *body, "}"]
        for name, result in found:
            self._bind(name, result)

    # --- loops ---

    def _loop(self, statement: Loop) -> None:
        emitter = self.emitter
        times = self._times(statement)
        if times == "0":
            return
        self.jumps = True
        carried = [name for name in assigned(statement.body) if name in emitter.bindings]
        varying = {name for name in carried if emitter.bindings[name].kind == "varying"}
        while True:
            outer = dict(self.uniform)
            scope = emitter.enter()
            lines, variables, found = self._turns(statement, carried, varying, times)
            emitter.leave(scope)
            self.uniform = outer
            more = {name for name, value in found.items() if value.kind == "varying"} - varying
            if not more:
                break
            # A number that has no slope at first may get one in a turn.
            varying |= more
        emitter.lines += lines
        for name in carried:
            self._bind(name, variables[name])

    def _turns(
        self, statement: Loop, carried: list[str], varying: set[str], times: str
    ) -> tuple[list[str], dict[str, Value], dict[str, Value]]:
        """The loop's text, its variables, and the values that they have at the end of a turn."""
        emitter = self.emitter
        variables = {
            name: emitter.variable("varying" if name in varying else "flat", emitter.bindings[name])
            for name in carried
        }
        head, emitter.lines = emitter.lines, []
        for name, variable in variables.items():
            self._bind(name, variable)
        turn = emitter.name()
        self.count(statement.turn, turn)
        going = ""
        if statement.until is not None:
            going = self._leave(statement.until, head)
        self._block(statement.body)
        found = {name: emitter.bindings[name] for name in carried}
        changed = [name for name in carried if found[name].text != variables[name].text]
        following = []
        for name in changed:
            text = emitter.full(found[name], variables[name])
            if found[name].text in {variable.text for variable in variables.values()}:
                text = emitter.copied(text, variables[name])
            following.append((variables[name], text))
        for variable, text in following:
            emitter.lines.append(
                emitter.picked(variable, going, text) if going else f"{variable.text} = {text};"
            )
        body = [f"    {line}" for line in emitter.lines]
        lines = [*head, f"for (int {turn} = 0; {turn} < {times}; ++{turn}) {{", *body, "}"]
        return lines, variables, found

    def _leave(self, until: Node, head: list[str]) -> str:
        """Ends the loop where a condition holds; the mask of the lanes that go on, if it depends on lanes."""
        uniform = self._uniform_condition(until)
        if uniform is None:
            condition = self.emitter.condition(until)
            if not isinstance(condition, bool):
                going = self.emitter.name()
                head.append(f"mask {going} = equal(R(0.0), R(0.0));")
                self.emitter.lines += [f"{going} &= ~{condition};", f"if (!any_lane({going})) break;"]
                return going
            uniform = str(int(condition))
        self.emitter.lines.append(f"if ({uniform}) break;")
        return ""

    def _times(self, statement: Loop) -> str:
        closed = self.emitter.closed(statement.turns)
        if closed is None:
            raise FormulaError("the turns of a loop must depend on parameters alone", Where())
        if not names_in(closed):
            turns = min(max(int(evaluate_constant(closed, {}) // 1), 0), statement.most)
            return f"TURNS({turns})" if turns else "0"
        most = Call("min", (Call("floor", (closed,)), Number(float(statement.most))))
        return f"(int){self.emitter.passed(most)}"


@dataclass(frozen=True, slots=True)
class _Arm:
    lines: list[str]
    bindings: dict[str, Value]
    uniform: dict[str, Node]
    jumps: bool


def _kind(a: Value, b: Value) -> Kind:
    """The kind of what may be one or the other."""
    return "varying" if "varying" in (a.kind, b.kind) else "flat"


def _size(node: Node) -> int:
    size = 0
    for _ in walk(node):
        size += 1
        if size > _MOST_CLOSED:
            break
    return size
