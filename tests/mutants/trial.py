"""A copy of the checkout with a mistake in it, and the tests that are run there."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tests.mutants.concerns import QUICK, concerned
from tests.mutants.mutant import Mutant

COPIED = ("clfractal", "kernels", "scenes", "tests", "docs", "benchmarks")
COPIED_FILES = ("README.md", "CHANGELOG.md", "pyproject.toml", "Makefile")
SLOWEST = 600
"""Seconds for the tests of one stage. What takes longer with a mistake than any set of tests without one is noticed."""

Verdict = Literal["killed", "timed out", "survived"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a mistake: which test noticed it, and after how many seconds."""

    mutant: Mutant
    verdict: Verdict
    by: str
    seconds: float


class Trial:
    """A copy of the checkout in which mistakes are tried, one after the other. The checkout itself is never touched.

    Caches of programs and the home folder are the copy's own: a mistake may leave anything in them.
    """

    def __init__(self, checkout: Path, folder: Path, *, quick: bool = True) -> None:
        self.tree, self.folder, self.quick = folder / "tree", folder, quick
        shutil.rmtree(self.tree, ignore_errors=True)
        for name in COPIED:
            shutil.copytree(checkout / name, self.tree / name, ignore=shutil.ignore_patterns("__pycache__"))
        for name in COPIED_FILES:
            shutil.copy(checkout / name, self.tree / name)
        (folder / "home").mkdir(parents=True, exist_ok=True)

    def of(self, mutant: Mutant) -> Outcome:
        """Asks first the tests that the mistake concerns, then the quick ones. A test that also fails without the
        mistake notices nothing."""
        began = time.monotonic()
        tests = concerned(mutant.path, self.tree)
        rest = [test for test in QUICK if test not in tests] if self.quick else []
        deselected: list[str] = []
        for stage in filter(None, (tests, rest)):
            while True:
                noticed = self._mutated(mutant, stage, deselected)
                if noticed is None:
                    break
                if noticed == "":
                    return Outcome(mutant, "timed out", " ".join(stage), time.monotonic() - began)
                if noticed in deselected or self._passes(noticed):
                    return Outcome(mutant, "killed", noticed, time.monotonic() - began)
                deselected.append(noticed)
        return Outcome(mutant, "survived", "", time.monotonic() - began)

    def _mutated(self, mutant: Mutant, tests: Sequence[str], deselected: Sequence[str]) -> str | None:
        """The first test that fails with a mistake, "" if they took too long, None if all pass."""
        path = self.tree / mutant.path
        path.write_text(mutant.after, encoding="utf-8")
        try:
            status = self._pytest(*tests, *(f"--deselect={test}" for test in deselected))
        finally:
            path.write_text(mutant.before, encoding="utf-8")
        if status in (0, 5):  # 5: all tests were left out
            return None
        return "" if status is None else next(iter(self._failed()), "nothing: pytest itself ended")

    def _passes(self, test: str) -> bool:
        """Whether a test passes without a mistake. What ended pytest itself has no name, and counts."""
        return test.startswith("nothing") or self._pytest(test) == 0

    def _failed(self) -> list[str]:
        """What pytest's own cache says of the last run."""
        path = self.folder / "pytest" / "v" / "cache" / "lastfailed"
        return list(json.loads(path.read_text(encoding="utf-8"))) if path.exists() else []

    def _pytest(self, *arguments: str) -> int | None:
        """Runs pytest in the copy: its exit status, or None if it took too long."""
        shutil.rmtree(self.folder / "pytest", ignore_errors=True)
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-x",
            "-q",
            f"--rootdir={self.tree}",
            "-o",
            f"cache_dir={self.folder / 'pytest'}",
        ]
        with open(self.folder / "log", "wb") as log:
            running = subprocess.Popen(
                [*command, "--timeout=200", *arguments],
                cwd=self.tree,
                env=self._environment(),
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                return running.wait(SLOWEST)
            except subprocess.TimeoutExpired:
                return None
            finally:
                if running.poll() is None:
                    os.killpg(running.pid, signal.SIGKILL)
                    running.wait()

    def _environment(self) -> dict[str, str]:
        return {
            **os.environ,
            "PYTHONPATH": str(self.tree),
            "PYTHONDONTWRITEBYTECODE": "1",
            "HOME": str(self.folder / "home"),
            "CLFRACTAL_CACHE": str(self.folder / "cache"),
            "POCL_CACHE_DIR": str(self.folder / "pocl"),
        }
