"""Words of a fragment shader's text with their places, comments taken out, and macros written in."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from clfractal.errors import FileError, Where

MAX_TOKENS = 100_000
MAX_MACROS = 1_000
_DEPTH = 20

_WORD = re.compile(
    r"(?P<space>[ \t\r\f\v]+|//[^\n]*|/\*.*?\*/|\\\r?\n)"
    r"|(?P<line>\n)"
    r"|(?P<number>0[xX][0-9a-fA-F]+|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)[fFuU]?"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r'|(?P<text>"[^"\n]*")'
    r"|(?P<sign>\+\+|--|<<=|>>=|<<|>>|[-+*/%&|^<>=!]=|&&|\|\||\^\^|[-+*/%<>=!&|^~?:;,.(){}\[\]#])",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Token:
    """A word: its kind is `number`, `name`, `text`, `sign`, `line` (an end of one) or `end`."""

    kind: str
    text: str
    where: Where


@dataclass(frozen=True, slots=True)
class Macro:
    """What a name stands for; `arguments` is None where it has no brackets."""

    arguments: tuple[str, ...] | None
    body: tuple[Token, ...]


def words_of(text: str, file: str, line: int = 1) -> list[Token]:
    """The words of a text; ends of lines are words, too.

    Raises:
        FileError: a character that is none of the language, with its place; or too many words.
    """
    found: list[Token] = []
    place, begin = 0, 0
    while place < len(text):
        match = _WORD.match(text, place)
        where = Where(file, line, place - begin + 1)
        if match is None:
            what = (
                "a comment without an end"
                if text.startswith("/*", place)
                else f"the character {text[place]!r}"
            )
            raise FileError(f"{what} is outside of the GLSL that is read", where)
        kind = str(match.lastgroup)
        if kind != "space":
            found.append(Token(kind, match[kind], where))
            if len(found) > MAX_TOKENS:
                raise FileError(f"is too long: at most {MAX_TOKENS:,} words", where)
        lines = text.count("\n", place, match.end())
        if lines:
            line += lines
            begin = text.rindex("\n", place, match.end()) + 1
        place = match.end()
    return found


@dataclass
class Macros:
    """The names that `#define` gave a meaning."""

    known: dict[str, Macro] = field(default_factory=dict)
    written: int = 0
    """Words that macros were replaced by."""

    def define(self, words: Sequence[Token]) -> None:
        """`#define`, from its name on.

        Raises:
            FileError: it has no name, or there are too many of them.
        """
        name = words[0] if words else None
        if name is None or name.kind != "name":
            raise FileError("#define must have a name", words[0].where if words else Where())
        if len(self.known) >= MAX_MACROS:
            raise FileError(f"has more than {MAX_MACROS:,} macros", name.where)
        arguments: tuple[str, ...] | None = None
        body = list(words[1:])
        # A bracket that stands at the name begins arguments.
        touches = body and body[0].text == "(" and _column(body[0]) == _column(name) + len(name.text)
        if touches:
            ends = [place for place, word in enumerate(body) if word.text == ")"]
            if not ends:
                raise FileError("#define has a bracket without an end", name.where)
            arguments = tuple(word.text for word in body[1 : ends[0]] if word.kind == "name")
            body = body[ends[0] + 1 :]
        self.known[name.text] = Macro(arguments, tuple(body))

    def expanded(self, words: Sequence[Token], hidden: frozenset[str] = frozenset()) -> Iterator[Token]:
        """Words with what macros stand for, at the places of their names.

        Raises:
            FileError: macros are within each other too deep, or what they stand for is too long.
        """
        place = 0
        while place < len(words):
            word = words[place]
            macro = self.known.get(word.text) if word.kind == "name" and word.text not in hidden else None
            place += 1
            if macro is None:
                yield word
                continue
            body: Sequence[Token] = macro.body
            if macro.arguments is not None:
                if place >= len(words) or words[place].text != "(":
                    yield word
                    continue
                given, place = _arguments(words, place)
                if len(given) != len(macro.arguments) and not (not macro.arguments and given == [[]]):
                    raise FileError(
                        f"the macro {word.text[:60]} has {len(macro.arguments)} arguments, not {len(given)}",
                        word.where,
                    )
                body = _filled(body, dict(zip(macro.arguments, given, strict=False)))
            self.written += len(body)
            if len(hidden) >= _DEPTH or self.written > MAX_TOKENS:
                raise FileError("macros stand for too much", word.where)
            here = [replace(each, where=word.where) for each in body]
            yield from self.expanded(here, hidden | {word.text})


def _column(word: Token) -> int:
    return word.where.column or 0


def _arguments(words: Sequence[Token], place: int) -> tuple[list[list[Token]], int]:
    """The arguments in brackets, and the place behind them."""
    first, depth = words[place], 0
    given: list[list[Token]] = [[]]
    while place < len(words):
        word = words[place]
        place += 1
        if word.text in ("(", "["):
            depth += 1
            if depth == 1:
                continue
        elif word.text in (")", "]"):
            depth -= 1
            if depth == 0:
                return given, place
        if word.text == "," and depth == 1:
            given.append([])
        elif word.kind != "line":
            given[-1].append(word)
    raise FileError("a bracket without an end", first.where)


def _filled(body: Sequence[Token], given: Mapping[str, Sequence[Token]]) -> list[Token]:
    return [
        part for word in body for part in (given.get(word.text, [word]) if word.kind == "name" else [word])
    ]
