"""Reads a formula's text, in the part of OpenCL C that formulas are written in, as a tree of statements.

pycparser parses C; comments and lines for the preprocessor are taken out before, and types that OpenCL has are made
known. What is outside of this part of the language is refused with its line.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from clfractal.errors import FileError, Where

MAX_CHARACTERS = 200_000
SIZES = {"REAL": 1, "float": 1, "double": 1, "int": 1, "bool": 1, "cl_float": 1}
SIZES |= {f"{kind}{size}": size for kind in ("REAL", "float", "double", "int") for size in (2, 3, 4)}
"""Numbers in a value of each type."""
MATRIX = "matrix33"
POINTER = "pointer"
"""A pointer to a vector, or to a number of one."""
_KNOWN = (*(kind for kind in SIZES if kind not in ("float", "double", "int")), MATRIX)
_POINTERS = ("sFractalCl", "sExtendedAuxCl")


@dataclass(frozen=True, slots=True)
class Expression:
    """A value.

    Attributes:
        kind: `number`, `name`, `member` (name is the member's), `item` (of an array), `call`, `operator`, `vector`
            (name is its type), `list` (of an array's values), `address` and `target` (of a pointer).
        name: what the kind says, an operator's sign, or "".
        parts: what it is made of.
        number: for a number.
    """

    kind: str
    name: str
    parts: tuple[Expression, ...]
    line: int
    number: float = 0.0


@dataclass(frozen=True, slots=True)
class Statement:
    """Something to do.

    Attributes:
        kind: `assign` (target, value), `declare` (name, value or nothing), `if` (condition), `loop` (condition),
            `switch` (value), `case` (labels; none is `default`), `leave`, `return` (value), `refuse` (name says why).
        name: an assignment's sign, a declaration's name, `break` or `continue`.
        values: the expressions that the kind says.
        blocks: of `if` two, of `loop` its beginning, its step and its body, of `switch` its cases, of `case` one.
        type: of a declaration.
        size: of a declaration: how many values an array has; 0: it is none.
    """

    kind: str
    name: str
    values: tuple[Expression, ...]
    blocks: tuple[tuple[Statement, ...], ...]
    line: int
    type: str = ""
    size: int = 0


def read_formula(text: str, file: str) -> tuple[Statement, ...]:
    """The statements of the function whose name ends in `Iteration`.

    Raises:
        FileError: it is no C, or outside of this part of it, with the line; or too long.
    """
    from pycparser import CParser, c_ast
    from pycparser.c_parser import ParseError

    if len(text) > MAX_CHARACTERS:
        raise FileError(f"is too long: at most {MAX_CHARACTERS:,} characters", Where(file))
    body = without_comments(text)
    words = {word for word in _words(body) if word.startswith("enum") and word != "enum"}
    known = " ".join(f"typedef int {name};" for name in (*_KNOWN, *_POINTERS, *sorted(words)))
    try:
        tree = CParser().parse(f"{known} {body}", file)
    except (ParseError, RecursionError, AssertionError) as error:
        raise FileError(
            f"is outside of the C that is read: {_reason(error)}", Where(file, _line(error))
        ) from None
    found = [
        node
        for node in tree.ext
        if isinstance(node, c_ast.FuncDef) and str(node.decl.name).endswith("Iteration")
    ]
    if len(found) != 1:
        raise FileError("must have one function whose name ends in Iteration", Where(file))
    return _Reader(file, c_ast).block(found[0].body)


def without_comments(text: str) -> str:
    """The text with comments, lines for the preprocessor and address spaces as blanks, so that lines keep their numbers."""
    parts: list[str] = []
    place = 0
    while place < len(text):
        starts = [(at, mark) for mark in ("//", "/*") if (at := text.find(mark, place)) >= 0]
        if not starts:
            parts.append(text[place:])
            break
        at, mark = min(starts)
        parts.append(text[place:at])
        end = text.find("\n" if mark == "//" else "*/", at + 2)
        end = len(text) if end < 0 else end + (0 if mark == "//" else 2)
        parts.append("\n" * text.count("\n", at, end) + " ")
        place = end
    lines = ("" if line.lstrip().startswith("#") else line for line in "".join(parts).split("\n"))
    return "\n".join(lines).replace("__constant", " ").replace("__global", " ").replace("inline", " ")


def _words(text: str) -> set[str]:
    return set("".join(each if each.isalnum() or each == "_" else " " for each in text).split())


def _line(error: Exception) -> int | None:
    parts = str(error).split(":")
    return next((int(part) for part in parts if part.isdecimal()), None)


def _reason(error: Exception) -> str:
    return str(error).rpartition(":")[2].strip()[:60] or "it is nested too deep"


class _Reader:
    """Turns pycparser's tree into ours."""

    def __init__(self, file: str, c_ast: Any) -> None:
        self.file, self.c = file, c_ast

    def refuse(self, node: Any, what: str) -> FileError:
        return FileError(
            f"{what} is outside of the C that is read", Where(self.file, node.coord and node.coord.line)
        )

    def block(self, node: Any) -> tuple[Statement, ...]:
        if node is None or isinstance(node, self.c.EmptyStatement):
            return ()
        if isinstance(node, self.c.Compound):
            return tuple(each for item in node.block_items or () for each in self.block(item))
        if isinstance(node, self.c.DeclList):
            return tuple(each for declared in node.decls for each in self.block(declared))
        if isinstance(node, (self.c.FuncCall, self.c.Cast)) and self.is_unused(node):
            return ()
        try:
            return (self.statement(node),)
        except FileError as error:  # only if it is reached, as what is switched off need not be read
            return (Statement("refuse", error.message, (), (), error.where.line or 0),)

    def is_unused(self, node: Any) -> bool:
        """`Q_UNUSED(x);` and `(void)x;` do nothing."""
        if isinstance(node, self.c.Cast):
            return self.type_of(node.to_type.type) == "void"
        return str(getattr(node.name, "name", "")) == "Q_UNUSED"

    def statement(self, node: Any) -> Statement:
        c, line = self.c, node.coord.line if node.coord else 0

        def made(
            kind: str, name: str, values: tuple[Expression, ...], *blocks: tuple[Statement, ...]
        ) -> Statement:
            return Statement(kind, name, values, blocks, line)

        if isinstance(node, c.Assignment):
            return made("assign", node.op, (self.expression(node.lvalue), self.expression(node.rvalue)))
        if isinstance(node, c.UnaryOp) and node.op in ("p++", "++", "p--", "--"):
            one = Expression("number", "", (), line, 1.0)
            return made("assign", "+=" if "+" in node.op else "-=", (self.expression(node.expr), one))
        if isinstance(node, c.Decl):
            return self.declaration(node, line)
        if isinstance(node, c.If):
            return made(
                "if", "", (self.expression(node.cond),), self.block(node.iftrue), self.block(node.iffalse)
            )
        if isinstance(node, c.For):
            condition = () if node.cond is None else (self.expression(node.cond),)
            return made(
                "loop", "", condition, self.block(node.init), self.block(node.next), self.block(node.stmt)
            )
        if isinstance(node, c.While):
            return made("loop", "", (self.expression(node.cond),), (), (), self.block(node.stmt))
        if isinstance(node, c.Switch):
            return made("switch", "", (self.expression(node.cond),), self.cases(node.stmt))
        if isinstance(node, (c.Break, c.Continue)):
            return made("leave", "break" if isinstance(node, c.Break) else "continue", ())
        if isinstance(node, c.Return):
            return made("return", "", (self.expression(node.expr),))
        raise self.refuse(node, type(node).__name__)

    def cases(self, node: Any) -> tuple[Statement, ...]:
        found = []
        for each in node.block_items or ():
            if not isinstance(each, (self.c.Case, self.c.Default)):
                raise self.refuse(each, "a statement before a case")
            labels = (self.expression(each.expr),) if isinstance(each, self.c.Case) else ()
            stmts = each.stmts or []
            # `case a: default: ...` is one within the other.
            while stmts and isinstance(stmts[0], (self.c.Case, self.c.Default)):
                found.append(Statement("case", "", labels, ((),), each.coord.line))
                each = stmts[0]
                labels = (self.expression(each.expr),) if isinstance(each, self.c.Case) else ()
                stmts = each.stmts or []
            body = tuple(one for stmt in stmts for one in self.block(stmt))
            found.append(Statement("case", "", labels, (body,), each.coord.line))
        return tuple(found)

    def declaration(self, node: Any, line: int) -> Statement:
        size, kind = 0, node.type
        if isinstance(kind, self.c.ArrayDecl):
            if (
                not isinstance(kind.dim, self.c.Constant)
                or not kind.dim.value.isdecimal()
                or int(kind.dim.value) > 64
            ):
                raise self.refuse(node, "an array of this size")
            size, kind = int(kind.dim.value), kind.type
        values = () if node.init is None else (self.expression(node.init),)
        if isinstance(kind, self.c.PtrDecl) and self.type_of(kind.type) in SIZES:
            return Statement("declare", node.name, values, (), line, POINTER)
        name = self.type_of(kind)
        if name != MATRIX and name not in SIZES and not name.startswith("enum"):
            raise self.refuse(node, f"type {name}")
        return Statement(
            "declare", node.name, values, (), line, "int" if name.startswith("enum") else name, size
        )

    def type_of(self, node: Any) -> str:
        if isinstance(node, self.c.TypeDecl) and isinstance(node.type, self.c.IdentifierType):
            return " ".join(node.type.names)
        return "a pointer"

    def expression(self, node: Any) -> Expression:
        c, line = self.c, node.coord.line if node.coord else 0

        def made(kind: str, name: str, *parts: Any) -> Expression:
            return Expression(kind, name, tuple(self.expression(part) for part in parts), line)

        if isinstance(node, c.Constant):
            return Expression("number", node.type, (), line, self.number(node))
        if isinstance(node, c.ID):
            return made("name", node.name)
        if isinstance(node, c.StructRef):
            return made("member", node.field.name, node.name)
        if isinstance(node, c.ArrayRef):
            return made("item", "", node.name, node.subscript)
        if isinstance(node, c.FuncCall) and isinstance(node.name, c.ID):
            return made("call", node.name.name, *(node.args.exprs if node.args else ()))
        if isinstance(node, c.UnaryOp) and node.op in ("-", "+", "!"):
            return made("operator", f"unary {node.op}", node.expr)
        if isinstance(node, c.UnaryOp) and node.op in ("&", "*"):
            return made("address" if node.op == "&" else "target", "", node.expr)
        if isinstance(node, c.BinaryOp):
            return made("operator", node.op, node.left, node.right)
        if isinstance(node, c.TernaryOp):
            return made("operator", "?", node.cond, node.iftrue, node.iffalse)
        if isinstance(node, c.CompoundLiteral):
            return made("vector", self.type_of(node.type.type), *node.init.exprs)
        if isinstance(node, c.InitList):
            return made("list", "", *node.exprs)
        if isinstance(node, c.Cast):
            if isinstance(node.to_type.type, c.PtrDecl):
                return self.expression(node.expr)
            name = self.type_of(node.to_type.type)
            parts = node.expr.exprs if isinstance(node.expr, c.ExprList) else [node.expr]
            if SIZES.get(name, 0) > 1:
                return made("vector", name, *parts)
            if name in SIZES:
                return made("call", f"({name})", *parts)
        raise self.refuse(node, type(node).__name__)

    def number(self, node: Any) -> float:
        digits = node.value.rstrip("fFlLuU")
        try:
            return float(int(digits, 0)) if node.type.endswith("int") else float(digits)
        except ValueError:
            raise self.refuse(node, f"the number {node.value[:20]}") from None
