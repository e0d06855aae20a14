"""Reads the part of GLSL that distances are written in, with the sliders of Fragmentarium, as a tree."""

from __future__ import annotations

from collections.abc import Sequence

from clfractal.errors import FileError
from clfractal.exchange.glsl_expressions import MAX_DEPTH, ExpressionReader
from clfractal.exchange.glsl_tokens import Token
from clfractal.exchange.glsl_tree import (
    SIZES,
    TYPES,
    Argument,
    Code,
    Expression,
    Function,
    Statement,
    Uniform,
)

MAX_ARRAY = 64
_QUALIFIERS = frozenset(
    (
        *(
            "const",
            "in",
            "out",
            "inout",
            "uniform",
            "varying",
            "attribute",
            "highp",
            "mediump",
            "lowp",
            "flat",
        ),
        *("invariant", "smooth", "precise"),
    )
)
_NOTES = ("slider", "color", "checkbox", "file", "range")
_LOCKS = ("Locked", "NotLocked", "NotLockable", "Linear", "Logarithmic", "Log", "AlwaysLocked")


def read_code(words: Sequence[Token], file: str) -> Code:
    """The tree of a fragment's words.

    Raises:
        FileError: what stands there is no GLSL, or outside of the part that is read, with its place.
    """
    reader = _Reader(words, file)
    try:
        return reader.code()
    except RecursionError:
        raise FileError("is nested too deep", reader.here.where) from None


class _Reader(ExpressionReader):
    """Reads declarations, sliders and statements."""

    def __init__(self, words: Sequence[Token], file: str) -> None:
        super().__init__(words, file)
        self.uniforms: dict[str, Uniform] = {}
        self.statements: list[Statement] = []
        self.functions: dict[str, list[Function]] = {}

    # --- declarations

    def code(self) -> Code:
        while self.here.kind != "end":
            if self.take(";"):
                continue
            self.declaration()
        functions = {name: tuple(found) for name, found in self.functions.items()}
        return Code(self.uniforms, tuple(self.statements), functions)

    def declaration(self) -> None:
        """One outside of functions: a uniform, a variable, or a function."""
        if self.take("precision"):
            while self.here.kind != "end" and not self.take(";"):
                self.next()
            return
        if self.here.text == "layout" and self.ahead(1).text == "(":
            self.next()
            self.skip("(", ")")
        qualifiers = self.qualifiers()
        kind = self.type()
        if "uniform" in qualifiers:
            self.uniform(kind)
            return
        name = self.name()
        if self.here.text == "(":
            self.function(kind, name)
            return
        unset = (
            "varying" in qualifiers or "attribute" in qualifiers or "in" in qualifiers or "out" in qualifiers
        )
        found = self.declared(kind, name)
        self.statements += () if unset else found
        self.need(";")
        self.note()

    def qualifiers(self) -> set[str]:
        found = set()
        while self.here.kind == "name" and self.here.text in _QUALIFIERS:
            found.add(self.next().text)
        return found

    def type(self) -> str:
        word = self.here
        if word.kind != "name" or (
            word.text not in TYPES
            and word.text not in ("void",)
            and not word.text.startswith(("sampler", "image", "isampler"))
        ):
            if word.text == "struct":
                self.refuse("struct is outside of the GLSL that is read")
            self.refuse(
                f"a type is missing before {word.text[:40]!r}; types are float, int, bool, vec2 to vec4, mat2 to mat4"
            )
        return self.next().text

    def declared(self, kind: str, name: Token) -> list[Statement]:
        """The variables of one declaration, from the name of the first one on."""
        found = []
        while True:
            size = 0
            if self.take("["):
                size = self.size()
            elif name.text in TYPES:
                self.refuse(f"{name.text} is the name of a type", name.where)
            values = (self.assignment(),) if self.take("=") else ()
            found.append(Statement("declare", name.text, name.where, values, type=kind, size=size))
            if not self.take(","):
                return found
            name = self.name()

    def size(self) -> int:
        word = self.next()
        if not word.text.isdecimal() or not 0 < int(word.text[:6]) <= MAX_ARRAY:
            self.refuse(f"an array must have 1 to {MAX_ARRAY} values", word.where)
        self.need("]")
        return int(word.text)

    def function(self, kind: str, name: Token) -> None:
        self.need("(")
        arguments: list[Argument] = []
        while not self.take(")"):
            if arguments:
                self.need(",")
            qualifiers = self.qualifiers()
            given = self.type()
            if given == "void":
                continue
            word = self.name().text if self.here.kind == "name" else f" {len(arguments)}"
            size = self.size() if self.take("[") else 0
            out = bool(qualifiers & {"out", "inout"})
            arguments.append(Argument(word, given, out, "out" not in qualifiers, size))
        if self.take(";"):
            return
        body = self.block()
        found = Function(name.text, kind, tuple(arguments), body, name.where)
        others = self.functions.setdefault(name.text, [])
        types = [each.type for each in arguments]
        others[:] = [each for each in others if [argument.type for argument in each.arguments] != types]
        others.append(found)

    # --- sliders

    def uniform(self, kind: str) -> None:
        while True:
            name = self.name()
            if self.take("["):
                self.size()
            if self.take("="):
                self.assignment()
            self.uniforms[name.text] = Uniform(name.text, kind, name.where)
            if not self.take(","):
                break
        self.need(";")
        note = self.note()
        if note is not None:
            self.uniforms[name.text] = self.chosen(kind, name, *note)

    def note(self) -> tuple[Token, list[list[float]]] | None:
        """What stands behind a declaration: `slider[0,1,2]`, `color[...]`, `checkbox[true]`."""
        if not (self.here.text in _NOTES and self.ahead(1).text == "["):
            return None
        word = self.next()
        self.next()
        groups: list[list[float]] = []
        if word.text == "file":
            while self.here.kind != "end" and not self.take("]"):
                self.next()
        while word.text != "file" and not self.take("]"):
            if groups:
                self.need(",")
            if self.take("("):
                groups.append([self.plain()])
                while not self.take(")"):
                    self.need(",")
                    groups[-1].append(self.plain())
            else:
                groups.append([self.plain()])
        while self.here.kind == "name" and self.here.text in _LOCKS:
            self.next()
        self.take(";")
        return word, groups

    def plain(self) -> float:
        """A number of a slider."""
        sign = -1.0 if self.take("-") else 1.0
        self.take("+")
        word = self.next()
        if word.text in ("true", "false"):
            return float(word.text == "true")
        if word.kind != "number":
            self.refuse(f"must be a number, got {word.text[:40]!r}", word.where)
        return sign * self.number(word)

    def chosen(self, kind: str, name: Token, word: Token, groups: list[list[float]]) -> Uniform:
        """A uniform with its slider."""
        size = SIZES.get(kind, 0)
        if word.text == "file" or not size:
            return Uniform(name.text, kind, name.where)
        if word.text == "checkbox":
            values: list[float] = groups[0] if groups else [0.0]
            return Uniform(
                name.text, kind, name.where, tuple(values[:1] * size), (0.0,) * size, (1.0,) * size
            )
        if word.text == "color":
            numbers = [each for group in groups for each in group]
            # A fourth number is a factor, with its least and largest value before it.
            ends = [(0.0, 1.0)] * 3
            if size == 4 and len(numbers) == 6:
                ends.append((numbers[0], numbers[2]))
                numbers = [*numbers[3:], numbers[1]]
            if len(numbers) != size or len(ends) < size:
                self.refuse(f"color of {kind} must have {6 if size == 4 else size} numbers", word.where)
            ends = ends[:size]
            return Uniform(
                name.text,
                kind,
                name.where,
                tuple(numbers),
                tuple(a for a, _ in ends),
                tuple(b for _, b in ends),
            )
        if len(groups) != 3 or any(len(group) not in (1, size) for group in groups):
            self.refuse(f"slider of {kind} must have its least, its first and its largest value", word.where)
        least, first, most = (tuple(group * size if len(group) == 1 else group) for group in groups)
        return Uniform(name.text, kind, name.where, first, least, most)

    # --- statements

    def block(self) -> tuple[Statement, ...]:
        """Statements in brackets."""
        self.need("{")
        found: list[Statement] = []
        while not self.take("}"):
            if self.here.kind == "end":
                self.refuse("'}' is missing")
            found += self.statement()
        return tuple(found)

    def statement(self) -> list[Statement]:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            self.refuse("is nested too deep")
        try:
            return self._statement()
        finally:
            self.depth -= 1

    def body(self) -> tuple[Statement, ...]:
        """One statement, or those in brackets."""
        return self.block() if self.here.text == "{" else tuple(self.statement())

    def _statement(self) -> list[Statement]:
        word = self.here
        if word.text == "{" and word.kind == "sign":
            return [Statement("block", "", word.where, blocks=(self.block(),))]
        if self.take(";"):
            return []
        if word.kind == "name":
            special = {
                "if": self._if,
                "for": self._for,
                "while": self._while,
                "do": self._do,
                "return": self._return,
                "switch": self._switch,
            }.get(word.text)
            if special is not None:
                self.next()
                return [special(word)]
            if word.text in ("break", "continue", "discard"):
                self.next()
                self.need(";")
                if word.text == "discard":
                    self.refuse("discard is outside of the GLSL that is read", word.where)
                return [Statement("leave", word.text, word.where)]
            if self.declares():
                return self.local()
        found = Statement("do", "", word.where, (self.expression(),))
        self.need(";")
        return [found]

    def declares(self) -> bool:
        """Whether a declaration begins here, not a value such as `vec3(1.0).x`."""
        word = self.here
        if word.text in _QUALIFIERS:
            return True
        return word.text in TYPES and self.ahead(1).kind == "name"

    def local(self) -> list[Statement]:
        self.qualifiers()
        kind = self.type()
        found = self.declared(kind, self.name())
        self.need(";")
        return found

    def _if(self, word: Token) -> Statement:
        self.need("(")
        condition = self.expression()
        self.need(")")
        yes = self.body()
        no = self.body() if self.take("else") else ()
        return Statement("if", "", word.where, (condition,), (yes, no))

    def _for(self, word: Token) -> Statement:
        self.need("(")
        begin: list[Statement] = []
        if not self.take(";"):
            if self.declares():
                begin = self.local()
            else:
                begin = [Statement("do", "", self.here.where, (self.expression(),))]
                self.need(";")
        condition = () if self.here.text == ";" else (self.expression(),)
        self.need(";")
        step = () if self.here.text == ")" else (Statement("do", "", self.here.where, (self.expression(),)),)
        self.need(")")
        return Statement("loop", "", word.where, condition, (tuple(begin), step, self.body()))

    def _while(self, word: Token) -> Statement:
        self.need("(")
        condition = self.expression()
        self.need(")")
        return Statement("loop", "", word.where, (condition,), ((), (), self.body()))

    def _do(self, word: Token) -> Statement:
        body = self.body()
        self.need("while")
        self.need("(")
        condition = self.expression()
        self.need(")")
        self.need(";")
        return Statement("loop", "", word.where, (condition,), ((), (), body), late=True)

    def _return(self, word: Token) -> Statement:
        values = () if self.here.text == ";" else (self.expression(),)
        self.need(";")
        return Statement("return", "", word.where, values)

    def _switch(self, word: Token) -> Statement:
        self.need("(")
        value = self.expression()
        self.need(")")
        self.need("{")
        cases: list[Statement] = []
        while not self.take("}"):
            label = self.here
            if self.take("case"):
                labels: tuple[Expression, ...] = (self.expression(),)
            elif self.take("default"):
                labels = ()
            else:
                self.refuse("a statement before a case")
            self.need(":")
            body: list[Statement] = []
            while self.here.text not in ("case", "default", "}"):
                if self.here.kind == "end":
                    self.refuse("'}' is missing")
                body += self.statement()
            cases.append(Statement("case", "", label.where, labels, (tuple(body),)))
        return Statement("switch", "", word.where, (value,), (tuple(cases),))

    def skip(self, begin: str, end: str) -> None:
        """Words between brackets."""
        self.need(begin)
        depth = 1
        while depth and self.here.kind != "end":
            text = self.next().text
            depth += (text == begin) - (text == end)
