"""Kernels call nothing of the driver's library of built-in functions, which a compiler may be unable to inline."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from clfractal.device import isolate
from clfractal.device.compiler import Warm
from clfractal.device.program import math_flags
from clfractal.device.select import Device, is_pocl
from clfractal.device.source import flatten
from clfractal.voxels import programs
from clfractal.voxels.lattice import EXTENT

Build = Callable[[str, programs.Recipe], None]


@pytest.fixture
def build_in_child(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Build:
    """Builds and launches a program in a new child process; PoCL keeps what it generates in a folder of the test."""
    if is_pocl(device.info):
        monkeypatch.setenv("POCL_CACHE_DIR", str(tmp_path / "pocl"))

    def build(text: str, recipe: programs.Recipe) -> None:
        folder = tmp_path / "job"
        folder.mkdir(exist_ok=True)
        launch = Warm(recipe.kernel, (recipe.items, recipe.group[1]), recipe.group, recipe.arguments)
        request = {"text": text, "flags": list(math_flags(recipe.precision)), "warm": launch.as_data()}
        isolate.end_child()
        failure = isolate.run(
            "clfractal.device.compiler:compile_job",
            device,
            request,
            doing="building",
            timeout_s=120,
            folder=folder,
        )
        assert failure is None, failure

    return build


@pytest.mark.parametrize("radius", [0, 1, 3])
def test_programs_that_store_bricks_can_be_loaded_again(build_in_child: Build, radius: int) -> None:
    """With vectors of 16 in calls of the library, PoCL 3.0 on a processor that it takes for one without AVX-512 writes a
    program that it cannot read again."""
    recipe = programs.store_recipe("bits", "byte", "byte", radius)
    structs = {"structs.h": EXTENT.c_text()}
    text = flatten(recipe.entry, generated=structs, defines=recipe.defines).text
    build_in_child(text, recipe)
    build_in_child(text, recipe)
