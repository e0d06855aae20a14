"""Reads expressions of GLSL from words, as a tree."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

from clfractal.errors import FileError, Where
from clfractal.exchange.glsl_tokens import Token
from clfractal.exchange.glsl_tree import TYPES, Expression

MAX_DEPTH = 60
_RANKS: tuple[tuple[str, ...], ...] = (
    *(("||",), ("^^",), ("&&",), ("|",), ("^",), ("&",), ("==", "!="), ("<", ">", "<=", ">=")),
    *(("<<", ">>"), ("+", "-"), ("*", "/", "%")),
)
_ASSIGNS = ("=", "+=", "-=", "*=", "/=", "%=")


class ExpressionReader:
    """A parser by recursive descent."""

    def __init__(self, words: Sequence[Token], file: str) -> None:
        self.words = words
        self.end = Token("end", "", words[-1].where if words else Where(file))
        self.place = 0
        self.depth = 0

    # --- words

    @property
    def here(self) -> Token:
        return self.ahead(0)

    def ahead(self, count: int) -> Token:
        place = self.place + count
        return self.words[place] if place < len(self.words) else self.end

    def next(self) -> Token:
        word = self.here
        self.place += 1
        return word

    def take(self, *texts: str) -> bool:
        """Whether the next word is one of these, which is gone then."""
        if self.here.kind in ("sign", "name") and self.here.text in texts:
            self.place += 1
            return True
        return False

    def need(self, text: str) -> Token:
        if self.here.text != text:
            self.refuse(
                f"{text!r} is missing before {self.here.text[:40]!r}"
                if self.here.text
                else f"{text!r} is missing"
            )
        return self.next()

    def name(self) -> Token:
        if self.here.kind != "name":
            self.refuse(f"a name is missing before {self.here.text[:40]!r}")
        return self.next()

    def refuse(self, what: str, where: Where | None = None) -> NoReturn:
        raise FileError(what, where or self.here.where)

    # --- expressions

    def expression(self) -> Expression:
        """Values with commas between them."""
        first = self.assignment()
        if self.here.text != ",":
            return first
        parts = [first]
        while self.take(","):
            parts.append(self.assignment())
        return Expression("list", "", tuple(parts), first.where)

    def assignment(self) -> Expression:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            self.refuse("is nested too deep")
        left = self.choice()
        word = self.here
        if word.kind == "sign" and word.text in _ASSIGNS:
            self.next()
            left = Expression("assign", word.text, (left, self.assignment()), word.where)
        elif word.kind == "sign" and word.text in ("<<=", ">>=", "&=", "|=", "^="):
            self.refuse(f"the operation {word.text} is outside of the GLSL that is read")
        self.depth -= 1
        return left

    def choice(self) -> Expression:
        condition = self.binary(0)
        word = self.here
        if not self.take("?"):
            return condition
        yes = self.assignment()
        self.need(":")
        return Expression("operator", "?", (condition, yes, self.assignment()), word.where)

    def binary(self, rank: int) -> Expression:
        if rank == len(_RANKS):
            return self.unary()
        left = self.binary(rank + 1)
        while self.here.kind == "sign" and self.here.text in _RANKS[rank]:
            word = self.next()
            left = Expression("operator", word.text, (left, self.binary(rank + 1)), word.where)
        return left

    def unary(self) -> Expression:
        word = self.here
        if word.kind == "sign" and word.text in ("-", "+", "!", "++", "--"):
            self.next()
            self.depth += 1
            if self.depth > MAX_DEPTH:
                self.refuse("is nested too deep")
            part = self.unary()
            self.depth -= 1
            kind = "before" if word.text in ("++", "--") else "operator"
            return Expression(
                kind, word.text if kind == "before" else f"unary {word.text}", (part,), word.where
            )
        return self.behind(self.first())

    def behind(self, value: Expression) -> Expression:
        """Members, indices, `++` and `--`."""
        while True:
            word = self.here
            if self.take("."):
                value = Expression("member", self.name().text, (value,), word.where)
            elif self.take("["):
                index = self.expression()
                self.need("]")
                value = Expression("item", "", (value, index), word.where)
            elif self.take("++", "--"):
                value = Expression("after", word.text, (value,), word.where)
            else:
                return value

    def first(self) -> Expression:
        word = self.next()
        if word.kind == "number":
            return Expression("number", "", (), word.where, self.number(word), whole=_is_whole(word.text))
        if word.text == "(" and word.kind == "sign":
            found = self.expression()
            self.need(")")
            return found
        if word.kind != "name":
            shown = f"{word.text[:40]!r}" if word.text else "the end"
            self.refuse(f"a value is missing before {shown}", word.where)
        if self.here.text == "[" and word.text in TYPES:
            self.refuse("a value of an array's type is outside of the GLSL that is read")
        if not self.take("("):
            return Expression("name", word.text, (), word.where)
        parts: list[Expression] = []
        if self.take("void"):
            self.need(")")
            return Expression("call", word.text, (), word.where)
        while not self.take(")"):
            if parts:
                self.need(",")
            parts.append(self.assignment())
        return Expression("call", word.text, tuple(parts), word.where)

    def number(self, word: Token) -> float:
        digits = word.text.rstrip("uU")
        try:
            if digits[:2].lower() == "0x":
                return float(int(digits, 16))
            found = float(digits.rstrip("fF"))
        except (ValueError, OverflowError):
            self.refuse(f"must be a number, got {word.text[:40]!r}", word.where)
        if not abs(found) <= 1e30:
            self.refuse(f"the number {word.text[:40]} is too large", word.where)
        return found


def _is_whole(text: str) -> bool:
    return text[:2].lower() == "0x" or text.rstrip("uU").isdecimal()
