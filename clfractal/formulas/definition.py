"""A formula, its parameters, and a formula bound to values of them."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any, Literal, TypeAlias

from clfractal.errors import FormulaError, Where
from clfractal.formulas.blocks import Block, leaves_in, nodes_of, run, turns_in
from clfractal.formulas.evaluate import as_function, evaluate, finite
from clfractal.formulas.names import APPLICATION
from clfractal.formulas.nodes import Call, Node, Number, is_condition, names_in, substitute, walk

# Of functions that are computed in several ways the argument that chooses.
_CHOOSING = MappingProxyType({"pow": 1, "cpow_re": 2, "cpow_im": 2, "where": 0})

Add: TypeAlias = Literal["point", "constant", "none"]
# Orbits begin at 0, at the point, or after the first application of a formula that adds it.
Begins: TypeAlias = Literal["zero", "point", "after"]

DEFAULT_DISTANCE_BAILOUT = 1000.0
# |z| after one more application than needed may be distance_bailout**degree, its Jacobian that over the
# distance, and squares of both are taken: 1e8 leaves a float32 room for distances down to 1e-10.
LARGEST_POWER = 1e8
MAX_REPEAT = 64


def point_name(variable: str) -> str:
    """The name under which a map may use the constant C of a variable (`point_x`; of a vector's numbers `point.x`)."""
    vector, dot, letter = variable.partition(".")
    return f"point.{letter}" if dot else f"point_{vector}"


def inside(where: Where, *parts: str) -> Where:
    """The place of a key below `where`."""
    path = ".".join([*([where.path] if where.path else []), *parts])
    return Where(where.file, where.line, where.column, path)


@dataclass(frozen=True, slots=True)
class Parameter:
    """A named number of a formula; `baked` has no effect, and is kept as it was read."""

    name: str
    type: Literal["int", "real"]
    default: float
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[float, ...] | None = None
    baked: bool = False
    description: str = ""

    def check(self, value: object, where: Where) -> float:
        """The value as a float (a whole one for `int`).

        Raises:
            FormulaError: not a finite number, not whole, out of range, or none of the choices.
        """
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise FormulaError(f"must be a number, got {str(value)[:60]!r}", where)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        shown = f"{number:g}"
        if not math.isfinite(number):
            raise FormulaError(f"must be a finite number, got {shown}", where)
        if self.type == "int" and number != math.floor(number):
            raise FormulaError(f"must be a whole number, got {shown}", where)
        if self.choices is not None and number not in self.choices:
            listing = ", ".join(f"{choice:g}" for choice in self.choices)
            raise FormulaError(f"must be one of {listing}, got {shown}", where)
        if self.minimum is not None and number < self.minimum:
            raise FormulaError(f"must be at least {self.minimum:g}, got {shown}", where)
        if self.maximum is not None and number > self.maximum:
            raise FormulaError(f"must be at most {self.maximum:g}, got {shown}", where)
        return number


@dataclass(frozen=True, slots=True)
class Carried:
    """A number that applications carry on beside z.

    Attributes:
        start: its value before the first application, of parameters and of the point's three coordinates.
        next: its value after an application, beside a `map`; None: it stays as it is, or `do` gives it values.
    """

    name: str
    start: Node
    next: Node | None = None


@dataclass(frozen=True, eq=False)
class Formula:
    """A map of three or four real variables that is iterated, as its file describes it.

    Formulas are equal only if they are the same object: the catalog returns one object for equal contents.

    Attributes:
        variables: names of the components of z; their order is the order of `map`.
        let: names for parts of the map, computed in this order before it; later ones may use earlier ones.
        map: one expression for each variable.
        repeat: how often the map is applied before C is added.
        add: `point` adds the point in space, `constant` a fixed one (a Julia set), `none` nothing (an IFS).
        degree: |z| grows like |z|**degree far outside, for one application with its repeats; 1: linearly.
        bounds_center, bounds_radius: a sphere that holds the set, in scene units.
        bailout, distance_bailout: |z| beyond which a point has escaped, for counts and for distances.
        step_scale: how much of an estimated distance it is safe to step.
        slice: the fourth coordinate of a point in space, for four variables.
        shape: for degree 1, the distance in z-space to the last solid; without it a ball around the origin.
        derivative: a cheaper scalar rule for |dz/dC|: its new value from `dr`, the old one, and the state
            before the application, with `added` 1 where C is the point and 0 elsewhere.
        point_map: the map or a `let` uses `point_<variable>`, the constant C.
        julia: the constant to add when none is given (only with `add: constant`).
        alone: the set is empty, and no ray asks for it: the formula of scenes of objects alone.
        source: the mapping it was read from, as plain data.
        state: the numbers that are carried beside z.
        steps: an application as statements, `let` and `map` among them, where the formula has `state` or `do`; else
            none, and `let` and `map` tell all.
        distance: the distance of a point, in scene units, from its last z and its carried numbers.
        numbered: an application depends on its number `n`.
    """

    name: str
    title: str
    reference: str
    variables: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    let: tuple[tuple[str, Node], ...]
    map: tuple[Node, ...]
    repeat: Node
    add: Add
    degree: Node
    bounds_center: tuple[Node, Node, Node]
    bounds_radius: Node
    bailout: Node
    distance_bailout: Node | None
    step_scale: Node
    slice: Node | None
    shape: Node | None
    derivative: Node | None
    point_map: bool
    julia: tuple[float, ...] | None
    alone: bool
    source: Mapping[str, Any]
    description: str
    state: tuple[Carried, ...] = ()
    steps: Block = ()
    distance: Node | None = None
    numbered: bool = False

    @property
    def grown(self) -> bool:
        """Whether it has words that change how it is written: what it does depends on more than z, or is in statements."""
        return bool(self.steps) or self.numbered or self.distance is not None

    def parameter(self, name: str) -> Parameter | None:
        """The parameter of that name, or None."""
        return next((parameter for parameter in self.parameters if parameter.name == name), None)

    def function(self, node: Node) -> Callable[[Mapping[str, float]], Any]:
        """One of the formula's expressions as a function of the values of its names; made once and kept."""
        known = self._functions.get(id(node))
        if known is None or known[0] is not node:
            self._functions[id(node)] = known = (node, as_function(node))
        return known[1]

    @cached_property
    def shaping(self) -> Mapping[str, float]:
        """Parameters that choose between ways to compute (by exponents, conditions, repeats), with their defaults."""
        let = dict(self.let)

        def leaves(node: Node) -> frozenset[str]:
            return frozenset(leaf for name in names_in(node) for leaf in known.get(name, (name,)))

        known: dict[str, frozenset[str]] = {}
        for name, node in let.items():
            known[name] = leaves(node)
        defaults = {parameter.name: parameter.default for parameter in self.parameters}
        found = set(names_in(self.repeat))
        if self.steps:
            own = {*self.variables, *(each.name for each in self.state)}
            uses = leaves_in(self.steps)
            known = {name: used - (uses.keys() - own) for name, used in uses.items()}
            for node in turns_in(self.steps):
                # Of `on > 0 and n > 3` a part is decided by a parameter alone.
                for part in walk(node):
                    if (part is node or is_condition(part)) and leaves(part) <= defaults.keys():
                        found |= leaves(part)
        nodes = nodes_of(self.steps) if self.steps else (*let.values(), *self.map)
        for node in (*nodes, *([self.derivative] if self.derivative else [])):
            for part in walk(node):
                if isinstance(part, Call) and part.function in _CHOOSING:
                    names = leaves(part.arguments[_CHOOSING[part.function]])
                    if names <= defaults.keys():
                        found |= names
        return {name: value for name, value in defaults.items() if name in found}

    @cached_property
    def content(self) -> str:
        """The mapping that it was read from, as text."""
        return json.dumps(self.source, sort_keys=True, default=str)

    @cached_property
    def _functions(self) -> dict[int, tuple[Node, Callable[[Mapping[str, float]], Any]]]:
        return {}

    def __getstate__(self) -> dict[str, Any]:
        """Only the fields: functions made from them cannot be sent to another process."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


@dataclass(frozen=True, eq=False)
class BoundFormula:
    """A formula with a value for each parameter; made by `bind`, which checks them.

    Attributes:
        values: parameter name to value (whole for `int`).
        julia: the constant that is added, one number for each variable, or None.
        bailout_override, distance_bailout_override: radii that replace the formula's own.
    """

    formula: Formula
    values: Mapping[str, float]
    julia: tuple[float, ...] | None = None
    bailout_override: float | None = None
    distance_bailout_override: float | None = None

    @cached_property
    def key(self) -> tuple[object, ...]:
        """Equal for two bound formulas that are the same in every value; bytes, because 0.0 == -0.0."""
        numbers = (*self.values.values(), *(self.julia or ()))
        return (
            self.formula,
            struct.pack(f"{len(numbers)}d", *numbers),
            self.julia is None,
            self.bailout_override,
            self.distance_bailout_override,
        )

    @property
    def add(self) -> Add:
        """What is added: a julia constant turns `point` into `constant`."""
        return "constant" if self.julia is not None else self.formula.add

    @property
    def repeat(self) -> int:
        """Applications of the map before C is added, 1 to MAX_REPEAT."""
        return round(self.value(self.formula.repeat))

    @property
    def degree(self) -> float:
        """Growth of |z| by one application with its repeats, at least 1."""
        return self.value(self.formula.degree)

    @property
    def bailout(self) -> float:
        """|z| beyond which a point has escaped, for counts and inside tests."""
        return self.bailout_override or self.value(self.formula.bailout)

    @property
    def distance_bailout(self) -> float:
        """|z| beyond which iteration for a distance stops; reduced with the degree, for float32's range."""
        if self.distance_bailout_override is not None:
            return max(self.distance_bailout_override, self.bailout)
        own = self.formula.distance_bailout
        wanted = DEFAULT_DISTANCE_BAILOUT if own is None else self.value(own)
        return max(
            min(wanted, LARGEST_POWER ** (1 / self.degree)) if self.degree > 1 else wanted, self.bailout
        )

    @property
    def center(self) -> tuple[float, float, float]:
        """Centre of the bounding sphere, in scene units; the origin where a Julia set was made of `point`."""
        if self._converted:
            return 0.0, 0.0, 0.0
        x, y, z = (self.value(node) for node in self.formula.bounds_center)
        return x, y, z

    @property
    def radius(self) -> float:
        """Radius of the bounding sphere, in scene units.

        For `add: point` turned into a Julia set it is derived. Superlinear maps: with |f(z)| >= |z|**d and R
        the radius for the set in C, |z| > max(R, |C|) escapes. Linear ones: twice that. Never beyond the
        bailout, since a point that starts there has escaped.
        """
        radius = self.value(self.formula.bounds_radius)
        if not self._converted or self.julia is None:
            return radius
        radius = max(
            radius + math.hypot(*(self.value(node) for node in self.formula.bounds_center)), self.julia_size
        )
        return min(radius if self.degree > 1 else 2 * radius, self.bailout)

    @property
    def julia_size(self) -> float:
        """|C| of a Julia set, else 0."""
        return math.hypot(*self.julia) if self.julia is not None else 0.0

    @property
    def step_scale(self) -> float:
        """Part of an estimated distance that is safe to step, above 0 to 1."""
        return self.value(self.formula.step_scale)

    @property
    def derivative(self) -> Node | None:
        """The scalar rule with `added` filled in, or None."""
        if self.formula.derivative is None:
            return None
        added = Number(1.0 if self.add == "point" else 0.0)
        return substitute(self.formula.derivative, {"added": added})

    @property
    def has_usual_values(self) -> bool:
        """Whether parameters that choose between ways to compute have the values that the formula gives them."""
        return all(self.values[name] == value for name, value in self.formula.shaping.items())

    @cached_property
    def content(self) -> tuple[str, str]:
        """What its text depends on beside values, as texts that are the same in every process."""
        return self.formula.content, self.add

    @property
    def begins(self) -> Begins:
        """Where an orbit begins whose first application is this formula's."""
        if self.add != "point":
            return "point"
        return "zero" if self.start is None else "after"

    @cached_property
    def start(self) -> tuple[float, ...] | None:
        """f(0), for `add: point`: iteration may begin at z = f(0) + C with count 1 and derivative identity.

        None where it may not (f(0) depends on C, or is not finite): begin at z = 0 with count 0 and
        derivative 0.
        """
        if self.formula.point_map:
            return None
        formula = self.formula
        if formula.steps:
            return self._start_of_steps()
        let = [(name, formula.function(node)) for name, node in formula.let]
        components = [formula.function(node) for node in formula.map]
        state = (0.0,) * len(formula.variables)
        for _ in range(self.repeat):
            names = {APPLICATION: 0.0, **self.values, **dict(zip(formula.variables, state, strict=True))}
            try:
                for name, value in let:
                    names[name] = finite(value(names))
                state = tuple(finite(component(names)) for component in components)
            except FormulaError:
                return None
        return state

    def _start_of_steps(self) -> tuple[float, ...] | None:
        """f(0), and behind it the carried numbers as they are then."""
        formula = self.formula
        names: dict[str, Any] = {APPLICATION: 0.0, **self.values, **dict.fromkeys(formula.variables, 0.0)}
        try:
            for each in formula.state:
                names[each.name] = float(evaluate(each.start, self.values))
            run(formula.steps, names)
            return tuple(
                finite(names[name]) for name in (*formula.variables, *(each.name for each in formula.state))
            )
        except FormulaError:
            return None  # a number begins with the point's coordinates, or is no number

    @property
    def _converted(self) -> bool:
        return self.formula.add == "point" and self.julia is not None

    @cached_property
    def _names(self) -> Mapping[str, float]:
        return {**self.values, "julia": self.julia_size}

    def value(self, node: Node) -> float:
        """The value of an expression of parameters; `julia` in it is |C| of a Julia set, else 0."""
        return finite(self.formula.function(node)(self._names))
