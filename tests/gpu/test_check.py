"""The compilers themselves, where they are: figures of small kernels, and what the command says and gives back."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from clfractal.device.source import FlatText, SourceMap
from tests.gpu import __main__ as command
from tests.gpu import compilers, listing, record, table
from tests.gpu.compilers import Compilers, MissingCompilerError, RejectedError
from tests.gpu.figures import GPUS, Figures
from tests.gpu.record import Record

EXPECTED = "CLFRACTAL_EXPECT_GPU_COMPILERS"
"""Set to 1: missing compilers are a failure, not a reason to skip."""

SMALL = "__kernel void small(__global float *a) { a[get_global_id(0)] *= 2.0f; }\n"
# Written and read at places that nobody knows before.
STACK = """__kernel void stack(__global float *a, int at) {
    float kept[64];
    for (int i = 0; i < 64; ++i) kept[(i * at) & 63] = a[i];
    a[at] = kept[(at + 1) & 63];
}
"""


@cache
def found() -> Compilers:
    try:
        return compilers.find()
    except MissingCompilerError as error:
        if os.environ.get(EXPECTED) == "1":
            pytest.fail(str(error))
        pytest.skip(str(error))


def of(text: str) -> dict[str, dict[str, Figures]]:
    return compilers.measured(found(), text, "float32")


def test_figures_of_every_gpu() -> None:
    (small,) = of(SMALL).values()
    assert list(small) == [gpu.name for gpu in GPUS]
    assert all(0 < each.registers <= 16 and each == Figures(each.registers) for each in small.values())
    (stack,) = of(STACK).values()
    assert all(256 <= each.stack <= 272 and each.spilled == 0 for each in stack.values())


def test_built_in_functions_are_linked() -> None:
    text = "__kernel void sines(__global float *a) { a[0] = sin(a[0]) + pow(a[1], a[2]); }\n"
    (sines,) = of(text).values()
    assert all(10 < each.registers < 128 for each in sines.values())


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("__kernel void k(__global float *a) { a[0] = nothing; }", "nothing"),
        ("float far(float); __kernel void k(__global float *a) { a[0] = far(a[0]); }", "far"),
        ('__kernel void k(__global float *a) { printf("%f", a[0]); }', "printf"),
        (
            "int up(int a); int down(int a) { return a < 1 ? a : up(a - 1) * a; }\n"
            "int up(int a) { return a > 9 ? down(a / 2) + 1 : a; } __kernel void k(__global int *a) { a[0] = up(a[1]); }",
            "recursion",
        ),
        (f"__kernel void k(__global int *a, {', '.join(f'__constant int *b{i}' for i in range(9))})"
         f" {{ a[0] = {' + '.join(f'b{i}[0]' for i in range(9))}; }}", "9 constant arguments"),
    ],
)  # fmt: skip
def test_what_is_rejected(text: str, told: str) -> None:
    with pytest.raises(RejectedError, match=told):
        of(text + "\n")


def run(monkeypatch: pytest.MonkeyPatch, known: Record, *arguments: str) -> int:
    """The command with one small program for each number type, and this record."""
    found()
    programs = [
        listing.Listed(f"small {precision}", precision, FlatText(SMALL, SourceMap()))
        for precision in listing.PRECISIONS
    ]
    monkeypatch.setattr(listing, "paired", lambda: programs)
    monkeypatch.setattr(listing, "everything", lambda: programs)
    monkeypatch.setattr(record, "load", lambda: known)
    return command.main(["--jobs", "1", *arguments])


def known(registers: int) -> Record:
    by_gpu = {gpu.name: Figures(registers) for gpu in GPUS}
    names = [f"small {precision} | small" for precision in listing.PRECISIONS]
    return Record(found().versions, dict.fromkeys(names, by_gpu))


def test_the_command_says_what_is_worse(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, known(255)) == 0
    said = capsys.readouterr()
    assert "small float64 | small: sm_75 " in said.out
    assert "2 kernels need less than on record" in said.out
    assert run(monkeypatch, known(1), "--only", "*32") == 1
    said = capsys.readouterr()
    assert said.err.count("were 1\n") == len(GPUS)
    assert "float64" not in said.out


def test_figures_of_other_compilers_are_not_compared(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    other = replace(known(255), versions={"clang": "1.2.3", "ptxas": "4.5.6"})
    assert run(monkeypatch, other) == 2
    assert "the record is of clang 1.2.3, ptxas 4.5.6" in capsys.readouterr().err
    assert run(monkeypatch, known(255), "--only", "nothing") == 2


def test_recording_some_programs_keeps_the_others_that_there_are(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    old = known(255)
    gone = replace(old, figures={**old.figures, "gone float32 | gone": {"sm_75": Figures(9)}})
    page = tmp_path / "page.md"
    page.write_text(table.BEGIN + table.END, encoding="utf-8")
    monkeypatch.setattr(record, "PATH", tmp_path / "record.json")
    monkeypatch.setattr(table, "PAGE", page)
    made: list[Record] = []
    monkeypatch.setattr(record, "save", made.append)
    assert run(monkeypatch, gone, "--record", "--only", "*32") == 0
    (new,) = made
    assert set(new.figures) == set(old.figures)
    assert new.figures["small float32 | small"]["sm_75"].registers < 255
    assert new.figures["small float64 | small"]["sm_75"].registers == 255
    assert new.texts == {"small float32": record.sum_of(compilers.shown(found(), SMALL, "float32"))}
    assert "| `small` | float64 | 1 | 255, 8 warps |" in page.read_text(encoding="utf-8")


def test_known_programs_are_compiled_when_their_text_has_changed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    same = record.sum_of(compilers.shown(found(), "// A remark.\n" + SMALL, "float32"))
    texts = {"small float32": same, "small float64": record.sum_of("another")}
    assert run(monkeypatch, replace(known(1), texts=texts), "--known") == 1
    said = capsys.readouterr()
    assert "1 programs are what they were" in said.out
    assert said.err.count("small float64 | small: ") == len(GPUS)
    assert "float32" not in said.err


def test_without_compilers_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert command.main([]) == 2
    assert capsys.readouterr().err.startswith(
        "gpu-check: compilers for GPUs are missing: apt-get install clang-16 libclc-16"
    )
