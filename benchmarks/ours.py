"""This engine's side: `clfractal bench`, in a process of its own, on one OpenCL implementation."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.rivals.base import MissingError, Sample, run
from benchmarks.runtimes import Runtime

REPOSITORY = Path(__file__).resolve().parent.parent


class Ours:
    """Rows of `python -m clfractal bench --json FILE` on one runtime: the wanted ones, or all."""

    def __init__(self, runtime: Runtime, rows: Sequence[str] = ()) -> None:
        self.name = f"clfractal ({runtime.name})"
        self._runtime = runtime
        self._rows = tuple(rows)

    def prepare(self) -> None:
        """One run for the caches: programs are built and lanes measured once per machine, not per picture."""
        self.measure()

    def measure(self) -> list[Sample]:
        with tempfile.TemporaryDirectory(prefix="clfractal-bench-") as folder:
            report = Path(folder, "bench.json")
            command: list[str | Path] = [sys.executable, "-m", "clfractal", "bench", "--json", report]
            for row in self._rows:
                command += ["--row", row]
            run(command, environment=self._runtime.environment(), timeout_s=900, cwd=REPOSITORY)
            try:
                rows = json.loads(report.read_text())["rows"]
                return [
                    Sample(
                        row["name"],
                        float(row["ms"]),
                        row.get("rays_per_s"),
                        row.get("iterations_per_s"),
                        row.get("steps_per_ray"),
                        row.get("fma_share"),
                    )
                    for row in rows
                ]
            except (OSError, ValueError, KeyError, TypeError) as error:
                raise MissingError(f"its report cannot be read: {error}") from error
