"""The generated OpenCL of every formula: against mpmath, in both precisions; that whole programs build; what its text has.

A packet's width is only a number, so those between are usually tried with a few formulas. All formulas of an entry point
share one build: what stands before the generated text is the same for all, and what comes after it gets a number. Only
the front end of the driver's compiler is asked (no optimiser); that the code it makes runs is the matter of other tests.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
import pytest

from clfractal.device import compiler, program
from clfractal.device.select import has_float64
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.files.channels import CHANNELS
from clfractal.formulas import catalog
from clfractal.formulas.backends import DualBackend, MpmathBackend, constant_dual, seeded
from clfractal.formulas.evaluate import evaluate
from clfractal.formulas.opencl import write_formula
from clfractal.formulas.reference import apply, constant_of, mp_jacobian, mp_orbit
from clfractal.geometry.solids import Body
from clfractal.images.tiles import Region
from clfractal.integrators import surface
from clfractal.integrators.plan import Plan
from clfractal.integrators.points import program_text
from clfractal.scene.load import load_scene
from tests.devices import check_usable, device
from tests.formulas.opencl_batch import kernel_file, numbered
from tests.formulas.orbits import FAR, SPECS, STEPS, chain_of, orbit, points_of, start_at, texts
from tests.formulas.rounding import NoisyBackend, spread
from tests.small_kernels import Floats
from tests.variants import one_of

Mask = np.ndarray[Any, np.dtype[np.bool_]]

PRECISIONS: tuple[Precision, ...] = ("float32", "float64")


# How many of them have no zero coordinate: there the derivative exists.
GENERAL = 10


@lru_cache
def exact(name: str) -> tuple[Floats, Floats]:
    """States (steps, size, n) and Jacobians (steps, size, 3, n) from mpmath, rounded to float64."""
    chain, first = chain_of(name), first_count(name)
    states, jacobians = [], []
    for point in points_of(chain):
        whole = mp_orbit(chain, list(point), STEPS + first, digits=30)
        states.append([[float(z) for z in state[: chain.size]] for state in whole[first:]])
        jacobians.append(
            [
                [
                    [float(p) for p in row]
                    for row in mp_jacobian(chain, list(point), n + first, digits=30)[: chain.size]
                ]
                for n in (0, 1, STEPS)
            ]
        )
    return np.moveaxis(np.array(states), 0, -1), np.moveaxis(np.array(jacobians), 0, -1)


def first_count(name: str) -> int:
    return int(chain_of(name).starts_counted)


@lru_cache
def tolerance(name: str, precision: Precision) -> tuple[Floats, Floats]:
    """What rounding alone may change of states and Jacobians, shapes as in `Orbit`."""
    chain, points = chain_of(name), points_of(chain_of(name))

    def disturbed(noisy: NoisyBackend) -> Floats:
        backend = DualBackend(noisy)
        state, point = start_at(chain, seeded(list(points.T)), backend)
        steps = []
        for n in range(STEPS + first_count(name) + 1):
            duals = [constant_dual(z, 3) for z in state[: chain.size]]
            rows = [[np.broadcast_to(v, len(points)) for v in (d.value, *d.partials)] for d in duals]
            steps.append(np.array(rows))
            bound = chain.link_at(n).bound
            constant = constant_of(bound, point)
            state = apply(bound, state, constant, backend, number=n, carried=chain.carried)
        return np.array(steps[first_count(name) :])

    unit = float(np.finfo(precision).eps)
    width = spread(disturbed, 2 * unit)
    with np.errstate(all="ignore"):
        size = disturbed(NoisyBackend(0.0, 0))
    # By norm: the ways to compute differ in how they cancel within a vector.
    width = np.broadcast_to(width.max(axis=1, keepdims=True), width.shape)
    scale = np.abs(size).max(axis=1, keepdims=True)
    allowed = 4 * width + 16 * unit * np.broadcast_to(scale, width.shape)
    return allowed[:, :, 0], allowed[:, :, 1:]


def compare(got: Floats, expected: Floats, allowed: Floats, states: Floats, what: str) -> None:
    """Asserts agreement at all steps until the orbit is far; the tolerances must be worth something, too."""
    radius = np.sqrt((states**2).sum(axis=1))
    near = np.logical_and.accumulate(radius <= FAR, axis=0)
    while near.ndim < got.ndim:
        near = near[:, None]
    near = np.broadcast_to(near, got.shape) & np.isfinite(allowed)
    assert near.mean() > 0.2, f"{what}: hardly anything was compared"
    with np.errstate(all="ignore"):
        ratio = np.where(near, np.abs(got - expected) / np.maximum(allowed, 1e-300), 0.0)
    ratio[near & np.isnan(got)] = np.inf
    worst = np.unravel_index(int(ratio.argmax()), ratio.shape)
    assert ratio.max() <= 1, (
        f"{what}{worst}: {got[worst]!r}, exact {expected[worst]!r}, allowed {allowed[worst]:.2g}"
    )


@pytest.mark.parametrize("precision", one_of(*PRECISIONS))
@pytest.mark.parametrize("name", list(SPECS))
def test_values(name: str, precision: Precision) -> None:
    check_usable(precision)
    states, _ = exact(name)
    allowed, _ = tolerance(name, precision)
    orbits = orbit(name, "operations", precision)
    compare(orbits.values, states, allowed, states, "value")
    for form in ("operations", "jacobian"):
        compare(orbit(name, form, precision).dual_values, states, allowed, states, form)


@pytest.mark.parametrize("precision", one_of(*PRECISIONS))
@pytest.mark.parametrize("form", ["operations", "jacobian"])
@pytest.mark.parametrize("name", list(SPECS))
def test_jacobians(name: str, form: str, precision: Precision) -> None:
    check_usable(precision)
    states, jacobians = exact(name)
    _, allowed = tolerance(name, precision)
    taken = [0, 1, STEPS]
    got = orbit(name, form, precision).jacobian[taken][..., :GENERAL]
    compare(
        got, jacobians[..., :GENERAL], allowed[taken][..., :GENERAL], states[taken][..., :GENERAL], "partial"
    )


@pytest.mark.parametrize("name", list(SPECS))
def test_where_only_one_sided_derivatives_exist_they_are_finite(name: str) -> None:
    states, _ = exact(name)
    near = np.logical_and.accumulate(np.sqrt((states**2).sum(axis=1)) <= FAR, axis=0)
    for form in ("operations", "jacobian"):
        finite: Mask = np.isfinite(orbit(name, form, "float32").jacobian)
        assert finite[np.broadcast_to(near[:, None, None], finite.shape)].all()


def rule_orbit(name: str) -> Floats:
    """The scalar derivative after every step, shape (steps, n), with mpmath."""
    chain, backend = chain_of(name), MpmathBackend()
    first = first_count(name)
    found = []
    with mpmath.workdps(30):
        for point in points_of(chain):
            states = mp_orbit(chain, list(point), STEPS + first, digits=30)[first:]
            growth = [mpmath.mpf(1)]
            for n, state in enumerate(states[:-1]):
                bound = chain.link_at(n + first).bound
                assert bound.derivative is not None
                names: dict[str, Any] = {**bound.values, "n": float(n + first), "dr": growth[-1]}
                names.update(zip(bound.formula.variables, state, strict=True))
                for let, node in bound.formula.let:
                    names[let] = evaluate(node, names, backend)
                growth.append(mpmath.mpf(evaluate(bound.derivative, names, backend)))
            found.append([float(g) for g in growth])
    return np.array(found).T


WITH_RULE = [
    name
    for name in SPECS
    if "derivative_apply_0" in texts("operations")[name].text and chain_of(name).rule_index is None
]


@pytest.mark.parametrize("precision", one_of(*PRECISIONS))
@pytest.mark.parametrize("name", WITH_RULE)
def test_scalar_rules(name: str, precision: Precision) -> None:
    check_usable(precision)
    states, _ = exact(name)
    expected = rule_orbit(name)
    allowed, _ = tolerance(name, precision)
    # A rule is a product of functions of the states: their relative errors add up.
    size = np.abs(states).max(axis=1)
    with np.errstate(all="ignore"):
        relative = 40 * np.maximum.accumulate(np.nan_to_num(allowed.max(axis=1) / size, nan=0.0), axis=0)
    unit = float(np.finfo(precision).eps)
    got = orbit(name, "operations", precision).growth[:, None]
    compare(got, expected[:, None], ((relative + 64 * unit) * np.abs(expected))[:, None], states, "growth")


def test_most_library_formulas_have_a_rule_to_test() -> None:
    assert len(WITH_RULE) >= 10


# --- whole programs build, without a warning ---


SCENE = """\
version: 1
formula: {name: %s}
camera: {position: [0, -3, 0], target: [0, 0, 0]}
coloring: {by: %s}
"""
# With Jacobians, with a scalar derivative, a chain, and a shape.
KINDS = ("hast", "quaternion_julia", "mengerbulb", "sierpinski_tetrahedron")
FORMULA = '#line 1 "generated/formula.h"'


def points_text(name: str, precision: Precision, lanes: int) -> str:
    return program_text(Body(catalog.load_chain(name), 1), lanes, precision).text


def surface_texts(name: str, precision: Precision, lanes: int, coloring: str = "iterations") -> list[str]:
    """The renderer's programs: the march, the stages that know no formula, and what asks the formula for colours."""
    scene = load_scene(SCENE % (name, coloring))
    plan = Plan(precision, lanes, 1, Region(0, 0, 64, 64), tuple(CHANNELS))
    return [each.flat.text for each in surface.program_texts(scene, plan)]


def whole_text(name: str, precision: Precision, lanes: int) -> str:
    """The march and, behind it, what the program for lists of points has of its own."""
    own = '#line 1 "kernels/formulas/points.cl"\n' + kernel_file("formulas/points.cl")
    assert "__kernel void escape_counts" in own
    return surface_texts(name, precision, lanes)[0] + own


def together(texts: list[str]) -> str:
    """Texts that are equal up to the formula as one: the head once, then all tails, numbered."""
    parts = [text.partition(FORMULA) for text in texts]
    head = parts[0][0]
    assert all(part[0] == head for part in parts)
    return head + "\n".join(FORMULA + numbered(part[2], n) for n, part in enumerate(parts))


def build_all(texts: list[str], precision: Precision) -> None:
    """A build for all texts of one head: that of a chain may tell where its turns begin to repeat."""
    groups: dict[str, list[str]] = {}
    for text in texts:
        groups.setdefault(text.partition(FORMULA)[0], []).append(text)
    for group in groups.values():
        build(together(group), precision)


def build(text: str, precision: Precision) -> None:
    flags = [*program.math_flags(precision), "-cl-opt-disable", "-Werror"]
    compiler.compile_source(device(), text, flags)


def build_formulas(names: Sequence[str], precision: Precision, lanes: int) -> None:
    build_all([whole_text(name, precision, lanes) for name in names], precision)


def test_all_packets_in_float32() -> None:
    """(Single lanes of every formula are built by test_opencl.py.)"""
    for lanes in accepted_lanes(device(), "float32"):
        build_formulas(KINDS, "float32", lanes)


def test_one_lane_count_in_float64() -> None:
    """That of every formula compiles, test_opencl.py shows."""
    if has_float64(device().info):
        build_formulas(KINDS, "float64", accepted_lanes(device(), "float64")[-1])


@pytest.mark.combination
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_every_formula_at_two_lane_counts(precision: Precision) -> None:
    """In turn, so that each count has a good part of them: a packet's width is only a number."""
    if precision == "float32" or has_float64(device().info):
        every = accepted_lanes(device(), precision)
        for number, lanes in enumerate(every):
            near = {number, (number + 1) % len(every)}
            build_formulas(
                [name for k, name in enumerate(catalog.names()) if k % len(every) in near], precision, lanes
            )


def test_stages_that_know_no_formula_are_the_same_for_all() -> None:
    """They are built once, the march once for a formula; what colours follow is data."""
    texts = [surface_texts(name, "float32", 4) for name in KINDS]
    assert len({march for march, *_ in texts}) == len(KINDS)
    assert all(stages == texts[0][1:] for _, *stages in texts)
    assert surface_texts("hast", "float32", 4, "normal") in texts


def test_a_fault_in_one_formula_is_noticed() -> None:
    texts = [points_text(name, "float32", 1) for name in catalog.names()]
    texts[3] = re.sub(r"\breal_mul\(", "real_mult(", texts[3].split(FORMULA)[1]).join(
        [texts[3].split(FORMULA)[0] + FORMULA, ""]
    )
    with pytest.raises(compiler.BuildFailureError, match="real_mult"):
        build(together(texts), "float32")


# --- the text ---


TRIGONOMETRY = re.compile(
    r"\b(?:real|dual)_(?:sin|cos|tan|asin|acos|atan|atan2|exp|log|pow|pow_real|power_\w+)\b"
)


def text_of(name: str, parameters: dict[str, float] | None = None, **options: Any) -> str:
    return write_formula(catalog.load_chain(name, parameters), **options).text


@pytest.mark.parametrize("power", range(2, 33))
def test_whole_mandelbulb_powers_need_no_trigonometry(power: int) -> None:
    text = text_of("mandelbulb", {"power": power})
    assert TRIGONOMETRY.findall(text) == []
    assert "real_apply_0" in text
    turned = text_of("mandelbulb", {"power": power, "theta_phase": 0.4, "phi_phase": -1.1})
    assert TRIGONOMETRY.findall(turned) == []


def test_an_exponent_is_written_once_as_a_literal_and_once_as_data() -> None:
    usual, general = (
        text_of("mandelbulb", {"power": 2.5}).partition(f"INLINE state real_{way}_0(")[2].partition("\n}")[0]
        for way in ("usual", "apply")
    )
    assert "raised" not in usual
    assert "complex_raised_root(" in general


@pytest.mark.parametrize("name", ["hast", "mandelbox", "menger_sponge", "quaternion_julia", "tetrabrot"])
def test_algebraic_formulas_need_none_at_all(name: str) -> None:
    assert TRIGONOMETRY.findall(text_of(name)) == []


def trigonometric_rule(point: list[float], power: int, applications: int) -> list[Any]:
    """White's rule with products, in spherical coordinates, as it is printed."""
    x, y, z = (mpmath.mpf(v) for v in point)
    cx, cy, cz = x, y, z
    for _ in range(applications - 1):
        r = mpmath.sqrt(x * x + y * y + z * z)
        theta, phi = mpmath.atan2(mpmath.hypot(x, y), z), mpmath.atan2(y, x)
        across = r**power * mpmath.sin(power * theta)
        x = across * mpmath.cos(power * phi) + cx
        y = across * mpmath.sin(power * phi) + cy
        z = r**power * mpmath.cos(power * theta) + cz
    return [x, y, z]


@pytest.mark.parametrize("applications", [2, 3])
def test_they_equal_the_trigonometric_rule_to_rounding(applications: int) -> None:
    points = points_of(catalog.load_chain("mandelbulb"))
    got = orbit("mandelbulb", "operations", "float32").values[applications - 1].T
    compared = 0
    with mpmath.workdps(40):
        for point, value in zip(points.tolist(), got.tolist(), strict=True):
            exact = [float(v) for v in trigonometric_rule(point, 8, applications)]
            size = float(np.linalg.norm(exact))
            if size > FAR:
                continue
            # The eighth power multiplies relative errors by 8 with every application.
            np.testing.assert_allclose(
                value, exact, rtol=0, atol=1e-6 * 8 ** (applications - 1) * max(size, 1.0)
            )
            compared += 1
    assert compared >= 12


RUN_TIME = [
    ("mandelbox", {"scale": 2.0}, {"scale": -1.5}),
    ("mandelbox", {"min_radius": 0.5}, {"min_radius": 0.25}),
    ("kaleidoscopic_ifs", {"turn_before": 0.3}, {"turn_before": 0.7}),
    ("mandelbulb", {"theta_phase": 0.5}, {"theta_phase": 0.9}),
    ("quaternion_mandelbrot", {"offset": 0.2}, {"offset": 0.3}),
    ("mandelbulb", {"power": 8.0}, {"power": 3.5}),
    ("hast", {"power": 2.0}, {"power": 8.0}),
    ("polyhedral_ifs", {"order": 3.0}, {"order": 5.0}),
]


@pytest.mark.parametrize(("name", "first", "second"), RUN_TIME)
def test_what_people_drag_does_not_change_the_text(
    name: str, first: dict[str, float], second: dict[str, float]
) -> None:
    one, other = (write_formula(catalog.load_chain(name, p)) for p in (first, second))
    assert one.text == other.text
    assert len(one.constants) == len(other.constants)
    assert one.constants != other.constants


def test_a_julia_constant_is_passed_at_run_time() -> None:
    one, other = (
        write_formula(catalog.load_chain({"name": "mandelbulb", "julia": [x, 0.5, 0.25]})) for x in (0.1, 0.2)
    )
    assert one.text == other.text
    assert 0.1 in one.constants
    assert 0.2 in other.constants


@pytest.mark.parametrize("name", catalog.names())
def test_the_text_is_the_same_every_time(name: str) -> None:
    assert write_formula(catalog.load_chain(name)) == write_formula(catalog.load_chain(name))


@pytest.mark.parametrize("name", catalog.names())
def test_marching_without_the_rule_leaves_it_out(name: str) -> None:
    formula = write_formula(catalog.load_chain(name), scalar_rule=False)
    assert not formula.has_derivative
    assert "#define HAS_DERIVATIVE 0" in formula.text
    assert "derivative_apply" not in formula.text


def test_numbers_in_the_text_are_those_of_the_formula() -> None:
    inline = {
        "title": "Numbers",
        "reference": "none",
        "variables": ["x", "y", "z"],
        "map": ["x + 0.1", "y*1e-7", "z/3"],
        "add": "none",
        "degree": 1,
        "bounds": {"center": [0, 0, 0], "radius": 1},
        "bailout": 2,
    }
    text = write_formula(catalog.load_chain({"inline": inline})).text
    for number in (0.1, 1e-7, 1 / 3):
        assert f"R({number!r})" in text


def test_numbering_renames_every_definition() -> None:
    text = text_of("bulbox")
    renamed = numbered(text, 7)
    for name in re.findall(r"^INLINE \w+ (\w+)\(", text, re.MULTILINE):
        assert not re.search(rf"\b{name}\b", renamed)
        assert f"{name}_f7(" in renamed
