"""The figures on record, and what a run has to say about others: `record.json` beside this file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, field
from pathlib import Path

from tests.gpu.figures import GPUS, Figures, Gpu

PATH = Path(__file__).with_name("record.json")
_ASKING = tuple(Path(__file__).with_name(f"{name}.py") for name in ("compilers", "figures", "limits"))

Measured = Mapping[str, Mapping[str, Figures]]
"""Figures by `program | kernel`, then by GPU."""


@dataclass(frozen=True, slots=True)
class Record:
    """Figures, and the versions of the compilers that they come from.

    Attributes:
        texts: by program, a sum of what the compilers saw of it.
    """

    versions: Mapping[str, str]
    figures: Measured
    texts: Mapping[str, str] = field(default_factory=dict)


def sum_of(shown: str) -> str:
    """Of a program as a compiler sees it but for empty lines, and of how it is compiled and what is asked of it."""
    lines = "\n".join(line for line in shown.splitlines() if line.strip())
    asking = [path.read_bytes() for path in _ASKING]
    return hashlib.sha256(b"\0".join([lines.encode(), *asking])).hexdigest()[:16]


def load(path: Path = PATH) -> Record:
    """Reads a record; an empty one where there is no file."""
    if not path.exists():
        return Record({}, {})
    read = json.loads(path.read_text(encoding="utf-8"))
    figures = {
        name: {gpu: Figures(*numbers) for gpu, numbers in by_gpu.items()}
        for name, by_gpu in read["figures"].items()
    }
    return Record(read["compilers"], figures, read.get("texts", {}))


def save(record: Record, path: Path = PATH) -> None:
    """Writes a record, a line for each kernel, so that a change shows which."""
    lines = [
        f"  {json.dumps(name)}: {json.dumps({gpu: list(astuple(figures)) for gpu, figures in by_gpu.items()})}"
        for name, by_gpu in sorted(record.figures.items())
    ]
    texts = [f"  {json.dumps(name)}: {json.dumps(text)}" for name, text in sorted(record.texts.items())]
    head = json.dumps({"compilers": dict(record.versions)})[:-1]
    parts = [
        head,
        '"texts": {\n' + ",\n".join(texts) + "\n}",
        '"figures": {\n' + ",\n".join(lines) + "\n}}\n",
    ]
    path.write_text(", ".join(parts), encoding="utf-8", newline="\n")


_BY_NAME = {gpu.name: gpu for gpu in GPUS}
_NOISE = 16  # bytes: four registers


def losses(gpu: Gpu, figures: Figures, known: Figures) -> list[str]:
    """What a kernel loses on a GPU by needing more than before: `12 warps, were 16 (registers 129, were 128)`.

    Compilers number registers as it comes: a line elsewhere in a program moves some of them by two or four. What a GPU
    notices is how many warps or waves are there at a time, and memory that a work-item writes and reads: of that more
    than a sixteenth counts.
    """
    said = []
    if (now := gpu.occupancy(figures)) < (before := gpu.occupancy(known)):
        said.append(f"{now} {gpu.word}, were {before} ({'; '.join(figures.worse_than(known))})")
    for name in ("stack", "spilled"):
        mine, old = getattr(figures, name), getattr(known, name)
        if mine > max(old * 17 // 16, old + _NOISE):
            said.append(f"{name} {mine}, were {old}")
    return said


def worse(measured: Measured, record: Record) -> Iterator[str]:
    """A line for each kernel that loses something beside the record (`losses`), or is not on it."""
    for name, by_gpu in measured.items():
        known = record.figures.get(name)
        if known is None:
            yield f"{name}: not on record"
            continue
        for gpu, figures in by_gpu.items():
            more = losses(_BY_NAME[gpu], figures, known[gpu]) if gpu in known else ["not on record"]
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
