"""Kernels are lent and given back: what is drawn again makes none, and takes no more memory."""

from __future__ import annotations

import gc
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device import program
from clfractal.device.kernels import Lease
from clfractal.device.loaded import MOST, MOST_RESTING, LoadedPrograms
from clfractal.device.program import Program
from clfractal.device.select import choose
from tests.calls import counted

SCENE: dict[str, Any] = {
    "version": 1,
    "formula": {"name": "mandelbulb", "iterations": 5},
    "image": {"width": 32, "height": 24},
    "camera": {"position": [0, -3, 0.5]},
}
HAST: dict[str, Any] = {**SCENE, "formula": {"name": "hast", "iterations": 5}}
TEXT = (
    "__kernel void one(__global int *a, int n) { a[0] = n; } __kernel void two(__global int *a) { a[0] = 2; }"
)


@pytest.fixture
def built() -> Program:
    return program.build(choose(), TEXT, flags=program.math_flags("float32"))


def pointers(lease: Lease) -> set[int]:
    return {lease.kernel(name).int_ptr for name in ("one", "two")}


def test_kernels_have_one_user_at_a_time(built: Program) -> None:
    device, names = choose(), ("one", "two")
    first = Lease(device, [(built, names)])
    second = Lease(device, [(built, names)])
    assert not pointers(first) & pointers(second)
    before = pointers(first)
    del first
    gc.collect()
    third = Lease(device, [(built, names)])
    assert pointers(third) == before
    # Others are of other programs, or know their numbers.
    other = Lease(device, [(built, ("one",))])
    assert other.kernel("one").int_ptr not in before | pointers(second)


def test_kernels_go_with_their_program() -> None:
    loaded = LoadedPrograms()
    loaded.keep("a", "program a")
    loaded.rest_kernels("key", ("program a",), "kernels a")
    assert loaded.take_kernels("key") == "kernels a"
    assert loaded.take_kernels("key") is None
    loaded.rest_kernels("key", ("program a",), "kernels a")
    for number in range(MOST):
        loaded.keep(f"b{number}", number)
    assert loaded.take_kernels("key") is None
    loaded.rest_kernels("late", ("program a",), "kernels a")  # whose program is forgotten already
    assert loaded.take_kernels("late") is None
    for number in range(MOST_RESTING + 5):
        loaded.rest_kernels(number, (MOST - 1,), number)
    assert loaded.take_kernels(0) is None
    assert loaded.take_kernels(MOST_RESTING + 4) == MOST_RESTING + 4
    loaded.clear()
    assert loaded.take_kernels(MOST_RESTING + 3) is None


def test_an_engine_that_changes_between_formulas_makes_kernels_once(monkeypatch: pytest.MonkeyPatch) -> None:
    names = counted(monkeypatch, Program, "kernel")
    with clfractal.Engine() as engine:
        first = [engine.render(scene) for scene in (SCENE, HAST)]
        names.clear()
        builds = counted(monkeypatch, program, "build")
        for _ in range(3):
            for scene, film in zip((SCENE, HAST), first, strict=True):
                np.testing.assert_array_equal(engine.render(scene)["R"], film["R"])
        assert names == []
        assert builds == []


def test_pictures_points_and_grids_without_an_engine_make_kernels_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    grid = {**SCENE, "renderer": {"type": "volume", "resolution": 16}}

    def course() -> None:
        clfractal.render(SCENE)
        clfractal.escape("mandelbulb", [[0, 0, 0]], iterations=8)
        clfractal.voxelize(grid)

    course()
    names = counted(monkeypatch, Program, "kernel")
    course()
    assert names == []


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux for the memory")
def test_pictures_in_turn_take_no_more_memory() -> None:
    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

    with clfractal.Engine() as engine:
        loaded = [clfractal.load_scene(scene) for scene in (SCENE, HAST)]

        def course(count: int) -> float:
            gc.collect()
            before = resident()
            for number in range(count):
                engine.render(loaded[number % 2])
            gc.collect()
            return (resident() - before) / count

        course(100)
        assert course(200) < 10_000  # bytes for each picture; it was 65 KB
