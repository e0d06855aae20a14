"""Figures are kept, compared, and shown in the documentation."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.gpu import record, table
from tests.gpu.figures import GPUS, Figures
from tests.gpu.record import Record

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
        f"{name}: sm_75: registers 97, were 96"
    ]
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
