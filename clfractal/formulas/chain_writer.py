"""Writes a chain's functions over `real` and `dual`: its start, each link's application, whose turn it is."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from clfractal.formulas.chain import Chain
from clfractal.formulas.chain_ends import EndsWriter, Leaf, parameters_of
from clfractal.formulas.costs import OPERATIONS, WORTH_CARRYING, cost_of, count_of_operations
from clfractal.formulas.definition import BoundFormula, point_name
from clfractal.formulas.emit import Constants, NumberType
from clfractal.formulas.evaluate import evaluate_constant
from clfractal.formulas.functions import (
    Facts,
    each_usual,
    function_text,
    link_name,
    place_include,
    state_functions,
)
from clfractal.formulas.fuse import fused, needed
from clfractal.formulas.jacobian import LocalJacobian, local_jacobian
from clfractal.formulas.names import APPLICATION
from clfractal.formulas.nodes import names_in
from clfractal.formulas.products import Value, literal
from clfractal.formulas.scopes import ScopedEmitter
from clfractal.formulas.statements import BlockWriter
from clfractal.formulas.turns import turn_lines

# How a map is written over dual numbers: operation by operation, by its own sparse Jacobian, or as costs less.
DualMap = Literal["operations", "jacobian", "cheapest"]


class ChainWriter(EndsWriter):
    def __init__(self, chain: Chain, scalar_rule: bool, dual_map: DualMap, leaf: Leaf | None) -> None:
        super().__init__(chain, scalar_rule, leaf)
        self.dual_map = dual_map
        has_rule = all(link.bound.derivative is not None for link in self.links)
        self.has_derivative = scalar_rule and (has_rule or self.ruled)
        self.ways = [
            (index, way)
            for index in range(len(self.links))
            for way in (False, True)
            if self.shaped(index) >= way
        ]

    def write(self) -> tuple[str, Facts, Constants]:
        """The text, what kernels know of it, and the places of what the host passes."""
        parts = [self.placed_table()] if self.placed else []
        parts += [self._has_usual_values(), *self._of_type("real"), *self._of_type("dual")]
        parts += filter(None, [self.carried_number()])
        if self.has_derivative:
            parts += (self._apply_derivative(index, usual=usual) for index, usual in self.ways)
            parts.append(self._dispatch("real", derivative=True))
            parts += [self.start_growth()] if self.placed else []
        facts = Facts(
            self.width,
            int(self.chain.starts_counted),
            self.chain.degree > 1,
            self.has_derivative,
            self.ruled or self.chain.shape_index is not None,
            any(map(_CALLS.search, parts)),
            len(self.links) == 1 and not self._numbered(0) and self._operations() >= WORTH_CARRYING,
            self.room,
            self.by_record,
            self.placed,
        )
        types = state_functions(self.width, self.room, self.over_duals, placed=self.placed)
        included = [place_include(self.width + self.room)] if self.placed else []
        head = [facts.defines() + each_usual(1), *included, types] if self.leaf is None else []
        return "\n".join([*head, *parts]) + "\n", facts, self.constants

    def _numbered(self, index: int) -> bool:
        """Whether a link's applications depend on their number."""
        return self.links[index].bound.formula.numbered

    def _operations(self) -> int:
        """Of an application as rays march by it, of the first link."""
        usual = self.shaped(0)
        if self.has_derivative and not self.ruled:
            marched = self._apply_derivative(0, usual=usual)
        else:
            marched = self._apply(0, "real" if self.ruled else "dual", usual=usual)
        return count_of_operations(marched, OPERATIONS)

    def _of_type(self, number_type: NumberType) -> list[str]:
        """The functions over one number type."""
        return [
            self.start(number_type),
            *(self._apply(index, number_type, usual=usual) for index, usual in self.ways),
            self._dispatch(number_type, derivative=False),
            self.solid_distance(number_type),
        ]

    def _has_usual_values(self) -> str:
        """Whether all parameters have the values that are literals."""
        answer = "1"
        if any(map(self.shaped, range(len(self.links)))):
            answer = f"k[{self.constants.slot((0, 'usual', 0))}] > S(0.5)"
        return function_text(
            f"INLINE int {self.name}has_usual_values(__constant const scalar *k) {{", [], f"return {answer};"
        )

    # --- one link ---

    def emitter(
        self, index: int, number_type: NumberType, *, branches: bool = False, usual: bool = False
    ) -> ScopedEmitter:
        bound = self.links[index].bound
        bindings = {point_name(v): self._point_value(index, i) for i, v in enumerate(bound.formula.variables)}
        bindings |= {v: Value(f"z.s{i}", "varying") for i, v in enumerate(bound.formula.variables)}
        bindings |= self._carried_values(index, number_type)
        if self._numbered(index):
            bindings[APPLICATION] = Value(f"((real)((scalar){APPLICATION}))", "flat")
        # Values that are not the usual ones need not be numbers where only the usual ones have a meaning.
        literals = {name: literal(value) for name, value in bound.formula.shaping.items() if usual}
        return ScopedEmitter(
            number_type,
            bindings | parameters_of(bound) | literals,
            self.constants,
            index,
            branches,
            guarded=usual,
        )

    def _carried_values(self, index: int, number_type: NumberType) -> dict[str, Value]:
        """The numbers that a link carries, as they are before it."""
        found = {}
        for each in self.links[index].bound.formula.state:
            place = self.carried.index(each.name)
            if number_type == "real" or place in self.over_duals:
                flat = number_type == "dual" and self.over_duals[place] == "real"
                found[each.name] = Value(f"z.e{place}", "flat" if flat else "varying")
        return found

    def _point_value(self, index: int, component: int) -> Value:
        """`point_x` and its like: the constant that is added, which in a Julia set is not the point in space."""
        bound = self.links[index].bound
        name = point_name(bound.formula.variables[component])
        rule = bound.formula.derivative
        used = bound.formula.point_map or (rule is not None and name in names_in(rule))
        if bound.add == "constant" and used:
            return Value(self.constants.text((index, "julia", component)), "flat")
        return Value(f"c.s{component}", "varying")

    def _map(self, emitter: ScopedEmitter, bound: BoundFormula, carried: Sequence[str] = ()) -> _Mapped:
        """What a link makes of z and of the numbers `carried`, before anything is added."""
        formula = bound.formula
        if not formula.steps:
            emitter.lets = dict(formula.let)
            return _Mapped([emitter.emit(node) for node in formula.map], {}, jumps=False)
        writer = BlockWriter(emitter)
        if formula.numbered:
            writer.count(APPLICATION, APPLICATION)
        own = [name for name in carried if name in emitter.bindings]
        writer.write(formula.steps, frozenset((*formula.variables, *own)))
        values = [emitter.bindings[name] for name in formula.variables]
        return _Mapped(values, {name: emitter.bindings[name] for name in own}, writer.jumps)

    def _beside(self, number_type: NumberType, emitter: ScopedEmitter, mapped: _Mapped) -> list[str]:
        """The texts of the numbers beside z after a link: those that it does not have stay as they are."""
        places = range(len(self.carried)) if number_type == "real" else sorted(self.over_duals)
        texts = ["R(0.0)" if number_type == "real" else "dual_constant(R(0.0))"] * (self.width - self.size)
        for place in places:
            value = mapped.beside.get(self.carried[place]) if place < len(self.carried) else None
            if value is None:
                texts.append(f"z.e{place}")
            elif number_type == "dual" and self.over_duals[place] == "dual":
                texts.append(self.full("dual", value))
            else:
                texts.append(value.text)
        return texts if places else []

    def _add_constant(
        self, index: int, number_type: NumberType, emitter: ScopedEmitter, mapped: list[Value]
    ) -> list[str]:
        """The components after adding C."""
        bound = self.links[index].bound
        texts: list[str] = []
        for i, value in enumerate(mapped):
            added = Value(f"c.s{i}", "varying")
            if bound.add == "none":
                texts.append(self.full(number_type, value))
            elif bound.add == "constant":
                assert bound.julia is not None
                added = Value(self.constants.text((index, "julia", i)), "flat")
                texts.append(self.full(number_type, emitter.combine("add", value, added)))
            elif number_type == "dual" and i < 3:
                # The point's own coordinate has the partials 1, 0, 0: one addition instead of four.
                texts.append(f"dual_add_coordinate_{'xyz'[i]}({self.full('dual', value)}, c.s{i}.v)")
            else:
                texts.append(f"{number_type}_add({self.full(number_type, value)}, c.s{i})")
            # The product of a last operation joins what is added, as it does within the map.
            call = fused("add", (value, added), emitter.origins, emitter.plain)
            if call is not None and bound.add == "point":
                text = f"{call[0]}({', '.join(call[1:])})"
                texts[i] = text if number_type == "real" else f"dual_with({texts[i]}, {text})"
        return texts

    def _apply(self, index: int, number_type: NumberType, *, usual: bool) -> str:
        bound = self.links[index].bound
        state = "state" if number_type == "real" else "dual_state"
        emitter = self.emitter(index, number_type, branches=number_type == "real", usual=usual)
        found = self._map(emitter, bound, self._beside_z(number_type))
        mapped = found.values
        local, written = None, emitter.lines
        if self._may_be_local(bound, number_type) and not found.jumps:
            usually = cost_of(needed(emitter.lines, [value.text for value in mapped]))
            jacobian = self._by_local_jacobian(index, usual=usual)
            if self.dual_map == "jacobian" or jacobian.cost() < usually:
                local, written = jacobian, jacobian.emitter.lines
        name = self.name + link_name(number_type, index, usual)
        number = f"int {APPLICATION}, " if self._numbered(index) else ""
        head = f"INLINE {state} {name}({number}{state} z, {state} c, __constant const scalar *k) {{"
        # All passes but the last one, whose map is written once more: what is added joins its last operations.
        passes = []
        times = self._times(index, usual=usual)
        if times != "1":
            inner = ", ".join(local.rows() if local else (self.full(number_type, value) for value in mapped))
            passes = [
                f"for (int pass = 1; pass < {times}; ++pass) {{",
                *("    " + line for line in written),
                f"    const {state} next = {{{inner}}};",
                "    z = next;",
                "}",
            ]
        texts = (
            self._add_to_jacobian(index, local)
            if local
            else self._add_constant(index, number_type, emitter, mapped)
        )
        texts += self._beside(number_type, emitter, found)
        return function_text(
            head, passes + written, f"const {state} next = {{{', '.join(texts)}}};\n    return next;"
        )

    def _beside_z(self, number_type: NumberType) -> list[str]:
        """The numbers that go on beside z over this number type."""
        if number_type == "real":
            return list(self.carried)
        return [self.carried[place] for place in self.over_duals if place < len(self.carried)]

    def _may_be_local(self, bound: BoundFormula, number_type: NumberType) -> bool:
        """Whether a map may be written by its own Jacobian."""
        own = {each.name for each in bound.formula.state}.intersection(self._beside_z("dual"))
        return (
            number_type == "dual"
            and not bound.formula.point_map
            and not own
            and self.dual_map != "operations"
        )

    def _times(self, index: int, *, usual: bool) -> str:
        """How often a link's map is applied before something is added, as C text."""
        bound = self.links[index].bound
        formula = bound.formula
        if usual or not names_in(formula.repeat):
            return str(round(evaluate_constant(formula.repeat, formula.shaping)))
        return f"(int)k[{self.constants.slot((index, 'repeat', 0))}]"

    def _by_local_jacobian(self, index: int, *, usual: bool) -> LocalJacobian:
        emitter = self.emitter(index, "real", usual=usual)
        emitter.bindings = {
            name: Value(f"{value.text}.v", value.kind) if value.text.startswith(("z.", "c.")) else value
            for name, value in emitter.bindings.items()
        }
        return local_jacobian(emitter, self._map(emitter, self.links[index].bound).values, self.size)

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
        number, passed = (f"int {APPLICATION}, ", f"{APPLICATION}, ") if self._numbered(index) else ("", "")
        name = self.name + link_name("derivative", index, usual)
        head = f"INLINE state {name}({number}state z, state c, real *growth, __constant const scalar *k) {{"
        if self.ruled:
            # The distance is in scene units: nothing is to be divided by.
            same = f"{self.name}{link_name('real', index, usual)}"
            return function_text(head, [], f"return {same}({passed}z, c, k);")
        assert bound.derivative is not None
        emitter = self.emitter(index, "real", branches=True, usual=usual)
        emitter.bindings["dr"] = Value("(*growth)", "varying")
        found = self._map(emitter, bound)
        growth = emitter.emit(bound.derivative)
        texts = self._add_constant(index, "real", emitter, found.values) + self._beside(
            "real", emitter, found
        )
        tail = f"const state next = {{{', '.join(texts)}}};\n    *growth = {growth.text};\n    return next;"
        return function_text(head, emitter.lines, tail)

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
            number = f"{APPLICATION}, " if self._numbered(index) else ""
            general, usual = (
                f"{self.name}{link_name(prefix, index, way)}({number}z, c{passed}, k)"
                for way in (False, True)
            )
            return f"return usual ? {usual} : {general};" if self.shaped(index) else f"return {general};"

        lines = []
        order = self.chain.turn_order
        last = order[-1]
        if self.chain.turns_are_data:
            last = len(order) - 1
            first, early, again = (f"(int)k[{self.constants.slot((0, 'turns', part))}]" for part in range(3))
            lines.append(f"const int place = n < {early} ? n : {early} + (n - {early}) % {again};")
            lines.append(f"const int link = (int)k[{first} + place];")
            lines += (f"if (link == {index}) {call(index)}" for index in range(len(self.links) - 1))
        elif len(self.links) > 1:
            lines += turn_lines(self.chain.spans)
            before = 0
            for index in order[:-1]:
                before += self.links[index].count
                lines.append(f"if (turn < {before}) {call(index)}")
        arguments = f"int n, {state} z, {state} c{extra}, __constant const scalar *k"
        inner = f"{name}_begun" if self.placed else f"{name}_by"
        head = f"INLINE {state} {inner}(int usual, {arguments}) {{"
        both = f"return {name}_by({self.name}has_usual_values(k), n, z, c{passed}, k);"
        waiting = self._waiting(name, state, arguments, derivative=derivative) if self.placed else ""
        return "".join(
            [
                function_text(head, lines, call(last)),
                waiting,
                function_text(f"INLINE {state} {name}({arguments}) {{", [both], None),
            ]
        )

    @staticmethod
    def _waiting(name: str, state: str, arguments: str, *, derivative: bool) -> str:
        """An application of those lanes whose orbits have begun; the others wait."""
        growth, passed = (["real grown = *growth;"], ", &grown") if derivative else ([], "")
        lines = [
            "const mask begun = less_equal(z.begun, (real)((scalar)n));",
            "if (!any_lane(begun)) return z;",
            *growth,
            f"{state} next = {name}_begun(usual, n, z, c{passed}, k);",
            "next.begun = R(0.0);",
            *(["*growth = pick(begun, grown, *growth);"] if derivative else []),
        ]
        pick = "state_pick" if state == "state" else "dual_state_pick"
        head = f"INLINE {state} {name}_by(int usual, {arguments}) {{"
        return function_text(head, lines, f"return {pick}(begun, next, z);")

    def shaped(self, index: int) -> bool:
        """Whether a link has parameters whose usual values are literals."""
        return bool(self.links[index].bound.formula.shaping)


@dataclass(frozen=True, slots=True)
class _Mapped:
    """What a link makes of z, and of the numbers beside it; and whether there are branches or loops in it."""

    values: list[Value]
    beside: dict[str, Value]
    jumps: bool


# What drivers have in a library: calls that move all registers into memory.
_CALLS = re.compile(r"\breal_(exp|log|pow|power_\w+|sin|cos|tan|asin|acos|atan2?|arc_slope)\(")
