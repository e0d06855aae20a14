"""A formula's application as a list of operations, which `kernels/formulas/near.h` follows beside a place.

The list is what any backend is asked while a tree is evaluated, so it is the same for maps and for statements. Powers with
whole exponents are products, and what chooses is `where`: a place and a point beside it may go different ways.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from clfractal.formulas.application import applied, constant_of
from clfractal.formulas.backends import MpmathBackend
from clfractal.formulas.chain import Chain
from clfractal.formulas.evaluate import MAX_EXPONENT, evaluate, power_by_squaring, whole
from clfractal.formulas.near_codes import CODES


@dataclass(frozen=True, slots=True)
class Register:
    """A number that differs from point to point, by its place in the list of all."""

    number: int


@dataclass(frozen=True, slots=True)
class Program:
    """The operations of an application.

    Attributes:
        inputs: how many numbers it begins with: the state's, C's, and the scalar derivative.
        operations: of each its code and the numbers of its operands; these come after the inputs in the list of all.
        constants: of each operation the number that it is, or has as its exponent.
        outputs: the new state's numbers, and the scalar derivative.
        slots: of all, where a kernel keeps it: a place is taken again once nobody needs what is there.
    """

    inputs: int
    operations: tuple[tuple[int, tuple[int, ...]], ...]
    constants: tuple[Any, ...]
    outputs: tuple[int, ...]
    slots: tuple[int, ...]

    def values(self, inputs: Sequence[Any], backend: MpmathBackend) -> list[float]:
        """What kernels know of each operation at a place, whose inputs are mpmath numbers.

        The value itself; of a comparison the difference of both, of `where` that of its arms, which decide exactly.
        """
        all_values, told = list(inputs), []
        for (code, operands), constant in zip(self.operations, self.constants, strict=True):
            name = CODES[code]
            given = [all_values[each] for each in operands]
            if name == "const":
                value = told_value = backend.mp.mpf(constant)
            elif name == "pow":
                value = told_value = backend.call(name, [given[0], constant])
            elif name in ("lt", "le", "eq"):
                told_value = given[0] - given[1]
                value = backend.mp.mpf(int(backend.call(name, given)))
            elif name == "where":
                told_value = given[1] - given[2]
                value = given[1] if given[0] > 0 else given[2]
            elif name in ("and", "not"):
                value = told_value = given[0] * given[1] if name == "and" else 1 - given[0]
            else:
                value = told_value = backend.call(name, given)
            all_values.append(value)
            told.append(float(told_value))
        return told


class _Recorder:
    """A backend whose numbers are registers."""

    def __init__(self, inputs: int) -> None:
        self.inputs = inputs
        self.operations: list[tuple[int, tuple[int, ...]]] = []
        self.constants: list[Any] = []
        self._known: dict[tuple[object, ...], Register] = {}
        do = self.call
        self._made: Mapping[str, Callable[..., Any]] = {
            "gt": lambda a, b: do("lt", [b, a]),
            "ge": lambda a, b: do("le", [b, a]),
            "ne": lambda a, b: do("not", [do("eq", [a, b])]),
            "or": lambda a, b: do("not", [do("and", [do("not", [a]), do("not", [b])])]),
            "abs": lambda a: do("where", [do("le", [0.0, a]), a, do("neg", [a])]),
            "min": lambda a, b: do("where", [do("le", [a, b]), a, b]),
            "max": lambda a, b: do("where", [do("le", [b, a]), a, b]),
            "clamp": lambda a, low, high: do("min", [do("max", [a, low]), high]),
            "mod": lambda a, b: do("sub", [a, do("mul", [b, do("floor", [do("div", [a, b])])])]),
            "pow": self._power,
            "cpow_re": lambda x, y, n: self._complex_power(x, y, n)[0],
            "cpow_im": lambda x, y, n: self._complex_power(x, y, n)[1],
        }

    def call(self, function: str, arguments: list[Any]) -> Any:
        made = self._made.get(function)
        if made is not None:
            return made(*arguments)
        return self._operation(function, [self.register(each) for each in arguments])

    def register(self, value: Any) -> Register:
        """A number as one of the list."""
        return value if isinstance(value, Register) else self._operation("const", [], float(value))

    def _operation(self, name: str, operands: Sequence[Register], constant: Any = 0.0) -> Register:
        numbers = tuple(each.number for each in operands)
        key = (name, numbers, constant)
        if key not in self._known:
            self._known[key] = Register(self.inputs + len(self.operations))
            self.operations.append((CODES.index(name), numbers))
            self.constants.append(constant)
        return self._known[key]

    def _times(self, a: Any, b: Any) -> Any:
        return self.call("mul", [a, b])

    def _power(self, a: Any, n: Any) -> Any:
        exponent = whole(n)
        if exponent is not None and abs(exponent) <= MAX_EXPONENT:
            power = power_by_squaring(a, abs(exponent), self._times, 1.0)
            return power if exponent >= 0 else self.call("div", [1.0, power])
        if isinstance(n, Register):
            return self.call("exp", [self._times(n, self.call("log", [a]))])
        return self._operation("pow", [self.register(a)], float(n))

    def _complex_power(self, x: Any, y: Any, n: Any) -> tuple[Any, Any]:
        exponent = whole(n)
        if exponent is not None and 0 < abs(exponent) <= MAX_EXPONENT:

            def times(a: tuple[Any, Any], b: tuple[Any, Any]) -> tuple[Any, Any]:
                real = self.call("sub", [self._times(a[0], b[0]), self._times(a[1], b[1])])
                return real, self.call("add", [self._times(a[0], b[1]), self._times(a[1], b[0])])

            re, im = power_by_squaring((x, y), abs(exponent), times, (1.0, 0.0))
            if exponent > 0:
                return re, im
            size = self.call("add", [self._times(re, re), self._times(im, im)])
            return self.call("div", [re, size]), self.call("neg", [self.call("div", [im, size])])
        square = self.call("add", [self._times(x, x), self._times(y, y)])
        radius = self._operation("pow", [self.register(square)], float(n) / 2)
        angle = self._times(self.call("atan2", [y, x]), n)
        return self._times(radius, self.call("cos", [angle])), self._times(radius, self.call("sin", [angle]))


@lru_cache(maxsize=256)
def program_of(chain: Chain, link: int, application: int) -> Program:
    """The operations of a link's application; `application` counts only if the formula knows its number."""
    bound = chain.links[link].bound
    size, width = chain.size, chain.size + len(chain.carried)
    inputs = width + size + 1
    recorder = _Recorder(inputs)
    registers = [Register(number) for number in range(inputs)]
    state, c, growth = registers[:width], registers[width : width + size], registers[-1]
    new, names = applied(
        bound, state, list(constant_of(bound, c)), recorder, number=application, carried=chain.carried
    )
    grown = growth
    if bound.derivative is not None:
        grown = evaluate(bound.derivative, {**names, "dr": growth}, recorder)
    outputs = tuple(recorder.register(each).number for each in (*new, grown))
    operations = tuple(recorder.operations)
    return Program(
        inputs, operations, tuple(recorder.constants), outputs, _slots(inputs, operations, outputs)
    )


def _slots(
    inputs: int, operations: Sequence[tuple[int, tuple[int, ...]]], outputs: Sequence[int]
) -> tuple[int, ...]:
    last = dict.fromkeys(range(inputs), -1)
    for number, (_, operands) in enumerate(operations):
        last.update(dict.fromkeys(operands, number))
    last.update(dict.fromkeys(outputs, len(operations)))
    slots = list(range(inputs))
    free: list[int] = []
    taken = inputs
    for number, (_, operands) in enumerate(operations):
        free += sorted({slots[each] for each in operands if last[each] == number}, reverse=True)
        if not free:
            free.append(taken)
            taken += 1
        slots.append(free.pop())
        if last.get(inputs + number, -1) < 0:
            free.append(slots[-1])
    return tuple(slots)
