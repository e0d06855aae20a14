"""A minute of random events; `make soak` has ten."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.shell import environment
from tests.window.display import Display

pytestmark = pytest.mark.quiet

ROOT = Path(__file__).absolute().parents[2]  # not resolved: tests of the installed package are linked to


def test_a_minute_of_random_events(display: Display, folder: Path) -> None:
    extra = environment({"CLFRACTAL_DEVICE": "pthread"})
    extra["PYTHONPATH"] += f":{ROOT}"
    ended = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-m", "tests.window.soak", "--minutes", "1"],
        cwd=folder,
        env=display.environment(extra),
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
