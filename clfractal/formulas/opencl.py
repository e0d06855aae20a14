"""Writes a chain of formulas as OpenCL C over packets: the functions that `orbit.h` iterates.

The text depends on the expressions, on counts, and on two facts that follow from values: whether the degree is above 1, and
whether f(0) is a finite number. Everything else is in `constants`, the values of the kernel argument `k`. So a text is
written once for all values of its parameters, and changing one needs no compilation. Where values choose between ways to
compute, an application is written twice: for the usual values, which are literals then, and for any.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any, Literal

from clfractal.formulas.costs import OPERATIONS, WORTH_CARRYING, cost_of, count_of_operations
from clfractal.formulas.emit import Constants, Emitter, NumberType
from clfractal.formulas.evaluate import as_function, evaluate_constant, finite
from clfractal.formulas.functions import Facts, each_usual, state_functions
from clfractal.formulas.fuse import fused, needed, without_unused
from clfractal.formulas.jacobian import LocalJacobian, local_jacobian
from clfractal.formulas.language import BoundFormula, Chain, Link, Name, Number, names_in, point_name
from clfractal.formulas.products import Value, literal
from clfractal.formulas.turns import Span

# How a map is written over dual numbers: operation by operation, by its own sparse Jacobian, or as costs less.
DualMap = Literal["operations", "jacobian", "cheapest"]


@dataclass(frozen=True, slots=True)
class Leaf:
    """A formula among several: what its functions' names begin with, and of how many numbers the state of all is."""

    name: str
    width: int


@dataclass(frozen=True, slots=True)
class FormulaText:
    """A chain in OpenCL C.

    Attributes:
        text: the definitions that `orbit.h` expects before it; of a leaf its functions alone. Equal texts are one
            object.
        constants: values of the run-time array `k`, in order; never empty.
    """

    text: str
    constants: tuple[float, ...]
    facts: Facts

    @property
    def has_derivative(self) -> bool:
        """Every link carries a scalar rule, so marching needs no Jacobian."""
        return self.facts.has_derivative


@lru_cache(maxsize=16)
def write_formula(
    chain: Chain, *, scalar_rule: bool = True, dual_map: DualMap = "cheapest", leaf: Leaf | None = None
) -> FormulaText:
    """The chain's functions over `real` and `dual`; as a leaf, under names of its own.

    `scalar_rule=False` leaves out the formulas' own derivative, so that marching uses the Jacobian throughout.
    A map that uses the point (`point_x`) is always written operation by operation.

    Writing takes milliseconds, so texts are kept: for other parameter values only the constants are computed.
    """
    structure = tuple(link.structure for link in chain.links)
    asked = _Asked((structure, chain.degree > 1, _starts_at_zero(chain)), chain)
    return _written(asked, scalar_rule, dual_map, leaf).filled(chain)


def forget_texts() -> None:
    """Forgets all kept texts."""
    write_formula.cache_clear()
    _written.cache_clear()


@dataclass(frozen=True, slots=True)
class _Asked:
    """A chain whose text is asked for: chains of one structure, whatever their parameters' values are, are one question."""

    structure: tuple[object, ...]
    chain: Chain = field(compare=False)


@dataclass(frozen=True, slots=True)
class _Written:
    """A text for all values of its parameters.

    Attributes:
        owners: of each run-time constant whose it is, its value by the link's parameters (None: it is no expression), and
            whether it must be a finite number.
    """

    text: str
    facts: Facts
    owners: tuple[tuple[object, Callable[[Mapping[str, float]], Any] | None, bool], ...]

    def filled(self, chain: Chain) -> FormulaText:
        """The text with the chain's constants."""
        constants = []
        for owner, function, strict in self.owners:
            if function is None:
                assert isinstance(owner, tuple)
                constants.append(_passed(chain, *owner))
            else:
                assert isinstance(owner, int)
                value = function(chain.links[owner].bound.values)
                constants.append(finite(value) if strict else float(value))
        return FormulaText(self.text, tuple(constants) or (0.0,), self.facts)


@lru_cache(maxsize=512)
def _one(text: str) -> str:
    """One object for equal texts, so that comparing them takes no time."""
    return text


@lru_cache(maxsize=64)
def _written(asked: _Asked, scalar_rule: bool, dual_map: DualMap, leaf: Leaf | None) -> _Written:
    return _ChainWriter(asked.chain, scalar_rule, dual_map, leaf).write()


def _starts_at_zero(chain: Chain) -> bool:
    """Whether iteration starts at z = 0, because f(0) is not a finite number or depends on the point."""
    return chain.add == "point" and chain.first.start is None


def _passed(chain: Chain, index: int, what: str, component: int) -> float:
    """A run-time constant that is no expression."""
    bound = chain.links[index].bound
    if what == "usual":
        return float(all(link.bound.has_usual_values for link in chain.links))
    if what == "repeat":
        return float(bound.repeat)
    numbers = bound.julia if what == "julia" else bound.start
    assert numbers is not None
    return numbers[component]


def operations_per_application(chain: Chain) -> float:
    """Arithmetic operations of one application as rays march by it, averaged over the chain's cycle.

    A fused multiply-add counts as two, a root or a division as one; comparisons and selections do not count.
    """
    formula = write_formula(chain)
    prefix = "derivative" if formula.has_derivative else "dual"
    usual = all(link.bound.has_usual_values for link in chain.links)
    total = 0.0
    for index in chain.spans[-1].members:
        link = chain.links[index]
        name = _name(prefix, index, usual and bool(link.bound.formula.shaping))
        body = formula.text.partition(f" {name}(")[2].partition("\n}")[0]
        total += link.count * link.bound.repeat * count_of_operations(body, OPERATIONS)
    return total / chain.cycle_length


class _ChainWriter:
    def __init__(self, chain: Chain, scalar_rule: bool, dual_map: DualMap, leaf: Leaf | None) -> None:
        self.chain = chain
        self.leaf = leaf
        self.name = "" if leaf is None else leaf.name
        self.dual_map = dual_map
        self.links: Sequence[Link] = chain.links
        self.size = chain.size
        self.width = chain.size if leaf is None else leaf.width
        self.constants = Constants()
        has_rule = all(link.bound.derivative is not None for link in self.links)
        self.has_derivative = scalar_rule and has_rule
        self.ways = [
            (index, way)
            for index in range(len(self.links))
            for way in (False, True)
            if self.shaped(index) >= way
        ]
        self.starts_at_zero = _starts_at_zero(chain)
        self.starts_at_first = chain.add == "point" and not self.starts_at_zero

    def write(self) -> _Written:
        parts = [self._has_usual_values(), *self._of_type("real"), *self._of_type("dual")]
        if self.has_derivative:
            parts += (self._apply_derivative(index, usual=usual) for index, usual in self.ways)
            parts.append(self._dispatch("real", derivative=True))
        facts = Facts(
            self.width,
            int(self.starts_at_first),
            self.chain.degree > 1,
            self.has_derivative,
            self.chain.shape_index is not None,
            any(map(_CALLS.search, parts)),
            len(self.links) == 1 and self._operations() >= WORTH_CARRYING,
        )
        head = [facts.defines() + each_usual(1), state_functions(self.width)] if self.leaf is None else []
        return _Written(
            _one("\n".join([*head, *parts]) + "\n"),
            facts,
            tuple(
                (owner, as_function(node) if node is not None else None, slot in self.constants.strict)
                for slot, (owner, node) in enumerate(self.constants.owners)
            ),
        )

    def _operations(self) -> int:
        """Of an application as rays march by it, of the first link."""
        usual = self.shaped(0)
        marched = self._apply_derivative if self.has_derivative else partial(self._apply, number_type="dual")
        return count_of_operations(marched(0, usual=usual), OPERATIONS)

    def _of_type(self, number_type: NumberType) -> list[str]:
        """The functions over one number type."""
        return [
            self._start(number_type),
            *(self._apply(index, number_type, usual=usual) for index, usual in self.ways),
            self._dispatch(number_type, derivative=False),
            self._solid_distance(self.chain.shape_index, number_type),
        ]

    def _has_usual_values(self) -> str:
        """Whether all parameters have the values that are literals."""
        answer = "1"
        if any(map(self.shaped, range(len(self.links)))):
            answer = f"k[{self.constants.slot((0, 'usual', 0))}] > S(0.5)"
        return _function(
            f"INLINE int {self.name}has_usual_values(__constant const scalar *k) {{", [], f"return {answer};"
        )

    # --- one link ---

    def _emitter(
        self, index: int, number_type: NumberType, *, branches: bool = False, usual: bool = False
    ) -> Emitter:
        bound = self.links[index].bound
        bindings = {point_name(v): self._point_value(index, i) for i, v in enumerate(bound.formula.variables)}
        bindings |= {v: Value(f"z.s{i}", "varying") for i, v in enumerate(bound.formula.variables)}
        # Values that are not the usual ones need not be numbers where only the usual ones have a meaning.
        literals = {name: literal(value) for name, value in bound.formula.shaping.items() if usual}
        return Emitter(
            number_type,
            bindings | _parameters(bound) | literals,
            self.constants,
            index,
            branches,
            guarded=usual,
        )

    def _point_value(self, index: int, component: int) -> Value:
        """`point_x` and its like: the constant that is added, which in a Julia set is not the point in space."""
        bound = self.links[index].bound
        name = point_name(bound.formula.variables[component])
        rule = bound.formula.derivative
        used = bound.formula.point_map or (rule is not None and name in names_in(rule))
        if bound.add == "constant" and used:
            return Value(self.constants.text((index, "julia", component)), "flat")
        return Value(f"c.s{component}", "varying")

    def _map(self, emitter: Emitter, bound: BoundFormula) -> list[Value]:
        emitter.lets = dict(bound.formula.let)
        return [emitter.emit(node) for node in bound.formula.map]

    def _full(self, number_type: NumberType, value: Value) -> str:
        """A value as text of the full number type."""
        return (
            f"dual_constant({value.text})"
            if number_type == "dual" and value.kind != "varying"
            else value.text
        )

    def _add_constant(
        self, index: int, number_type: NumberType, emitter: Emitter, mapped: list[Value]
    ) -> list[str]:
        """The components after adding C."""
        bound = self.links[index].bound
        texts: list[str] = []
        for i, value in enumerate(mapped):
            added = Value(f"c.s{i}", "varying")
            if bound.add == "none":
                texts.append(self._full(number_type, value))
            elif bound.add == "constant":
                assert bound.julia is not None
                added = Value(self.constants.text((index, "julia", i)), "flat")
                texts.append(self._full(number_type, emitter.combine("add", value, added)))
            elif number_type == "dual" and i < 3:
                # The point's own coordinate has the partials 1, 0, 0: one addition instead of four.
                texts.append(f"dual_add_coordinate_{'xyz'[i]}({self._full('dual', value)}, c.s{i}.v)")
            else:
                texts.append(f"{number_type}_add({self._full(number_type, value)}, c.s{i})")
            # The product of a last operation joins what is added, as it does within the map.
            call = fused("add", (value, added), emitter.origins, emitter.plain)
            if call is not None and bound.add == "point":
                text = f"{call[0]}({', '.join(call[1:])})"
                texts[i] = text if number_type == "real" else f"dual_with({texts[i]}, {text})"
        return texts

    def _apply(self, index: int, number_type: NumberType, *, usual: bool) -> str:
        bound = self.links[index].bound
        state = "state" if number_type == "real" else "dual_state"
        emitter = self._emitter(index, number_type, branches=number_type == "real", usual=usual)
        mapped = self._map(emitter, bound)
        local = None
        if number_type == "dual" and not bound.formula.point_map and self.dual_map != "operations":
            usually = cost_of(needed(emitter.lines, [value.text for value in mapped]))
            jacobian = self._by_local_jacobian(index, usual=usual)
            if self.dual_map == "jacobian" or jacobian.cost() < usually:
                local, emitter = jacobian, jacobian.emitter
        name = self.name + _name(number_type, index, usual)
        head = f"INLINE {state} {name}({state} z, {state} c, __constant const scalar *k) {{"
        # All passes but the last one, whose map is written once more: what is added joins its last operations.
        passes = []
        times = self._times(index, usual=usual)
        if times != "1":
            inner = ", ".join(local.rows() if local else (self._full(number_type, value) for value in mapped))
            passes = [
                f"for (int pass = 1; pass < {times}; ++pass) {{",
                *("    " + line for line in emitter.lines),
                f"    const {state} next = {{{inner}}};",
                "    z = next;",
                "}",
            ]
        texts = (
            self._add_to_jacobian(index, local)
            if local
            else self._add_constant(index, number_type, emitter, mapped)
        )
        return _function(
            head, passes + emitter.lines, f"const {state} next = {{{', '.join(texts)}}};\n    return next;"
        )

    def _times(self, index: int, *, usual: bool) -> str:
        """How often a link's map is applied before something is added, as C text."""
        bound = self.links[index].bound
        formula = bound.formula
        if usual or not names_in(formula.repeat):
            return str(round(evaluate_constant(formula.repeat, formula.shaping)))
        return f"(int)k[{self.constants.slot((index, 'repeat', 0))}]"

    def _by_local_jacobian(self, index: int, *, usual: bool) -> LocalJacobian:
        emitter = self._emitter(index, "real", usual=usual)
        emitter.bindings = {
            name: Value(f"{value.text}.v", value.kind) if value.text.startswith(("z.", "c.")) else value
            for name, value in emitter.bindings.items()
        }
        return local_jacobian(emitter, self._map(emitter, self.links[index].bound), self.size)

    def _add_to_jacobian(self, index: int, local: LocalJacobian) -> list[str]:
        """The components after adding C of a map that is written by its Jacobian."""
        bound = self.links[index].bound
        if bound.add == "none":
            return local.rows()
        texts = []
        for i, value in enumerate(local.mapped):
            added = Value(f"c.s{i}.v", "varying")
            if bound.add == "constant":
                added = Value(self.constants.text((index, "julia", i)), "flat")
            # The product of a last operation joins what is added, as it does within the map.
            call = fused("add", (value, added), local.emitter.origins, local.emitter.plain)
            function, *operands = call or ("real_add", value.text, added.text)
            text = f"{function}({', '.join(operands)})"
            if bound.add == "constant":
                texts.append(local.row(i, text))
            elif i < 3:
                texts.append(local.row(i, text, "xyz"[i]))
            else:
                texts.append(f"dual_with(dual_add({local.row(i, value.text)}, c.s{i}), {text})")
        return texts

    def _apply_derivative(self, index: int, *, usual: bool) -> str:
        """One application that carries the scalar derivative along, sharing what the two have in common."""
        bound = self.links[index].bound
        assert bound.derivative is not None
        emitter = self._emitter(index, "real", branches=True, usual=usual)
        emitter.bindings["dr"] = Value("(*growth)", "varying")
        mapped = self._map(emitter, bound)
        growth = emitter.emit(bound.derivative)
        texts = self._add_constant(index, "real", emitter, mapped)
        name = self.name + _name("derivative", index, usual)
        head = f"INLINE state {name}(state z, state c, real *growth, __constant const scalar *k) {{"
        tail = f"const state next = {{{', '.join(texts)}}};\n    *growth = {growth.text};\n    return next;"
        return _function(head, emitter.lines, tail)

    def _solid_distance(self, index: int | None, number_type: NumberType) -> str:
        """The shape's; nobody asks for that of a formula without one."""
        prefix, state = ("", "state") if number_type == "real" else ("dual_", "dual_state")
        name = f"{self.name}{prefix}solid_distance"
        head = f"INLINE {number_type} {name}({state} z, __constant const scalar *k) {{"
        if index is None:
            return _function(head, [], f"return {self._full(number_type, Value('R(0.0)', 'constant'))};")
        bound = self.links[index].bound
        assert bound.formula.shape is not None
        emitter = self._emitter(index, number_type)
        emitter.lets = dict(bound.formula.let)
        value = self._full(number_type, emitter.emit(bound.formula.shape))
        return _function(head, emitter.lines, f"return {value};")

    # --- the chain ---

    def _dispatch(self, number_type: NumberType, *, derivative: bool) -> str:
        """`apply`: the link whose turn it is, the same for every lane because counts run together."""
        prefix = "derivative" if derivative else number_type
        name = self.name + (
            "apply_derivative" if derivative else "apply" if number_type == "real" else "dual_apply"
        )
        state = "state" if number_type == "real" else "dual_state"
        extra, passed = (", real *growth", ", growth") if derivative else ("", "")

        def call(index: int) -> str:
            general, usual = (
                f"{self.name}{_name(prefix, index, way)}(z, c{passed}, k)" for way in (False, True)
            )
            return f"return usual ? {usual} : {general};" if self.shaped(index) else f"return {general};"

        lines = []
        if len(self.links) > 1:
            lines += _turn(self.chain.spans)
            before = 0
            for index, link in enumerate(self.links[:-1]):
                before += link.count
                lines.append(f"if (turn < {before}) {call(index)}")
        arguments = f"int n, {state} z, {state} c{extra}, __constant const scalar *k"
        head = f"INLINE {state} {name}_by(int usual, {arguments}) {{"
        both = f"return {name}_by({self.name}has_usual_values(k), n, z, c{passed}, k);"
        return _function(head, lines, call(len(self.links) - 1)) + _function(
            f"INLINE {state} {name}({arguments}) {{", [both], None
        )

    def shaped(self, index: int) -> bool:
        """Whether a link has parameters whose usual values are literals."""
        return bool(self.links[index].bound.formula.shaping)

    def _start(self, number_type: NumberType) -> str:
        """The point as a state, and where the orbit begins.

        With f(0) = 0 the first application gives C; dual numbers at 0 would give 0 times infinity in many formulas.
        """
        index, bound = self.chain.first_index, self.chain.first
        names = ["point.x", "point.y", "point.z"]
        state = "state" if number_type == "real" else "dual_state"
        components = names if number_type == "real" else [f"dual_coordinate_{a[-1]}({a})" for a in names]
        bindings = {v: Value(f"c->s{i}", "varying") for i, v in enumerate(bound.formula.variables[:3])}
        emitter = Emitter(number_type, bindings | _parameters(bound), self.constants, index, prefix="p")
        lines = [f"c->s{i} = {component};" for i, component in enumerate(components)]
        if self.size == 4:
            fourth = emitter.emit(bound.formula.slice or Number(0.0))
            lines += [*emitter.lines, f"c->s3 = {self._full(number_type, fourth)};"]
        zero = "R(0.0)" if number_type == "real" else "dual_constant(R(0.0))"
        lines += [f"c->s{i} = {zero};" for i in range(self.size, self.width)]
        if self.starts_at_zero:
            lines += [f"z->s{i} = {zero};" for i in range(self.width)]
        else:
            lines.append("*z = *c;")
            for i in range(self.size if self.starts_at_first else 0):
                component = f"z->s{i}" if number_type == "real" else f"z->s{i}.v"
                lines.append(f"{component} += {self.constants.text((index, 'start', i))};")
        name = "start" if number_type == "real" else "dual_start"
        name = self.name + name
        head = f"INLINE void {name}(vec point, __constant const scalar *k, {state} *c, {state} *z) {{"
        return _function(head, lines, None)


# What drivers have in a library: calls that move all registers into memory.
_CALLS = re.compile(r"\breal_(exp|log|pow|power_\w+|sin|cos|tan|asin|acos|atan2?|arc_slope)\(")


def _name(prefix: str, index: int, usual: bool) -> str:
    return f"{prefix}_{'usual' if usual else 'apply'}_{index}"


def _parameters(bound: BoundFormula) -> dict[str, Value]:
    """Parameters as names that `Emitter` turns into places of `k`."""
    return {name: Value("", "constant", Name(name)) for name in bound.values}


def _turn(spans: Sequence[Span]) -> list[str]:
    """`turn`: the place that application `n` has in the turns of all links."""
    if len(spans) == 1:
        return [f"const int turn = n % {spans[0].cycle};"]
    lines = ["int turn;"]
    for span in spans:
        condition = f"if (n < {span.end}) " if span.end is not None else ""
        lines.append(f"{'} else ' if span is not spans[0] else ''}{condition}{{")
        lines.append(f"    turn = (n + {span.offset}) % {span.cycle};")
        lines += [f"    if (turn >= {first}) turn += {count};" for first, count in span.skipped]
    return [*lines, "}"]


def _function(head: str, lines: Sequence[str], tail: str | None) -> str:
    body = "".join(f"    {line}\n" for line in lines) + (f"    {tail}\n" if tail else "")
    return f"{head}\n{without_unused(body)}}}\n"
