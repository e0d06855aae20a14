"""Ctrl-C: status 130 and one line, at once, whatever the program is doing."""

from __future__ import annotations

import re
import time
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from clfractal.cli.shell import Shell
from clfractal.cli.unfinished import Unfinished
from clfractal.device.select import choose
from clfractal.engine.prepare import prepare
from clfractal.scene.load import load_scene
from tests.long_renders import ENDLESS, LIMIT_SECONDS, PROMISE_SECONDS, interrupt
from tests.shell import SCENE

pytestmark = pytest.mark.usefixtures("interrupts_are_not_ignored")


def _is_past(moment: float) -> bool:
    return time.monotonic() > moment


def test_in_the_middle_of_a_kernel(tmp_path: Path) -> None:
    (tmp_path / "endless.yaml").write_text(ENDLESS)
    journal = tmp_path / "out.exr.partial"
    seconds = []
    for _ in range(3):

        def rendering() -> bool:
            if not journal.exists():
                return False
            time.sleep(1.0)  # the program is loaded and its kernel runs
            return True

        status, told, took = interrupt(tmp_path, rendering, {}, "--quiet")
        assert status == 130
        assert re.fullmatch(r"(clfractal|out\.exr(\.partial)?): interrupted.*\n", told), told
        assert not (tmp_path / "out.exr").exists()
        assert journal.exists() == ("--resume" in told), "without a finished tile nothing stays"
        assert took < LIMIT_SECONDS
        seconds.append(took)
    assert min(seconds) < PROMISE_SECONDS


def test_in_the_middle_of_a_compilation(tmp_path: Path) -> None:
    """With an empty cache a child process compiles the kernel first: it must not outlive its parent."""
    (tmp_path / "endless.yaml").write_text(ENDLESS)
    cache = tmp_path / "cache"
    children: list[int] = []

    def compiling() -> bool:
        found = [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]
        for process in found:
            try:
                words = Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")
                owner = Path(f"/proc/{process}/environ").read_bytes()
            except OSError:
                continue
            if b"clfractal.device.child" in words and str(cache).encode() in owner:
                children.append(process)
        return bool(children)

    extra = {"CLFRACTAL_CACHE": str(cache), "CLFRACTAL_LANES": "1", "POCL_CACHE_DIR": str(tmp_path / "pocl")}
    status, told, took = interrupt(tmp_path, compiling, extra, "--quiet")
    assert status == 130
    assert told.count("\n") == 1
    assert "interrupted" in told
    assert took < LIMIT_SECONDS
    deadline = time.monotonic() + 5
    while any(Path(f"/proc/{child}").exists() for child in children):
        assert time.monotonic() < deadline, "the compiling child lives on"
        time.sleep(0.01)
    assert {path.name for path in tmp_path.iterdir()} - {"cache", "pocl"} == {"endless.yaml"}


def test_while_everything_is_still_loading(tmp_path: Path) -> None:
    (tmp_path / "endless.yaml").write_text(ENDLESS)
    for delay in (0.15, 0.3, 0.45):
        moment = time.monotonic() + delay
        status, told, took = interrupt(tmp_path, partial(_is_past, moment), {}, "--quiet")
        assert status == 130
        assert told.count("\n") == 1
        assert "Traceback" not in told
        assert took < LIMIT_SECONDS


@pytest.mark.parametrize("tiles", [0, 1])
def test_a_main_thread_that_does_not_answer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], tiles: int
) -> None:
    """It is in a driver's call: what another thread does before the process is ended leaves no empty file behind."""
    (tmp_path / "a.yaml").write_text(SCENE)
    job = prepare(load_scene(tmp_path / "a.yaml"), choose())
    (tmp_path / "a.yaml").unlink()
    shell = Shell(owns_process=False)
    left = ["a.exr.partial"] * tiles
    with suppress(KeyboardInterrupt), Unfinished(job, {}, tmp_path / "a.exr", shell, resume=False) as work:
        shell.state = work.interrupted
        for tile in range(tiles):
            work.framebuffers[0].put(tile, np.zeros((len(job.channels), 32, 32), np.float32))
        shell.interrupted()
        assert [path.name for path in tmp_path.iterdir()] == left
        assert ("--resume" in capsys.readouterr().err) == bool(tiles)
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.iterdir()] == left
    assert not shell.leaving
