"""Every operation of every number type, alone, in packets of unlike lanes, against mpmath."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache

import mpmath
import numpy as np
import pytest

from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.files.resources import folder
from tests.devices import device, usable
from tests.numbers.arguments import COUNT, Floats, arguments, partials
from tests.numbers.comparison import Range, partial_fault, value_fault
from tests.numbers.operations import Operation, table
from tests.numbers.runner import Runner

PRECISIONS: tuple[Precision, ...] = ("float32", "float64")
NAMES = [operation.name for operation in table("float32")]
REAL = [operation.name for operation in table("float32") if operation.real]
DUAL = [(operation.name, call) for operation in table("float32") for call in operation.duals]


@lru_cache
def operations(precision: Precision) -> dict[str, Operation]:
    return {operation.name: operation for operation in table(precision)}


@lru_cache
def tried(name: str, precision: Precision) -> Floats:
    return arguments(operations(precision)[name], precision)


@lru_cache
def results(precision: Precision) -> dict[int, tuple[Floats, Floats]]:
    """For each lane count what all operations of `real` and of `dual` gave."""
    table_here = operations(precision)
    real_arguments = np.stack([tried(name, precision) for name in REAL])
    dual_arguments = np.stack([tried(name, precision) for name, _ in DUAL])
    found = {}
    for lanes in accepted_lanes(device(), precision):
        runner = Runner(
            device(), precision, lanes, [table_here[n].real for n in REAL], [call for _, call in DUAL]
        )
        real = runner.run("real", real_arguments, partials(precision))
        found[lanes] = (real, runner.run("dual", dual_arguments, partials(precision)))
    assert found
    return found


def distinct(found: dict[int, Floats]) -> Iterator[tuple[int, int, list[float]]]:
    """Every result once: (lanes, place, planes). Most are the same bits for every lane count."""
    seen: list[Floats] = []
    for lanes, planes in found.items():
        new = np.ones(COUNT, bool)
        for earlier in seen:
            new &= ~((planes == earlier) | (np.isnan(planes) & np.isnan(earlier))).all(axis=0)
        seen.append(planes)
        for place in np.flatnonzero(new).tolist():
            yield lanes, place, planes[:, place].tolist()


def report(faults: list[str]) -> str:
    return "\n".join([f"{len(faults)} faults", *faults[:12]])


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", REAL)
def test_real(name: str, precision: Precision) -> None:
    if not usable(precision):
        return
    operation, numbers = operations(precision)[name], Range.of(precision)
    columns = tried(name, precision)[: operation.arity].T.tolist()
    faults = []
    found = {lanes: real[REAL.index(name)] for lanes, (real, _) in results(precision).items()}
    with mpmath.workdps(40):
        for lanes, place, (got,) in distinct(found):
            fault = value_fault(operation, numbers, columns[place], got)
            faults += [f"{lanes} lanes: {fault}"] if fault else []
    assert not faults, report(faults)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize(("name", "call"), DUAL)
def test_dual(name: str, call: str, precision: Precision) -> None:
    if not usable(precision):
        return
    operation, numbers = operations(precision)[name], Range.of(precision)
    columns = tried(name, precision)[: operation.arity].T.tolist()
    inputs = partials(precision).reshape(3, 3, COUNT).transpose(2, 0, 1).tolist()
    faults = []
    found = {lanes: dual[DUAL.index((name, call))] for lanes, (_, dual) in results(precision).items()}
    with mpmath.workdps(40):
        for lanes, place, got in distinct(found):
            fault = value_fault(operation, numbers, columns[place], got[0])
            axis = place % 3  # one of the three: they have the slopes in common
            fault = fault or partial_fault(
                operation, call, numbers, columns[place], inputs[place], got[1 + axis], axis
            )
            faults += [f"{lanes} lanes: {fault}"] if fault else []
    assert not faults, report(faults)


@pytest.mark.parametrize("number_type", ["real", "dual"])
def test_no_operation_is_forgotten(number_type: str) -> None:
    text = (folder("kernels") / "formulas/numbers" / f"{number_type}.h").read_text()
    defined = set(re.findall(r"^INLINE \w+ (\w+)\(", text, re.MULTILINE))
    calls = " ".join(call for o in table("float32") for call in (o.real, *o.duals))
    assert len(defined) > 20
    assert defined <= set(re.findall(r"\w+", calls))
