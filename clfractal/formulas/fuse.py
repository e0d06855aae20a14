"""Products that are added become one operation with the sum, rounded once.

Whether compilers do that to what stands in two statements is their own affair. So it is written, and by expressions alone:
an orbit has the same values, and ends alike, whichever derivative goes with it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from clfractal.formulas.products import Value

_PRODUCT = re.compile(
    r"^[^\S\n]*const (?:real|dual) (\w+) = (?:real|dual)_mul(?:_real)?\([^;\n]*;\n", re.MULTILINE
)
_WORD = re.compile(r"\b[A-Za-z_]\w*\b")


def _name(line: str) -> str:
    found = _PRODUCT.match(line)
    return found[1] if found else ""


def without_unused(body: str) -> str:
    """The statements of one function without products that nothing uses but sums that took them."""
    while True:
        uses: dict[str, int] = {}
        for word in _WORD.findall(body):
            uses[word] = uses.get(word, 0) + 1
        # A statement may be there twice: in a loop, and behind it.
        written: dict[str, int] = {}
        for found in _PRODUCT.finditer(body):
            written[found[1]] = written.get(found[1], 0) + 1
        unused = {name for name, times in written.items() if uses[name] == times}
        if not unused:
            return body
        lines = (each for each in body.splitlines(keepends=True) if _name(each) not in unused)
        body = "".join(lines)


def fused(
    function: str,
    operands: tuple[Value, ...],
    origins: Mapping[str, tuple[str, tuple[Value, ...]]],
    plain: Callable[[Value], str],
) -> tuple[str, ...] | None:
    """The function and the operands that a product and a sum or a difference become, with the second one of two; else None.

    Args:
        origins: of each variable the function and its operands.
        plain: the text of a value without its partials.
    """
    if function not in ("add", "sub") or operands[0].text == operands[1].text:
        return None
    for place in (1, 0):
        made, factors = origins.get(operands[place].text, ("", ()))
        if made == "mul":
            name = "fma" if function == "add" else "fnma" if place else "fms"
            return f"real_{name}", *map(plain, (*factors, operands[1 - place]))
    return None
