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
from dataclasses import replace
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
)

MAX_TEXT = 10_000
MAX_NODES = 2_000
MAX_DEPTH = 100

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
    ast.Attribute: "attributes ('.') are not part of the language",
    ast.Tuple: "a single value is needed here, not a list",
}


def parse(
    text: str | int | float, *, names: Collection[str], where: Where, parameters_only: bool = False
) -> Node:
    """The tree of an expression, or of a plain number.

    Args:
        names: every name that has a meaning in it, besides `pi`.
        where: where the text stands; errors add the column inside the text (from 1).
        parameters_only: the expression is computed once, from parameters; allows `log2`.

    Raises:
        FormulaError: not an expression of the language, an unknown name, a division by a constant zero, a
        number that
            is not finite, or more than MAX_TEXT characters, MAX_NODES nodes or MAX_DEPTH levels.
    """
    return _Parser(text, names, where, parameters_only).parse()


class _Parser:
    """One expression on its way from text to tree."""

    def __init__(
        self, text: str | int | float, names: Collection[str], where: Where, parameters_only: bool
    ) -> None:
        self.given = text
        self.names = names
        self.where = where
        self.functions = PARAMETER_FUNCTIONS if parameters_only else FUNCTIONS
        self.text = ""
        self.offset = 0
        self.nodes = 0
        self._readers: Mapping[type[ast.expr], Callable[[Any, int, int], Node]] = {
            ast.UnaryOp: self._unary,
            ast.BinOp: self._binary,
            ast.BoolOp: self._boolean,
            ast.Compare: self._compare,
            ast.Call: self._call,
        }

    def fail(self, message: str, position: int = 0) -> NoReturn:
        """Raises the error, pointing at a column of the text (0: at the text as a whole)."""
        if not position:
            raise FormulaError(message, self.where)
        raise FormulaError(
            f"{message} (at column {position} of {_excerpt(self.text, position)})",
            replace(self.where, column=position) if self.where.file is None else self.where,
        )

    def parse(self) -> Node:
        given = self.given
        if isinstance(given, bool) or not isinstance(given, (int, float, str)):
            self.fail(f"must be an expression or a number, got {_kind(given)}")
        if not isinstance(given, str):
            return self._number(given, 0)
        if len(given) > MAX_TEXT:
            self.fail(f"is too long: {len(given):,} characters, at most {MAX_TEXT:,}")
        self.text = re.sub(r"[\t\r\n]", " ", given)
        self._check_characters()
        tree = self._read()
        node = self._node(tree, 1)
        if is_condition(node):
            self.fail("must be a number, not a condition", node.position)
        if tree_depth(node) > MAX_DEPTH:  # min(a, b, ...) and a < b < ... are deeper as trees than as texts
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

    def _node(self, tree: ast.expr, depth: int) -> Node:
        position = int(getattr(tree, "col_offset", 0)) + self.offset + 1
        self._count(position, depth)
        if isinstance(tree, ast.Constant):
            return self._number(tree.value, position)
        if isinstance(tree, ast.Name):
            return self._name(tree.id, position)
        read: Callable[[Any, int, int], Node] | None = self._readers.get(type(tree))
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

    def _name(self, name: str, position: int) -> Node:
        if name == "pi":
            return Number(math.pi, position)
        if name in self.names:
            return Name(name, position)
        if name in self.functions:
            self.fail(f"{name!r} is a function and needs its arguments in brackets", position)
        return self.fail(unknown_name("name", name, {*self.names, "pi"}), position)

    def _value(self, tree: ast.expr, depth: int, user: str) -> Node:
        """A number for an operator or a function."""
        node = self._node(tree, depth)
        if is_condition(node):
            self.fail(f"{user} needs a number here, not a condition", node.position)
        return node

    def _condition(self, tree: ast.expr, depth: int, user: str) -> Node:
        node = self._node(tree, depth)
        if not is_condition(node):
            self.fail(f"{user} needs a condition here, such as x > 0", node.position)
        return node

    def _unary(self, tree: ast.UnaryOp, position: int, depth: int) -> Node:
        if isinstance(tree.op, ast.Not):
            return Call("not", (self._condition(tree.operand, depth + 1, "'not'"),), position)
        if isinstance(tree.op, ast.UAdd):
            return self._value(tree.operand, depth + 1, "'+'")
        if not isinstance(tree.op, ast.USub):
            self.fail("is not part of the language", position)
        operand = self._value(tree.operand, depth + 1, "'-'")
        if isinstance(operand, Number):
            return Number(-operand.value, position)
        return Call("neg", (operand,), position)

    def _binary(self, tree: ast.BinOp, position: int, depth: int) -> Node:
        function = _BINARY.get(type(tree.op))
        if function is None:
            self.fail(_HINTS.get(type(tree.op), "this operator is not part of the language"), position)
        symbol = {"add": "'+'", "sub": "'-'", "mul": "'*'", "div": "'/'", "pow": "'**'"}[function]
        node = Call(
            function,
            (self._value(tree.left, depth + 1, symbol), self._value(tree.right, depth + 1, symbol)),
            position,
        )
        return self._checked(node)

    def _boolean(self, tree: ast.BoolOp, position: int, depth: int) -> Node:
        operator = "and" if isinstance(tree.op, ast.And) else "or"
        parts = [self._condition(part, depth + 1, f"'{operator}'") for part in tree.values]
        return self._fold(operator, parts, position, depth)

    def _checked(self, node: Call) -> Call:
        """Refuses a division by a constant zero and an exponent that no number survives."""
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
        operands = [self._value(part, depth + 1, "a comparison") for part in (tree.left, *tree.comparators)]
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

    def _call(self, tree: ast.Call, position: int, depth: int) -> Node:
        if not isinstance(tree.func, ast.Name):
            self.fail(_HINTS.get(type(tree.func), "only a function's name can be called"), position)
        function = tree.func.id
        if function not in self.functions:
            if function in self.names or function == "pi":
                self.fail(f"{function!r} is not a function; write '*' to multiply", position)
            self.fail(unknown_name("function", function, self.functions), position)
        if tree.keywords or any(isinstance(argument, ast.Starred) for argument in tree.args):
            self.fail(f"{function} takes plain arguments only", position)
        expected, got = self.functions[function], len(tree.args)
        several = function in ("min", "max") and got > expected
        if got != expected and not several:
            least = "at least " if function in ("min", "max") else ""
            plural = "s" if expected > 1 else ""
            self.fail(f"{function} takes {least}{expected} argument{plural}, got {got}", position)
        read: list[Callable[[ast.expr, int, str], Node]] = [self._value] * got
        if function == "where":
            read[0] = self._condition
        arguments = [
            reader(argument, depth + 1, function) for reader, argument in zip(read, tree.args, strict=True)
        ]
        if several:
            return self._fold(function, arguments, position, depth)
        return self._checked(Call(function, tuple(arguments), position))


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
