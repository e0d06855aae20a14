"""Products that are added become one operation with the sum, rounded once.

Whether compilers do that to what stands in two statements is their own affair. So it is written, and by expressions alone:
an orbit has the same values, and ends alike, whichever derivative goes with it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial

from clfractal.formulas.products import Value

_STATEMENT = re.compile(r"^[^\S\n]*const (?:complex_)?(?:real|dual) (\w+) = [^;\n]*;\n", re.MULTILINE)
_WORD = re.compile(r"\b[A-Za-z_]\w*\b")


def _unless(names: set[str], statement: re.Match[str]) -> str:
    return "" if statement[1] in names else statement[0]


def without_unused(body: str) -> str:
    """The statements of one function without those that nothing uses: products that sums took, slopes that cancelled."""
    while True:
        uses = Counter(_WORD.findall(body))
        # A statement may be there twice: in a loop, and behind it.
        written = Counter(_STATEMENT.findall(body))
        unused = {name for name, times in written.items() if uses[name] == times}
        if not unused:
            return body
        body = _STATEMENT.sub(partial(_unless, unused), body)


def needed(lines: Sequence[str], results: Sequence[str]) -> list[str]:
    """Statements, and what they are for, without those that nothing uses."""
    return without_unused("".join(f"{line}\n" for line in [*lines, *results])).splitlines()


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
