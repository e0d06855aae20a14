"""Parses an expression's text into a tree: Python's grammar, a whitelist of what may stand in it, and limits.

Nothing is ever executed. Characters, length and brackets are checked before Python's parser sees the text,
because that parser recurses; what it returns is then taken apart against the whitelist.
"""

from __future__ import annotations

import ast
import math
import re
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn

from clfractal.errors import FormulaError, Where, unknown_name
from clfractal.formulas.evaluate import MAX_EXPONENT, evaluate
from clfractal.formulas.nodes import (
    FUNCTIONS,
    PARAMETER_FUNCTIONS,
    Call,
    Name,
    Node,
    Number,
    is_condition,
    tree_depth,
    walk,
)
from clfractal.formulas.vectors import (
    COMPONENTS,
    VECTOR_FUNCTIONS,
    Operand,
    Share,
    Vector,
    call_vector,
    described,
    each_component,
    swizzled,
)

MAX_TEXT = 10_000
MAX_NODES = 2_000
MAX_DEPTH = 100
# Of an expression with vectors written as numbers, and functions of the formula's own written in.
MAX_EXPANDED = 20_000

_ALLOWED = re.compile(r"[A-Za-z0-9_ .,+\-*/<>=!()]*")
_BINARY: Mapping[type[ast.operator], str] = {
    ast.Add: "add",
    ast.Sub: "sub",
    ast.Mult: "mul",
    ast.Div: "div",
    ast.Pow: "pow",
}
_COMPARE: Mapping[type[ast.cmpop], str] = {
    ast.Lt: "lt",
    ast.LtE: "le",
    ast.Gt: "gt",
    ast.GtE: "ge",
    ast.Eq: "eq",
    ast.NotEq: "ne",
}
_HINTS: Mapping[type[ast.AST], str] = {
    ast.FloorDiv: "'//' is not part of the language; use floor(x/y)",
    ast.IfExp: "'if' is not part of the language; use where(condition, then, otherwise)",
    ast.Tuple: "a single value is needed here, not a list",
}


@dataclass(frozen=True, slots=True)
class OwnFunction:
    """A function that a formula defines: its text is read anew wherever it is called.

    Attributes:
        let: names for parts of its value, in order.
        names: what its text may use beside its arguments.
        functions: those that its text may call.
    """

    name: str
    arguments: tuple[str, ...]
    let: tuple[tuple[str, str | int | float], ...]
    value: str | int | float
    where: Where
    names: frozenset[str]
    functions: Mapping[str, OwnFunction]


@dataclass(frozen=True, slots=True)
class Names:
    """What an expression may use.

    Attributes:
        known: every name that has a meaning, besides `pi`. `v` is a vector if `v.x`, `v.y` and so on are among them.
        functions: of the formula's own.
        share: gives a part that is used several times a name of its own; None: it is written several times.
        bound: names that stand for what is written already: arguments of a function.
    """

    known: Collection[str]
    functions: Mapping[str, OwnFunction] = field(default_factory=dict)
    share: Share | None = None
    bound: Mapping[str, Operand] = field(default_factory=dict)


def parse(
    text: str | int | float,
    *,
    names: Collection[str] | Names,
    where: Where,
    parameters_only: bool = False,
    condition: bool = False,
) -> Node:
    """The tree of an expression, or of a plain number; with `condition` of a condition.

    Args:
        names: every name that has a meaning in it, besides `pi`.
        where: where the text stands; errors add the column inside the text (from 1).
        parameters_only: the expression is computed once, from parameters; allows `log2`.

    Raises:
        FormulaError: not an expression of the language, an unknown name, a division by a constant zero, a
        number that
            is not finite, or more than MAX_TEXT characters, MAX_NODES nodes or MAX_DEPTH levels.
    """
    reader = _Parser(text, names, where, parameters_only)
    value = reader.parse(condition)
    if isinstance(value, Vector):
        reader.fail(f"must be a number, not {described(value)}", value.position)
    return value


def parse_operand(text: str | int | float, *, names: Names, where: Where) -> Operand:
    """The same, of an expression that may be a vector."""
    return _Parser(text, names, where, parameters_only=False).parse(condition=False)


class _Parser:
    """One expression on its way from text to tree."""

    def __init__(
        self,
        text: str | int | float,
        names: Collection[str] | Names,
        where: Where,
        parameters_only: bool,
        expanded: list[int] | None = None,
    ) -> None:
        self.given = text
        known = names if isinstance(names, Names) else Names(names)
        self.names, self.own, self.bound = known.known, known.functions, known.bound
        self.share: Share = known.share or (lambda node: node)
        self.where = where
        self.functions = PARAMETER_FUNCTIONS if parameters_only else FUNCTIONS
        # (Where only parameters are, everything is a number.)
        self.vectors = {} if parameters_only else VECTOR_FUNCTIONS
        self.text = ""
        self.offset = 0
        self.nodes = 0
        # What functions have been written in altogether, by whoever calls them.
        self.expanded = [0] if expanded is None else expanded
        self._readers: Mapping[type[ast.expr], Callable[[Any, int, int], Operand]] = {
            ast.UnaryOp: self._unary,
            ast.BinOp: self._binary,
            ast.BoolOp: self._boolean,
            ast.Compare: self._compare,
            ast.Call: self._call,
            ast.Attribute: self._swizzle,
        }

    def fail(self, message: str, position: int = 0) -> NoReturn:
        """Raises the error, pointing at a column of the text (0: at the text as a whole)."""
        if not position:
            raise FormulaError(message, self.where)
        raise FormulaError(
            f"{message} (at column {position} of {_excerpt(self.text, position)})",
            replace(self.where, column=position) if self.where.file is None else self.where,
        )

    def parse(self, condition: bool) -> Operand:
        """The tree, or the trees of a vector's components."""
        given = self.given
        if isinstance(given, bool) or not isinstance(given, (int, float, str)):
            self.fail(f"must be an expression or a number, got {_kind(given)}")
        if not isinstance(given, str) and not condition:
            return self._number(given, 0)
        given = str(given)
        if len(given) > MAX_TEXT:
            self.fail(f"is too long: {len(given):,} characters, at most {MAX_TEXT:,}")
        self.text = re.sub(r"[\t\r\n]", " ", given)
        self._check_characters()
        tree = self._read()
        node = self._node(tree, 1)
        parts = node.parts if isinstance(node, Vector) else (node,)
        if is_condition(parts[0]) != condition:
            what = (
                f"a condition, such as x > 0, not {described(node)}"
                if condition
                else "a number, not a condition"
            )
            self.fail(f"must be {what}", node.position)
        # min(a, b, ...) and a < b < ... are deeper as trees than as texts
        if any(tree_depth(part) > MAX_DEPTH for part in parts):
            self.fail(f"nested more than {MAX_DEPTH} levels deep", node.position)
        return node

    def _check_characters(self) -> None:
        good = _ALLOWED.match(self.text)
        end = good.end() if good else 0
        if end < len(self.text):
            hint = "; a power is written x**2" if self.text[end] == "^" else ""
            self.fail(f"unexpected character {self.text[end]!r}{hint}", end + 1)
        if not self.text.strip():
            self.fail("is empty")
        depth = 0
        for column, character in enumerate(self.text, start=1):
            depth += (character == "(") - (character == ")")
            if depth > MAX_DEPTH:
                self.fail(f"nested more than {MAX_DEPTH} levels deep", column)

    def _read(self) -> ast.expr:
        stripped = self.text.lstrip(" ")
        self.offset = len(self.text) - len(stripped)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return ast.parse(stripped, mode="eval").body
        except SyntaxError as error:
            column = min(max(error.offset or 1, 1) + self.offset, max(len(self.text), 1))
            problem = (error.msg or "invalid syntax").split(".")[0]
            if "integer string" in problem or "Exceeds the limit" in problem:
                problem = "a number with too many digits"
            # In `{d: max(a, 1)}` the comma ends the value, so that the expression is cut short.
            hint = "; inside {} or [] of YAML an expression with a comma needs quotes"
            hint = hint if "never closed" in problem and "," not in self.text else ""
            if re.search(r"(?<![\w.])[\d.]+(?!e[-+]?\d)[a-z_]", self.text, re.IGNORECASE):
                hint = "; a product is written 2*x"
            self.fail(f"cannot be read: {problem[:1].lower()}{problem[1:80]}{hint}", column)
        except (RecursionError, MemoryError):
            self.fail(f"nested more than {MAX_DEPTH} levels deep", 1)
        except ValueError:
            self.fail("cannot be read", 1)

    def _count(self, position: int, depth: int, nodes: int = 1) -> None:
        self.nodes += nodes
        if self.nodes > MAX_NODES:
            self.fail(f"is too large: more than {MAX_NODES:,} numbers, names and operations", position)
        if depth > MAX_DEPTH:
            self.fail(f"nested more than {MAX_DEPTH} levels deep", position)

    def _node(self, tree: ast.expr, depth: int) -> Operand:
        position = int(getattr(tree, "col_offset", 0)) + self.offset + 1
        self._count(position, depth)
        if isinstance(tree, ast.Constant):
            return self._number(tree.value, position)
        if isinstance(tree, ast.Name):
            return self._name(tree.id, position)
        read: Callable[[Any, int, int], Operand] | None = self._readers.get(type(tree))
        if read is None:
            self.fail(_HINTS.get(type(tree), "is not part of the language"), position)
        return read(tree, position, depth)

    def _number(self, value: object, position: int) -> Number:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.fail(f"a number or a name is needed, got {_kind(value)}", position)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self.fail("must be a finite number", position)
        return Number(number, position)

    def _name(self, name: str, position: int) -> Operand:
        if name == "pi":
            return Number(math.pi, position)
        if name in self.bound:
            return self.bound[name]
        if name in self.names:
            return Name(name, position)
        if f"{name}.x" in self.names:
            parts = (f"{name}.{letter}" for letter in COMPONENTS)
            return Vector(tuple(Name(part, position) for part in parts if part in self.names), position)
        if name in self.functions or name in self.own or name in self.vectors:
            self.fail(f"{name!r} is a function and needs its arguments in brackets", position)
        return self.fail(unknown_name("name", name, {*self.names, *self.bound, "pi"}), position)

    def _value(self, tree: ast.expr, depth: int, user: str) -> Operand:
        """A number, or a vector, for an operator or a function."""
        node = self._node(tree, depth)
        if not isinstance(node, Vector) and is_condition(node):
            self.fail(f"{user} needs a number here, not a condition", node.position)
        return node

    def _plain(self, tree: ast.expr, depth: int, user: str) -> Node:
        """A number for what takes no vectors."""
        node = self._value(tree, depth, user)
        if isinstance(node, Vector):
            self.fail(f"{user} needs a number here, not {described(node)}", node.position)
        return node

    def _condition(self, tree: ast.expr, depth: int, user: str) -> Node:
        node = self._node(tree, depth)
        if isinstance(node, Vector) or not is_condition(node):
            self.fail(f"{user} needs a condition here, such as x > 0", node.position)
        return node

    def _swizzle(self, tree: ast.Attribute, position: int, depth: int) -> Operand:
        if isinstance(tree.value, ast.Name) and f"{tree.value.id}.{tree.attr}" in self.names:
            return Name(f"{tree.value.id}.{tree.attr}", position)
        value = self._value(tree.value, depth + 1, "'.'")
        if not isinstance(value, Vector):
            self.fail("attributes ('.') are parts of vectors, and this is a number", position)
        return swizzled(value, tree.attr, position, self.fail)

    def _unary(self, tree: ast.UnaryOp, position: int, depth: int) -> Operand:
        if isinstance(tree.op, ast.Not):
            return Call("not", (self._condition(tree.operand, depth + 1, "'not'"),), position)
        if isinstance(tree.op, ast.UAdd):
            return self._value(tree.operand, depth + 1, "'+'")
        if not isinstance(tree.op, ast.USub):
            self.fail("is not part of the language", position)
        operand = self._value(tree.operand, depth + 1, "'-'")
        if isinstance(operand, Number):
            return Number(-operand.value, position)
        return each_component("neg", (operand,), position, self.fail)

    def _binary(self, tree: ast.BinOp, position: int, depth: int) -> Operand:
        function = _BINARY.get(type(tree.op))
        if function is None:
            self.fail(_HINTS.get(type(tree.op), "this operator is not part of the language"), position)
        symbol = {"add": "'+'", "sub": "'-'", "mul": "'*'", "div": "'/'", "pow": "'**'"}[function]
        operands = (self._value(tree.left, depth + 1, symbol), self._value(tree.right, depth + 1, symbol))
        return self._checked(each_component(function, operands, position, self.fail))

    def _boolean(self, tree: ast.BoolOp, position: int, depth: int) -> Node:
        operator = "and" if isinstance(tree.op, ast.And) else "or"
        parts = [self._condition(part, depth + 1, f"'{operator}'") for part in tree.values]
        return self._fold(operator, parts, position, depth)

    def _checked(self, node: Operand) -> Operand:
        """Refuses a division by a constant zero and an exponent that no number survives."""
        if isinstance(node, Vector):
            for part in node.parts:
                self._checked(part)
            return node
        assert isinstance(node, Call)
        last = _constant(node.arguments[-1])
        place = node.arguments[-1].position
        if node.function in ("div", "mod") and last == 0:
            self.fail("division by zero", place)
        if node.function in ("pow", "cpow_re", "cpow_im") and last is not None:
            if not abs(last) <= MAX_EXPONENT:
                self.fail(f"an exponent must be at most {MAX_EXPONENT}", place)
            if node.function == "pow" and last < 0 and _constant(node.arguments[0]) == 0:
                self.fail("division by zero (a negative power of zero)", place)
        return node

    def _compare(self, tree: ast.Compare, position: int, depth: int) -> Node:
        operands = [self._plain(part, depth + 1, "a comparison") for part in (tree.left, *tree.comparators)]
        parts: list[Node] = []
        for operator, left, right in zip(tree.ops, operands, operands[1:], strict=False):
            function = _COMPARE.get(type(operator))
            if function is None:
                self.fail("this comparison is not part of the language", position)
            parts.append(Call(function, (left, right), left.position))
        return self._fold("and", parts, position, depth)

    def _fold(self, function: str, parts: list[Node], position: int, depth: int) -> Node:
        """f(a, b, c) as f(f(a, b), c)."""
        self._count(position, depth + len(parts) - 2, len(parts) - 2)
        folded = parts[0]
        for part in parts[1:]:
            folded = Call(function, (folded, part), position)
        return folded

    def _call(self, tree: ast.Call, position: int, depth: int) -> Operand:
        if not isinstance(tree.func, ast.Name):
            self.fail(_HINTS.get(type(tree.func), "only a function's name can be called"), position)
        function = tree.func.id
        least, most = self._arities(function, position)
        if tree.keywords or any(isinstance(argument, ast.Starred) for argument in tree.args):
            self.fail(f"{function} takes plain arguments only", position)
        got = len(tree.args)
        if not least <= got <= most:
            words = (
                f"{least}"
                if least == most
                else f"at least {least}"
                if most > MAX_NODES
                else f"{least} to {most}"
            )
            plural = "s" if (least if least == most or most > MAX_NODES else most) > 1 else ""
            self.fail(f"{function} takes {words} argument{plural}, got {got}", position)
        if function in self.own:
            values = [self._value(argument, depth + 1, function) for argument in tree.args]
            return self._expanded(self.own[function], values, position)
        if function in self.vectors:
            values = [self._value(argument, depth + 1, function) for argument in tree.args]
            return self._limited(call_vector(function, values, position, self.fail, self.share), position)
        if function == "where":
            condition = self._condition(tree.args[0], depth + 1, function)
            values = [self._value(argument, depth + 1, function) for argument in tree.args[1:]]
            return each_component(function, (condition, *values), position, self.fail)
        read = self._plain if function in ("cpow_re", "cpow_im") else self._value
        arguments = [read(argument, depth + 1, function) for argument in tree.args]
        if got > 2 and function in ("min", "max"):
            self._count(position, depth + got - 2, got - 2)
            folded = arguments[0]
            for argument in arguments[1:]:
                folded = each_component(function, (folded, argument), position, self.fail)
            return folded
        return self._checked(each_component(function, arguments, position, self.fail))

    def _arities(self, function: str, position: int) -> tuple[int, int]:
        """The fewest and the most arguments of a function; an error if there is none of that name."""
        if function in self.own:
            arguments = len(self.own[function].arguments)
            return arguments, arguments
        if function in self.functions:
            return self.functions[function], MAX_TEXT if function in ("min", "max") else self.functions[
                function
            ]
        if function in self.vectors:
            least, most, _ = self.vectors[function]
            return least, most
        if function in self.names or function in self.bound or function == "pi":
            self.fail(f"{function!r} is not a function; write '*' to multiply", position)
        every = {*self.functions, *self.own, *self.vectors}
        return self.fail(unknown_name("function", function, every), position)

    def _limited(self, value: Operand, position: int) -> Operand:
        size = 0
        for part in value.parts if isinstance(value, Vector) else (value,):
            for _ in walk(part):
                size += 1
                if size > MAX_EXPANDED:
                    self.fail(
                        "is too large with its vectors written as numbers: give parts of it names", position
                    )
        return value

    def _expanded(self, function: OwnFunction, values: list[Operand], position: int) -> Operand:
        """A function of the formula's own, written in."""
        bound = dict(zip(function.arguments, map(self._shared, values), strict=True))
        for name, text in (*function.let, ("", function.value)):
            where = inside_function(function, name)
            names = Names(function.names, function.functions, self.share, bound)
            reader = _Parser(text, names, where, parameters_only=False, expanded=self.expanded)
            value = reader.parse(condition=False)
            self.expanded[0] += reader.nodes
            if self.expanded[0] > MAX_EXPANDED:
                self.fail(f"is too large with {function.name!r} written in", position)
            if name:
                bound[name] = self._limited(self._shared(value), position)
        return self._limited(value, position)

    def _shared(self, value: Operand) -> Operand:
        if isinstance(value, Vector):
            return Vector(tuple(map(self.share, value.parts)), value.position)
        return self.share(value)


def inside_function(function: OwnFunction, name: str) -> Where:
    """The place of a part of a function's text; without a name of its value."""
    if not function.let:
        return function.where
    parts = ("let", name) if name else ("value",)
    return replace(function.where, path=".".join((function.where.path or "", *parts)))


def _constant(node: Node) -> float | None:
    """The value of a tree without names, or None."""
    try:
        value = evaluate(node, {})
    except FormulaError:
        return None
    return float(value)


_KINDS: tuple[tuple[tuple[type, ...], str], ...] = (
    ((type(None),), "nothing"),
    ((complex,), "an imaginary number"),
    ((str, bytes), "a text"),
    ((list, tuple), "a list"),
    ((dict,), "a mapping"),
)


def _kind(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return next((words for types, words in _KINDS if isinstance(value, types)), "something else")


def _excerpt(text: str, position: int) -> str:
    """The part of a text around a column, in quotes, on one line."""
    start, end = max(position - 31, 0), position + 29
    return repr(("..." if start else "") + text[start:end] + ("..." if end < len(text) else ""))
