"""Several formulas in one text: each one's functions under names of its own, and those that choose.

Before the constants of each stands the number of its leaf: whoever is given constants asks the formula whose they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from clfractal.formulas.functions import Facts, each_usual, state_functions
from clfractal.formulas.language import Chain
from clfractal.formulas.opencl import FormulaText, Leaf, write_formula

# What a formula is asked: the type of the answer, the function, and its parameters before the constants and behind them.
_ASKED = (
    ("void", "start", "vec point", "state *c, state *z"),
    ("void", "dual_start", "vec point", "dual_state *c, dual_state *z"),
    ("state", "apply_by", "int usual, int n, state z, state c", ""),
    ("state", "apply", "int n, state z, state c", ""),
    ("dual_state", "dual_apply_by", "int usual, int n, dual_state z, dual_state c", ""),
    ("dual_state", "dual_apply", "int n, dual_state z, dual_state c", ""),
    ("real", "solid_distance", "state z", ""),
    ("dual", "dual_solid_distance", "dual_state z", ""),
)
_ASKED_CARRIED = (("real", "carried_number", "int name, state z", ""),)
_ASKED_DERIVATIVE = (
    ("state", "apply_derivative_by", "int usual, int n, state z, state c, real *growth", ""),
    ("state", "apply_derivative", "int n, state z, state c, real *growth", ""),
)


@dataclass(frozen=True, slots=True)
class Together:
    """Formulas in one text.

    Attributes:
        text: the definitions that `kernels/formulas/orbit.h` expects before it.
        formulas: of each formula its functions and constants; equal functions are there once.
        firsts: where the constants of each begin.
        constants: all of them, each formula's behind its leaf.
    """

    text: str
    formulas: tuple[FormulaText, ...]
    firsts: tuple[int, ...]
    constants: tuple[float, ...]


@lru_cache(maxsize=16)
def write_together(chains: tuple[Chain, ...]) -> Together:
    """The text of all; the scalar rules of their own are in it if all have one."""
    scalar_rule = all(write_formula(chain).has_derivative for chain in chains)
    width, carried = max(chain.size for chain in chains), max(len(chain.carried) for chain in chains)
    leaves: list[FormulaText] = []
    found: list[FormulaText] = []
    firsts: list[int] = []
    constants: list[float] = []
    for chain in chains:
        for number in range(len(leaves) + 1):
            leaf = Leaf(_name(number), width, carried)
            written = write_formula(chain, scalar_rule=scalar_rule, leaf=leaf)
            if number == len(leaves):
                leaves.append(written)
            if leaves[number].text == written.text:
                break
        found.append(written)
        constants.append(number)
        firsts.append(len(constants))
        constants += written.constants
    asked = [
        *_ASKED,
        *(_ASKED_CARRIED if carried else ()),
        *(_ASKED_DERIVATIVE if scalar_rule else ()),
    ]
    text = "\n".join(
        [
            _facts([leaf.facts for leaf in leaves]),
            state_functions(width, carried, dict.fromkeys(range(carried), "dual")),
            *(leaf.text for leaf in leaves),
            _usual(len(leaves)),
            *(_choice(len(leaves), *each) for each in asked),
        ]
    )
    return Together(text, tuple(found), tuple(firsts), tuple(constants))


def _name(leaf: int) -> str:
    return f"leaf_{leaf}_"


def _facts(each: list[Facts]) -> str:
    """The facts as defines: what is not the same of all formulas stands in the record of each."""
    differing = {
        name.upper(): f"(orbit->{name})"
        for name in ("first_count", "logarithmic", "has_shape")
        if len({getattr(facts, name) for facts in each}) > 1 or any(name in facts.by_record for facts in each)
    }
    # (Orbits of several solids run neither side by side nor are they left under way: the last two are of no account.)
    return each[0].defines(JOINED=1, HAS_CALLS=1, CARRIES_ORBITS=0, **differing)


def _usual(leaves: int) -> str:
    """Whether the formula whose constants are given has its usual values, and which it is: what orbits are written for."""
    names = [f"{_name(leaf)}has_usual_values(k)" for leaf in range(leaves)]
    lines = [
        f"    if ((int)k[-1] == {leaf}) {{ return {names[leaf]} ? {leaf + 1} : 0; }}\n"
        for leaf in range(1, leaves)
    ]
    return (
        f"{each_usual(leaves)}INLINE int has_usual_values(__constant const scalar *k) {{\n"
        f"{''.join(lines)}    return {names[0]};\n}}\n"
        "INLINE int leaf_of(int usual, __constant const scalar *k) { return usual ? usual - 1 : (int)k[-1]; }\n"
    )


def _choice(leaves: int, answer: str, function: str, before: str, behind: str) -> str:
    """The function of the formula whose constants are given."""
    parameters = ", ".join(filter(None, (before, "__constant const scalar *k", behind)))
    passed = ", ".join(each.split()[-1].lstrip("*") for each in parameters.split(", "))
    returned, ended = ("", " return;") if answer == "void" else ("return ", "")
    asked = "leaf_of(usual, k)" if "usual" in before else "(int)k[-1]"
    lines = [
        f"    if ({asked} == {leaf}) {{ {returned}{_name(leaf)}{function}({passed});{ended} }}\n"
        for leaf in range(1, leaves)
    ]
    lines.append(f"    {returned}{_name(0)}{function}({passed});\n")
    return f"INLINE {answer} {function}({parameters}) {{\n{''.join(lines)}}}\n"
