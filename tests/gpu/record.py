"""The figures on record, and what a run has to say about others: `record.json` beside this file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass
from pathlib import Path

from tests.gpu.figures import Figures

PATH = Path(__file__).with_name("record.json")

Measured = Mapping[str, Mapping[str, Figures]]
"""Figures by `program | kernel`, then by GPU."""


@dataclass(frozen=True, slots=True)
class Record:
    """Figures, and the versions of the compilers that they come from."""

    versions: Mapping[str, str]
    figures: Measured


def load(path: Path = PATH) -> Record:
    """Reads a record; an empty one where there is no file."""
    if not path.exists():
        return Record({}, {})
    read = json.loads(path.read_text(encoding="utf-8"))
    figures = {
        name: {gpu: Figures(*numbers) for gpu, numbers in by_gpu.items()}
        for name, by_gpu in read["figures"].items()
    }
    return Record(read["compilers"], figures)


def save(record: Record, path: Path = PATH) -> None:
    """Writes a record, a line for each kernel, so that a change shows which."""
    lines = [
        f"  {json.dumps(name)}: {json.dumps({gpu: list(astuple(figures)) for gpu, figures in by_gpu.items()})}"
        for name, by_gpu in sorted(record.figures.items())
    ]
    head = json.dumps({"compilers": dict(record.versions)})[:-1]
    path.write_text(head + ', "figures": {\n' + ",\n".join(lines) + "\n}}\n", encoding="utf-8", newline="\n")


def worse(measured: Measured, record: Record) -> Iterator[str]:
    """A line for each kernel that needs more than on record, or is not on it."""
    for name, by_gpu in measured.items():
        known = record.figures.get(name)
        if known is None:
            yield f"{name}: not on record"
            continue
        for gpu, figures in by_gpu.items():
            more = figures.worse_than(known[gpu]) if gpu in known else ["not on record"]
            if more:
                yield f"{name}: {gpu}: {'; '.join(more)}"


def better(measured: Measured, record: Record) -> int:
    """How many kernels need less than on record on some GPU, and more on none."""
    count = 0
    for name, by_gpu in measured.items():
        known = record.figures.get(name, {})
        pairs = [(figures, known[gpu]) for gpu, figures in by_gpu.items() if gpu in known]
        less = any(old.worse_than(new) for new, old in pairs)
        count += less and not any(new.worse_than(old) for new, old in pairs)
    return count
