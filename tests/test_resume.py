"""Killed at any moment, a render is resumed and ends with the bits of one that was never disturbed."""

from __future__ import annotations

import json
import random
import re
import signal
import subprocess
import time
import zlib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.cli.shell import Shell
from clfractal.cli.unfinished import Unfinished, continued
from clfractal.device.select import choose
from clfractal.engine import finish
from clfractal.engine.prepare import prepare
from clfractal.files.exr import read_exr
from clfractal.files.journal import _HEAD, MAGIC
from tests.calls import raising
from tests.interrupts import planes
from tests.long_renders import HEAVY, TILES, holding
from tests.shell import Ended, InProcess, Running, command, environment, has_tiles, process, works
from tests.variants import one_of

pytestmark = pytest.mark.usefixtures("interrupts_are_not_ignored")


def render(folder: Path, *options: str) -> Ended:
    return process(["render", "heavy.yaml", "-o", "out.exr", *options], folder)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    """A finished render, and the seconds that it took with everything compiled."""
    folder = tmp_path_factory.mktemp("undisturbed")
    (folder / "heavy.yaml").write_text(HEAVY)
    assert render(folder, "--quiet").status == 0  # compiles
    start = time.perf_counter()
    ended = render(folder, "--quiet")
    assert ended == Ended(0, "", "")
    return folder / "out.exr", time.perf_counter() - start


@pytest.mark.parametrize("seed", one_of(0, 1, 2))
def test_killed_at_random_moments(seed: int, undisturbed: tuple[Path, float], tmp_path: Path) -> None:
    whole, seconds = undisturbed
    chance = random.Random(seed)
    (tmp_path / "heavy.yaml").write_text(HEAVY)
    kills = 0
    while kills < 4:
        running = subprocess.Popen(
            command("render", "heavy.yaml", "-o", "out.exr", "--quiet", "--resume"),
            cwd=tmp_path,
            env=environment(),
        )
        try:
            running.wait(chance.uniform(0.2, 1.0) * seconds)
            break  # it finished
        except subprocess.TimeoutExpired:
            running.send_signal(signal.SIGKILL)
            running.wait()
            kills += 1
            # It may have just finished: a picture appears whole, or not at all.
            if (tmp_path / "out.exr").exists():
                assert planes(tmp_path / "out.exr") == planes(whole)
                break
    assert render(tmp_path, "--resume", "--quiet") == Ended(0, "", "") or kills == 0
    assert planes(tmp_path / "out.exr") == planes(whole)
    assert not (tmp_path / "out.exr.partial").exists()


def test_resuming_renders_only_what_is_missing(undisturbed: tuple[Path, float], tmp_path: Path) -> None:
    """Killed as soon as there is a tile on the disk; the statistics tell what the second run did."""
    (tmp_path / "heavy.yaml").write_text(HEAVY)
    running = Running(tmp_path, words=holding(2, "render", "heavy.yaml", "-o", "out.exr", "--quiet"))
    running.wait_until(has_tiles(tmp_path / "out.exr.partial", 2))
    assert running.ended_by(signal.SIGKILL)[0] == -signal.SIGKILL
    assert render(tmp_path, "--resume", "--stats", "stats.json", "--quiet") == Ended(0, "", "")
    stats = json.loads((tmp_path / "stats.json").read_text())
    assert stats["tiles"] == TILES
    assert 1 <= stats["tiles_resumed"] < TILES
    assert stats["rays"] < 224 * 160 * 16
    assert planes(tmp_path / "out.exr") == planes(undisturbed[0])


@pytest.fixture
def left(clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The work of the small scene, in the current folder: the disk was full when the picture was written."""
    with monkeypatch.context() as patch:
        patch.setattr(finish, "save_outputs", raising(OSError(28, "No space left on device")))
        assert clf("render", "scene.yaml", "-o", "a.png", "--quiet").status == 2
    return Path("a.png.partial")


def test_other_work_is_not_resumed(clf: InProcess, left: Path) -> None:
    before = left.read_bytes()
    for options, said in (
        (["--set", "camera.fov=44"], "the scene has changed"),
        (["--samples", "4"], "the scene has changed"),
        (["--size", "64x36"], "the size was [40, 36] and is [64, 36]"),
        (["--region", "0,0,8,8"], "the region was [0, 0, 40, 36] and is [0, 0, 8, 8]"),
        (["--set", "output.channels=[R, G, B]"], "the channels was"),
    ):
        ended = clf("render", "scene.yaml", "-o", "a.png", "--resume", *options)
        assert ended.is_one_line(2, "a.png.partial: cannot be resumed: ", said)
        assert left.read_bytes() == before
        assert not Path("a.png").exists()


def test_another_version_or_device_is_not_resumed(clf: InProcess, left: Path) -> None:
    whole = left.read_bytes()
    for old, new, said in (
        (f'"version": "{clfractal.__version__}"', '"version": "0.0.0"', 'the version was "0.0.0"'),
        ('"device": "', '"device": "Old ', "the device"),
    ):
        _, length, _ = _HEAD.unpack_from(whole)
        text = whole[_HEAD.size : _HEAD.size + length].decode().replace(old, new).encode()
        changed = _HEAD.pack(MAGIC, len(text), zlib.crc32(text)) + text + whole[_HEAD.size + length :]
        left.write_bytes(changed)
        ended = clf("render", "scene.yaml", "-o", "a.png", "--resume")
        assert ended.is_one_line(2, "a.png.partial: cannot be resumed: ", said)


def test_work_goes_on_with_the_lanes_that_it_began_with(tmp_path: Path) -> None:
    """The fastest lanes may have been measured since."""
    began, other = 1, 4
    whole, resumed = tmp_path / "whole", tmp_path / "resumed"
    (tmp_path / "heavy.yaml").write_text(HEAVY)
    job = prepare(clfractal.load_scene(tmp_path / "heavy.yaml"), choose())
    view = replace(job.views[0], plan=replace(job.views[0].plan, lanes=began))
    begun = replace(job, views=(view,))
    shell = Shell(owns_process=False)
    with suppress(KeyboardInterrupt), Unfinished(begun, {}, whole, shell, resume=False) as work:
        work.framebuffers[0].put(0, np.zeros((len(job.channels), 32, 32), np.float32))
        raise KeyboardInterrupt
    later = replace(job, views=(replace(view, plan=replace(view.plan, lanes=other)),))
    assert continued(later, whole).views[0].plan.lanes == began
    assert continued(later, resumed).views[0].plan.lanes == other  # nothing was begun there
    with Unfinished(continued(later, whole), {}, whole, shell, resume=True) as work:
        assert work.framebuffers[0].done.sum() == 1
    elsewhere = replace(later, device=replace(later.device, driver="another"))
    assert continued(elsewhere, whole).views[0].plan.lanes == other


def test_without_resume_it_starts_anew_and_says_so(clf: InProcess, left: Path) -> None:
    assert left.exists()
    ended = works(clf("render", "scene.yaml", "-o", "a.png"))
    assert ended.err.splitlines()[0].startswith("a.png.partial: earlier work is discarded")
    assert {path.name for path in Path().iterdir()} == {"scene.yaml", "a.png"}


def test_a_picture_that_is_being_rendered_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "heavy.yaml").write_text(HEAVY)
    running = Running(tmp_path, words=holding(1, "render", "heavy.yaml", "-o", "out.exr", "--quiet"))
    try:
        running.wait_until(has_tiles(tmp_path / "out.exr.partial"))
        running.process.send_signal(signal.SIGSTOP)
        # (Its work is not discarded, and nothing else is said.)
        ended = process(["render", "heavy.yaml", "-o", "out.exr"], tmp_path)
        assert ended.is_one_line(2, "out.exr.partial: is in use")
    finally:
        (tmp_path / "go").touch()
        assert running.ended_by(signal.SIGCONT)[0] == 0


# --- both eyes ---


# (The program of the other file of this kind: its text does not depend on the picture's size.)
PAIR = HEAVY.replace("width: 224, height: 160", "width: 128, height: 96") + "stereo: {separation: 0.3}\n"
PAIR_TILES = 2 * 4 * 3
LEFT, RIGHT = "out.exr.partial", "out.exr.right.partial"


@pytest.fixture(scope="module")
def undisturbed_pair(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The channels of a finished render."""
    folder = tmp_path_factory.mktemp("undisturbed_pair")
    (folder / "heavy.yaml").write_text(PAIR)
    assert render(folder, "--quiet") == Ended(0, "", "")
    assert {path.name for path in folder.iterdir()} == {"heavy.yaml", "out.exr"}
    return planes(folder / "out.exr")


def stopped(folder: Path, number: signal.Signals, side: str) -> tuple[int, str]:
    """A render that gets a signal as soon as some of an eye's tiles are on the disk: status, and standard error."""
    (folder / "heavy.yaml").write_text(PAIR)
    tiles = 1 if side == LEFT else PAIR_TILES // 2 + 1
    running = Running(folder, words=holding(tiles, "render", "heavy.yaml", "-o", "out.exr", "--quiet"))
    running.wait_until(has_tiles(folder / side))
    return running.ended_by(number)


@pytest.mark.parametrize("side", [LEFT, RIGHT])
def test_killed_and_resumed(tmp_path: Path, undisturbed_pair: dict[str, bytes], side: str) -> None:
    assert stopped(tmp_path, signal.SIGKILL, side) == (-signal.SIGKILL, "")
    assert {path.name for path in tmp_path.iterdir()} == {"heavy.yaml", LEFT, RIGHT}
    assert render(tmp_path, "--resume", "--stats", "stats.json", "--quiet") == Ended(0, "", "")
    told = json.loads((tmp_path / "stats.json").read_text())
    assert told["tiles"] == PAIR_TILES
    assert (1 if side == LEFT else PAIR_TILES // 2 + 1) <= told["tiles_resumed"] < PAIR_TILES
    assert told["rays"] == (PAIR_TILES - told["tiles_resumed"]) * 32 * 32 * 16
    assert planes(tmp_path / "out.exr") == undisturbed_pair
    assert {path.name for path in tmp_path.iterdir()} == {"heavy.yaml", "out.exr", "stats.json"}


def test_interrupted_and_shown_in_another_way(tmp_path: Path, undisturbed_pair: dict[str, bytes]) -> None:
    """Ctrl-C is told in one line. How the pair is shown is free to change: the eyes' pictures stay the same."""
    status, told = stopped(tmp_path, signal.SIGINT, RIGHT)
    assert status == 130
    found = re.fullmatch(
        rf"{re.escape(LEFT)}: interrupted with (\d+) of {PAIR_TILES} tiles done; --resume continues\n", told
    )
    assert found, told
    assert {path.name for path in tmp_path.iterdir()} == {"heavy.yaml", LEFT, RIGHT}
    options = ("--resume", "--stats", "stats.json", "--quiet", "--set", "stereo.mode=multi_view")
    assert render(tmp_path, *options) == Ended(0, "", "")
    resumed = json.loads((tmp_path / "stats.json").read_text())["tiles_resumed"]
    assert int(found[1]) <= resumed < PAIR_TILES
    views = read_exr(tmp_path / "out.exr")[0]
    assert len(views) == 2 * len(undisturbed_pair)
    assert {path.name for path in tmp_path.iterdir()} == {"heavy.yaml", "out.exr", "stats.json"}
    # The same as both halves of the split picture.
    for name, right in (("R", "right.R"), ("Z", "right.Z"), ("N.left.X", "N.right.X")):
        beside = np.concatenate([views[name], views[right]], axis=1)
        assert beside.tobytes() == undisturbed_pair[name.replace("left.", "")]
