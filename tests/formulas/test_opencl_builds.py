"""The whole programs of every library formula build, without a warning, in single lanes and packets.

A packet's width is only a number, so those between are usually tried with a few formulas.

All formulas of an entry point share one build: what stands before the generated text is the same for all,
and what comes after it gets a number. Only the front end of the driver's compiler is asked (no optimiser);
that the code it makes runs is the matter of the other tests.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import pytest

from clfractal.device import compiler, program
from clfractal.device.select import has_float64
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.files.channels import CHANNELS
from clfractal.formulas import catalog
from clfractal.geometry.solids import Body
from clfractal.images.tiles import Region
from clfractal.integrators import surface
from clfractal.integrators.plan import Plan
from clfractal.integrators.points import program_text
from clfractal.scene.load import load_scene
from tests.devices import device
from tests.formulas.opencl_batch import kernel_file, numbered

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
def test_every_formula_at_every_lane_count(precision: Precision) -> None:
    if precision == "float32" or has_float64(device().info):
        for lanes in accepted_lanes(device(), precision):
            build_formulas(catalog.names(), precision, lanes)


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
