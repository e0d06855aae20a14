"""Writes expressions as OpenCL C statements over a number type, one statement an operation.

Every value is classified by what it depends on, and costs accordingly:

- *constant*: only parameters. Evaluated on the host; a value that shapes no code is passed at run time in the array `k`.
  What a live parameter is in never shapes code: neither a value of 0 or 1, nor a condition, nor a whole exponent.
- *flat*: the state, but with slope zero everywhere (`floor`, `sign`, a `where` of constants): a plain `real`.
- *varying*: the state: `real` or `dual`, as the number type says.

Equal operations on equal operands become one statement, so formulas may repeat themselves freely.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

from clfractal.formulas.decisions import Decisions
from clfractal.formulas.evaluate import evaluate_constant
from clfractal.formulas.nodes import COMPARISONS, Call, Name, Node, Number, names_in, substitute

NumberType = Literal["real", "dual"]
_LIFTED = frozenset(("atan2", "min", "max", "mod"))
_COMPLEX_POWERS = frozenset(("cpow_re", "cpow_im"))
# Functions that cost so much that they are not written twice where operands can be chosen in place of results.
_COSTLY = _COMPLEX_POWERS | {*("pow", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2")}


@dataclass(frozen=True, slots=True)
class Value:
    """An operand: C text, and what it is. `number` is set for literals, `node` for constants of either sort."""

    text: str
    kind: Literal["constant", "flat", "varying"]
    node: Node | None = None
    number: float | None = None


@dataclass(slots=True)
class Constants:
    """Gives places to what the host passes at run time: `k[i]` in the text. Values come later."""

    owners: list[tuple[object, Node | None]] = field(default_factory=list)
    _slots: dict[tuple[object, Node | None], int] = field(default_factory=dict)

    def slot(self, owner: object, node: Node | None = None) -> int:
        """The place of a run-time constant; equal expressions of one owner share it."""
        key = (owner, node)
        if key not in self._slots:
            self._slots[key] = len(self.owners)
            self.owners.append(key)
        return self._slots[key]

    def text(self, owner: object, node: Node | None = None) -> str:
        """The same as C text."""
        return f"((real)(k[{self.slot(owner, node)}]))"


def literal(value: float) -> Value:
    """A number known when the text is written."""
    return Value(f"R({float(value)!r})", "constant", Number(value), float(value))


@dataclass(slots=True)
class Emitter:
    """Turns nodes into statements.

    Args:
        number_type: `real` or `dual`.
        bindings: the values of the names that expressions may use.
        constants: where run-time constants are collected.
        owner: distinguishes equal expressions with different parameter values (links of a chain).
        decisions: all that may be known of parameter values while writing.
        prefix: begins the names of this emitter's variables.
        lets: further names and their expressions, written where they are first used.
        lines: the statements so far.
        origins: of each variable over `real` the function and its operands (of `where` the mask's text first).
    """

    number_type: NumberType
    bindings: dict[str, Value]
    constants: Constants
    owner: object
    decisions: Decisions
    prefix: str = "t"
    lets: dict[str, Node] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    origins: dict[str, tuple[str, tuple[Value, ...]]] = field(default_factory=dict)
    _known: dict[tuple[str, ...], Value] = field(default_factory=dict)
    # How many branches of run-time conditions surround what is written: values there need not be numbers.
    _branches: int = 0

    def emit(self, node: Node) -> Value:
        """The value of an expression; appends the statements that compute it."""
        if isinstance(node, Number):
            return literal(node.value)
        if isinstance(node, Name):
            value = self._binding(node.name)
            return value if value.text else self._constant(node, [value])
        if node.function == "where":
            chosen = self._decided(node.arguments[0])
            if chosen is not None:
                return self.emit(node.arguments[1 if chosen else 2])
        names = {name: self._binding(name) for name in sorted(names_in(node))}
        if all(value.kind == "constant" for value in names.values()):
            return self._constant(
                substitute(node, {n: v.node for n, v in names.items() if v.node}), names.values()
            )
        function = node.function
        if function == "where":
            return self._where(node)
        operands = [self.emit(argument) for argument in node.arguments]
        if function == "pow":
            return self._power(operands[0], operands[1])
        if function in _COMPLEX_POWERS:
            re, im = self._complex_power(*operands)
            return re if function == "cpow_re" else im
        if function in ("min", "max") and len(operands) > 2:
            head = operands[0]
            for operand in operands[1:]:
                head = self._operation(function, head, operand)
            return head
        return self._operation(function, *operands)

    def _binding(self, name: str) -> Value:
        if name not in self.bindings and name in self.lets:
            self.bindings[name] = self.emit(self.lets[name])
        return self.bindings[name]

    def combine(self, function: str, *operands: Value) -> Value:
        """One more operation on values that are there already."""
        return self._operation(function, *operands)

    def radicand(self, value: Value) -> Value | None:
        """x for a value that was computed as sqrt(x), else None."""
        function, operands = self.origins.get(value.text, ("", ()))
        return operands[0] if function == "sqrt" else None

    def _never_negative(self, value: Value) -> bool:
        """Whether its operations alone show that a value is not below 0: a sum of squares, say."""
        if value.number is not None:
            return value.number >= 0
        function, operands = self.origins.get(value.text, ("", ()))
        if function in ("abs", "sqrt", "rsqrt", "exp"):
            return True
        if function == "mul" and operands[0].text == operands[1].text:
            return True
        if function == "max":
            return any(map(self._never_negative, operands))
        return function in ("add", "mul", "div", "min") and all(map(self._never_negative, operands))

    # --- operations ---

    def _constant(self, node: Node, operands: Iterable[Value]) -> Value:
        """A value known to the host: part of the text if it shapes code or is plain, else a run-time constant."""
        if all(operand.number is not None for operand in operands):
            return literal(evaluate_constant(node, {}))
        # A run-time constant of 0 or 1 is usually a feature that is off: its operations vanish from the code.
        strict = self._branches == 0
        number = self.decisions.folded(node, strict=strict)
        if number is not None:
            return literal(number)
        return Value(self._passed(node, strict=strict), "constant", node)

    def _passed(self, node: Node, *, strict: bool) -> str:
        """The C text of a value that the host passes at run time; the truth of a condition is 1 or 0."""
        self.decisions.place(node, self.constants.slot(self.owner, node), strict=strict)
        return self.constants.text(self.owner, node)

    def _statement(self, c_type: str, kind: Literal["flat", "varying"], call: str, *arguments: str) -> Value:
        key = (call, *arguments)
        if key not in self._known:
            name = f"{self.prefix}{len(self._known)}"
            self.lines.append(f"const {c_type} {name} = {call}({', '.join(arguments)});")
            self._known[key] = Value(name, kind)
        return self._known[key]

    def _plain(self, value: Value) -> str:
        """The value without its partials."""
        return f"{value.text}.v" if value.kind == "varying" and self.number_type == "dual" else value.text

    def _lift(self, value: Value) -> str:
        """The value as a number of the full type."""
        return value.text if value.kind == "varying" else f"dual_constant({value.text})"

    def _operation(self, function: str, *operands: Value) -> Value:
        """One operation, in the cheapest form that its operands' kinds allow."""
        a = operands[0]
        b = operands[1] if len(operands) > 1 else None
        if function == "neg" and a.number is not None:
            return literal(-a.number)
        simple = self._simplify(function, a, b)
        if simple is not None:
            return simple
        if function == "div" and a.number == 1 and b is not None:
            square = self.radicand(b)
            if square is not None:
                # One operation for 1/sqrt(x): shorter to wait for than a root and a division in turn.
                return self._operation("rsqrt", square)
        if function == "div" and b is not None and b.kind == "constant" and b.number != 0:
            # The host divides once; the kernel multiplies.
            inverse = self._constant(Call("div", (Number(1.0), b.node or Number(1.0))), [literal(1.0), b])
            return self._operation("mul", a, inverse)
        result = self._call(function, operands)
        self.origins.setdefault(result.text, (function, operands))
        return result

    def _call(self, function: str, operands: tuple[Value, ...]) -> Value:
        """The statement of one operation over the number type."""
        a = operands[0]
        b = operands[1] if len(operands) > 1 else None
        varying = any(operand.kind == "varying" for operand in operands)
        if self.number_type == "real" or not varying:
            kind: Literal["flat", "varying"] = "varying" if self.number_type == "real" and varying else "flat"
            return self._statement("real", kind, f"real_{function}", *(o.text for o in operands))
        if function in ("sign", "floor"):
            return self._statement("real", "flat", f"real_{function}", self._plain(a))
        if b is None:
            return self._statement("dual", "varying", f"dual_{function}", a.text)
        if function == "mul" and a.text == b.text:
            return self._statement("dual", "varying", "dual_square", a.text)
        if function in _LIFTED or len(operands) > 2:
            return self._statement("dual", "varying", f"dual_{function}", *(self._lift(o) for o in operands))
        if a.kind != "varying":
            if function in ("add", "mul"):
                return self._statement("dual", "varying", f"dual_{function}_real", b.text, a.text)
            return self._statement("dual", "varying", f"real_{function}_dual", a.text, b.text)
        suffix = "" if b.kind == "varying" else "_real"
        return self._statement("dual", "varying", f"dual_{function}{suffix}", a.text, b.text)

    def _simplify(self, function: str, a: Value, b: Value | None) -> Value | None:
        """Operations with 0 and 1 that need no code. x * 0 counts as 0 for infinite x too."""
        if b is None:
            return None
        if function == "mul" and a.number is not None and b.number is not None:
            return literal(a.number * b.number)
        if function == "add":
            return b if a.number == 0 else a if b.number == 0 else None
        if function == "sub":
            return a if b.number == 0 else self._operation("neg", b) if a.number == 0 else None
        if function == "mul":
            if 0 in (a.number, b.number):
                return literal(0.0)
            return b if a.number == 1 else a if b.number == 1 else None
        return a if function == "div" and b.number == 1 else None

    def _power(self, base: Value, exponent: Value) -> Value:
        """base ** exponent: whole exponents by repeated squaring, so that no logarithm is involved."""
        n = exponent.number
        if n is not None and n == math.floor(n) and abs(n) <= 1024:
            if n < 0:
                return self._operation("div", literal(1.0), self._whole_power(base, int(-n)))
            return self._whole_power(base, int(n)) if n > 0 else literal(1.0)
        if n is not None and n + 0.5 == math.floor(n + 0.5) and 0 < n <= 1024:
            # A half more than a whole power is that power times the square root.
            root = self._operation("sqrt", base)
            return root if n == 0.5 else self._operation("mul", self._whole_power(base, int(n)), root)
        if self.number_type == "dual" and base.kind == "varying" and exponent.kind != "varying":
            return self._statement("dual", "varying", "dual_pow_real", base.text, exponent.text)
        if self.number_type == "dual" and "varying" in (base.kind, exponent.kind):
            return self._statement("dual", "varying", "dual_pow", self._lift(base), self._lift(exponent))
        return self._operation("pow", base, exponent)

    def _whole_power(self, base: Value, n: int) -> Value:
        if n == 1:
            return base
        half = self._whole_power(base, n // 2)
        square = self._operation("mul", half, half)
        return self._operation("mul", square, base) if n % 2 else square

    def _complex_power(self, x: Value, y: Value, exponent: Value) -> tuple[Value, Value]:
        """(x + iy)^n: whole n by complex multiplications, otherwise by modulus and angle."""
        n = exponent.number
        if n is not None and n == math.floor(n) and 0 < abs(n) <= 1024:
            square = self.radicand(y)
            if square is None:
                re, im = self._whole_complex_power(x, y, int(abs(n)))
            else:
                if not self._never_negative(square):
                    # The root of a negative number is 0, and so is its square.
                    square = self._operation("max", square, literal(0.0))
                re, share = self._power_over_root(x, square, int(abs(n)))
                im = self._operation("mul", share, y)
            if n > 0:
                return re, im
            two = literal(2.0)
            square = self._operation("add", self._power(re, two), self._power(im, two))
            return self._operation("div", re, square), self._operation(
                "neg", self._operation("div", im, square)
            )
        square = self._operation("add", self._operation("mul", x, x), self._operation("mul", y, y))
        half = (
            self._operation("mul", exponent, literal(0.5)) if exponent.node is None else self._half(exponent)
        )
        modulus = self._power(square, half)
        if exponent.node is not None and self.decisions.is_live(exponent.node):
            # A live exponent may become negative, and (0 + 0i)^n is 0 then too; it is 1 for n = 0.
            zero = Call("eq", (exponent.node, Number(0.0)))
            origin = self._constant(Call("where", (zero, Number(1.0), Number(0.0))), [exponent])
            modulus = self._select(f"less(R(0.0), {self._plain(square)})", modulus, origin)
        angle = self._operation("mul", self._operation("atan2", y, x), exponent)
        return (
            self._operation("mul", modulus, self._operation("cos", angle)),
            self._operation("mul", modulus, self._operation("sin", angle)),
        )

    def _half(self, exponent: Value) -> Value:
        node = exponent.node or Number(0.0)
        return self._constant(Call("mul", (node, Number(0.5))), [exponent, literal(0.5)])

    def _whole_complex_power(self, x: Value, y: Value, n: int) -> tuple[Value, Value]:
        if n == 1:
            return x, y
        re, im = self._whole_complex_power(x, y, n // 2)
        # (re + im)(re - im) cancels less than re^2 - im^2.
        real_part = self._operation("mul", self._operation("add", re, im), self._operation("sub", re, im))
        product = self._operation("mul", re, im)
        imaginary = self._operation("add", product, product)
        if n % 2 == 0:
            return real_part, imaginary
        return (
            self._operation(
                "sub", self._operation("mul", real_part, x), self._operation("mul", imaginary, y)
            ),
            self._operation(
                "add", self._operation("mul", real_part, y), self._operation("mul", imaginary, x)
            ),
        )

    def _power_over_root(self, x: Value, square: Value, n: int) -> tuple[Value, Value]:
        """(x + i sqrt(square))^n as (re, s) with imaginary part s * sqrt(square), so that nothing waits for the root."""
        if n == 1:
            return x, literal(1.0)
        do = self._operation
        re, s = self._power_over_root(x, square, n // 2)
        squared = do("sub", do("mul", re, re), do("mul", square, do("mul", s, s)))
        product = do("mul", re, s)
        doubled = do("add", product, product)
        if n % 2 == 0:
            return squared, doubled
        return (
            do("sub", do("mul", squared, x), do("mul", square, doubled)),
            do("add", do("mul", doubled, x), squared),
        )

    # --- conditions ---

    def _where(self, node: Call) -> Value:
        """`where`: the branch that is not taken spoils neither the value nor a partial, since lanes are selected."""
        condition, yes, no = node.arguments
        if self._is_live(condition):
            return self._live_where(condition, yes, no)
        chosen = self._condition(condition)
        if isinstance(chosen, bool):
            return self.emit(yes if chosen else no)
        return self._select(chosen, *self._branches_of(condition, yes, no))

    def _select(self, chosen: str, a: Value, b: Value) -> Value:
        """`a` in the lanes of the mask `chosen`, else `b`, of either number type."""
        if self.number_type == "dual" and "varying" in (a.kind, b.kind):
            return self._statement("dual", "varying", "dual_where", chosen, self._lift(a), self._lift(b))
        return self.choose(chosen, a, b)

    def _live_where(self, condition: Node, yes: Node, no: Node) -> Value:
        """`where` by live parameters alone: both branches are written, and the host decides which one is taken."""
        if yes == no:
            return self.emit(yes)
        if isinstance(yes, Call) and isinstance(no, Call) and yes.function == no.function in _COSTLY:
            pairs = zip(yes.arguments, no.arguments, strict=True)
            operands = (a if a == b else Call("where", (condition, a, b)) for a, b in pairs)
            return self.emit(Call(yes.function, tuple(operands)))
        return self._select(self._live_condition(condition), *self._branches_of(condition, yes, no))

    def _branches_of(self, condition: Node, yes: Node, no: Node) -> tuple[Value, Value]:
        """Both branches. Where a live parameter is in the condition their constants need not be numbers."""
        live = bool(self.decisions.live) and any(
            value.node is not None and self.decisions.is_live(value.node)
            for value in map(self._binding, sorted(names_in(condition)))
        )
        self._branches += live
        try:
            return self.emit(yes), self.emit(no)
        finally:
            self._branches -= live

    def _is_live(self, node: Node) -> bool:
        """Whether an expression is constant and uses a live parameter."""
        if not self.decisions.live:
            return False
        closed = self._closed(node)
        return closed is not None and self.decisions.is_live(closed)

    def _live_condition(self, condition: Node) -> str:
        """The mask of a condition that the host decides, so that every precision decides alike."""
        closed = self._closed(condition)
        assert closed is not None
        return f"less(R(0.5), {self._passed(closed, strict=False)})"

    def _closed(self, node: Node) -> Node | None:
        """An expression that depends on parameters alone, with names of `let` filled in; None for any other."""
        names = {name: self._binding(name) for name in sorted(names_in(node))}
        if any(value.kind != "constant" for value in names.values()):
            return None
        return substitute(node, {n: v.node for n, v in names.items() if v.node})

    def choose(self, chosen: str, a: Value, b: Value) -> Value:
        """`a` in the lanes of the mask `chosen`, else `b`, both plain numbers."""
        kind: Literal["flat", "varying"] = "varying" if self.number_type == "real" else "flat"
        result = self._statement("real", kind, "real_where", chosen, a.text, b.text)
        self.origins.setdefault(result.text, ("where", (Value(chosen, "flat"), a, b)))
        return result

    def _decided(self, condition: Node) -> bool | None:
        """The truth of a condition that depends on parameters alone: only the branch taken is written."""
        closed = self._closed(condition)
        if closed is None or self.decisions.is_live(closed):
            return None
        return self.decisions.truth(closed)

    def _condition(self, node: Node) -> str | bool:
        """A condition as the text of a mask, or its truth when it is known now."""
        assert isinstance(node, Call)
        if self._is_live(node):
            return self._live_condition(node)
        if node.function == "not":
            inner = self._condition(node.arguments[0])
            return (not inner) if isinstance(inner, bool) else f"(~{inner})"
        if node.function in ("and", "or"):
            left, right = (self._condition(argument) for argument in node.arguments)
            decisive = node.function == "or"
            if isinstance(left, bool):
                return decisive if left is decisive else right
            if isinstance(right, bool):
                return decisive if right is decisive else left
            return f"({left} {'|' if decisive else '&'} {right})"
        assert node.function in COMPARISONS
        a, b = (self.emit(argument) for argument in node.arguments)
        if a.number is not None and b.number is not None:
            p, q = a.number, b.number
            truths = {"lt": p < q, "le": p <= q, "gt": p > q, "ge": p >= q, "eq": p == q, "ne": p != q}
            return truths[node.function]
        radicand = self.radicand(a)
        if radicand is not None and b.number == 0 and node.function in ("gt", "eq", "ne"):
            # The root need not be waited for. It is 0 for x < 0 too: sqrt(x) > 0 and sqrt(x) != 0 where x > 0.
            text = f"less({self._plain(b)}, {self._plain(radicand)})"
            return f"(~{text})" if node.function == "eq" else text
        left, right = self._plain(a), self._plain(b)
        if node.function in ("gt", "ge"):
            left, right = right, left
        call = {"lt": "less", "gt": "less", "le": "less_equal", "ge": "less_equal"}.get(
            node.function, "equal"
        )
        text = f"{call}({left}, {right})"
        return f"(~{text})" if node.function == "ne" else text
