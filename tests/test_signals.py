"""SIGTERM and SIGHUP, which batch systems, containers, `timeout` and closed terminals send, end work as Ctrl-C does."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.interrupts import planes
from tests.shell import command, environment, process, works

if sys.platform == "win32":
    pytest.skip("Windows has no such signals", allow_module_level=True)

# Many tiles, of which each takes some hundredths of a second.
SCENE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 512, height: 288}
camera: {position: [1.2, -2.2, 1.0]}
renderer: {samples: 64}
animation: {frames: 40}
"""


class Work:
    """A command that runs, in a folder with the scene."""

    def __init__(self, folder: Path, *arguments: str, before: Callable[[], object] | None = None) -> None:
        (folder / "scene.yaml").write_text(SCENE)
        self.running = subprocess.Popen(
            command(*arguments),
            cwd=folder,
            env=environment(),
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=before,
        )

    def wait_until(self, ready: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 120
        while not ready():
            assert self.running.poll() is None, self.running.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.01)

    def ended_by(self, *signals: signal.Signals) -> tuple[int, str]:
        """Sends the signals; gives status and standard error."""
        for each in signals:
            self.running.send_signal(each)
        try:
            told = self.running.communicate(timeout=60)[1]
        finally:
            if self.running.poll() is None:
                os.killpg(self.running.pid, signal.SIGKILL)
        return self.running.returncode, told


def _has_tiles(journal: Path) -> Callable[[], bool]:
    # (A tile of its four channels has 64 KB; before the first there is but the header.)
    return lambda: journal.exists() and journal.stat().st_size > 100_000


@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGHUP])
def test_a_render_is_continued(tmp_path: Path, sent: signal.Signals) -> None:
    work = Work(tmp_path, "render", "scene.yaml", "-o", "a.exr", "--quiet")
    work.wait_until(_has_tiles(tmp_path / "a.exr.partial"))
    status, told = work.ended_by(sent)
    assert status == 128 + sent
    found = re.fullmatch(
        r"a\.exr\.partial: interrupted with (\d+) of (\d+) tiles done; --resume continues\n", told
    )
    assert found, told
    assert 0 < int(found[1]) < int(found[2])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr.partial", "scene.yaml"]
    if sent == signal.SIGHUP:
        return
    works(process(["render", "scene.yaml", "-o", "a.exr", "--resume"], tmp_path))
    works(process(["render", "scene.yaml", "-o", "b.exr", "--quiet"], tmp_path))
    assert planes(tmp_path / "a.exr") == planes(tmp_path / "b.exr")


@pytest.mark.parametrize(
    "arguments",
    [
        ("animate", "scene.yaml", "-o", "f_####.exr"),
        ("animate", "scene.yaml", "-o", "f.mkv"),
        ("voxelize", "scene.yaml", "-o", "a.nrrd", "--resolution", "1024"),
        ("mesh", "scene.yaml", "-o", "a.ply", "--resolution", "1024"),
        ("watch", "scene.yaml", "-o", "a.png"),
        ("render", "scene.yaml", "-o", "a.png", "--cluster", "local:1"),
    ],
    ids=lambda arguments: " ".join((*arguments[:1], *arguments[3:])),
)
def test_long_commands(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    if "--cluster" in arguments:
        pytest.importorskip("distributed")
    work = Work(tmp_path, *arguments, "--quiet")
    moment = time.monotonic() + 2.0
    work.wait_until(lambda: time.monotonic() > moment)
    status, told = work.ended_by(signal.SIGTERM)
    assert status == 143, told
    assert re.fullmatch(r"[^\n]*(interrupted|no longer watched)[^\n]*\n", told), told
    left = {path.name for path in tmp_path.iterdir()}
    assert not [name for name in left if name.endswith(".tmp")]
    if "--resume" in told and "0 of" not in told:
        assert [name for name in left if name != "scene.yaml"]


def test_what_was_ignored_stays_so(tmp_path: Path) -> None:
    """`nohup`, and a job in the background of a script; SIGTERM ends both."""

    def ignore() -> None:
        for each in (signal.SIGHUP, signal.SIGINT):
            signal.signal(each, signal.SIG_IGN)

    work = Work(tmp_path, "render", "scene.yaml", "-o", "a.exr", "--quiet", before=ignore)
    work.wait_until(_has_tiles(tmp_path / "a.exr.partial"))
    before = (tmp_path / "a.exr.partial").stat().st_size
    work.running.send_signal(signal.SIGHUP)
    work.running.send_signal(signal.SIGINT)
    work.wait_until(lambda: (tmp_path / "a.exr.partial").stat().st_size > before)
    status, told = work.ended_by(signal.SIGTERM)
    assert status == 143
    assert "--resume continues" in told


def test_the_first_of_several_counts(tmp_path: Path) -> None:
    work = Work(tmp_path, "render", "scene.yaml", "-o", "a.exr", "--quiet")
    work.wait_until(_has_tiles(tmp_path / "a.exr.partial"))
    work.running.send_signal(signal.SIGTERM)
    time.sleep(0.02)
    status, told = work.ended_by(signal.SIGHUP, signal.SIGTERM, signal.SIGINT)
    assert status == 143
    assert told.count("\n") == 1
    assert "--resume continues" in told
