"""Writes expressions as OpenCL C statements over a number type, one statement an operation.

Every value is classified by what it depends on, and costs accordingly:

- *constant*: only parameters. Evaluated on the host and passed at run time in the array `k`, so that no value of a
  parameter shapes code. Where code would differ both ways are written, and a branch that all lanes take alike chooses:
  by the truth of a condition, or by what an exponent is.
- *flat*: the state, but with slope zero everywhere (`floor`, `sign`, a `where` of constants): a plain `real`.
- *varying*: the state: `real` or `dual`, as the number type says.

Equal operations on equal operands become one statement, so formulas may repeat themselves freely.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, TypeGuard

from clfractal.formulas.evaluate import call_float, evaluate_constant
from clfractal.formulas.fuse import fused
from clfractal.formulas.nodes import COMPARISONS, Call, Name, Node, Number, names_in, substitute
from clfractal.formulas.products import Value, literal, power_over_root, whole_complex_power, whole_power

NumberType = Literal["real", "dual"]
_LIFTED = frozenset(("atan2", "min", "max", "mod"))
_COMPLEX_POWERS = frozenset(("cpow_re", "cpow_im"))
# Functions that cost so much that they are not written twice where operands can be chosen in place of results.
_COSTLY = _COMPLEX_POWERS | {*("pow", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "atan2")}
# The largest whole exponent whose power is made of products.
_WHOLE = 1024


@dataclass(slots=True)
class Constants:
    """Gives places to what the host passes at run time: `k[i]` in the text. Values come later.

    Attributes:
        owners: of each place whose it is, and its expression of parameters.
        strict: places whose value must be a finite number. It need not be where only a branch uses it that is not taken.
    """

    owners: list[tuple[object, Node | None]] = field(default_factory=list)
    strict: set[int] = field(default_factory=set)
    _slots: dict[tuple[object, Node | None], int] = field(default_factory=dict)

    def slot(self, owner: object, node: Node | None = None) -> int:
        """The place of a run-time constant; equal expressions of one owner share it."""
        key = (owner, node)
        if key not in self._slots:
            self._slots[key] = len(self.owners)
            self.owners.append(key)
        return self._slots[key]

    def text(self, owner: object, node: Node | None = None) -> str:
        """The same as C text, for all lanes of a packet."""
        return f"((real)(k[{self.slot(owner, node)}]))"


def _is_complex_power(node: Node) -> TypeGuard[Call]:
    return isinstance(node, Call) and node.function in _COMPLEX_POWERS


@dataclass(slots=True)
class Emitter:
    """Turns nodes into statements.

    Args:
        number_type: `real` or `dual`.
        bindings: the values of the names that expressions may use.
        constants: where run-time constants are collected.
        owner: distinguishes equal expressions with different parameter values (links of a chain).
        guarded: whether all of it is used for some values of parameters only.
        branches: whether conditions of parameters become branches, else selections: only these can be differentiated.
        prefix: begins the names of this emitter's variables.
        lets: further names and their expressions, written where they are first used.
        lines: the statements so far.
        origins: of each variable the function and its operands (of `where` the mask's text first).
    """

    number_type: NumberType
    bindings: dict[str, Value]
    constants: Constants
    owner: object
    branches: bool = False
    guarded: bool = False
    prefix: str = "t"
    lets: dict[str, Node] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    origins: dict[str, tuple[str, tuple[Value, ...]]] = field(default_factory=dict)
    _known: dict[tuple[str, ...], Value] = field(default_factory=dict)
    _pairs: dict[tuple[Node, ...], tuple[Value, Value]] = field(default_factory=dict)
    _constancy: dict[str, bool] = field(default_factory=dict)
    _names: int = 0
    # How many arms of conditions with parameters surround what is written: values there need not be numbers.
    _arms: int = 0

    def emit(self, node: Node) -> Value:
        """The value of an expression; appends the statements that compute it."""
        if isinstance(node, Number):
            return literal(node.value)
        if isinstance(node, Name):
            value = self._binding(node.name)
            return value if value.text else self._constant(node)
        closed = self._closed(node)
        if closed is not None:
            return self._constant(closed)
        function = node.function
        if function == "where":
            return self._where(node)
        operands = [self.emit(argument) for argument in node.arguments]
        if function == "pow":
            return self._power(operands[0], operands[1])
        if function in _COMPLEX_POWERS:
            re, im = self._complex_power(*operands)
            return re if function == "cpow_re" else im
        return self.combine(function, *operands)

    def _binding(self, name: str) -> Value:
        if name not in self.bindings and name in self.lets:
            self.bindings[name] = self.emit(self.lets[name])
        return self.bindings[name]

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

    def _constant(self, node: Node) -> Value:
        """A value known to the host: part of the text if no parameter is in it, else a run-time constant."""
        if not names_in(node):
            return literal(evaluate_constant(node, {}))
        return Value(f"((real)({self._passed(node)}))", "constant", node)

    def _passed(self, node: Node) -> str:
        """The C text of a number that the host passes at run time; the truth of a condition is 1 or 0."""
        slot = self.constants.slot(self.owner, node)
        if self._arms == 0 and not self.guarded:
            self.constants.strict.add(slot)
        return f"k[{slot}]"

    def _name(self) -> str:
        self._names += 1
        return f"{self.prefix}{self._names - 1}"

    def _statement(self, c_type: str, kind: Literal["flat", "varying"], call: str, *arguments: str) -> Value:
        key = (call, *arguments)
        if key not in self._known:
            name = self._name()
            self.lines.append(f"const {c_type} {name} = {call}({', '.join(arguments)});")
            self._known[key] = Value(name, kind)
        return self._known[key]

    def plain(self, value: Value) -> str:
        """The value without its partials."""
        return f"{value.text}.v" if value.kind == "varying" and self.number_type == "dual" else value.text

    def _lift(self, value: Value) -> str:
        """The value as a number of the full type."""
        return value.text if value.kind == "varying" else f"dual_constant({value.text})"

    def combine(self, function: str, *operands: Value) -> Value:
        """One operation on values that are there, in the cheapest form that their kinds allow."""
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
                return self.combine("rsqrt", square)
        if function == "div" and b is not None and b.kind == "constant" and b.number != 0:
            # The host divides once; the kernel multiplies.
            inverse = self._constant(Call("div", (Number(1.0), b.node or Number(1.0))))
            return self.combine("mul", a, inverse)
        result = self._fused(function, operands) or self._call(function, operands)
        self.origins.setdefault(result.text, (function, operands))
        return result

    def _fused(self, function: str, operands: tuple[Value, ...]) -> Value | None:
        call = fused(function, operands, self.origins, self.plain)
        if call is None:
            return None
        varying = any(operand.kind == "varying" for operand in operands)
        if self.number_type == "dual" and varying:
            value = f"{call[0]}({', '.join(call[1:])})"
            return self._statement("dual", "varying", "dual_with", self._call(function, operands).text, value)
        return self._statement("real", "varying" if varying else "flat", *call)

    def _call(self, function: str, operands: tuple[Value, ...]) -> Value:
        """The statement of one operation over the number type."""
        a = operands[0]
        b = operands[1] if len(operands) > 1 else None
        varying = any(operand.kind == "varying" for operand in operands)
        if self.number_type == "real" or not varying:
            kind: Literal["flat", "varying"] = "varying" if self.number_type == "real" and varying else "flat"
            if function == "clamp" and all(bound.kind == "constant" for bound in operands[1:]):
                # Constants are numbers, where they are used at all.
                function = "bounded"
            return self._statement("real", kind, f"real_{function}", *(o.text for o in operands))
        if function in ("sign", "floor"):
            return self._statement("real", "flat", f"real_{function}", self.plain(a))
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
            return a if b.number == 0 else self.combine("neg", b) if a.number == 0 else None
        if function == "mul":
            if 0 in (a.number, b.number):
                return literal(0.0)
            return b if a.number == 1 else a if b.number == 1 else None
        return a if function == "div" and b.number == 1 else None

    def _power(self, base: Value, exponent: Value) -> Value:
        """base ** exponent: whole exponents by repeated squaring, so that no logarithm is involved."""
        n = exponent.number
        if n is not None and n == math.floor(n) and abs(n) <= _WHOLE:
            if n < 0:
                return self.combine("div", literal(1.0), self._whole_power(base, int(-n)))
            return self._whole_power(base, int(n)) if n > 0 else literal(1.0)
        if n is not None and n + 0.5 == math.floor(n + 0.5) and 0 < n <= _WHOLE:
            # A half more than a whole power is that power times the square root.
            root = self.combine("sqrt", base)
            return root if n == 0.5 else self.combine("mul", whole_power(self.combine, base, int(n)), root)
        if exponent.node is not None and n is None:
            return self._raised(base, exponent)
        if self.number_type == "dual" and base.kind == "varying" and exponent.kind != "varying":
            return self._statement("dual", "varying", "dual_pow_real", base.text, exponent.text)
        if self.number_type == "dual" and "varying" in (base.kind, exponent.kind):
            return self._statement("dual", "varying", "dual_pow", self._lift(base), self._lift(exponent))
        return self.combine("pow", base, exponent)

    def _whole_power(self, base: Value, n: int) -> Value:
        """base ** n; of a root by its square, so that less waits for the root."""
        square = self._square_of_root(base) if n > 1 else None
        power = whole_power(self.combine, square or base, n // 2 if square else n)
        return self.combine("mul", power, base) if square and n % 2 else power

    def _raised(self, base: Value, exponent: Value) -> Value:
        """base ** exponent where the exponent is data; see `kernels/formulas/numbers/powers.h`."""
        passed = self._exponent(exponent)
        if self.number_type == "dual" and base.kind == "varying":
            return self._statement("dual", "varying", "dual_raised", base.text, *passed)
        kind: Literal["flat", "varying"] = "varying" if base.kind == "varying" else "flat"
        result = self._statement("real", kind, "real_raised", base.text, *passed)
        self.origins.setdefault(result.text, ("raised", (base, exponent)))
        return result

    def raised_slope(self, base: Value, exponent: Value) -> Value:
        """The derivative of `_raised` by its base."""
        return self._statement("real", "varying", "real_raised_slope", base.text, *self._exponent(exponent))

    def _exponent(self, exponent: Value) -> tuple[str, str]:
        """An exponent that is data, and twice it where that is a whole number, else 0."""
        node = exponent.node
        assert node is not None
        twice = Call("mul", (Number(2.0), node))
        short = Call("le", (Call("abs", (node,)), Number(float(_WHOLE))))
        whole = Call("and", (Call("eq", (twice, Call("floor", (twice,)))), short))
        return self._passed(node), f"(int){self._passed(Call('where', (whole, twice, Number(0.0))))}"

    def _complex_power(self, x: Value, y: Value, exponent: Value) -> tuple[Value, Value]:
        """(x + iy)^n: whole n by complex multiplications, otherwise by modulus and angle."""
        n = exponent.number
        if n is None:
            return self._raised_complex(x, y, exponent)
        if n == math.floor(n) and 0 < abs(n) <= _WHOLE:
            square = self._square_of_root(y)
            if square is None:
                re, im = whole_complex_power(self.combine, x, y, int(abs(n)))
            else:
                re, share = power_over_root(self.combine, x, square, int(abs(n)))
                im = self.combine("mul", share, y)
            if n > 0:
                return re, im
            two = literal(2.0)
            square = self.combine("add", self._power(re, two), self._power(im, two))
            return self.combine("div", re, square), self.combine("neg", self.combine("div", im, square))
        square = self.combine("add", self.combine("mul", x, x), self.combine("mul", y, y))
        modulus = self._power(square, literal(n / 2))
        angle = self.combine("mul", self.combine("atan2", y, x), exponent)
        return (
            self.combine("mul", modulus, self.combine("cos", angle)),
            self.combine("mul", modulus, self.combine("sin", angle)),
        )

    def _square_of_root(self, y: Value) -> Value | None:
        """The square of what was computed as a root, else None."""
        square = self.radicand(y)
        if square is not None and not self._never_negative(square):
            # The root of a negative number is 0, and so is its square.
            square = self.combine("max", square, literal(0.0))
        return square

    def _raised_complex(self, x: Value, y: Value, exponent: Value) -> tuple[Value, Value]:
        """(x + iy)^n where n is data; see `kernels/formulas/numbers/powers.h`."""
        passed = self._exponent(exponent)
        if self.number_type == "dual" and "varying" in (x.kind, y.kind):
            pair = self._statement(
                "complex_dual", "varying", "dual_complex_raised", self._lift(x), self._lift(y), *passed
            )
            return Value(f"{pair.text}.re", "varying"), Value(f"{pair.text}.im", "varying")
        kind: Literal["flat", "varying"] = "varying" if "varying" in (x.kind, y.kind) else "flat"
        square = self._square_of_root(y)
        if square is None:
            pair = self._statement("complex_real", kind, "complex_raised", x.text, y.text, *passed)
        else:
            pair = self._statement(
                "complex_real", kind, "complex_raised_root", x.text, square.text, y.text, *passed
            )
        re, im = Value(f"{pair.text}.re", kind), Value(f"{pair.text}.im", kind)
        self.origins.setdefault(re.text, ("cpow_re", (x, y, exponent, re, im)))
        self.origins.setdefault(im.text, ("cpow_im", (x, y, exponent, re, im)))
        return re, im

    # --- conditions ---

    def _where(self, node: Call) -> Value:
        """`where`: the branch that is not taken spoils neither the value nor a partial, since lanes are selected."""
        condition, yes, no = node.arguments
        closed = self._closed(condition)
        if closed is not None and not names_in(closed):
            return self.emit(yes if evaluate_constant(closed, {}) else no)
        if yes == no:
            return self.emit(yes)
        if closed is not None:
            return self._branch(closed, yes, no) if self.branches else self._selected(condition, yes, no)
        chosen = self._condition(condition)
        if isinstance(chosen, bool):
            return self.emit(yes if chosen else no)
        return self._select(chosen, *self._both(condition, yes, no))

    def _select(self, chosen: str, a: Value, b: Value) -> Value:
        """`a` in the lanes of the mask `chosen`, else `b`, of either number type."""
        if self.number_type == "dual" and "varying" in (a.kind, b.kind):
            return self._statement("dual", "varying", "dual_where", chosen, self._lift(a), self._lift(b))
        return self.choose(chosen, a, b)

    def _branch(self, condition: Node, yes: Node, no: Node) -> Value:
        """`where` by parameters alone as a branch that the host decides; both parts of a complex power come of one."""
        for name in sorted(names_in(yes) & names_in(no)):
            # What both arms use is written before them.
            if not self._is_constant(name):
                self._binding(name)
        if _is_complex_power(yes) and _is_complex_power(no) and yes.function == no.function:
            key = (condition, *yes.arguments, *no.arguments)
            if key not in self._pairs:
                powers = (
                    lambda each=each: self._complex_power(*map(self.emit, each.arguments))
                    for each in (yes, no)
                )
                re, im = self._arms_of(condition, *powers)
                self._pairs[key] = re, im
            return self._pairs[key][yes.function == "cpow_im"]
        (result,) = self._arms_of(condition, lambda: (self.emit(yes),), lambda: (self.emit(no),))
        return result

    def _arms_of(self, condition: Node, *arms: Callable[[], tuple[Value, ...]]) -> tuple[Value, ...]:
        """Results of one of two arms. What an arm has computed is known in it alone."""
        passed = self._passed(condition)
        lines, bindings, known, pairs = self.lines, self.bindings, self._known, self._pairs
        written = []
        self._arms += 1
        for arm in arms:
            self.lines, self.bindings, self._known, self._pairs = [], dict(bindings), dict(known), dict(pairs)
            values = arm()
            written.append((self.lines, values))
        self._arms -= 1
        self.lines, self.bindings, self._known, self._pairs = lines, bindings, known, pairs
        results = [self._name() for _ in written[0][1]]
        lines.append(f"real {', '.join(results)};")
        for head, (inner, values) in zip((f"if ({passed} > S(0.5)) {{", "} else {"), written, strict=True):
            lines += [head, *(f"    {line}" for line in inner)]
            lines += [f"    {name} = {value.text};" for name, value in zip(results, values, strict=True)]
        lines.append("}")
        return tuple(Value(name, "varying") for name in results)

    def _selected(self, condition: Node, yes: Node, no: Node) -> Value:
        """`where` by parameters alone as a selection. What costs much is computed once, of the operands selected."""
        if isinstance(yes, Call) and isinstance(no, Call) and yes.function == no.function in _COSTLY:
            pairs = zip(yes.arguments, no.arguments, strict=True)
            operands = (a if a == b else Call("where", (condition, a, b)) for a, b in pairs)
            return self.emit(Call(yes.function, tuple(operands)))
        return self._select(self._passed_condition(condition), *self._both(condition, yes, no))

    def _both(self, condition: Node, yes: Node, no: Node) -> tuple[Value, Value]:
        """Both branches. Where a parameter is in the condition their constants need not be numbers."""
        names = [name for name in sorted(names_in(condition)) if self._is_constant(name)]
        guarded = any(self._binding(name).number is None for name in names)
        self._arms += guarded
        try:
            return self.emit(yes), self.emit(no)
        finally:
            self._arms -= guarded

    def _passed_condition(self, condition: Node) -> str:
        """The mask of a condition that the host decides, so that every precision decides alike."""
        closed = self._closed(condition)
        assert closed is not None
        return f"less(R(0.5), ((real)({self._passed(closed)})))"

    def _closed(self, node: Node) -> Node | None:
        """An expression that depends on parameters alone, with names of `let` filled in; None for any other."""
        names = sorted(names_in(node))
        if not all(map(self._is_constant, names)):
            return None
        values = {name: self._binding(name).node for name in names}
        return substitute(node, {name: value for name, value in values.items() if value})

    def _is_constant(self, name: str) -> bool:
        """Whether a name depends on parameters alone; what it stands for is not written for that."""
        if name in self.bindings:
            return self.bindings[name].kind == "constant"
        if name not in self._constancy:
            self._constancy[name] = all(map(self._is_constant, names_in(self.lets[name])))
        return self._constancy[name]

    def choose(self, chosen: str, a: Value, b: Value) -> Value:
        """`a` in the lanes of the mask `chosen`, else `b`, both plain numbers."""
        kind: Literal["flat", "varying"] = "varying" if self.number_type == "real" else "flat"
        result = self._statement("real", kind, "real_where", chosen, a.text, b.text)
        self.origins.setdefault(result.text, ("where", (Value(chosen, "flat"), a, b)))
        return result

    def choose_above(self, limit: str, a: Value, slope: Value) -> Value:
        """A slope in the lanes where `a` is above a limit, else 0."""
        return self.choose(f"less({limit}, {a.text})", slope, literal(0.0))

    def _condition(self, node: Node) -> str | bool:
        """A condition as the text of a mask, or its truth when it is known now."""
        assert isinstance(node, Call)
        closed = self._closed(node)
        if closed is not None and names_in(closed):
            return self._passed_condition(node)
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
            return bool(call_float(node.function, [a.number, b.number]))
        radicand = self.radicand(a)
        if radicand is not None and b.number == 0 and node.function in ("gt", "eq", "ne"):
            # The root need not be waited for. It is 0 for x < 0 too: sqrt(x) > 0 and sqrt(x) != 0 where x > 0.
            text = f"less({self.plain(b)}, {self.plain(radicand)})"
            return f"(~{text})" if node.function == "eq" else text
        left, right = self.plain(a), self.plain(b)
        if node.function in ("gt", "ge"):
            left, right = right, left
        call = {"lt": "less", "gt": "less", "le": "less_equal", "ge": "less_equal"}.get(
            node.function, "equal"
        )
        text = f"{call}({left}, {right})"
        return f"(~{text})" if node.function == "ne" else text
