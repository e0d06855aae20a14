"""This engine and its rivals side by side: one session, rounds in turn, medians.

    python -m benchmarks.compare [--rounds N] [--json FILE] [--row NAME ...] [--only TEXT ...]
        [--runtime NAME=ICD_FOLDER[,LIBRARY_FOLDER] ...] [--kernel ROW=FILE.cl[,DETAIL] ...]

Prints a Markdown table. A contestant that cannot run gets a line that says why. In every round each
contestant draws once, so that a machine that slows down slows all of them. Needs nothing but this engine;
Numba (extra `bench`), VTK 9 (`pip install vtk`; without a display under `xvfb-run -a`), Mandelbulber 2
(Debian package) and further OpenCL runtimes join where they are installed.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import platform
import statistics
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.ours import Ours
from benchmarks.rivals.base import ROWS, Contestant, MissingError, Sample
from benchmarks.rivals.mandelbulber import Mandelbulber
from benchmarks.rivals.vtk_volume import VtkVolume
from benchmarks.runtimes import Runtime, find_runtimes, parse_runtime
from benchmarks.stand_alone import StandAloneKernel

if TYPE_CHECKING:
    from benchmarks.rivals.numba_grid import NumbaGrid
    from benchmarks.rivals.numba_march import NumbaMarch
    from benchmarks.rivals.numba_plane import NumbaPlane


class NumbaRival:
    """The rows that Numba draws, compiled before the first round; Numba is optional, so imported late."""

    name = "Numba"
    rows = ("mandelbulb8-shadow", "hast2-shadow", "hast2-grid512", "hast2-plane256")

    def __init__(self, rows: Sequence[str] = ()) -> None:
        """`rows` are those that are wanted; all, if none is named."""
        self._measures: dict[str, Callable[[], Sample]] = {}
        self._wanted = [row for row in self.rows if row in rows or not rows]

    def prepare(self) -> None:
        try:
            import numba

            from benchmarks.rivals import numba_grid, numba_march, numba_plane
        except ImportError as error:
            raise MissingError("Numba is not installed (pip install numba)") from error
        self.name = f"Numba {numba.__version__}, {numba.get_num_threads()} threads"
        for row in self._wanted:
            if row == "hast2-grid512":
                self._measures[row] = _grid_measure(row, numba_grid.NumbaGrid())
            elif row == "hast2-plane256":
                self._measures[row] = _plane_measure(row, numba_plane.NumbaPlane(periodicity=True))
            else:
                march = numba_march.hast_march if row == "hast2-shadow" else numba_march.mandelbulb_march
                self._measures[row] = _march_measure(row, march())

    def measure(self) -> list[Sample]:
        return [measure() for measure in self._measures.values()]


def _march_measure(row: str, march: NumbaMarch) -> Callable[[], Sample]:
    def measure() -> Sample:
        milliseconds, counts = march.frame()
        seconds = milliseconds / 1e3
        return Sample(
            row,
            milliseconds,
            rays_per_second=counts.rays / seconds,
            iterations_per_second=counts.iterations / seconds,
            steps_per_ray=counts.steps / counts.rays,
        )

    return measure


def _grid_measure(row: str, grid: NumbaGrid) -> Callable[[], Sample]:
    return lambda: Sample(row, grid.fill())


def _plane_measure(row: str, plane: NumbaPlane) -> Callable[[], Sample]:
    def measure() -> Sample:
        milliseconds, applications = plane.frame()
        seconds = milliseconds / 1e3
        return Sample(
            row,
            milliseconds,
            rays_per_second=plane.counts.size / seconds,
            iterations_per_second=applications / seconds,
        )

    return measure


@dataclass(slots=True)
class Entry:
    """All timings of one contestant, or why there are none."""

    contestant: Contestant
    samples: dict[str, list[Sample]] = field(default_factory=dict)
    missing: str | None = None

    def median(self, row: str) -> Sample | None:
        """The sample with the median time of a row (the slower of the middle two)."""
        samples = sorted(self.samples.get(row, []), key=lambda sample: sample.milliseconds)
        return samples[len(samples) // 2] if samples else None


def play(contestants: Sequence[Contestant], rounds: int) -> list[Entry]:
    """Prepare all, then let each measure once per round; progress goes to standard error."""
    entries = [Entry(contestant) for contestant in contestants]
    for turn in range(rounds + 1):
        for entry in entries:
            if entry.missing is not None:
                continue
            try:
                if turn == 0:
                    print(f"preparing {entry.contestant.name}", file=sys.stderr)
                    entry.contestant.prepare()
                    continue
                for sample in entry.contestant.measure():
                    entry.samples.setdefault(sample.row, []).append(sample)
                print(f"round {turn} of {rounds}: {entry.contestant.name}", file=sys.stderr)
            except MissingError as error:
                entry.missing = str(error)
                print(f"{entry.contestant.name}: {error}", file=sys.stderr)
    return entries


def row_names(entries: Sequence[Entry]) -> list[str]:
    """The standing rows, then any other in the order met."""
    return list(dict.fromkeys([*ROWS, *(row for entry in entries for row in entry.samples)]))


def reference(entries: Sequence[Entry], row: str) -> Entry | None:
    """Whose time counts as 1 in a row: our first runtime, else the fastest contestant."""
    present = [entry for entry in entries if entry.samples.get(row)]
    ours = [entry for entry in present if isinstance(entry.contestant, Ours)]
    if ours:
        return ours[0]
    return min(present, key=lambda entry: _milliseconds(entry, row), default=None)


def report(entries: Sequence[Entry], rounds: int) -> dict[str, object]:
    """Everything measured, ready for JSON."""
    rows = []
    for row in row_names(entries):
        base = reference(entries, row)
        for entry in entries:
            sample = entry.median(row)
            if sample is None or base is None:
                continue
            times = [one.milliseconds for one in entry.samples[row]]
            rows.append(
                {
                    "row": row,
                    "contestant": entry.contestant.name,
                    "ms": statistics.median(times),
                    "ratio": _milliseconds(entry, row) / _milliseconds(base, row),
                    "samples_ms": times,
                    "rays_per_s": sample.rays_per_second,
                    "iterations_per_s": sample.iterations_per_second,
                    "steps_per_ray": sample.steps_per_ray,
                    "fma_share": sample.fma_share,
                }
            )
    missing = [
        {"contestant": entry.contestant.name, "why": entry.missing} for entry in entries if entry.missing
    ]
    return {"machine": machine(), "rounds": rounds, "rows": rows, "missing": missing}


def markdown(entries: Sequence[Entry]) -> str:
    """The table; `ratio` is against our first runtime, or the fastest contestant where ours is absent."""
    lines = [
        "| row | contestant | median ms | best ms | ratio | Mrays/s | Miterations/s | steps/ray | FMA peak |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for row in row_names(entries):
        base = reference(entries, row)
        for entry in entries:
            sample = entry.median(row)
            if sample is None or base is None:
                continue
            milliseconds = _milliseconds(entry, row)
            cells = [
                row,
                entry.contestant.name,
                f"{milliseconds:.0f}",
                f"{min(one.milliseconds for one in entry.samples[row]):.0f}",
                f"{milliseconds / _milliseconds(base, row):.2f}",
                _cell(sample.rays_per_second, 1e-6, "{:.2f}"),
                _cell(sample.iterations_per_second, 1e-6, "{:.1f}"),
                _cell(sample.steps_per_ray, 1, "{:.1f}"),
                _cell(sample.fma_share, 100, "{:.0f} %"),
            ]
            lines.append(f"| {' | '.join(cells)} |")
    lines += [
        f"| - | {entry.contestant.name} | missing: {entry.missing} |||||||"
        for entry in entries
        if entry.missing
    ]
    return "\n".join(lines)


def machine() -> dict[str, object]:
    """The processor and how busy it was."""
    model = platform.processor() or platform.machine()
    with contextlib.suppress(OSError):
        text = Path("/proc/cpuinfo").read_text()
        model = next(
            (line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line), model
        )
    return {
        "processor": model,
        "cores": len(os.sched_getaffinity(0)),
        "system": platform.platform(),
        "python": platform.python_version(),
        "load_average": os.getloadavg(),
    }


def _milliseconds(entry: Entry, row: str) -> float:
    return statistics.median(sample.milliseconds for sample in entry.samples[row])


def _cell(value: float | None, scale: float, form: str) -> str:
    return "" if value is None else form.format(value * scale)


def contestants(
    runtimes: Sequence[Runtime], kernels: Sequence[str], flags: str, rows: Sequence[str] = ()
) -> list[Contestant]:
    """Everyone who might take part in the wanted rows, or in all, ours first."""
    found: list[Contestant] = [Ours(runtime, rows) for runtime in runtimes]
    for text in kernels:
        row, equals, rest = text.partition("=")
        file, _, detail = rest.partition(",")
        if not (equals and Path(file).is_file()):
            raise ValueError(f"a kernel looks like ROW=FILE.cl or ROW=FILE.cl,DETAIL, not {text!r}")
        path, wanted = Path(file).resolve(), float(detail or 1)
        found += [StandAloneKernel(row, path, flags, runtime, detail=wanted) for runtime in runtimes]
    rivals: list[Contestant] = []
    if not rows or set(rows) & set(NumbaRival.rows):
        rivals.append(NumbaRival(rows))
    if not rows or set(rows) & set(VtkVolume.rows):
        rivals.append(VtkVolume())
    if not rows or set(rows) & set(Mandelbulber.rows):
        rivals.append(Mandelbulber())
    return [*found, *rivals]


def main() -> int:
    """Entry point; exit status 2 for wrong arguments, else 0."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.compare", description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", type=Path, help="also write everything measured to this file")
    parser.add_argument("--row", action="append", default=[], help="only this row; repeat it for more")
    parser.add_argument(
        "--only", action="append", default=[], help="only contestants whose name contains this text"
    )
    parser.add_argument("--runtime", action="append", default=[], help="NAME=ICD_FOLDER[,LIBRARY_FOLDER]")
    parser.add_argument(
        "--kernel",
        action="append",
        default=[],
        help="ROW=FILE.cl[,DETAIL], a stand-alone kernel to time too, whose rays end so many pixels' widths before the set",
    )
    parser.add_argument(
        "--kernel-flags", default="-cl-fast-relaxed-math", help="how stand-alone kernels are built"
    )
    arguments = parser.parse_args()
    if arguments.rounds < 1:
        parser.error("--rounds: must be at least 1")
    with tempfile.TemporaryDirectory(prefix="clfractal-runtimes-") as scratch:
        try:
            runtimes = [parse_runtime(text) for text in arguments.runtime] or find_runtimes(Path(scratch))
            everyone = contestants(runtimes, arguments.kernel, arguments.kernel_flags, arguments.row)
        except ValueError as error:
            parser.error(str(error))
        wanted = [text.casefold() for text in arguments.only]
        chosen = [
            one for one in everyone if not wanted or any(text in one.name.casefold() for text in wanted)
        ]
        entries = play(chosen, arguments.rounds)
    print(markdown(entries))
    if arguments.json:
        arguments.json.write_text(json.dumps(report(entries, arguments.rounds), indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
