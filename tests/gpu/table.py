"""The figures on record as a table of `docs/performance.md`, between two marks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from clfractal.formulas import catalog
from clfractal.integrators.lanes import rule_of
from tests.gpu.figures import GPUS, Figures, Gpu
from tests.gpu.record import Measured

PAGE = Path(__file__).resolve().parents[2] / "docs" / "performance.md"
BEGIN, END = "<!-- gpu-check: begin -->\n", "<!-- gpu-check: end -->\n"

# Targets: registers of a march; and in float32 no private memory.
MARCH_REGISTERS = {"float32": 96, "float64": 168}

# Kernels that take registers on purpose, or run once for a device.
_UNLISTED = ("peak", "probe", "structs")


def markdown(measured: Measured) -> str:
    """A row for each kernel and number type: of all its programs the one that needs most on each GPU."""
    rows: dict[tuple[str, str], dict[str, Figures]] = {}
    counts: dict[tuple[str, str], int] = {}
    for name, by_gpu in measured.items():
        row = _row(name)
        if row is None:
            continue
        counts[row] = counts.get(row, 0) + 1
        worst = rows.setdefault(row, {})
        for gpu, figures in by_gpu.items():
            worst[gpu] = _most(worst.get(gpu, Figures(0)), figures)
    lines = [
        "| kernel | numbers | programs | " + " | ".join(gpu.name for gpu in GPUS) + " |",
        "|---|---|--:|" + "--:|" * len(GPUS),
    ]
    for row in sorted(rows):
        cells = [_cell(gpu, rows[row][gpu.name]) for gpu in GPUS]
        lines.append(f"| {row[0]} | {row[1]} | {counts[row]} | {' | '.join(cells)} |")
    above = [
        f"{kernel} ({precision})"
        for (kernel, precision), worst in sorted(rows.items())
        if _above(kernel, precision, worst)
    ]
    lines += ["", f"Above the targets: {'; '.join(above)}." if above else "All targets are met."]
    return "\n".join(lines) + "\n"


def _above(kernel: str, precision: str, worst: Mapping[str, Figures]) -> bool:
    """Whether a row's most is more than the target."""
    limit = MARCH_REGISTERS[precision] if kernel.startswith("`march") else max(gpu.registers for gpu in GPUS)
    memory = precision == "float32" and any(each.stack or each.spilled for each in worst.values())
    return memory or any(each.registers > limit for each in worst.values())


def into_page(text: str, table: str) -> str:
    """A page's text with another table.

    Raises:
        ValueError: the page has no marks.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"no {BEGIN.strip()} ... {END.strip()}")
    return before + begin + table + end + after


def _row(name: str) -> tuple[str, str] | None:
    """Kernel and number type of a row, from `program | kernel`."""
    program, _, kernel = name.partition(" | ")
    first, *_, precision = program.split()
    if first in _UNLISTED:
        return None
    return f"`{kernel}`{_rule(program)}", precision


def _rule(program: str) -> str:
    """The rule by which a march's formula gives distances, where the program is a march's alone."""
    kind, formula, *_ = program.split()
    if not kind.startswith("march") or formula not in catalog.names():
        return ""
    return {"scalar": ", scalar rule", "jacobian": ", Jacobian"}[rule_of(catalog.load_chain(formula))]


def _most(one: Figures, other: Figures) -> Figures:
    return Figures(
        max(one.registers, other.registers),
        max(one.stack, other.stack),
        max(one.spilled, other.spilled),
        max(one.local, other.local),
    )


def _cell(gpu: Gpu, figures: Figures) -> str:
    """`96, 20 warps`, and what should not be."""
    said = [str(figures.registers), f"{gpu.occupancy(figures)} {gpu.word}"]
    said += [f"{figures.stack} B stack"] if figures.stack else []
    said += [f"{figures.spilled} B spilled"] if figures.spilled else []
    said += [f"{figures.local} B local"] if figures.local else []
    return ", ".join(said)


def listed(measured: Measured) -> Iterator[str]:
    """A line for each kernel of each program, with all its figures."""
    for name, by_gpu in measured.items():
        cells = [f"{gpu.name} {_cell(gpu, by_gpu[gpu.name])}" for gpu in GPUS if gpu.name in by_gpu]
        yield f"{name}: {'; '.join(cells)}"
