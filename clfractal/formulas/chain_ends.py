"""Writes the two ends of a chain's orbits: where they begin, and what tells the last solid."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from clfractal.formulas.carried import carried_over_duals
from clfractal.formulas.chain import Chain, Link
from clfractal.formulas.definition import BoundFormula
from clfractal.formulas.emit import Constants, NumberType
from clfractal.formulas.functions import function_text
from clfractal.formulas.names import name_number
from clfractal.formulas.nodes import Name, Node, Number, names_in
from clfractal.formulas.products import Value
from clfractal.formulas.scopes import ScopedEmitter


@dataclass(frozen=True, slots=True)
class Leaf:
    """A formula among several: what its functions' names begin with, and of how many numbers the state of all is.

    Attributes:
        width: numbers of z.
        carried: numbers that are carried beside it.
    """

    name: str
    width: int
    carried: int = 0


class EndsWriter(ABC):
    """What all functions of a chain are written with, and those of its ends.

    Where turns are data any link may be the first one, and the last: what differs between them is passed.
    """

    def __init__(self, chain: Chain, scalar_rule: bool, leaf: Leaf | None) -> None:
        self.chain = chain
        self.leaf = leaf
        self.name = "" if leaf is None else leaf.name
        self.links: Sequence[Link] = chain.links
        self.size = chain.size
        self.width = chain.size if leaf is None else leaf.width
        self.constants = Constants()
        # Rays march by a scalar rule, or by a distance of the formula's own.
        self.ruled = scalar_rule and chain.rule_index is not None
        self.carried = chain.carried
        self.room = len(self.carried) if leaf is None else leaf.carried
        over_duals = carried_over_duals(chain)
        # Of each number beside z over dual numbers the type; several formulas have them all as dual numbers.
        self.over_duals = {self.carried.index(name): c_type for name, c_type in over_duals.items()}
        if leaf is not None:
            self.over_duals = dict.fromkeys(range(self.room), "dual")
        self.placed = chain.place is not None
        firsts = chain.links if chain.turns_are_data else (chain.links[chain.first_index],)
        self.begins = {link.bound.begins for link in firsts}

    @property
    def by_record(self) -> frozenset[str]:
        """What kernels know of the formula that differs with the turns, and is read from the orbit's record."""
        found = {"first_count"} if len(self.begins) > 1 and "after" in self.begins else set()
        if self.chain.turns_are_data:
            if len({link.bound.degree > 1 for link in self.links}) > 1:
                found.add("logarithmic")
            if 0 < len(self.tells_solid) < len(self.links):
                found.add("has_shape")
        return frozenset(found)

    @property
    def tells_solid(self) -> tuple[int, ...]:
        """The links that may tell the last solid as rays march."""
        return self.chain.may_tell_solid(ruled=self.ruled)

    def full(self, number_type: NumberType, value: Value) -> str:
        """A value as text of the full number type."""
        return (
            f"dual_constant({value.text})"
            if number_type == "dual" and value.kind != "varying"
            else value.text
        )

    # --- the beginning ---

    def start(self, number_type: NumberType) -> str:
        """The point as a state, and where the orbit begins.

        With f(0) = 0 the first application gives C; dual numbers at 0 would give 0 times infinity in many formulas.
        """
        if self.placed:
            return self._placed_start(number_type)
        names = ["point.x", "point.y", "point.z"]
        state = "state" if number_type == "real" else "dual_state"
        components = names if number_type == "real" else [f"dual_coordinate_{a[-1]}({a})" for a in names]
        lines = [f"c->s{i} = {component};" for i, component in enumerate(components)]
        if self.size == 4:
            lines += self._fourth(number_type)
        zero = "R(0.0)" if number_type == "real" else "dual_constant(R(0.0))"
        lines += [f"c->s{i} = {zero};" for i in range(self.size, self.width)]
        zeros = [f"z->s{i} = {zero};" for i in range(self.width)]
        if len(self.begins) == 1:
            lines += zeros if "zero" in self.begins else ["*z = *c;"]
        elif "zero" in self.begins:
            at_point = f"k[{self.constants.slot((0, 'begins', 0))}] > S(0.5)"
            lines += [f"if ({at_point}) {{", "    *z = *c;", "} else {", *("    " + z for z in zeros), "}"]
        else:
            lines.append("*z = *c;")
        for i in range(self.size if "after" in self.begins else 0):
            component = f"z->s{i}" if number_type == "real" else f"z->s{i}.v"
            lines.append(f"{component} += {self.constants.text((0, 'start', i))};")
        lines += self._start_beside(number_type)
        name = self.name + ("start" if number_type == "real" else "dual_start")
        head = f"INLINE void {name}(vec point, __constant const scalar *k, {state} *c, {state} *z) {{"
        return function_text(head, lines, None)

    def _placed_start(self, number_type: NumberType) -> str:
        """The same where a scene shows a place of the formula's space: orbits begin as a table says."""
        over_reals = number_type == "real"
        state = "state" if over_reals else "dual_state"
        lines = ["const placed at = placed_begin(point, placed_table(k), k);"]
        for i, axis in enumerate("xyz"):
            near = self.constants.text((0, "center", i))
            coordinate = f"{near} + at.moved.{axis}"
            lines.append(
                f"c->s{i} = {coordinate if over_reals else f'dual_coordinate_{axis}({coordinate})'};"
            )
        if self.size == 4:
            lines += self._fourth(number_type)
        for i in range(self.size):
            lines.append(f"z->s{i} = {_placed_number(i, plain=over_reals)};")
        for place in range(self.room) if over_reals else sorted(self.over_duals):
            plain = self.is_plain(number_type, place)
            lines.append(f"c->e{place} = {'R(0.0)' if plain else 'dual_constant(R(0.0))'};")
            lines.append(f"z->e{place} = {_placed_number(self.size + place, plain=plain)};")
        lines += ["c->begun = R(0.0);", "z->begun = at.begun;"]
        name = "start" if over_reals else "dual_start"
        head = f"INLINE void {name}(vec point, __constant const scalar *k, {state} *c, {state} *z) {{"
        return function_text(head, lines, None)

    def start_growth(self) -> str:
        """The scalar derivative where an orbit begins."""
        head = "INLINE real start_growth(vec point, __constant const scalar *k) {"
        lines = ["const placed at = placed_begin(point, placed_table(k), k);"]
        return function_text(head, lines, "return at.growth;")

    def placed_table(self) -> str:
        """Where among the constants the table of begun orbits stands."""
        at = f"(int)k[{self.constants.slot((0, 'place', 0))}]"
        return function_text("INLINE int placed_table(__constant const scalar *k) {", [], f"return {at};")

    def _fourth(self, number_type: NumberType) -> list[str]:
        """The fourth coordinate of a point in space, as the first link has it."""
        nodes = {index: link.bound.formula.slice or Number(0.0) for index, link in enumerate(self.links)}
        if self.chain.turns_are_data:
            usual = Value(self.constants.text((0, "slice", 0)), "constant")
            lines = [f"c->s3 = {self.full(number_type, usual)};"]
            return lines + self._of_links("c->s3", number_type, "fourth", 0, nodes)
        emitter = self._at_point(number_type, self.chain.first_index, "p")
        fourth = emitter.emit(nodes[self.chain.first_index])
        return [*emitter.lines, f"c->s3 = {self.full(number_type, fourth)};"]

    def _of_links(
        self, target: str, number_type: NumberType, what: str, place: int, nodes: Mapping[int, Node]
    ) -> list[str]:
        """Statements that set something to what the link with the number `what` says, where that depends on the point."""
        lines = []
        for index, node in nodes.items():
            if names_in(node) <= self.links[index].bound.values.keys():
                continue
            emitter = self._at_point(number_type, index, "p")
            value = self.full(number_type, emitter.emit(node))
            lines += [
                f"if ((int)k[{self.constants.slot((0, what, place))}] == {index}) {{",
                *("    " + line for line in (*emitter.lines, f"{target} = {value};")),
                "}",
            ]
        return lines

    def _at_point(self, number_type: NumberType, index: int, prefix: str) -> ScopedEmitter:
        """An emitter for expressions of a link's parameters and of the point's coordinates."""
        bound = self.links[index].bound
        bindings = {v: Value(f"c->s{i}", "varying") for i, v in enumerate(bound.formula.variables[:3])}
        return ScopedEmitter(
            number_type, bindings | parameters_of(bound), self.constants, index, prefix=prefix
        )

    def _start_beside(self, number_type: NumberType) -> list[str]:
        """The numbers beside z before the first application that is counted on."""
        zero = "R(0.0)" if number_type == "real" else "dual_constant(R(0.0))"
        places = range(self.room) if number_type == "real" else sorted(self.over_duals)
        lines = [f"c->e{place} = {zero};" for place in places if not self.is_plain(number_type, place)]
        lines += [f"c->e{place} = R(0.0);" for place in places if self.is_plain(number_type, place)]
        for place in places:
            value, more = Value("R(0.0)", "constant"), list[str]()
            if place < len(self.carried):
                value, more = self._begun(number_type, place)
            plain = self.is_plain(number_type, place)
            text = value.text if plain else self.full(number_type, value)
            lines += [*more, f"z->e{place} = {text};"]
            if place < len(self.carried) and self.chain.turns_are_data:
                starts = self.chain.starts_of(self.carried[place])
                lines += self._of_links(f"z->e{place}", number_type, "begun", place, starts)
        return lines

    def _begun(self, number_type: NumberType, place: int) -> tuple[Value, list[str]]:
        """A carried number before the first application that is counted on, and the statements that this needs."""
        name = self.carried[place]
        if self.chain.turns_are_data or self.chain.begun(name) is None:
            return Value(self.constants.text((0, "beside", place)), "constant"), []
        index, node = self.chain.begins(name)
        emitter = self._at_point(number_type, index, f"b{place}_")
        return emitter.emit(node), emitter.lines

    def is_plain(self, number_type: NumberType, place: int) -> bool:
        """Whether a number beside z has no partials."""
        return number_type == "real" or self.over_duals[place] == "real"

    # --- the end ---

    def carried_number(self) -> str:
        """What a number beside z is, by the number of its name; nothing where no formula of the text carries any."""
        if not self.room:
            return ""
        cases = [f"case {name_number(name)}: return z.e{place};" for place, name in enumerate(self.carried)]
        head = f"INLINE real {self.name}carried_number(int name, state z, __constant const scalar *k) {{"
        return function_text(head, [f"switch (name) {{ {' '.join(cases)} default: return R(0.0); }}"], None)

    def solid_distance(self, number_type: NumberType) -> str:
        """The shape's, or the formula's own distance; nobody asks for that of a formula without one."""
        prefix, state = ("", "state") if number_type == "real" else ("dual_", "dual_state")
        name = f"{self.name}{prefix}solid_distance"
        parameters = f"({state} z, __constant const scalar *k) {{"
        ruled = self.ruled and number_type == "real"
        told = self.chain.may_tell_solid(ruled=ruled)
        if not told:
            nothing = self.full(number_type, Value("R(0.0)", "constant"))
            return function_text(f"INLINE {number_type} {name}{parameters}", [], f"return {nothing};")
        if len(told) == 1:
            return self._solid_of(told[0], number_type, f"{name}{parameters}")
        each = [self._solid_of(index, number_type, f"{name}_{index}{parameters}") for index in told]
        last = f"(int)k[{self.constants.slot((0, 'last', 0))}]"
        lines = [f"if ({last} == {index}) return {name}_{index}(z, k);" for index in told[:-1]]
        chosen = function_text(
            f"INLINE {number_type} {name}{parameters}", lines, f"return {name}_{told[-1]}(z, k);"
        )
        return "".join([*each, chosen])

    def _solid_of(self, index: int, number_type: NumberType, head: str) -> str:
        formula = self.links[index].bound.formula
        node = formula.shape if self.chain.rule_index is None else formula.distance
        assert node is not None
        emitter = self.emitter(index, number_type)
        emitter.lets = dict(formula.let)
        value = self.full(number_type, emitter.emit(node))
        return function_text(f"INLINE {number_type} {head}", emitter.lines, f"return {value};")

    @abstractmethod
    def emitter(
        self, index: int, number_type: NumberType, *, branches: bool = False, usual: bool = False
    ) -> ScopedEmitter:
        """An emitter for what a link makes of z."""


def _placed_number(number: int, *, plain: bool) -> str:
    """A number of the state where an orbit begins."""
    z = f"at.z[{number}]"
    return f"{z}.v" if plain else f"(dual){{{z}.v, {z}.dx, {z}.dy, {z}.dz}}"


def parameters_of(bound: BoundFormula) -> dict[str, Value]:
    """Parameters as names that `Emitter` turns into places of `k`."""
    return {name: Value("", "constant", Name(name)) for name in bound.values}


def passed(chain: Chain, index: int, what: str, component: int, *, behind: int) -> float:
    """A run-time constant that is no expression.

    Args:
        index: the link's number; of what belongs to the whole chain 0.
        behind: how many constants there are, behind which the turns stand.
    """
    bound = chain.links[index].bound
    if what == "usual":
        return float(all(link.bound.has_usual_values for link in chain.links))
    if what == "repeat":
        return float(bound.repeat)
    if what == "turns":
        table, again = chain.table
        return float((behind, len(table) - again, again)[component])
    if what == "place":
        return float(behind + (len(chain.table[0]) if chain.turns_are_data else 0))
    if what == "center":
        assert chain.place is not None
        return chain.place.near[component]
    if what == "last":
        found = chain.rule_index if chain.rule_index is not None else chain.shape_index
        return float(-1 if found is None else found)
    if what == "begins":
        return float(not chain.starts_at_zero)
    if what == "slice":
        return _plain_value(chain.first, chain.first.formula.slice or Number(0.0))
    if what == "fourth":
        return float(chain.first_index)
    if what == "beside":
        return _beside(chain, chain.carried[component])
    if what == "begun":
        found = chain.begun(chain.carried[component])
        return float(-1 if found is None else found)
    if what == "start":
        begin = chain.first.start if chain.starts_counted else None
        return 0.0 if begin is None else begin[component]
    assert bound.julia is not None
    return bound.julia[component]


def _beside(chain: Chain, name: str) -> float:
    """A carried number before the first application that is counted on, where that is a value of parameters; else 0."""
    if chain.begun(name) is None:
        own = [each.name for each in chain.first.formula.state]
        assert chain.first.start is not None
        return chain.first.start[chain.size + own.index(name)]
    index, node = chain.begins(name)
    return _plain_value(chain.links[index].bound, node)


def _plain_value(bound: BoundFormula, node: Node) -> float:
    """An expression of parameters alone; 0 for others."""
    return bound.value(node) if names_in(node) <= bound.values.keys() else 0.0
