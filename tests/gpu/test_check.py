"""The check for GPUs: its compilers where they are, figures that are read and kept, limits, pairs of features."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from clfractal.device.orbit import ORBIT
from clfractal.device.source import FlatText, SourceMap
from clfractal.device.structs import Precision
from clfractal.formulas import catalog
from clfractal.formulas.chain import MAX_TABLE, Chain
from clfractal.formulas.opencl import write_formula
from clfractal.scene.checks import MAX_PLANES
from clfractal.scene.objects import MAX_FORMULAS
from tests.gpu import __main__ as command
from tests.gpu import compilers, limits, listing, record, table
from tests.gpu.compilers import Compilers, MissingCompilerError, RejectedError
from tests.gpu.figures import GPUS, Figures
from tests.gpu.pairs import Pair, covering
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
GREEDY = STACK.replace("stack", "small")


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


def run(monkeypatch: pytest.MonkeyPatch, known: Record, *arguments: str, text: str = SMALL) -> int:
    """The command with one small program for each number type, and this record."""
    found()
    programs = [
        listing.Listed(f"small {precision}", precision, FlatText(text, SourceMap()))
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
    assert run(monkeypatch, known(255), "--only", "*32", text=GREEDY) == 1
    said = capsys.readouterr()
    assert said.err.count(": stack 2") == said.err.count(", were 0\n") == len(GPUS)
    assert "float64" not in said.out


def test_figures_of_other_compilers_are_not_compared(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    other = replace(known(255), versions={"clang": "1.2.3", "ptxas": "4.5.6"})
    assert run(monkeypatch, other) == 2
    assert "the record is of clang 1.2.3, ptxas 4.5.6" in capsys.readouterr().err
    assert run(monkeypatch, known(255), "--only", "nothing") == 2


@pytest.mark.parametrize("chosen", [("--only", "*32"), ()], ids=["named", "changed"])
def test_recording_some_programs_keeps_the_others_that_there_are(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, chosen: tuple[str, ...]
) -> None:
    old = known(255)
    sums = {
        f"small {each}": record.sum_of(compilers.shown(found(), SMALL, each)) for each in listing.PRECISIONS
    }
    if not chosen:  # the other is on record as it is
        old = replace(old, texts={"small float64": sums["small float64"]})
    gone = replace(old, figures={**old.figures, "gone float32 | gone": {"sm_75": Figures(9)}})
    page = tmp_path / "page.md"
    page.write_text(table.BEGIN + table.END, encoding="utf-8")
    monkeypatch.setattr(record, "PATH", tmp_path / "record.json")
    monkeypatch.setattr(table, "PAGE", page)
    made: list[Record] = []
    monkeypatch.setattr(record, "save", made.append)
    assert run(monkeypatch, gone, "--record", *chosen) == 0
    (new,) = made
    assert set(new.figures) == set(old.figures)
    assert new.figures["small float32 | small"]["sm_75"].registers < 255
    assert new.figures["small float64 | small"]["sm_75"].registers == 255
    assert new.texts == {name: sums[name] for name in ("small float32", *old.texts)}
    assert "| `small` | float64 | 1 | 255, 8 warps |" in page.read_text(encoding="utf-8")


def test_known_programs_are_compiled_when_their_text_has_changed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    same = record.sum_of(compilers.shown(found(), "// A remark.\n" + GREEDY, "float32"))
    texts = {"small float32": same, "small float64": record.sum_of("another")}
    assert run(monkeypatch, replace(known(1), texts=texts), "--known", text=GREEDY) == 1
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


# --- limits ---


ENTRY = ".entry kernel_a(\n{}\n)\n{{\n}}\n"
CONSTANT = ".param .u64 .ptr .const .align 8 kernel_a_param_{}"
GLOBAL = ".param .u64 .ptr .global .align 4 kernel_a_param_{}"


def entry(*arguments: str) -> str:
    return ENTRY.format(",\n".join(f"\t{each}" for each in arguments))


def test_arguments_are_counted() -> None:
    (found,) = limits.entries(
        entry(*(CONSTANT.format(i) for i in range(3)), GLOBAL.format(3), ".param .u32 kernel_a_param_4")
    )
    assert found == limits.Entry("kernel_a", 3, 36, 0)


def test_what_is_guaranteed_passes() -> None:
    ptx = ".const .align 4 .b8 table[65536];\n.shared .align 4 .b8 rays[32768];\n" + entry(
        *(CONSTANT.format(i) for i in range(8)), *(GLOBAL.format(i) for i in range(8, 128))
    )
    assert not list(limits.broken(ptx))


@pytest.mark.parametrize(
    ("ptx", "told"),
    [
        (entry(*(CONSTANT.format(i) for i in range(9))), "9 constant arguments, 8 are guaranteed"),
        (entry(*(GLOBAL.format(i) for i in range(129))), "1032 bytes of arguments, 1024 are guaranteed"),
        (entry(".param .align 8 .b8 kernel_a_param_0[48]"), "vectors or structs"),
        (".const .align 16 .b8 one[65000];\n.const .align 4 .u32 two[200];\n", "65800 bytes of .const"),
        (".shared .align 4 .f64 rays[4097];\n", "32776 bytes of .shared"),
        ("\tcvta.const.u64 \t%rd1, %rd2;\n", "older drivers"),
        (
            ".func  (.param .b32 func_retval0) f(\n\t.param .b32 f_param_0\n)\n{\n\tcall.uni (retval0), \n\tg, \n\t(\n"
            "\tparam0\n\t);\n}\n.func g(\n)\n{\n\tcall.uni \n\tf, \n\t(\n\t);\n}\n",
            "recursion",
        ),
    ],
)
def test_what_is_not_guaranteed_is_told(ptx: str, told: str) -> None:
    (line,) = limits.broken(ptx)
    assert told in line


@pytest.mark.parametrize(
    "code",
    [
        "printf(1);",
        "goto end;",
        "float3 a;",
        "uchar3 a = vload3(0, p);",
        "half a;",
        "vload_half(0, p);",
        "work_group_reduce_add(a);",
        "sub_group_broadcast(a, 0);",
        "__generic int *p;",
        "barrier(CLK_LOCAL_MEM_FENCE);",
        "atom_add(p, 1l);",
        "__builtin_fma(a, b, c);",
        "write_imagef(shown, at, color);",
        "__write_only image2d_t shown",
        'asm("bar");',
        "float f(__constant const float row[3], int i) { return row[i]; }",
    ],
)
def test_words_that_devices_lack(code: str) -> None:
    assert list(limits.words(code, code))


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_the_longest_lists_fit_constant_memory(precision: Precision) -> None:
    """The orbits of the object and of all planes; the constants of all formulas of a scene, with the longest turns."""
    assert (1 + MAX_PLANES) * ORBIT.dtype(precision).itemsize <= limits.CONSTANT_BYTES
    chains = [catalog.load_chain(name) for name in catalog.names()]
    most = max(len(write_formula(chain).constants) - len(_turns(chain)) for chain in chains)
    each = 1 + max(most, 100) + MAX_TABLE
    assert most > 0
    assert (1 + MAX_FORMULAS) * each * np.dtype(precision).itemsize <= limits.CONSTANT_BYTES


def _turns(chain: Chain) -> tuple[int, ...]:
    return chain.table[0] if chain.turns_are_data else ()


def test_words_that_are_no_such_words() -> None:
    code = (
        "float4 a = vload4(0, p); const float half_side = 0.5f; atomic_inc(p); float8 imagery; int printf_ed;"
        "float f(__constant const float *row, float a[3]) { __local float b[4]; return b[0]; }"
    )
    assert not list(limits.words(code, code))


def test_a_program_for_images_may_have_them() -> None:
    code = "write_imagef(shown, at, color);"
    assert not list(limits.words(f"__kernel void show(__write_only image2d_t shown) {{ {code} }}", code))
    assert list(limits.words(f"__kernel void show(__global float4 *shown) {{ {code} }}", code))


# --- pairs of features ---


FACTORS = {
    "a": ("1", "2", "3"),
    "b": ("1", "2"),
    "c": ("1", "2", "3", "4"),
    **{f"d{i}": ("no", "yes") for i in range(8)},
}


def met(choices: list[dict[str, str]]) -> set[Pair]:
    return {frozenset(pair) for chosen in choices for pair in combinations(chosen.items(), 2)}


def every_pair() -> set[Pair]:
    return {
        frozenset({(one, first), (other, second)})
        for one, other in combinations(FACTORS, 2)
        for first in FACTORS[one]
        for second in FACTORS[other]
    }


def test_all_pairs_meet_in_few_choices() -> None:
    choices = covering(FACTORS)
    assert met(choices) == every_pair()
    # The least is 3 * 4; all combinations are 6144.
    assert 12 <= len(choices) <= 18
    assert covering(FACTORS) == choices


def test_what_must_not_meet_does_not() -> None:
    apart = {frozenset({("a", "1"), ("c", "2")}), frozenset({("b", "2"), ("d0", "yes")})}
    assert met(covering(FACTORS, apart)) == every_pair() - apart


def test_names_tell_programs_apart() -> None:
    programs = listing.unlike(listing.paired())
    assert len({each.name for each in programs}) == len(programs)
    assert len({(each.text.text, each.precision) for each in programs}) == len(programs)
    assert {each.precision for each in programs} == {"float32", "float64"}


# --- the record ---


KNOWN = Record(
    {"clang": "16.0.6"},
    {
        "march hast float32 | march": {"sm_75": Figures(96), "gfx1030": Figures(85)},
        "surface still float32 | surface": {"sm_75": Figures(192, 952), "gfx1030": Figures(183, 960)},
    },
    {"march hast float32": "0123456789abcdef"},
)


def test_a_record_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "record.json"
    record.save(KNOWN, path)
    assert record.load(path) == KNOWN
    assert sum("|" in line for line in path.read_text(encoding="utf-8").splitlines()) == 2
    assert record.load(tmp_path / "none.json").figures == {}


def test_what_is_worse_is_told_and_nothing_else() -> None:
    name = "march hast float32 | march"
    assert not list(record.worse(KNOWN.figures, KNOWN))
    assert list(record.worse({name: {"sm_75": Figures(97), "gfx1030": Figures(80)}}, KNOWN)) == [
        f"{name}: sm_75: 16 warps, were 20 (registers 97, were 96)"
    ]
    assert not list(record.worse({name: {"sm_75": Figures(96), "gfx1030": Figures(86)}}, KNOWN))
    assert list(record.worse({"march hast float64 | march": {"sm_75": Figures(1)}}, KNOWN)) == [
        "march hast float64 | march: not on record"
    ]
    assert list(record.worse({name: {"sm_90": Figures(1)}}, KNOWN)) == [f"{name}: sm_90: not on record"]


def test_what_is_better_is_counted() -> None:
    name = "march hast float32 | march"
    assert record.better(KNOWN.figures, KNOWN) == 0
    assert record.better({name: {"sm_75": Figures(95), "gfx1030": Figures(85)}}, KNOWN) == 1
    assert record.better({name: {"sm_75": Figures(95), "gfx1030": Figures(86)}}, KNOWN) == 0


def test_a_row_of_the_table_is_the_most_of_its_programs() -> None:
    figures = {
        f"surface {name} float32 | surface": {gpu.name: each for gpu in GPUS}
        for name, each in (("one", Figures(64, 8)), ("two", Figures(96, 0, 4)))
    }
    rows = table.markdown(figures).splitlines()[2:-2]
    cells = "96, 20 warps, 8 B stack, 4 B spilled | 96, 20 warps, 8 B stack, 4 B spilled"
    waves = "96, 20 waves, 8 B stack, 4 B spilled | 96, 32 waves, 8 B stack, 4 B spilled"
    assert rows == [f"| `surface` | float32 | 2 | {cells} | {waves} |"]


def test_marches_are_told_apart_by_their_rule() -> None:
    figures = {
        f"march {name} float32 | march": {gpu.name: Figures(50) for gpu in GPUS}
        for name in ("mandelbulb", "hast")
    }
    assert [line.split(" | ")[0] for line in table.markdown(figures).splitlines()[2:-2]] == [
        "| `march`, Jacobian",
        "| `march`, scalar rule",
    ]


@pytest.mark.parametrize(
    ("name", "figures", "above"),
    [
        ("march hast float32 | march", Figures(96), None),
        ("march hast float32 | march", Figures(97), "`march`, Jacobian (float32)"),
        ("march hast float64 | march", Figures(168, 88, 8), None),
        ("march hast float64 | march", Figures(169), "`march`, Jacobian (float64)"),
        ("surface hast float32 | shade", Figures(255), None),
        ("surface hast float32 | shade", Figures(20, 8), "`shade` (float32)"),
        ("surface hast float32 | shade", Figures(20, 0, 4), "`shade` (float32)"),
        ("surface hast float64 | shade", Figures(255, 80, 40), None),
    ],
)
def test_what_is_above_the_targets(name: str, figures: Figures, above: str | None) -> None:
    last = table.markdown({name: {gpu.name: figures for gpu in GPUS}}).splitlines()[-1]
    assert last == (f"Above the targets: {above}." if above else "All targets are met.")


def test_a_page_keeps_all_but_the_table() -> None:
    page = f"before\n{table.BEGIN}old\n{table.END}after\n"
    assert table.into_page(page, "new\n") == f"before\n{table.BEGIN}new\n{table.END}after\n"
    with pytest.raises(ValueError, match="gpu-check"):
        table.into_page("no marks\n", "new\n")


def test_the_documentation_shows_the_record() -> None:
    page = table.PAGE.read_text(encoding="utf-8")
    known = record.load()
    assert known.figures
    assert table.into_page(page, table.markdown(known.figures)) == page, "make gpu-check ARGUMENTS=--record"
