"""Mistakes in OpenCL C: other operators, constants and comparisons, swapped arguments, statements left out.

A kernel is no Python, so no well-kept tool knows it. What is found here relies on the style of the kernels: a binary
operator has a space on both sides, a pointer's star has not.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

from tests.mutants.mutant import Mutant

# What a binary operator becomes. Both sides have spaces, so `float *x` and `-x` are none.
_OPERATORS = {
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
    "%": "*",
    "<": "<=",
    "<=": "<",
    ">": ">=",
    ">=": ">",
    "==": "!=",
    "!=": "==",
    "&&": "||",
    "||": "&&",
    "&": "|",
    "|": "&",
    "<<": ">>",
    ">>": "<<",
    "+=": "-=",
    "-=": "+=",
    "*=": "/=",
    "/=": "*=",
    "|=": "&=",
    "&=": "|=",
}
_OPERATOR = re.compile(
    r"(?<= )(" + "|".join(re.escape(o) for o in sorted(_OPERATORS, key=len)[::-1]) + r")(?= )"
)

# What a call becomes, argument for argument.
_CALLS = {
    "less": "less_equal",
    "less_equal": "less",
    "fmin": "fmax",
    "fmax": "fmin",
    "min": "max",
    "max": "min",
    "sin": "cos",
    "cos": "sin",
    "floor": "ceil",
    "fabs": "",
    "sqrt": "",
    "vec_add": "vec_sub",
    "vec_sub": "vec_add",
}
_CALL = re.compile(r"\b([A-Za-z_]\w*)\(")

# Calls of which neighbouring arguments have the same type, from the argument with this number on: others would not build.
_SWAPS = {
    "pick": 1,
    "vec_pick": 1,
    "color_pick": 1,
    "ray_pick": 1,
    "less": 0,
    "less_equal": 0,
    "vec_sub": 0,
    "vec_cross": 0,
    "vec_of": 0,
    "color_of": 0,
    "color_mix": 0,
    "mix": 0,
    "clamp": 0,
    "pow": 0,
    "real_atan2": 0,
    "between": 0,
    "dual_sub": 0,
    "dual_div": 0,
}

_NUMBER = re.compile(r"(?<![\w.])(\d+\.\d*(?:[eE][-+]?\d+)?|\d+(?:[eE][-+]?\d+)?)(?![\w.])")
_SIGN = re.compile(r"(?<![\w)\]] )(?<![eE])[-~!](?=[\w(])")
_CHANGE = re.compile(r"(?<=[;{})])\s+(?:\*?[\w.]|->|\[\w+\])+ [-+*/|&]?= [^;{}]*;")

Edit = tuple[int, int, str, str]
"""Where it starts and ends, the kind of mistake, the new text."""


def kernel_mutants(path: str, text: str) -> list[Mutant]:
    """Every mistake that can be made in a kernel file, in order of place."""
    code = _blank(text)
    edits = sorted({*_operators(code), *_numbers(code), *_calls(code), *_statements(code)})
    return [Mutant(path, what, text, text[:start] + new + text[end:]) for start, end, what, new in edits]


def _blank(text: str) -> str:
    """The text with spaces in place of comments, texts and of directives other than `#define` of a value."""

    def spaces(found: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " ", found[0])

    text = re.sub(r"//[^\n]*|/\*.*?\*/|\"[^\"\n]*\"", spaces, text, flags=re.DOTALL)
    text = re.sub(r"^[ \t]*#(?!define)(?:[^\n]*\\\n)*[^\n]*", spaces, text, flags=re.MULTILINE)
    return re.sub(r"^[ \t]*#define +\w+(?:\([^)\n]*\))?", spaces, text, flags=re.MULTILINE)


def _operators(code: str) -> Iterator[Edit]:
    for found in _OPERATOR.finditer(code):
        yield *found.span(), f"{found[0]} becomes {_OPERATORS[found[0]]}", _OPERATORS[found[0]]
    for found in _SIGN.finditer(code):
        yield *found.span(), f"{found[0]} left out", ""


def _numbers(code: str) -> Iterator[Edit]:
    for found in _NUMBER.finditer(code):
        old = found[0]
        whole = old.isdecimal()
        new = str(int(old) + 1) if whole else repr(1.25 * float(old) or 1.0)
        yield *found.span(), f"{old} becomes {new}", new


def _calls(code: str) -> Iterator[Edit]:
    for found in _CALL.finditer(code):
        name, (start, end) = found[1], found.span(1)
        if name in _CALLS:
            yield start, end, f"{name} becomes {_CALLS[name] or 'nothing'}", _CALLS[name]
        spans = list(_arguments(code, end + 1))[_SWAPS.get(name, 99) :]
        for (a, b), (c, d) in pairwise(spans):
            if code[a:b] != code[c:d] and not _declares(code, start):
                yield a, d, f"arguments of {name} swapped", code[c:d] + code[b:c] + code[a:b]


def _declares(code: str, start: int) -> bool:
    """Whether the name that starts here is a function's in its own head: a type stands before it."""
    return re.search(r"\w[ *]+$", code[max(0, start - 20) : start]) is not None and not re.search(
        r"\breturn +$", code[:start]
    )


def _arguments(code: str, start: int) -> Iterator[tuple[int, int]]:
    """The spans of a call's arguments; `start` is the place after its opening bracket."""
    depth, first = 0, start
    for place in range(start, len(code)):
        letter = code[place]
        if (depth == 0 and letter in ",)") and code[first:place].strip():
            lead = len(code[first:place]) - len(code[first:place].lstrip())
            yield first + lead, place
            first = place + 1
        if depth == 0 and letter == ")":
            return
        depth += (letter in "([{") - (letter in ")]}")


def _statements(code: str) -> Iterator[Edit]:
    for found in _CHANGE.finditer(code):
        start = found.start() + len(found[0]) - len(found[0].lstrip())
        yield start, found.end(), "statement left out", ";"
    for found in re.finditer(r"\bif \(", code):
        spans = list(_arguments(code, found.end()))
        if len(spans) == 1:
            a, b = spans[0]
            yield a, b, "condition reversed", f"!({code[a:b]})"
