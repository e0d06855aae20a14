"""A stereo render that is killed or interrupted between its two eyes goes on where it ended, to the same bits."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from clfractal.files.exr import read_exr
from tests.interrupts import planes
from tests.long_renders import HEAVY
from tests.shell import SCENE as SMALL
from tests.shell import Ended, InProcess, command, environment, process

pytestmark = pytest.mark.usefixtures("interrupts_are_not_ignored")

# (The program of the other file of this kind: its text does not depend on the picture's size.)
SCENE = HEAVY.replace("width: 224, height: 160", "width: 128, height: 96") + "stereo: {separation: 0.3}\n"
TILES = 2 * 4 * 3
LEFT, RIGHT = "out.exr.partial", "out.exr.right.partial"


# The program, with a pause after each tile that it has stored: so there is time to stop it between two, however many
# tiles the device renders at once.
SLOWLY = """
import sys, time
from clfractal.cli import main
from clfractal.images.store import JournalFramebuffer
put = JournalFramebuffer.put
def slowly(*arguments):
    put(*arguments)
    time.sleep(0.03)
JournalFramebuffer.put = slowly
sys.argv = ["clfractal", "render", "scene.yaml", "-o", "out.exr", "--quiet"]
main()
"""


def render(folder: Path, *options: str) -> Ended:
    return process(["render", "scene.yaml", "-o", "out.exr", *options], folder)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The channels of a finished render."""
    folder = tmp_path_factory.mktemp("undisturbed")
    (folder / "scene.yaml").write_text(SCENE)
    assert render(folder, "--quiet") == Ended(0, "", "")
    assert {path.name for path in folder.iterdir()} == {"scene.yaml", "out.exr"}
    return planes(folder / "out.exr")


def stopped(folder: Path, number: signal.Signals, side: str) -> tuple[int, str]:
    """A render that gets a signal as soon as some of an eye's tiles are on the disk: status, and standard error."""
    (folder / "scene.yaml").write_text(SCENE)
    running = subprocess.Popen(
        [command()[0], "-P", "-c", SLOWLY],
        cwd=folder,
        env=environment(),
        stderr=subprocess.PIPE,
        text=True,
    )
    record = 8 * 32 * 32 * 4
    while running.poll() is None:
        if (folder / side).exists() and (folder / side).stat().st_size > record:
            running.send_signal(number)
            break
        time.sleep(0.001)
    _, told = running.communicate(timeout=60)
    return running.returncode, told


@pytest.mark.parametrize("side", [LEFT, RIGHT])
def test_killed_and_resumed(tmp_path: Path, undisturbed: dict[str, bytes], side: str) -> None:
    assert stopped(tmp_path, signal.SIGKILL, side) == (-signal.SIGKILL, "")
    assert {path.name for path in tmp_path.iterdir()} == {"scene.yaml", LEFT, RIGHT}
    assert render(tmp_path, "--resume", "--stats", "stats.json", "--quiet") == Ended(0, "", "")
    told = json.loads((tmp_path / "stats.json").read_text())
    assert told["tiles"] == TILES
    assert (1 if side == LEFT else TILES // 2 + 1) <= told["tiles_resumed"] < TILES
    assert told["rays"] == (TILES - told["tiles_resumed"]) * 32 * 32 * 16
    assert planes(tmp_path / "out.exr") == undisturbed
    assert {path.name for path in tmp_path.iterdir()} == {"scene.yaml", "out.exr", "stats.json"}


def test_interrupted_and_shown_in_another_way(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    """Ctrl-C is told in one line. How the pair is shown is free to change: the eyes' pictures stay the same."""
    status, told = stopped(tmp_path, signal.SIGINT, RIGHT)
    assert status == 130
    found = re.fullmatch(
        rf"{re.escape(LEFT)}: interrupted with (\d+) of {TILES} tiles done; --resume continues\n", told
    )
    assert found, told
    assert {path.name for path in tmp_path.iterdir()} == {"scene.yaml", LEFT, RIGHT}
    options = ("--resume", "--stats", "stats.json", "--quiet", "--set", "stereo.mode=multi_view")
    assert render(tmp_path, *options) == Ended(0, "", "")
    resumed = json.loads((tmp_path / "stats.json").read_text())["tiles_resumed"]
    assert int(found[1]) <= resumed < TILES
    views = read_exr(tmp_path / "out.exr")[0]
    assert len(views) == 2 * len(undisturbed)
    assert {path.name for path in tmp_path.iterdir()} == {"scene.yaml", "out.exr", "stats.json"}
    # The same as both halves of the split picture.
    for name, right in (("R", "right.R"), ("Z", "right.Z"), ("N.left.X", "N.right.X")):
        beside = np.concatenate([views[name], views[right]], axis=1)
        assert beside.tobytes() == undisturbed[name.replace("left.", "")]


def test_other_eyes_are_not_resumed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stopped(tmp_path, signal.SIGKILL, RIGHT)
    before = {name: (tmp_path / name).read_bytes() for name in (LEFT, RIGHT)}
    scene = tmp_path / "scene.yaml"
    for change in ("stereo.separation=0.4", "stereo.convergence=parallel", "stereo.screen_distance=0.7"):
        ended = InProcess(capsys)("render", scene, "-o", tmp_path / "out.exr", "--resume", "--set", change)
        assert ended.is_one_line(2, f"{LEFT}: cannot be resumed: the scene has changed")
        assert {name: (tmp_path / name).read_bytes() for name in (LEFT, RIGHT)} == before


def test_without_resume_both_begin_anew_and_say_so(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    stopped(tmp_path, signal.SIGKILL, RIGHT)
    ended = render(tmp_path)
    assert ended.status == 0
    dropped = [line for line in ended.err.splitlines() if "earlier work is discarded" in line]
    assert [line.partition(":")[0] for line in dropped] == [LEFT, RIGHT]
    assert planes(tmp_path / "out.exr") == undisturbed
    assert {path.name for path in tmp_path.iterdir()} == {"scene.yaml", "out.exr"}


def test_one_eye_alone_leaves_nothing_of_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What an interrupted pair left is not needed by a render of one eye that begins anew."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.yaml").write_text(SMALL + "stereo: {mode: left}\n")
    (tmp_path / RIGHT).write_bytes(b"earlier work")
    ended = InProcess(capsys)("render", "scene.yaml", "-o", "out.exr", "--resume")
    assert ended.status == 0
    assert {path.name for path in tmp_path.iterdir()} == {"scene.yaml", "out.exr", RIGHT}
    ended = InProcess(capsys)("render", "scene.yaml", "-o", "out.exr")
    assert ended.err.splitlines()[0] == f"{RIGHT}: earlier work is discarded"
    assert {path.name for path in tmp_path.iterdir()} == {"scene.yaml", "out.exr"}
