"""Pictures of several views, layouts and both eyes', that are interrupted go on where they ended, to the same bits."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import clfractal
from clfractal import cli
from clfractal.cli.shell import Shell
from clfractal.engine import finish
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.run import Progress, run
from clfractal.images.compose import Side
from tests.calls import raising
from tests.interrupts import planes, watched
from tests.shell import Ended, InProcess, works

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 136, height: 70}
camera: {position: [0, -3, 0.5]}
layout:
  gap: 4
  background: [0.2, 0.1, 0.3]
  views:
  - {}
  - renderer: {type: cut_plane, plane: {width: 2.5, height: 2.5}, samples: 2}
  - renderer: {samples: 3}
    camera: {position: [2.5, -1, 1]}
output:
  channels: [R, G, B, A, Z, N.X, iterations, steps, samples]
  precision: {R: float, G: float, B: float, N.X: float}
"""
PAIR = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 96, height: 70}
camera: {position: [0, -3, 0]}
renderer: {samples: 2}
stereo: {mode: split, separation: 0.3}
"""


class Work(NamedTuple):
    """A scene of several views, and the journals in which they are kept, in their order."""

    scene: str
    view_tiles: int
    journals: list[str]

    @property
    def tiles(self) -> int:
        return self.view_tiles * len(self.journals)


WORKS = {
    # Each view is 42 or 43 pixels wide: 2 x 3 tiles.
    "layout": Work(SCENE, 6, ["out.exr.partial", "out.exr.view2.partial", "out.exr.view3.partial"]),
    # Of two views: the squeezed eyes' are 32 pixels wide each, 1 x 3 tiles.
    "layout of both eyes": Work(
        SCENE.replace("  - renderer: {samples: 3}\n    camera: {position: [2.5, -1, 1]}\n", "")
        + "stereo: {mode: split_half, separation: 0.5}\n",
        3,
        [f"out.exr.{view}partial" for view in ("", "view2.", "right.", "right.view2.")],
    ),
    # 3 x 3 tiles for each eye.
    "pair": Work(PAIR, 9, ["out.exr.partial", "out.exr.right.partial"]),
}
NAMES, TILES = WORKS["layout"].journals, WORKS["layout"].tiles


def render(clf: InProcess, *options: str) -> Ended:
    return clf("render", "scene.yaml", "-o", "out.exr", "--quiet", *options)


def finished(clf: InProcess) -> dict[str, bytes]:
    """What an undisturbed render gives; it leaves nothing else."""
    assert render(clf) == Ended(0, "", "")
    assert {path.name for path in Path().iterdir()} == {"scene.yaml", "out.exr"}
    found = planes(Path("out.exr"))
    Path("out.exr").unlink()
    return found


def interrupted(clf: InProcess, tiles: int, *options: str) -> None:
    """A render that ends as soon as so many tiles are finished."""
    with pytest.MonkeyPatch.context() as patch:
        seen = watched(patch, tiles)
        with pytest.raises(KeyboardInterrupt):
            render(clf, *options)
        assert seen[-1][1] == tiles
    assert not Path("out.exr").exists()


def partials() -> list[str]:
    return sorted(path.name for path in Path().glob("*.partial"))


def begun(kind: str) -> Work:
    Path("scene.yaml").write_text(WORKS[kind].scene)
    return WORKS[kind]


def discarded(ended: Ended) -> list[str]:
    """The journals of which it is told that they begin anew."""
    return [line.partition(":")[0] for line in ended.err.splitlines() if "earlier work is discarded" in line]


def check(seen: list[tuple[int, int, int]], before: int, tiles: int) -> None:
    """From what was there to all there is, a tile at a time at most."""
    assert {(each[0], each[2]) for each in seen} == {(before, tiles)}
    done = [before, *(each[1] for each in seen)]
    assert done[-1] == tiles
    assert {later - earlier for earlier, later in pairwise(done)} <= {0, 1}


@pytest.mark.parametrize(
    ("kind", "tiles"),
    [
        *(("layout", tiles) for tiles in (3, 6, 8, 17)),
        *(("layout of both eyes", tiles) for tiles in (2, 5, 7, 11)),
        *(("pair", tiles) for tiles in (1, 8, 9, 10, 17)),
    ],
)
def test_in_any_view(here: Path, clf: InProcess, kind: str, tiles: int) -> None:
    """Views that have no tile leave no journal; what is there is not rendered again, and counted once."""
    work = begun(kind)
    with pytest.MonkeyPatch.context() as patch:
        seen = watched(patch)
        expected = finished(clf)
    check(seen, 0, work.tiles)
    interrupted(clf, tiles)
    assert partials() == sorted(work.journals[: -(-tiles // work.view_tiles)])
    with pytest.MonkeyPatch.context() as patch:
        seen = watched(patch)
        assert render(clf, "--resume", "--stats", "stats.json") == Ended(0, "", "")
    check(seen, tiles, work.tiles)
    told = json.loads((here / "stats.json").read_text())
    assert (told["tiles"], told["tiles_resumed"]) == (work.tiles, tiles)
    assert planes(here / "out.exr") == expected
    assert partials() == []


def test_again_and_again(here: Path, clf: InProcess) -> None:
    expected = finished(clf)
    for tiles in (2, 5, 7, 13, 16):
        interrupted(clf, tiles, "--resume")
    with pytest.MonkeyPatch.context() as patch:
        seen = watched(patch)
        assert render(clf, "--resume") == Ended(0, "", "")
    assert (seen[0][0], seen[-1]) == (16, (16, 18, 18))
    assert planes(here / "out.exr") == expected


def test_a_region_of_it(here: Path, clf: InProcess) -> None:
    """Of the second view and the third: the first of them is kept beside the output, whichever it is."""
    region = ("--region", "60,5,60,50")
    assert render(clf, *region) == Ended(0, "", "")
    expected = planes(here / "out.exr")
    (here / "out.exr").unlink()
    interrupted(clf, 6, *region)
    assert partials() == ["out.exr.partial", "out.exr.view3.partial"]
    before = {name: (here / name).read_bytes() for name in partials()}
    ended = render(clf, "--resume")
    assert ended.is_one_line(2, "out.exr.partial: cannot be resumed: ")
    assert {name: (here / name).read_bytes() for name in partials()} == before
    assert render(clf, "--resume", *region) == Ended(0, "", "")
    assert planes(here / "out.exr") == expected


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("layout", "layout.gap=5"),
        ("layout", "layout.views.2.camera.position=[2, -2, 1]"),
        ("layout", "layout.views.1.renderer.samples=1"),
        ("layout", "formula.iterations=9"),
        ("pair", "stereo.separation=0.4"),
        ("pair", "stereo.convergence=parallel"),
        ("pair", "stereo.screen_distance=0.7"),
    ],
)
def test_other_views_are_not_resumed(here: Path, clf: InProcess, kind: str, change: str) -> None:
    work = begun(kind)
    interrupted(clf, work.view_tiles + 2)
    before = {name: (here / name).read_bytes() for name in work.journals[:2]}
    ended = render(clf, "--resume", "--set", change)
    assert ended.is_one_line(2, "out.exr.partial: cannot be resumed: ")
    assert {name: (here / name).read_bytes() for name in partials()} == before


@pytest.mark.parametrize("kind", ["layout", "pair"])
def test_without_resume_all_begin_anew_and_say_so(here: Path, clf: InProcess, kind: str) -> None:
    work = begun(kind)
    expected = finished(clf)
    interrupted(clf, 14)
    assert discarded(clf("render", "scene.yaml", "-o", "out.exr")) == work.journals
    assert planes(here / "out.exr") == expected


def test_how_files_are_written_is_free_to_change(here: Path, clf: InProcess) -> None:
    interrupted(clf, 8)
    assert render(clf, "--resume", "--set", "output.exposure=1", "--set", "output.tone=agx").status == 0
    assert partials() == []


def test_a_picture_of_one_view_leaves_nothing_of_the_others(here: Path, clf: InProcess) -> None:
    """And nothing is taken away that only looks like it."""
    interrupted(clf, 14)
    others = ["out.exr.viewpoint.partial", "out.exr.view.partial", "other.exr.view2.partial"]
    for name in others:
        (here / name).write_text("something else")
    ended = works(clf("render", "scene.yaml", "-o", "out.exr", "--set", "layout=null"))
    assert sorted(discarded(ended)) == NAMES
    assert partials() == sorted(others)


def test_what_an_interrupt_tells(
    here: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tiles of all views together."""
    watched(monkeypatch, 8)
    shell = Shell(owns_process=False)
    with pytest.raises(KeyboardInterrupt):
        cli.run(["render", "scene.yaml", "-o", "out.exr", "--quiet"], shell)
    shell.interrupted()
    told = f"{NAMES[0]}: interrupted with 8 of {TILES} tiles done; --resume continues\n"
    assert capfd.readouterr().err == told
    assert partials() == NAMES[:2]


# --- progress ---


def test_nothing_is_left(here: Path, clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk was full when the files were written: all tiles are there, and none is rendered again."""
    begun("pair")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(finish, "save_outputs", raising(OSError(28, "No space left on device")))
        assert render(clf).status == 2
    seen = watched(monkeypatch)
    ended = works(clf("render", "scene.yaml", "-o", "out.exr", "--resume", "--stats", "stats.json"))
    assert seen == []
    assert "nothing was left to render" in ended.err
    told = json.loads((here / "stats.json").read_text())
    assert (told["tiles"], told["tiles_resumed"], told["rays"]) == (
        WORKS["pair"].tiles,
        WORKS["pair"].tiles,
        0,
    )


@pytest.mark.parametrize("side", ["left", "right"])
def test_of_python(side: Side) -> None:
    """Stores that hold some of one eye's tiles: the time that is left is told from what this run did."""
    with clfractal.Engine() as engine:
        job = engine.prepare(clfractal.load_scene(PAIR))
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
        assert {(each[0], each[2]) for each in seen} == {(4, WORKS["pair"].tiles)}
        assert (state.tiles_done, state.remaining) == (WORKS["pair"].tiles, 0)
        assert state.rays == 2 * (2 * 96 * 70 - there_already)
        for name in framebuffers.picture():
            np.testing.assert_array_equal(framebuffers.picture()[name], whole.picture()[name])


def test_one_eye_alone_leaves_nothing_of_the_other(here: Path, clf: InProcess) -> None:
    """What an interrupted pair left is not needed by a render of one eye that begins anew."""
    Path("scene.yaml").write_text(PAIR.replace("split", "left"))
    right = Path("out.exr.right.partial")
    right.write_bytes(b"earlier work")
    assert render(clf, "--resume") == Ended(0, "", "")
    assert right.exists()
    assert discarded(clf("render", "scene.yaml", "-o", "out.exr")) == [right.name]
    assert {path.name for path in here.iterdir()} == {"scene.yaml", "out.exr"}
