"""Whoever waits is told what the program is doing, after two seconds without a sign of life."""

from __future__ import annotations

import io
import threading
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from clfractal.cli import progress
from clfractal.cli.film_count import FilmCount
from clfractal.cli.progress import Patience, Reporter
from clfractal.cli.shell import Shell
from clfractal.device import activity
from clfractal.engine.run import Progress
from clfractal.files import environment_map as environment
from clfractal.files import volume_file as volume
from clfractal.files.exr import write_exr
from clfractal.scene import load


class Terminal(io.StringIO):
    """Standard error, as a terminal or not."""

    def __init__(self, *, terminal: bool) -> None:
        super().__init__()
        self.terminal = terminal

    def isatty(self) -> bool:
        return self.terminal


@pytest.fixture(autouse=True)
def _hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "SILENT_SECONDS", 0.2)
    monkeypatch.setattr(progress, "_LOOK_SECONDS", 0.02)


def shell_on(monkeypatch: pytest.MonkeyPatch, *, terminal: bool = False) -> tuple[Shell, Terminal]:
    errors = Terminal(terminal=terminal)
    monkeypatch.setattr("sys.stderr", errors)
    return Shell(owns_process=False), errors


def wait_for(errors: Terminal, text: str) -> str:
    """What was written by the time that a text appears in it."""
    end = time.perf_counter() + 120
    while text not in errors.getvalue():
        assert time.perf_counter() < end, errors.getvalue()
        time.sleep(0.01)
    return errors.getvalue()


class Clock:
    """The time by which the program is patient: it stands still until a test puts it forward."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now, self.looks = 1000.0, 0
        current, began = activity.current, activity.Activity
        monkeypatch.setattr(time, "monotonic", lambda: self.now)
        monkeypatch.setattr(activity, "Activity", lambda what: began(what, self.now))

        def looked() -> activity.Activity | None:
            self.looks += 1
            return current()

        monkeypatch.setattr(progress, "current", looked)

    def later(self, seconds: float) -> None:
        """Puts it forward, and waits until the program has looked, and has done what it then does."""
        self.now += seconds
        enough, end = self.looks + 2, time.perf_counter() + 120
        while self.looks < enough:
            assert time.perf_counter() < end
            time.sleep(0.005)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


def doing() -> str:
    """What is under way, by its name."""
    found = activity.current()
    return "" if found is None else found.what


def test_lines_tell_what_lasts(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> None:
    """The innermost, whole lines, seldomer as it goes on."""
    monkeypatch.setattr(progress, "SILENT_SECONDS", 2.0)
    shell, errors = shell_on(monkeypatch)
    with Patience(shell), activity.doing("rendering"), activity.doing("filling the grid"):
        for _ in range(40):
            clock.later(0.5)
    lines = errors.getvalue().splitlines()
    assert lines == [f"filling the grid, {seconds} s" for seconds in (2, 6, 14)]
    clock.now += 100
    time.sleep(0.3)
    assert errors.getvalue().splitlines() == lines  # nothing is told afterwards


def test_progress_is_a_sign_of_life(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> None:
    monkeypatch.setattr(progress, "SILENT_SECONDS", 1.0)
    shell, errors = shell_on(monkeypatch)
    reporter, state = Reporter(shell, 10), Progress(10)
    with Patience(shell), activity.doing("rendering"):
        for _ in range(4):
            reporter(state)
            clock.later(0.9)
    assert errors.getvalue() == ""


def test_nobody_is_told_of_nothing(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> None:
    """With `--quiet`, where a window shows it, and if nothing is under way."""
    for quiet, patient, what in ((True, True, "rendering"), (False, False, "rendering"), (False, True, "")):
        shell, errors = shell_on(monkeypatch)
        shell.quiet, shell.patient = quiet, patient
        with Patience(shell):
            if what:
                with activity.doing(what):
                    clock.later(10.0)
            else:
                clock.later(10.0)
        assert errors.getvalue() == ""


def test_a_terminal_shows_one_line_that_goes_away(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> None:
    shell, errors = shell_on(monkeypatch, terminal=True)
    clear = "\r\x1b[2K"
    with Patience(shell), activity.doing("compiling for a device"):
        clock.later(0.3)
        told = wait_for(errors, "compiling for a device, 0 s")
        assert told.startswith(clear)
        assert "\n" not in told
        shell.say("a remark")
    assert f"{clear}a remark\n" in errors.getvalue()
    lines = errors.getvalue().split("\n")
    assert lines[-1] in ("", clear) or lines[-1].endswith(clear)


def test_a_bar_shows_it_beside_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "BAR_AFTER_SECONDS", 0.0)
    shell, errors = shell_on(monkeypatch, terminal=True)
    with Patience(shell), activity.doing("rendering"):
        reporter = Reporter(shell, 10)
        reporter(Progress(10, tiles_done=3))
        wait_for(errors, "rendering, ")
        assert shell.stalled != shell.status
        reporter.close()
        assert shell.stalled == shell.status


def test_the_files_that_a_scene_reads_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The scene itself, its grid and its map; any of them may be large, or lie on a slow disk."""
    told: dict[str, str] = {}

    def listening(module: ModuleType, name: str) -> None:
        read = getattr(module, name)

        def listen(path: Path, *rest: Any, **more: Any) -> Any:
            told[Path(path).name] = doing()
            return read(path, *rest, **more)

        monkeypatch.setattr(module, name, listen)

    listening(load, "read_text")
    listening(volume, "read_volume")
    listening(environment, "read_environment")
    np.save(tmp_path / "scan.npy", np.arange(8, dtype=np.float32).reshape(2, 2, 2))
    sky = np.ones((8, 16), np.float32)
    bands = [dict.fromkeys("RGB", sky)]
    write_exr(tmp_path / "sky.exr", bands, display=(16, 8), region=(0, 0, 16, 8), channels="RGB", half="RGB")
    (tmp_path / "scene.yaml").write_text(
        "version: 1\nformula: {name: mandelbulb}\ncamera: {}\nrenderer: {type: volume, file: scan.npy}\n"
        "environment: {file: sky.exr}\n"
    )
    load.load_scene(tmp_path / "scene.yaml")
    assert told == {name: f"reading {tmp_path / name}" for name in ("scene.yaml", "scan.npy", "sky.exr")}


def test_nothing_is_shown_after_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even what was about to be shown when the command ended."""
    monkeypatch.setattr(progress, "_LAST_SECONDS", 10.0)
    shell, errors = shell_on(monkeypatch, terminal=True)
    begun = threading.Event()

    def slowly(line: str) -> None:
        begun.set()
        time.sleep(0.2)
        shell.status(line)

    shell.stalled = slowly
    with Patience(shell), activity.doing("rendering"):
        assert begun.wait(120)
    told = errors.getvalue()
    assert told.endswith("\r\x1b[2K")
    time.sleep(0.4)
    assert errors.getvalue() == told


def test_what_began_last_is_told() -> None:
    with activity.doing("one"):
        with activity.doing("two"):
            assert doing() == "two"
        assert doing() == "one"
    assert activity.current() is None


def test_a_log_gets_a_line_for_each_tenth(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a render that takes hours, and of a film; and one a minute where a tenth takes longer."""
    now = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    for seconds, most in ((500.0, 10), (20.0, 10), (1.0, 0), (1000.0, 17), (36_000.0, 500)):
        now, tiles = 0.0, 1000
        shell, errors = shell_on(monkeypatch)
        reporter = Reporter(shell, tiles)
        for done in range(1, tiles + 1):
            now = seconds * done / tiles
            reporter(Progress(tiles, tiles_done=done))
        lines = errors.getvalue().splitlines()
        assert all(line.startswith("rendering: ") for line in lines)
        assert most - 1 <= len(lines) <= most, (seconds, len(lines))

    now = 0.0
    shell, errors = shell_on(monkeypatch)
    count = FilmCount(shell, 500, 0.0)
    for frame in range(500):
        now = 3.0 * frame
        count.rendered(1)
    told = [int(line.split()[1]) for line in errors.getvalue().splitlines()]
    assert 20 <= len(told) <= 25, told  # a tenth takes 150 s
    assert told == sorted(told)
