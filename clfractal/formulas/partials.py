"""Differentiates what an `Emitter` wrote over `real`, by the components of the state.

A formula's map depends on each component in few places, so its own 3 x 3 (or 4 x 4) Jacobian is sparse and shares much with
the map; multiplying it by the J carried along often costs less than carrying three partials through every operation.
Forward rules as in Griewank & Walther, Evaluating Derivatives, 2nd ed. (SIAM 2008), ch. 3; conventions at kinks and poles
as in `kernels/formulas/numbers/dual.h`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from clfractal.formulas.emit import Emitter
from clfractal.formulas.products import Value, literal

# A partial that is zero everywhere is None: it costs nothing.
Partial = Value | None

_ONE, _TWO, _HALF = literal(1.0), literal(2.0), literal(0.5)


class Differentiator:
    """Partials of values of one emitter by its state variables `z.s0.v`, `z.s1.v`, ..."""

    def __init__(self, emitter: Emitter) -> None:
        self.emitter = emitter
        self._known: dict[tuple[str, int], Partial] = {}

    def partial(self, value: Value, by: int) -> Partial:
        """The partial of a value by component `by`; appends the statements that compute it."""
        if value.kind != "varying":
            return None
        if value.text.startswith("z.s"):
            return _ONE if value.text == f"z.s{by}.v" else None
        key = (value.text, by)
        if key not in self._known:
            function, operands = self.emitter.origins[value.text]
            self._known[key] = self._rule(function, operands, value, by)
        return self._known[key]

    def _rule(self, function: str, operands: tuple[Value, ...], value: Value, by: int) -> Partial:
        if function == "where":
            mask, yes, no = operands
            return self._choose(mask.text, self.partial(yes, by), self.partial(no, by))
        if function in ("cpow_re", "cpow_im"):
            return self._of_complex_power(function, operands, by)
        if function == "raised":
            base, exponent = operands
            partial = self.partial(base, by)
            return (
                None if partial is None else self._times(self.emitter.raised_slope(base, exponent), partial)
            )
        partials = [self.partial(operand, by) for operand in operands]
        if all(partial is None for partial in partials):
            return None
        if len(operands) == 1:
            return self._times(_SLOPES[function](self.emitter, operands[0], value), partials[0])
        if function == "clamp":
            return self._clamp(operands, partials)
        return self._binary(function, operands[0], operands[1], partials[0], partials[1], value)

    # --- functions of two ---

    def _binary(self, function: str, a: Value, b: Value, da: Partial, db: Partial, value: Value) -> Partial:
        do = self.emitter.combine
        if function == "add":
            return self._sum(da, db)
        if function == "sub":
            return self._sum(da, self._times(literal(-1.0), db))
        if function == "mul":
            if a.text == b.text:
                return self._times(do("mul", a, _TWO), da)
            return self._sum(self._times(b, da), self._times(a, db))
        if function == "div":
            inverse = do("div", _ONE, b)
            by_b = self._times(do("neg", do("mul", value, inverse)), db) if db is not None else None
            return self._sum(self._times(inverse, da), by_b)
        if function in ("min", "max"):
            first, second = (a, b) if function == "min" else (b, a)
            return self._choose(f"less_equal({first.text}, {second.text})", da, db)
        if function == "mod":
            turns = do("floor", do("div", a, b))
            return self._sum(da, self._times(do("neg", turns), db))
        if function == "atan2":
            square = do("add", do("mul", a, a), do("mul", b, b))
            inverse = self.emitter.choose_above("R(0.0)", square, do("div", _ONE, square))
            by_a = self._times(do("mul", b, inverse), da)
            by_b = self._times(do("neg", do("mul", a, inverse)), db) if db is not None else None
            return self._sum(by_a, by_b)
        assert function == "pow", function
        by_base = self._times(do("power_slope", a, b), da) if da is not None else None
        by_exponent = self._times(do("power_log", value, a), db) if db is not None else None
        return self._sum(by_base, by_exponent)

    def _of_complex_power(self, function: str, operands: tuple[Value, ...], by: int) -> Partial:
        """w^n has the slope n w^n / w, a complex number u + iv: dre = u dx - v dy, and dim = v dx + u dy; 0 for w = 0."""
        do = self.emitter.combine
        x, y, exponent, re, im = operands
        dx, dy = self.partial(x, by), self.partial(y, by)
        if dx is None and dy is None:
            return None
        square = do("add", do("mul", x, x), self.emitter.radicand(y) or do("mul", y, y))
        share = self.emitter.choose_above("R(0.0)", square, do("div", exponent, square))
        u = do("mul", do("add", do("mul", re, x), do("mul", im, y)), share)
        v = do("mul", do("sub", do("mul", im, x), do("mul", re, y)), share)
        if function == "cpow_re":
            return self._sum(self._times(u, dx), self._times(do("neg", v), dy))
        return self._sum(self._times(v, dx), self._times(u, dy))

    def _clamp(self, operands: tuple[Value, ...], partials: list[Partial]) -> Partial:
        """clamp(x, low, high): the partial of whichever of the three it is; `high` wins where low > high."""
        x, low, high = operands
        below = self._choose(f"less_equal({low.text}, {x.text})", partials[0], partials[1])
        within = f"less_equal({x.text}, {high.text})"
        if low.number is None or high.number is None or not low.number <= high.number:
            within = f"({within} & less_equal({low.text}, {high.text}))"
        return self._choose(within, below, partials[2])

    # --- sparse arithmetic ---

    def _times(self, factor: Value, partial: Partial) -> Partial:
        if partial is None or factor.number == 0:
            return None
        if factor.number == -1:
            return self._opposite(partial) or self.emitter.combine("neg", partial)
        if self.emitter.origins.get(partial.text) == ("sign", (factor,)):
            return self.emitter.combine("abs", factor)
        # Numbers in both may cancel, as in -w^3/2 by 2y.
        (one, bare), (other, rest) = self._factored(factor), self._factored(partial)
        if one * other == 1:
            return self.emitter.combine("mul", bare, rest)
        if one * other == -1:
            return self.emitter.combine("neg", self.emitter.combine("mul", bare, rest))
        return self.emitter.combine("mul", factor, partial)

    def _sum(self, a: Partial, b: Partial) -> Partial:
        if a is None or b is None:
            return a if b is None else b
        for one, other in ((b, a), (a, b)):
            opposite = self._opposite(one)
            if opposite is not None:
                return self.emitter.combine("sub", other, opposite)
        return self.emitter.combine("add", a, b)

    def _choose(self, mask: str, yes: Partial, no: Partial) -> Partial:
        if yes is None and no is None:
            return None
        opposite = self._opposite(yes) if yes is not None and no is None else None
        if opposite is not None:
            return self.emitter.combine("neg", self.emitter.choose(mask, opposite, literal(0.0)))
        return self.emitter.choose(mask, yes or literal(0.0), no or literal(0.0))

    def _opposite(self, value: Value) -> Partial:
        """x for a value that was computed as -x, else None."""
        function, operands = self.emitter.origins.get(value.text, ("", ()))
        return operands[0] if function == "neg" else None

    def _factored(self, value: Value) -> tuple[float, Value]:
        """A number, and what it multiplies."""
        if value.number is not None:
            return value.number, _ONE
        function, operands = self.emitter.origins.get(value.text, ("", ()))
        if function == "neg":
            number, bare = self._factored(operands[0])
            return -number, bare
        for of, rest in (operands, operands[::-1]) if function == "mul" else ():
            if of.number is not None:
                return of.number, rest
        return 1.0, value


# The derivatives of functions of one number, by what it is and what the function gives.
_SLOPES: Mapping[str, Callable[[Emitter, Value, Value], Value]] = {
    "neg": lambda emit, a, value: literal(-1.0),
    "abs": lambda emit, a, value: emit.combine("sign", a),
    "sqrt": lambda emit, a, value: emit.combine(
        "mul", emit.choose_above("R(0.0)", a, emit.combine("rsqrt", a)), _HALF
    ),
    "rsqrt": lambda emit, a, value: emit.combine(
        "mul", emit.combine("mul", value, emit.combine("mul", value, value)), literal(-0.5)
    ),
    "exp": lambda emit, a, value: value,
    "log": lambda emit, a, value: emit.choose_above("(real)(LOG_SMALLEST)", a, emit.combine("div", _ONE, a)),
    "sin": lambda emit, a, value: emit.combine("cos", a),
    "cos": lambda emit, a, value: emit.combine("neg", emit.combine("sin", a)),
    "tan": lambda emit, a, value: emit.combine("add", emit.combine("mul", value, value), _ONE),
    "atan": lambda emit, a, value: emit.combine(
        "div", _ONE, emit.combine("add", emit.combine("mul", a, a), _ONE)
    ),
    "asin": lambda emit, a, value: emit.combine("arc_slope", a),
    "acos": lambda emit, a, value: emit.combine("neg", emit.combine("arc_slope", a)),
    "sign": lambda emit, a, value: literal(0.0),
    "floor": lambda emit, a, value: literal(0.0),
}
