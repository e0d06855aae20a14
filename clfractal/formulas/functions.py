"""What kernels know of a formula beside its functions, and what its functions stand behind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from clfractal.formulas.chain import Chain
from clfractal.formulas.fuse import without_unused
from clfractal.formulas.near_codes import CODES, MOST_SLOTS


@dataclass(frozen=True, slots=True)
class Facts:
    """What `kernels/formulas/orbit.h` has to know of a formula before it.

    Attributes:
        size: numbers of its state.
        first_count: applications that the starting state already counts.
        logarithmic: the degree is above 1, so that distances follow |z| log|z|.
        has_derivative: every link carries a scalar rule, so marching needs no Jacobian.
        has_shape: the last solid is told by a shape.
        has_calls: of exp, sin and their like.
        carries_orbits: whether a march leaves a packet's last orbits under way: where an application costs much beside a
            step, and is the same however many have been.
        carried: numbers that go on beside z.
        by_record: which of these differ with a chain's turns: they are read from the orbit's record.
        placed: orbits begin as a table says; see `deep.py`.
    """

    size: int
    first_count: int
    logarithmic: bool
    has_derivative: bool
    has_shape: bool
    has_calls: bool
    carries_orbits: bool
    carried: int = 0
    by_record: frozenset[str] = frozenset()
    placed: bool = False

    def of(self, chain: Chain) -> Facts:
        """The same of a chain with other turns, whose text this is too."""
        if not self.by_record:
            return self
        shape = chain.shape_index is not None if "has_shape" in self.by_record else self.has_shape
        return replace(
            self, first_count=int(chain.starts_counted), logarithmic=chain.degree > 1, has_shape=shape
        )

    def defines(self, **others: object) -> str:
        """As defines, of which some have other values."""
        read = {name.upper(): f"(orbit->{name})" for name in sorted(self.by_record)}
        values: dict[str, object] = {
            "JOINED": 0,
            "STATE_SIZE": self.size,
            "FIRST_COUNT": self.first_count,
            "LOGARITHMIC": int(self.logarithmic),
            "HAS_DERIVATIVE": int(self.has_derivative),
            "HAS_SHAPE": int(self.has_shape),
            "HAS_CALLS": int(self.has_calls),
            "CARRIES_ORBITS": int(self.carries_orbits),
        }
        if self.carried:
            values["STATE_CARRIED"] = self.carried
        if self.placed:
            values["SHOWS_PLACE"] = 1
        return "".join(f"#define {name} {value}\n" for name, value in {**values, **read, **others}.items())


def each_usual(formulas: int) -> str:
    """What `has_usual_values` may say: 1 for the usual values of the first formula, 2 for the second's, and so on."""
    return f"#define EACH_USUAL(DO) {' '.join(f'DO({which + 1})' for which in range(formulas))}\n"


def state_functions(
    size: int, carried: int = 0, over_duals: Mapping[int, str] | None = None, *, placed: bool = False
) -> str:
    """The state of an orbit, by components so that every one can live in a register.

    Args:
        size: numbers of z.
        carried: numbers beside it.
        over_duals: those of them that go with z over dual numbers, and their types.
        placed: whether it waits until an application, which is then kept.
    """
    fields = [f"s{i}" for i in range(size)]
    waits = ["begun"] if placed else []
    beside = [f"e{i}" for i in range(carried)] + waits
    over = {f"e{i}": c_type for i, c_type in (over_duals or {}).items()} | dict.fromkeys(waits, "real")

    def each(text: str, join: str = ", ", also: str = "") -> str:
        return join.join([text.replace("@", field) for field in fields] + ([also] if also else []))

    picked = ", ".join(f"pick(m, yes.{field}, no.{field})" for field in beside)
    picked_over = ", ".join(
        f"{'dual_where' if c_type == 'dual' else 'pick'}(m, yes.{field}, no.{field})"
        for field, c_type in over.items()
    )
    fields_over = "".join(f"\n    {c_type} {field};" for field, c_type in over.items())
    return f"""\
typedef struct {{
    real {", ".join([*fields, *beside])};
}} state;
typedef struct {{
    dual {", ".join(fields)};{fields_over}
}} dual_state;
INLINE state state_pick(mask m, state yes, state no) {{
    const state r = {{{each("pick(m, yes.@, no.@)", also=picked)}}};
    return r;
}}
INLINE dual_state dual_state_pick(mask m, dual_state yes, dual_state no) {{
    const dual_state r = {{{each("dual_where(m, yes.@, no.@)", also=picked_over)}}};
    return r;
}}
INLINE real state_square(state z) {{ return {each("z.@ * z.@", " + ")}; }}
INLINE real dual_state_square(dual_state z) {{ return {each("z.@.v * z.@.v", " + ")}; }}
// J^T z times a factor: half the gradient of |z|^2 by the point.
INLINE vec dual_state_gradient(dual_state z, real factor) {{
    return vec_of({", ".join(each(f"(factor * z.@.v) * z.@.d{axis}", " + ") for axis in "xyz")});
}}
"""


def place_include(width: int) -> str:
    """What stands before the functions of a formula of whose space a place is shown; `width`: numbers of its state."""
    codes = "".join(f"#define NEAR_{name.upper()} {number}\n" for number, name in enumerate(CODES))
    return (
        f'{codes}#define NEAR_SLOTS {MOST_SLOTS}\n#define PLACED_WIDTH {width}\n#include "formulas/place.h"'
    )


def link_name(prefix: str, index: int, usual: bool) -> str:
    """The name of a link's function, before that of a leaf."""
    return f"{prefix}_{'usual' if usual else 'apply'}_{index}"


def function_text(head: str, lines: Sequence[str], tail: str | None) -> str:
    """A function's text: its head, its statements without those that nothing uses, and what it ends with."""
    body = "".join(f"    {line}\n" for line in lines) + (f"    {tail}\n" if tail else "")
    return f"{head}\n{without_unused(body)}}}\n"
