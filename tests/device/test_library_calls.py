"""Kernels call nothing of the driver's library of built-in functions, which a compiler may be unable to inline.

What is called is seen in the machine code that PoCL makes. Where that tells nothing (another driver, no `objdump`, a
library that is inlined on this processor), the test says so; the texts of the programs are looked through everywhere.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from clfractal.device import compiler, driver_files, isolate
from clfractal.device.compiler import Warm
from clfractal.device.program import math_flags
from clfractal.device.select import Device, by_key, is_pocl
from clfractal.device.source import flatten
from clfractal.files.resources import folder as resources
from clfractal.integrators.lanes import best_lanes
from clfractal.voxels import programs
from clfractal.voxels.lattice import EXTENT
from tests.shell import environment

KERNELS = (
    *("begin_samples", "march_rays", "find_interactions", "light_interactions", "volume_medium", "cut_plane"),
    *("fill_bricks", "store_bricks", "classify_nodes", "classify_bricks", "seen_blocks"),
)

# Functions that are too large to be written out, and what they call in turn (PoCL's `__pocl_...`); and adding to a
# launch's counts, which a work-item does once, at its end.
_TRANSCENDENTAL = "exp|exp2|log|log2|pow|sin|cos|tan|asin|acos|atan|atan2|sincos"
_ALLOWED = re.compile(
    rf"_Z\d+(_cl_)?({_TRANSCENDENTAL})[DPfd]|_Z\d+__pocl_|_Z\d+get_|_Z\d+_cl_atomic_add|mem(cpy|set)"
)

# Built-in functions that are no more than some instructions.
_SMALL = re.compile(
    r"\b(?:JOIN\()?(fabs|fmin|fmax|fma|mad|floor|ceil|trunc|rint|round|sqrt|rsqrt|native_\w+|half_\w+|copysign|fmod|fdim|ldexp|clamp|mix"
    r"|step|smoothstep|sign|min|max|dot|cross|length|normalize|distance|select|bitselect|any|all|isnan|isinf|isfinite|signbit"
    r"|abs|abs_diff|clz|mad24|mul24|mul_hi|rotate|popcount|v(?:load|store)\d*|convert_\w+)"
    r"(?:\(|, LANES\)\()"
)
# Those that stand in parts of a text that packets on a processor do not take.
_ELSEWHERE = {
    "any": "where the compiler has no reduction",
    "convert_int": "of single lanes",
}

Build = Callable[[str, programs.Recipe], None]


@pytest.fixture
def build_in_child(device: Device, tmp_path: Path) -> Build:
    """Builds and launches a program in a new child process, and loads it in another.

    What PoCL generates is laid out in a folder of the test.
    """

    def build(text: str, recipe: programs.Recipe) -> None:
        folder = tmp_path / "job"
        folder.mkdir(exist_ok=True)
        launch = Warm(recipe.kernel, (recipe.items, recipe.group[1]), recipe.group, recipe.arguments)
        request = {"text": text, "flags": list(math_flags(recipe.precision)), "warm": [launch.as_data()]}
        for job in ("clfractal.device.compiler:compile_job", "tests.device.test_library_calls:load_job"):
            isolate.end_children()
            failure = isolate.run(job, device, request, doing="building", timeout_s=120, folder=folder)
            assert failure is None, failure
        lay_out((folder / compiler.BINARY).read_bytes(), tmp_path / "pocl")

    return build


def lay_out(kept: bytes, folder: Path) -> None:
    """Writes the files of PoCL, if it has left some."""
    for name, content in driver_files.contents(kept) if driver_files.is_packed(kept) else ():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def load_job(request: dict[str, Any]) -> None:
    """In a child: loads what another one kept, and launches it."""
    device = by_key(*request["device"])
    kept = (Path(request["folder"]) / compiler.BINARY).read_bytes()
    program = compiler.load_kept(device, kept, request["text"], request["flags"])
    assert program is not None
    for launch in request["warm"]:
        compiler.warm_up(device, program, Warm.from_data(launch))


@pytest.mark.parametrize("radius", [0, 1, 3])
def test_programs_that_store_bricks_can_be_loaded_again(build_in_child: Build, radius: int) -> None:
    """With vectors of 16 in calls of the library, PoCL 3.0 on a processor that it takes for one without AVX-512 writes a
    program that it cannot read again."""
    recipe = programs.store_recipe("bits", "byte", radius)
    structs = {"structs.h": EXTENT.c_text()}
    text = flatten(recipe.entry, generated=structs, defines=recipe.defines).text
    build_in_child(text, recipe)


@pytest.fixture(scope="module")
def rendered(device: Device, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the texts of the programs of small pictures, and what PoCL made of them."""
    where = tmp_path_factory.mktemp("rendered")
    settings = {
        "CLFRACTAL_LANES": str(best_lanes(device, "float32")),
        "CLFRACTAL_DEVICE": device.info.index,
    }
    command = [sys.executable, "-P", str(Path(__file__).with_name("render_and_record.py")), str(where)]
    ended = subprocess.run(command, env=environment(settings), capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    for path in where.glob("*.kept"):
        lay_out(path.read_bytes(), where / "pocl")
    return where


def calls(folder: Path, kernel: str) -> Counter[str]:
    """How often the machine code of a kernel calls which function."""
    found = [path for path in folder.rglob("*.so") if path.name == f"{kernel}.so"]
    assert found, f"PoCL has left no machine code of {kernel}"
    names: Counter[str] = Counter()
    for path in found:
        listing = subprocess.run(
            ["objdump", "-d", "--no-show-raw-insn", str(path)], capture_output=True, text=True, check=True
        ).stdout
        names.update(re.findall(r"\s(?:call|callq|bl)\s+[0-9a-f]+ <([^>+@]+)", listing))
    return names


def test_the_machine_code_calls_nothing_small(
    device: Device, rendered: Path, build_in_child: Build, tmp_path: Path
) -> None:
    if not is_pocl(device.info):
        pytest.skip("the machine code of this driver cannot be read; the texts are looked through")
    if shutil.which("objdump") is None:
        pytest.skip("there is no objdump (Debian: binutils); the texts are looked through")
    text = "__kernel void known(__global float8 *a) { a[0] = fmax(a[0], a[1]); }"
    build_in_child(text, programs.Recipe("", "known", {}, "float32", {}, 1, (1, 1), (programs._BUFFER,)))
    if not calls(tmp_path / "pocl", "known"):
        pytest.skip(
            "the library is inlined on this processor, whatever is called; the texts are looked through"
        )
    found = {
        kernel: {
            name: count
            for name, count in calls(rendered, kernel).items()
            # Functions of the program itself have the names that their texts give them.
            if name.startswith("_") and not _ALLOWED.match(name)
        }
        for kernel in KERNELS
    }
    assert found == {kernel: {} for kernel in KERNELS}


def test_the_texts_name_nothing_small_that_is_no_operation(rendered: Path) -> None:
    direct = (resources("kernels") / "device/direct.h").read_text(encoding="utf-8")
    defined = set(re.findall(r"#define (\w+)\(", direct))
    texts = [path.read_text(encoding="utf-8") for path in rendered.glob("*.cl")]
    assert len(texts) >= len(KERNELS)
    for text in texts:
        assert "direct_fmax" in text
        code = re.sub(r"//[^\n]*", "", text.replace(direct, ""))
        named = set(_SMALL.findall(code)) - set(_ELSEWHERE)
        # `JOIN(vload, LANES)` makes vload8.
        named = {f"{name}8" if name in ("vload", "vstore") else name for name in named}
        assert named <= defined
