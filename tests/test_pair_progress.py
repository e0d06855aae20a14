"""Progress of a pair that goes on after an interrupt: finished tiles are counted once, and never more than there are."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.engine import finish
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.run import Progress, run
from clfractal.images.compose import Side
from tests.interrupts import planes, watched
from tests.shell import Ended, InProcess

# 3 x 3 tiles for each eye.
SCENE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 96, height: 70}
camera: {position: [0, -3, 0]}
renderer: {samples: 2}
stereo: {mode: split, separation: 0.3}
"""
TILES = 18


@pytest.fixture
def shell(capfd: pytest.CaptureFixture[str]) -> InProcess:
    return InProcess(capfd)


def render(shell: InProcess, *options: str) -> Ended:
    return shell("render", "scene.yaml", "-o", "out.exr", *options)


def check(seen: list[tuple[int, int, int]], before: int) -> None:
    """From what was there to all there is, a tile at a time at most."""
    assert {each[0] for each in seen} == {before}
    assert {each[2] for each in seen} == {TILES}
    done = [before, *(each[1] for each in seen)]
    assert done[-1] == TILES
    assert {later - earlier for earlier, later in pairwise(done)} <= {0, 1}


@pytest.mark.parametrize("tiles", [1, 8, 9, 10, 17])
def test_of_the_shell(here: Path, shell: InProcess, tiles: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        first = watched(patch, tiles)
        with pytest.raises(KeyboardInterrupt):
            render(shell, "--quiet")
    assert first[-1] == (0, tiles, TILES)
    with pytest.MonkeyPatch.context() as patch:
        seen = watched(patch)
        assert render(shell, "--resume", "--quiet", "--stats", "stats.json") == Ended(0, "", "")
    check(seen, tiles)
    told = json.loads((here / "stats.json").read_text())
    assert (told["tiles"], told["tiles_resumed"]) == (TILES, tiles)
    resumed = planes(here / "out.exr")
    with pytest.MonkeyPatch.context() as patch:
        seen = watched(patch)
        assert render(shell, "--quiet") == Ended(0, "", "")
    check(seen, 0)
    assert planes(here / "out.exr") == resumed


def test_interrupted_twice(here: Path, shell: InProcess) -> None:
    for tiles in (4, 12):
        with pytest.MonkeyPatch.context() as patch:
            seen = watched(patch, tiles)
            with pytest.raises(KeyboardInterrupt):
                render(shell, "--quiet", "--resume")
        assert seen[-1][1:] == (tiles, TILES)
    assert seen[0][0] == 4
    with pytest.MonkeyPatch.context() as patch:
        seen = watched(patch)
        assert render(shell, "--resume", "--quiet") == Ended(0, "", "")
    check(seen, 12)


def test_nothing_is_left(here: Path, shell: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk was full when the files were written: all tiles are there, and none is rendered again."""

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(finish, "save_outputs", full)
        assert render(shell, "--quiet").status == 2
    seen = watched(monkeypatch)
    ended = render(shell, "--resume", "--stats", "stats.json")
    assert ended.status == 0
    assert seen == []
    assert "nothing was left to render" in ended.err
    told = json.loads((here / "stats.json").read_text())
    assert (told["tiles"], told["tiles_resumed"], told["rays"]) == (TILES, TILES, 0)


@pytest.mark.parametrize("side", ["left", "right"])
def test_of_python(side: Side) -> None:
    """Stores that hold some of one eye's tiles: the time that is left is told from what this run did."""
    with clfractal.Engine() as engine:
        job = engine.prepare(clfractal.load_scene(SCENE))
        whole = JobFramebuffers(job)
        run(job, whole.framebuffers, engine.executor)
        framebuffers = JobFramebuffers(job)
        number = job.sides.index(side)
        there = framebuffers.framebuffers[number]
        there_already = 0
        for index in (0, 4, 5, 8):
            tile = there.grid.tile(index)
            there_already += tile.width * tile.height
            part = (slice(tile.y, tile.y + tile.height), slice(tile.x, tile.x + tile.width))
            there.put(index, np.stack([whole.framebuffers[number][name][part] for name in there]))
        seen: list[tuple[int, int, int]] = []

        def told(state: Progress) -> None:
            seen.append((state.tiles_before, state.tiles_done, state.tiles))
            assert (state.remaining is None) == (state.tiles_done == 4)
            assert state.remaining is None or state.remaining >= 0

        state = run(job, framebuffers.framebuffers, engine.executor, progress=told)
        assert [each[1] for each in seen] == sorted(each[1] for each in seen)
        assert {(each[0], each[2]) for each in seen} == {(4, TILES)}
        assert (state.tiles_done, state.remaining) == (TILES, 0)
        assert state.rays == 2 * (2 * 96 * 70 - there_already)
        for name in framebuffers.picture():
            np.testing.assert_array_equal(framebuffers.picture()[name], whole.picture()[name])
