"""Sums that products join: the same numbers where nothing is rounded, by fewer operations; in all texts the same ones."""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.device.structs import Precision
from clfractal.formulas.costs import count_of_operations
from clfractal.formulas.emit import Constants, Emitter
from clfractal.formulas.fuse import without_unused
from clfractal.formulas.nodes import Call, Name, Node, Number
from clfractal.formulas.products import Value
from tests.devices import check_usable
from tests.formulas.orbits import SPECS, orbit, texts
from tests.variants import every, one_of

OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "abs": abs,
    "fma": lambda a, b, c: a * b + c,
    "fms": lambda a, b, c: a * b - c,
    "fnma": lambda a, b, c: c - a * b,
}
VALUES = {"x": Fraction(3, 2), "y": Fraction(-5, 7)}

nodes: st.SearchStrategy[Node] = st.recursive(
    st.sampled_from([Name("x"), Name("y"), Number(2.0), Number(0.5)]),
    lambda inner: st.one_of(
        st.builds(lambda a: Call("abs", (a,)), inner),
        st.builds(
            lambda function, a, b: Call(function, (a, b)),
            st.sampled_from(["add", "sub", "mul", "mul"]),
            inner,
            inner,
        ),
    ),
    max_leaves=16,
)


def exact(node: Node) -> Fraction:
    if isinstance(node, Number):
        return Fraction(node.value)
    if isinstance(node, Name):
        return VALUES[node.name]
    return Fraction(OPERATIONS[node.function](*map(exact, node.arguments)))


def computed(body: str, result: str) -> Fraction:
    """What statements compute, in exact arithmetic."""
    names: dict[str, Any] = {f"real_{name}": function for name, function in OPERATIONS.items()}
    names |= {"R": Fraction, "real": lambda a: a, **VALUES}
    for line in body.splitlines():
        name, _, expression = line.strip().rstrip(";").partition(" = ")
        names[name.split()[-1]] = eval(expression, {}, names)
    return Fraction(eval(result, {}, names))


@given(nodes)
def test_the_same_number_by_no_more_operations(node: Node) -> None:
    emitter = Emitter("real", {name: Value(name, "varying") for name in VALUES}, Constants(), 0)
    value = emitter.emit(node)
    written = "".join(f"    {line}\n" for line in emitter.lines)
    body = without_unused(written + f"return {value.text};\n").rpartition("return")[0]
    assert computed(body, value.text) == exact(node)
    # As many sums as there are, and no product that is only added.
    assert body.count("\n") <= written.count("\n")
    for name in re.findall(r"const real (\w+) = real_mul\(", body):
        others = [line for line in [*body.splitlines(), value.text] if re.search(rf"\b{name}\b", line)][1:]
        assert others


def written(text: str) -> list[str]:
    """The statements of a sum of products."""
    emitter = Emitter("real", {name: Value(name, "varying") for name in "abcd"}, Constants(), 0)
    product: Node = Call("mul", (Name("a"), Name("b")))
    others: dict[str, Node] = {"c": Name("c"), "cd": Call("mul", (Name("c"), Name("d"))), "ab": product}
    other = others[text.strip("+-")]
    function = "add" if "+" in text else "sub"
    operands = (product, other) if text[0] in "+-" else (other, product)
    value = emitter.emit(Call(function, operands))
    body = without_unused("".join(f"{line}\n" for line in emitter.lines) + f"return {value.text};\n")
    return re.findall(r"= (.*);", body)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("+c", ["real_fma(a, b, c)"]),
        ("-c", ["real_fms(a, b, c)"]),
        ("c+", ["real_fma(a, b, c)"]),
        ("c-", ["real_fnma(a, b, c)"]),
        ("+cd", ["real_mul(a, b)", "real_fma(c, d, t0)"]),
        ("cd-", ["real_mul(c, d)", "real_fnma(a, b, t0)"]),
        # Doubling is an addition.
        ("+ab", ["real_mul(a, b)", "real_add(t0, t0)"]),
    ],
)
def test_each_way_to_add_a_product(text: str, expected: list[str]) -> None:
    assert written(text) == expected


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("form", ["operations", "jacobian"])
# (Of exponents that are data, complex powers over duals go another way.)
@pytest.mark.parametrize("name", every(2, sorted(set(SPECS) - {"mandelbulb, turned", "mandelbulb, Julia"})))
def test_orbits_have_the_same_bits_whichever_derivative_goes_with_them(
    name: str, form: str, precision: Precision
) -> None:
    check_usable(precision)
    found = orbit(name, form, precision)
    np.testing.assert_array_equal(found.values, found.dual_values)


def test_every_formula_has_joined_sums_that_have_any() -> None:
    assert sum("real_fma(" in texts("jacobian")[name].text for name in SPECS) > 0.8 * len(SPECS)


def test_operations_are_counted_once() -> None:
    body = """\
    const real t0 = real_mul(z.s0, ((real)(k[3])));
    const real t1 = real_fma(z.s0, ((real)(k[3])), R(2.0));
    const real t2 = real_fnma(z.s1, (*growth), t0);
    const state next = {real_bounded(t1, R(0.0), R(1.0)), real_fms(z.s0, t1, t2), real_sqrt(t2)};
"""
    weights = {"real_fma": 2, "real_fms": 2, "real_fnma": 2, "real_bounded": 0}
    # A product, a sum with it, two times two, and a root.
    assert count_of_operations(body, weights) == 1 + 1 + 2 + 2 + 1
